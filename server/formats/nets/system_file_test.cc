#include "server/formats/nets/system_file.h"

#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "server/base/testing/temporary_folder.h"

namespace pheromone::nets {
namespace {

constexpr std::string_view kGate = R"(
[net]
name = "gate"
[parameters]
width = { value = 1, least = 1, most = 3 }
[[place]]
id = "lane"
[[place]]
id = "open"
box = "Open{as}"
tokens = 1
owner = "environment"
[[transition]]
id = "pass"
takes = ["{width} lane"]
gives = ["{width} behind"]
reads = ["open"]
owner = "robot"
tag = "{as}"
[[place]]
id = "behind"
[[claim]]
id = "wide"
text = "always behind <= {width}"
)";

constexpr std::string_view kBench = R"(
[net]
name = "bench"
[parameters]
robots = 2
[[place]]
id = "nest"
tokens = "{robots}"
[[transition]]
id = "home"
takes = ["{robots - 1} N2.behind"]
gives = ["nest"]
inhibited_by = ["3 OpenN1"]
[[claim]]
id = "all"
text = """always nest + N1.behind
          + N2.behind = {robots}"""
[[instance]]
net = "gate.toml"
as = "N1"
with = { lane = "nest" }
[[instance]]
net = "gate.toml"
as = "N2"
with = { lane = "N1.behind" }
parameters = { width = "{robots}" }
)";

class SystemFileTest : public ::testing::Test {
 protected:
  void SetUp() override {
    Write("gate.toml", kGate);
    Write("bench.toml", kBench);
  }

  void Write(const std::string& name, std::string_view text) const {
    std::ofstream(folder_ / name) << text;
  }

  petri::Net Load(const std::string& name, const Parameters& chosen = {}) const {
    Result<petri::Net> net = LoadSystem(folder_ / name, chosen);
    EXPECT_TRUE(net.ok()) << net.error();
    return net.ok() ? std::move(net).value() : petri::Net{};
  }

  const TemporaryFolder folder_;
};

TEST_F(SystemFileTest, ReadsASingleNet) {
  const petri::Net expected{
      .name = "gate",
      .places = {{.id = "lane"},
                 {.id = "open", .tokens = 1, .box = "Open", .owner = "environment"},
                 {.id = "behind"}},
      .transitions =
          {{.id = "pass", .takes = {{0, 3}}, .gives = {{2, 3}}, .reads = {{1}}, .owner = "robot"}},
      .claims = {{"wide", "always behind <= 3"}}};
  EXPECT_EQ(Load("gate.toml", {{"width", 3}}), expected);
}

TEST_F(SystemFileTest, ComposesInstances) {
  const petri::Net expected{
      .name = "bench",
      .places = {{.id = "nest", .tokens = 2},
                 {.id = "N2.behind"},
                 {.id = "OpenN1", .tokens = 1, .box = "OpenN1", .owner = "environment"},
                 {.id = "N1.behind"},
                 {.id = "OpenN2", .tokens = 1, .box = "OpenN2", .owner = "environment"}},
      .transitions = {{.id = "home", .takes = {{1}}, .gives = {{0}}, .inhibitors = {{2, 3}}},
                      {.id = "N1.pass",
                       .takes = {{0}},
                       .gives = {{3}},
                       .reads = {{2}},
                       .owner = "robot",
                       .tag = "N1"},
                      {.id = "N2.pass",
                       .takes = {{3, 2}},
                       .gives = {{1, 2}},
                       .reads = {{4}},
                       .owner = "robot",
                       .tag = "N2"}},
      .claims = {{"all", "always nest + N1.behind + N2.behind = 2"},
                 {"N1.wide", "always N1.behind <= 1"},
                 {"N2.wide", "always N2.behind <= 2"}}};
  EXPECT_EQ(Load("bench.toml"), expected);
}

TEST_F(SystemFileTest, AChosenParameterReachesInstances) {
  const petri::Net net = Load("bench.toml", {{"robots", 3}});
  EXPECT_EQ(net.places[0].tokens, 3u);
  EXPECT_EQ(net.transitions[0].takes, (std::vector<petri::Arc>{{1, 2}}));
  EXPECT_EQ(net.transitions[2].takes, (std::vector<petri::Arc>{{3, 3}}));
  EXPECT_EQ(net.claims[0].text, "always nest + N1.behind + N2.behind = 3");
}

TEST_F(SystemFileTest, AClaimReplacesAnInstancesOne) {
  Write("other.toml",
        "[net]\nname = \"other\"\n[[instance]]\nnet = \"bench.toml\"\n"
        "[[claim]]\nid = \"all\"\ntext = \"never nest = 1\"\n");
  const petri::Net net = Load("other.toml");
  ASSERT_EQ(net.claims.size(), 3u);
  EXPECT_EQ(net.claims[0], (petri::Claim{"all", "never nest = 1"}));
  EXPECT_EQ(net.claims[1].id, "N1.wide");
}

TEST_F(SystemFileTest, CountsInstances) {
  Write("many.toml", R"(
[net]
name = "many"
[parameters]
robots = 2
[[place]]
id = "nest"
[[instance]]
net = "gate.toml"
as = "R"
count = "{robots}"
with = { lane = "nest", behind = "nest{as}" }
[[place]]
id = "nestR1"
[[place]]
id = "nestR2"
)");
  const petri::Net net = Load("many.toml");
  ASSERT_EQ(net.transitions.size(), 2u);
  EXPECT_EQ(net.transitions[1].id, "R2.pass");
  EXPECT_EQ(net.places[net.transitions[1].gives[0].place].id, "nestR2");
  EXPECT_EQ(Load("many.toml", {{"robots", 1}}).transitions.size(), 1u);
}

TEST_F(SystemFileTest, ReplacesAFileInAllThatAnInstanceIsMadeOf) {
  Write("outer.toml",
        "[net]\nname = \"outer\"\n[[instance]]\nnet = \"bench.toml\"\n"
        "replace = { \"gate.toml\" = \"sub/slow.toml\" }\n");
  std::filesystem::create_directory(folder_ / "sub");
  std::string slow(kGate);
  slow.replace(slow.find("\"pass\""), 6, "\"creep\"");
  Write("sub/slow.toml", slow);
  const petri::Net net = Load("outer.toml");
  ASSERT_EQ(net.transitions.size(), 3u);
  EXPECT_EQ(net.transitions[1].id, "N1.creep");
  EXPECT_EQ(net.transitions[2].id, "N2.creep");
  EXPECT_EQ(net.name, "outer");
}

TEST_F(SystemFileTest, ReadsATextAsIfItWereInAFolder) {
  const Result<petri::Net> net = ParseSystem("text", kBench, {}, folder_.path());
  ASSERT_TRUE(net.ok()) << net.error();
  EXPECT_EQ(net.value(), Load("bench.toml"));
}

}  // namespace
}  // namespace pheromone::nets
