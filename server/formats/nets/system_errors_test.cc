#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "server/base/testing/temporary_folder.h"
#include "server/formats/nets/system_file.h"

namespace pheromone::nets {
namespace {

class SystemErrorsTest : public ::testing::Test {
 protected:
  void Write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
  }

  // The message, its folder left out; `more` begins on line 7.
  std::string ErrorOf(const std::string& more, const Parameters& chosen = {}) const {
    return Told(ParseSystem(
        "f.toml", "[net]\nname = \"f\"\n[[place]]\nid = \"a\"\n[[place]]\nid = \"b\"\n" + more,
        chosen, folder_.path()));
  }

  std::string Told(const Result<petri::Net>& net) const {
    std::string error = net.ErrorOr("");
    const std::string folder = folder_.string() + "/";
    for (size_t at = error.find(folder); at != std::string::npos; at = error.find(folder)) {
      error.erase(at, folder.size());
    }
    return error;
  }

  const TemporaryFolder folder_;
};

TEST_F(SystemErrorsTest, AreAllTold) {
  EXPECT_EQ(
      Told(ParseSystem("f.toml", "[[place]]\nid = \"a b\"\ntoken = 1\n")),
      "f.toml:1:1: net: missing, expected a table [net] with a name\n"
      "f.toml:2:6: place[1].id: found \"a b\", expected letters, digits, _ . and -\n"
      "f.toml:3:1: place[1].token: unknown key, expected one of id, name, tokens, box, owner, "
      "tag, does");
}

TEST_F(SystemErrorsTest, OfPlacesAndTransitions) {
  EXPECT_EQ(ErrorOf("tokens = -1\n"),
            "f.toml:7:10: place[2].tokens: found -1, expected a whole number from 0 to 1000000000");
  EXPECT_EQ(ErrorOf("tokens = \"x\"\n"),
            "f.toml:7:10: place[2].tokens: found the string \"x\", expected a whole number from 0 "
            "to 1000000000");
  EXPECT_EQ(ErrorOf("[[place]]\nid = \"a\"\n"),
            "f.toml:8:6: place[3].id: found \"a\" twice, expected another name");
  EXPECT_EQ(ErrorOf("[[place]]\n"),
            "f.toml:7:1: place[3].id: missing, expected a name of letters, digits, _ . and -");
  const auto error = [this](const std::string& keys) {
    return ErrorOf("[[transition]]\nid = \"t\"\n" + keys);
  };
  EXPECT_EQ(error("takes = [\"0 a\"]\n"),
            "f.toml:9:10: transition[1].takes: found \"0 a\", expected a place, or a number from 1 "
            "to 1000000000 and a place: \"2 place\"");
  EXPECT_EQ(error("takes = [\"9999999999 a\", \"two a\"]\n").substr(0, 60),
            "f.toml:9:10: transition[1].takes: found \"9999999999 a\", expe");
  EXPECT_EQ(error("takes = [\"a\", \"2 a\"]\n"),
            "f.toml:9:15: transition[1].takes: found \"a\" twice, expected one arc with the sum of "
            "the weights");
  EXPECT_EQ(
      error("takes = \"a\"\n"),
      "f.toml:9:9: transition[1].takes: found the string \"a\", expected an array of strings");
  EXPECT_EQ(error("takes = [1]\n"), "f.toml:9:10: transition[1].takes: found 1, expected a string");
  EXPECT_EQ(error("takes = [\"c\"]\n"),
            "f.toml:9:10: transition: found \"c\", expected a place of this file or of an "
            "instance");
  EXPECT_EQ(ErrorOf("[[claim]]\nid = \"c\"\n"),
            "f.toml:7:1: claim[1].text: missing, expected a claim");
}

TEST_F(SystemErrorsTest, OfParameters) {
  const std::string declared = "[parameters]\nrobots = { value = 2, least = 1, most = 5 }\n";
  EXPECT_EQ(ErrorOf(declared, {{"robots", 5}}), "");
  EXPECT_EQ(ErrorOf(declared, {{"robots", 6}}),
            "f.toml:8:10: parameters.robots: chosen as 6, expected 1 to 5");
  EXPECT_EQ(ErrorOf(declared, {{"robot", 2}}),
            "f.toml:7:1: parameters: \"robot\" is chosen as 2, expected one of robots");
  EXPECT_EQ(ErrorOf("[parameters]\nrobots = { value = 9, most = 5 }\n"),
            "f.toml:8:20: parameters.robots.value: found 9, expected a whole number from 0 to 5");
  EXPECT_EQ(ErrorOf("tokens = \"{robot}\"\n" + declared),
            "f.toml:7:10: place[2].tokens: found \"{robot}\", expected a parameter in the braces, "
            "such as {robots} or {robots - 1}; parameters: robots");
  EXPECT_EQ(ErrorOf("tokens = \"{robots - 3}\"\n" + declared),
            "f.toml:7:10: place[2].tokens: found the string \"{robots - 3}\", that is \"-1\", "
            "expected a whole number from 0 to 1000000000");
  EXPECT_EQ(ErrorOf("name = \"{robots\"\n" + declared),
            "f.toml:7:8: place[2].name: found \"{\" without \"}\", expected a parameter in braces");
}

TEST_F(SystemErrorsTest, OfInstances) {
  Write("g.toml",
        "[net]\nname = \"g\"\n[[place]]\nid = \"x\"\ntokens = 2\n[[place]]\nid = \"y\"\n"
        "[parameters]\nn = 1\n");
  const auto error = [this](const std::string& keys) {
    return ErrorOf("[[instance]]\nnet = \"g.toml\"\nas = \"G\"\n" + keys);
  };
  EXPECT_EQ(error("with = { x = \"a\" }\nparameters = { n = 3 }\n"), "");
  EXPECT_EQ(error("with = { z = \"a\" }\n"),
            "f.toml:10:10: instance[1].with.z: expected a place of \"g\": x, y");
  EXPECT_EQ(error("with = { x = \"c\" }\n"),
            "f.toml:10:14: instance[1].with.x: found \"c\", expected a place of this file or of an "
            "instance");
  EXPECT_EQ(error("parameters = { m = 1 }\n"),
            "g.toml:8:1: parameters: \"m\" is chosen as 1, expected one of n");
  EXPECT_EQ(error("[[instance]]\nnet = \"g.toml\"\nas = \"G\"\n"),
            "f.toml:12:6: instance[2].as: found \"G\", expected a name of letters, digits, _ . and "
            "-, once in this file");
  EXPECT_EQ(error("[[instance]]\nnet = \"g.toml\"\nwith = { y = \"G.x\", x = \"a\" }\n"
                  "[[place]]\nid = \"G.y\"\n"),
            "f.toml:7:1: instance[1]: place \"G.y\" is both in net \"f\" and in instance \"G\", "
            "expected it to be bound in one, or a box");
  EXPECT_EQ(error("with = { x = \"a\" }\n[[instance]]\nnet = \"g.toml\"\n"
                  "with = { x = \"a\", y = \"a\" }\n[[place]]\nid = \"c\"\ntokens = 1\n"),
            "");
  EXPECT_EQ(ErrorOf("tokens = 3\n[[instance]]\nnet = \"g.toml\"\nas = \"G\"\n"
                    "with = { x = \"b\" }\n"),
            "f.toml:8:1: instance[1]: place \"b\" has 3 tokens in net \"f\" and 2 in instance "
            "\"G\", expected them in one, or the same in both");
  EXPECT_EQ(ErrorOf("[[instance]]\nas = \"G\"\n"),
            "f.toml:7:1: instance[1].net: missing, expected the name of a net's file");
  EXPECT_EQ(ErrorOf("[[instance]]\nnet = \"g.toml\"\ncount = 2\n"),
            "f.toml:7:1: instance[1].as: missing, expected a name beside count");
}

TEST_F(SystemErrorsTest, OfFiles) {
  EXPECT_EQ(ErrorOf("[[instance]]\nnet = \"none.toml\"\n"),
            "f.toml:8:7: instance[1].net: found \"none.toml\", expected a file; there is no "
            "none.toml");
  Write("one.toml", "[net]\nname = \"1\"\n[[instance]]\nnet = \"two.toml\"\n");
  Write("two.toml", "[net]\nname = \"2\"\n[[instance]]\nnet = \"./one.toml\"\n");
  EXPECT_EQ(Told(LoadSystem(folder_ / "one.toml")),
            "two.toml:4:7: instance[1].net: found \"./one.toml\", which is being read: expected a "
            "net that is not made of itself");
  Write("g.toml", "[net]\nname = \"g\"\n");
  EXPECT_EQ(
      ErrorOf("[[instance]]\nnet = \"g.toml\"\nreplace = { \"h.toml\" = \"g.toml\" }\n"),
      "f.toml:9:11: instance[1].replace: found \"h.toml\", expected a file that \"g.toml\" is "
      "made of");
  EXPECT_NE(Told(LoadSystem(folder_ / "nothing.toml")).find("nothing.toml"), std::string::npos);
  EXPECT_EQ(Told(ParseSystem("f.toml", "[net\n")).substr(0, 12), "f.toml:1:5: ");
  EXPECT_EQ(Told(ParseSystem("f.toml", "[net]\n#" + std::string(17'000, '-') + "\n")),
            "f.toml:2:1: syntax: the line is longer than 16384 bytes");
  EXPECT_EQ(Told(ParseSystem("f.toml", "\xFE\xFF[net]\n")),
            "f.toml:1:1: syntax: found the byte order mark of UTF-16 or UTF-32, expected UTF-8");
  EXPECT_EQ(Told(ParseSystem("f.toml", "\xEF\xBB\xBF[net\n")).substr(0, 12), "f.toml:1:5: ");
}

// Each file asks for the next one 100 times: a billion instances in a few lines.
TEST_F(SystemErrorsTest, OfTooManyInstances) {
  for (int i = 0; i < 5; ++i) {
    Write(std::to_string(i) + ".toml", "[net]\nname = \"n\"\n[[instance]]\nnet = \"" +
                                           std::to_string(i + 1) +
                                           ".toml\"\nas = \"i\"\ncount = 100\n");
  }
  Write("5.toml", "[net]\nname = \"n\"\n");
  EXPECT_EQ(Told(LoadSystem(folder_ / "0.toml")),
            "4.toml:3:1: instance[1]: expected at most 10000 instances");
}

}  // namespace
}  // namespace pheromone::nets
