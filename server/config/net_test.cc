// [[net]].
#include "server/core/petri/net.h"

#include <gmock/gmock.h>

#include <filesystem>

#include "server/config/describe.h"
#include "server/config/testing/folder_test.h"
#include "server/core/engine/engine.h"

namespace pheromone::config {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr const char* kTagNames[] = {"N1", "N2", "N3", "N4", "N5", "N6",
                                     "S1", "S2", "S3", "S4", "P",  "Src"};

class NetTest : public FolderTest {
 protected:
  NetTest() {
    std::filesystem::copy(
        std::filesystem::path(PHEROMONE_SOURCE_DIR) / "deploy" / "examples" / "nets", folder_,
        std::filesystem::copy_options::recursive);
  }

  // The tags of the bench, then [[net]] with these keys besides name, file and robot_file.
  static std::string WithNet(
      const std::string& keys = "",
      const std::string& files = "file = \"pheromone.toml\"\nrobot_file = \"robot.toml\"\n",
      const std::string& renamed = "") {
    std::string text;
    for (const std::string name : kTagNames) {
      text += "[[tag]]\nname = \"" + (name == renamed ? "other" : name) + "\"\nx_m = 1\ny_m = 2\n";
    }
    return text + "[[net]]\nname = \"bench\"\n" + files + keys;
  }

  std::vector<petri::LiveSettings> Nets(const std::string& more) const {
    const Result<Config> parsed = Parse(more);
    EXPECT_TRUE(parsed.ok()) << parsed.error();
    return parsed.ok() ? parsed.value().engine.nets : std::vector<petri::LiveSettings>{};
  }
};

TEST_F(NetTest, NeedNotBeThere) {
  EXPECT_TRUE(Nets("").empty());
}

TEST_F(NetTest, ANetHasItsFilesAndDefaults) {
  const std::vector<petri::LiveSettings> nets = Nets(WithNet());
  ASSERT_EQ(nets.size(), 1u);
  const petri::LiveSettings& net = nets[0];
  EXPECT_EQ(net.name, "bench");
  EXPECT_EQ(net.net.places.size(), 83u);
  EXPECT_EQ(net.net.transitions.size(), 75u);
  EXPECT_TRUE(net.net.claims.empty());
  EXPECT_NE(net.robot_hash, 0u);
  EXPECT_EQ(net.period_ms, 200u);
  EXPECT_EQ(net.law, petri::EvaporationLaw::kE1);
  EXPECT_EQ(net.rate_milli, 1'000u);
  EXPECT_EQ(net.dead_band_milli, 0u);
  EXPECT_FALSE(net.has_source);
  ASSERT_EQ(net.tags.size(), 12u);
  for (const petri::LiveTag& tag : net.tags) {
    EXPECT_EQ(tag.tag, tag.in_net);
    EXPECT_EQ(tag.candidates, tag.in_net == "P"     ? (std::vector<uint8_t>{2, 8, 15})
                              : tag.in_net == "Src" ? (std::vector<uint8_t>{5, 12})
                                                    : tag.candidates);
    EXPECT_EQ(tag.candidates.size(), tag.in_net == "P" ? 3u : tag.in_net == "Src" ? 2u : 1u);
  }
}

TEST_F(NetTest, ItsKeysAreRead) {
  const std::vector<petri::LiveSettings> nets =
      Nets(WithNet("parameters = { robots = 7 }\nperiod_ms = 100\nlaw = \"e4\"\nrate = 0.25\n"
                   "dead_band = 1.5\nsource = 1000\ntags = { N1 = \"other\" }\n",
                   "file = \"pheromone.toml\"\nrobot_file = \"robot.toml\"\n", "N1"));
  ASSERT_EQ(nets.size(), 1u);
  const petri::LiveSettings& net = nets[0];
  EXPECT_EQ(net.net.places[petri::PlaceOf(net.net, "nest")].tokens, 7u);
  EXPECT_EQ(net.period_ms, 100u);
  EXPECT_EQ(net.law, petri::EvaporationLaw::kE4);
  EXPECT_EQ(net.rate_milli, 250u);
  EXPECT_EQ(net.dead_band_milli, 1'500u);
  EXPECT_TRUE(net.has_source);
  EXPECT_EQ(net.source, 1'000u);
  EXPECT_THAT(net.tags, Contains(petri::LiveTag{"N1", "other", {1}}));
}

TEST_F(NetTest, ItsAuthorIsPrivilegedOnTags) {
  const Result<Config> parsed = Parse(WithNet() + "[tags]\nprivileged = [\"ann\"]\n");
  ASSERT_TRUE(parsed.ok()) << parsed.error();
  EXPECT_EQ(parsed.value().engine.tags.privileged, (std::vector<std::string>{"ann", "net:bench"}));
}

TEST_F(NetTest, TheEngineTakesIt) {
  const Result<Config> parsed = Parse(WithNet());
  ASSERT_TRUE(parsed.ok()) << parsed.error();
  EXPECT_TRUE(engine::Engine().CheckConfig(parsed.value().engine).ok());
}

TEST_F(NetTest, TheOtherNetsOfTheBenchCanBeExecutedToo) {
  for (const std::string file : {"motion", "pheromone_exploring"}) {
    EXPECT_EQ(
        Nets(WithNet("", "file = \"" + file + ".toml\"\nrobot_file = \"robot.toml\"\n")).size(),
        1u);
  }
}

TEST_F(NetTest, ItIsDescribed) {
  const Result<Config> parsed = Parse(WithNet());
  ASSERT_TRUE(parsed.ok());
  EXPECT_THAT(DescribeConfig(parsed.value()),
              Contains("net \"bench\": pheromone, 83 places, 75 transitions, 12 tags, read every "
                       "200 ms; law e1, rate 1, dead band 0, source endless"));
}

TEST_F(NetTest, MistakesAreNamed) {
  EXPECT_EQ(ErrorOf(WithNet("law = \"e5\"\n")),
            "f.toml:81:7: net[1].law: found the string \"e5\", expected one of \"e1\", "
            "\"e2\", \"e3\", \"e4\", \"exponential\", \"counter\"");
  EXPECT_EQ(ErrorOf(WithNet("period_ms = 1\n")),
            "f.toml:81:13: net[1].period_ms: found 1, expected a whole number from 2 to 60000");
  EXPECT_EQ(ErrorOf(WithNet("rats = 1\n")),
            "f.toml:81:1: net[1].rats: unknown key, expected rate?");
  EXPECT_EQ(ErrorOf(WithNet("rate = -1\n")),
            "f.toml:81:8: net[1].rate: found -1, expected a number from 0 to 1000000");
  EXPECT_EQ(ErrorOf(WithNet("parameters = { robots = \"many\" }\n")),
            "f.toml:81:25: net[1].parameters.robots: found the string \"many\", expected a whole "
            "number from 0 to 1000000");
  EXPECT_THAT(ErrorOf(WithNet("parameters = { robot = 2 }\n")),
              StartsWith("f.toml:79:8: net[1].file: found a net with an error: pheromone.toml"));
  EXPECT_EQ(ErrorOf(WithNet("tags = { N9 = \"N1\" }\n")),
            "f.toml:81:15: net[1].tags.N9: unknown tag of the net, expected one of P, N1, N2, N3, "
            "N4, N5, N6, S1, S2, Src, S3, S4");
  EXPECT_EQ(ErrorOf(WithNet("tags = { N2 = \"N1\" }\n")),
            "f.toml:79:8: net[1].file: found a net with an error: net \"bench\": tag \"N2\" or "
            "\"N1\" is bound twice");
}

TEST_F(NetTest, ATagThatIsMissingOrTooSmallIsNamed) {
  EXPECT_EQ(ErrorOf(WithNet("", "file = \"pheromone.toml\"\nrobot_file = \"robot.toml\"\n", "N3")),
            "f.toml:77:1: net[1].tags: tag \"N3\" of the net is [[tag]] \"N3\", which is missing");
  std::string small = WithNet();
  small.replace(small.find("y_m = 2\n"), 8, "y_m = 2\nslots = 3\n");
  EXPECT_EQ(ErrorOf(small),
            "f.toml:78:1: net[1].tags: tag \"N1\" of the net is [[tag]] \"N1\" with 3 slots, "
            "expected at least 4");
  EXPECT_THAT(ErrorOf(WithNet() + WithNet().substr(WithNet().find("[[net]]"))),
              HasSubstr("net[2].name: found the string \"bench\" again, expected a value not used "
                        "by another net"));
}

TEST_F(NetTest, FilesThatAreNoNetForThisAreNamed) {
  const auto error = [&](const std::string& file, const std::string& robot_file) {
    return ErrorOf(WithNet("", "file = \"" + file + "\"\nrobot_file = \"" + robot_file + "\"\n"));
  };
  EXPECT_EQ(ErrorOf(WithNet("", "robot_file = \"robot.toml\"\n")),
            "f.toml:77:1: net[1].file: missing, expected a string");
  EXPECT_EQ(
      error("identity.toml", "robot.toml"),
      "f.toml:79:8: net[1].file: found a net with an error: net \"bench\": no transition of a "
      "robot does anything, expected present, take or another one");
  EXPECT_EQ(error("pheromone.toml", "pheromone.toml"),
            "f.toml:80:14: net[1].robot_file: found a net with an error: found 83 places, expected "
            "1 to 32 in the net of a robot");
  EXPECT_EQ(error("source.toml", "robot.toml"),
            "f.toml:80:14: net[1].robot_file: found a net with an error: transition \"t1\" is at "
            "tag \"N1\", but the net in \"file\" has no transition of a robot there");
  Write("broken.toml", "net = 3\n");
  EXPECT_EQ(error("broken.toml", "robot.toml"),
            "f.toml:79:8: net[1].file: found a net with an error: broken.toml:1:7: net: found 3, "
            "expected a table");
}

}  // namespace
}  // namespace pheromone::config
