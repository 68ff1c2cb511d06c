#include "server/formats/nets/robot_tables.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <random>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "server/base/file.h"
#include "server/formats/nets/system_file.h"

namespace pheromone::nets {
namespace {

using protocol::PlaceDoes;
using protocol::TransitionDoes;

const std::filesystem::path kSource = PHEROMONE_SOURCE_DIR;

RobotTables Shipped() {
  const Result<petri::Net> net = LoadSystem(kSource / "deploy/examples/nets/robot.toml");
  EXPECT_TRUE(net.ok()) << net.error();
  const Result<RobotTables> robot = MakeRobotTables(net.value());
  EXPECT_TRUE(robot.ok()) << robot.error();
  return robot.ok() ? robot.value() : RobotTables{};
}

// A robot that goes to and fro between two tags.
petri::Net Shuttle() {
  return {.name = "shuttle",
          .places = {{.id = "out", .tokens = 1, .does = "follow 3"},
                     {.id = "held", .does = "wait 3"},
                     {.id = "free", .tokens = 1},
                     {.id = "back", .does = "follow 15"}},
          .transitions = {
              {.id = "ask", .takes = {{0}}, .gives = {{1}}, .tag = "gate", .does = "present"},
              {.id = "load",
               .takes = {{1}, {2}},
               .gives = {{3}},
               .inhibitors = {{0}},
               .tag = "far",
               .does = "take"},
              {.id = "home", .takes = {{3}}, .gives = {{0}, {2}}, .tag = "near"}}};
}

std::string ErrorOf(const petri::Net& net) {
  const Result<RobotTables> robot = MakeRobotTables(net);
  return robot.ErrorOr("");
}

TEST(RobotTables, HasMasksAndMeaningsOfANet) {
  petri::Net net = Shuttle();
  net.transitions[1].reads = {};
  net.transitions[0].reads = {{2}};
  const Result<RobotTables> robot = MakeRobotTables(net);
  ASSERT_TRUE(robot.ok()) << robot.error();
  EXPECT_EQ(robot.value().marking, 0b0101U);
  const std::vector<RobotPlace> places{{"out", PlaceDoes::kFollow, 3},
                                       {"held", PlaceDoes::kWait, 3},
                                       {"free", PlaceDoes::kNothing, 0},
                                       {"back", PlaceDoes::kFollow, 15}};
  EXPECT_EQ(robot.value().places, places);
  const std::vector<RobotTransition> transitions{
      {"ask", "gate", 0b0101, 0b0110, 0, TransitionDoes::kPresent},
      {"load", "far", 0b0110, 0b1000, 0b0001, TransitionDoes::kTake},
      {"home", "near", 0b1000, 0b0101, 0, TransitionDoes::kNothing}};
  EXPECT_EQ(robot.value().transitions, transitions);
}

// FNV-1a over the bytes that protocol/README.md lists, one after another.
TEST(RobotTables, HashesWhatTheProtocolSays) {
  std::vector<uint8_t> bytes{4, 3};
  const auto word = [&](uint32_t value) {
    for (int i = 0; i < 4; ++i) {
      bytes.push_back(static_cast<uint8_t>(value >> (8 * i)));
    }
  };
  word(0b0101);
  bytes.insert(bytes.end(), {1, 3, 2, 3, 0, 0, 1, 15});
  for (const auto& [takes, gives, inhibited_by, does] :
       std::vector<std::tuple<uint32_t, uint32_t, uint32_t, uint8_t>>{
           {1, 2, 0, 1}, {6, 8, 1, 7}, {8, 5, 0, 0}}) {
    word(takes);
    word(gives);
    word(inhibited_by);
    bytes.push_back(does);
  }
  uint32_t hash = 0x811c9dc5;
  for (const uint8_t byte : bytes) {
    hash = (hash ^ byte) * 0x01000193;
  }
  const Result<RobotTables> robot = MakeRobotTables(Shuttle());
  ASSERT_TRUE(robot.ok()) << robot.error();
  EXPECT_EQ(robot.value().hash, hash);
}

TEST(RobotTables, AnotherNetHasAnotherHash) {
  const uint32_t hash = MakeRobotTables(Shuttle()).value().hash;
  petri::Net net = Shuttle();
  net.places[3].does = "follow 14";
  EXPECT_NE(MakeRobotTables(net).value().hash, hash);
  net = Shuttle();
  net.transitions[1].does = "";
  EXPECT_NE(MakeRobotTables(net).value().hash, hash);
  net = Shuttle();
  net.transitions[1].inhibitors.clear();
  EXPECT_NE(MakeRobotTables(net).value().hash, hash);
  net = Shuttle();
  net.name = "bus";
  net.transitions[1].id = "fill";
  net.transitions[1].tag = "well";
  EXPECT_EQ(MakeRobotTables(net).value().hash, hash);
}

TEST(RobotTables, ShippedNetHasTheCandidatesOfThePaper) {
  const RobotTables robot = Shipped();
  EXPECT_EQ(robot.places.size(), 14U);
  EXPECT_EQ(robot.transitions.size(), 15U);
  EXPECT_EQ(robot.marking, 1U);
  EXPECT_EQ(robot.CandidatesOf("P"), (std::vector<uint8_t>{2, 8, 15}));
  EXPECT_EQ(robot.CandidatesOf("Src"), (std::vector<uint8_t>{5, 12}));
  EXPECT_EQ(robot.CandidatesOf("N4"), (std::vector<uint8_t>{9}));
  EXPECT_EQ(robot.CandidatesOf("N7"), std::vector<uint8_t>());
}

// The masks, fired as a robot fires them, against the net's own rule.
TEST(RobotTables, MasksFireLikeTheNet) {
  for (const petri::Net& net :
       {Shuttle(), LoadSystem(kSource / "deploy/examples/nets/robot.toml").value()}) {
    const RobotTables robot = MakeRobotTables(net).value();
    std::mt19937 random(1);
    petri::Marking marking = petri::InitialMarking(net);
    uint32_t bits = robot.marking;
    int fired = 0;
    for (int i = 0; i < 10'000; ++i) {
      const size_t chosen = random() % net.transitions.size();
      const RobotTransition& it = robot.transitions[chosen];
      const bool enabled = (bits & it.takes) == it.takes && (bits & it.inhibited_by) == 0;
      ASSERT_EQ(petri::IsEnabled(net, chosen, marking), enabled) << it.id;
      if (enabled) {
        ++fired;
        marking = petri::Fire(net, chosen, marking);
        bits = (bits & ~it.takes) | it.gives;
      }
      for (size_t p = 0; p < net.places.size(); ++p) {
        ASSERT_EQ(marking[static_cast<Eigen::Index>(p)], static_cast<int32_t>(bits >> p & 1));
      }
    }
    EXPECT_GT(fired, 500);
  }
}

// Computed by protocol/vectors/net_vectors.py, independently.
TEST(RobotTables, ShippedNetHasTheHashOfTheVectors) {
  const Result<std::string> vectors = ReadFile(kSource / "protocol/vectors/net_records.txt");
  ASSERT_TRUE(vectors.ok()) << vectors.error();
  EXPECT_NE(
      vectors.value().find(fmt::format("\ntrigger_of_P | trigger | {:08X} |", Shipped().hash)),
      std::string::npos);
}

TEST(RobotTables, NamesWhatNoRobotCanDo) {
  EXPECT_EQ(ErrorOf(Shuttle()), "");
  petri::Net net = Shuttle();
  for (const std::string does : {"follow", "follow 0", "follow 16", "follow x", "follow 1 ", "walk",
                                 "wait", "choose 1", "follow 99999999999"}) {
    net.places[3].does = does;
    EXPECT_EQ(ErrorOf(net), "place \"back\": does: found \"" + does +
                                "\", expected \"follow T\", \"wait T\" or \"choose\", with the "
                                "line's pheromone type T, 1 to 15");
  }
  net = Shuttle();
  net.transitions[2].does = "leave C";
  EXPECT_EQ(ErrorOf(net),
            "transition \"home\": does: found \"leave C\", expected present, leave, "
            "leave A, leave B, store A, store B or take");
  net = Shuttle();
  net.transitions[2].tag = "";
  EXPECT_EQ(ErrorOf(net), "transition \"home\": expected a tag, whose capture fires it");
  net = Shuttle();
  net.places[2].tokens = 2;
  EXPECT_EQ(ErrorOf(net), "place \"free\": tokens: found 2, expected 0 or 1");
  net = Shuttle();
  net.transitions[1].takes[1].weight = 2;
  EXPECT_EQ(ErrorOf(net),
            "transition \"load\": found an arc of weight 2 to place \"free\", expected 1");
  net = Shuttle();
  net.transitions[1].reads = {{2}};
  EXPECT_EQ(ErrorOf(net), "transition \"load\" reads a place that it takes from or gives to");
  net = Shuttle();
  net.places[1].id = "out";
  EXPECT_EQ(ErrorOf(net), "net \"shuttle\": the ID \"out\" is given twice");
}

TEST(RobotTables, NamesWhatDoesNotFit) {
  petri::Net net = Shuttle();
  EXPECT_EQ(ErrorOf({.name = "empty"}), "found 0 places, expected 1 to 32 in the net of a robot");
  while (net.places.size() < 32) {
    net.places.push_back({.id = "p" + std::to_string(net.places.size())});
  }
  EXPECT_EQ(ErrorOf(net), "");
  net.places.push_back({.id = "more"});
  EXPECT_EQ(ErrorOf(net), "found 33 places, expected 1 to 32 in the net of a robot");
  net = Shuttle();
  while (net.transitions.size() < 33) {
    net.transitions.push_back(net.transitions[2]);
    net.transitions.back().id += std::to_string(net.transitions.size());
  }
  EXPECT_EQ(ErrorOf(net), "found 33 transitions, expected 1 to 32 in the net of a robot");
  net.transitions.resize(14);
  EXPECT_EQ(ErrorOf(net), "tag \"near\": found 12 transitions, expected 11 at most");
  net.transitions.resize(13);
  EXPECT_EQ(ErrorOf(net), "");
}

TEST(RobotTables, RobotAlwaysKnowsWhatToDo) {
  petri::Net net = Shuttle();
  const std::string first =
      "of the places that are marked initially, expected exactly one that does something, and "
      "this \"follow T\"";
  net.places[0].tokens = 0;
  EXPECT_EQ(ErrorOf(net), first);
  net.places[3].tokens = 1;
  EXPECT_EQ(ErrorOf(net), "");
  net.places[0].tokens = 1;
  EXPECT_EQ(ErrorOf(net), first);
  net = Shuttle();
  net.transitions[2].gives = {{2}};
  EXPECT_EQ(ErrorOf(net),
            "transition \"home\": expected that it takes from exactly one place that "
            "does something, and gives to exactly one");
  net = Shuttle();
  net.transitions[0].does = "";
  EXPECT_EQ(ErrorOf(net),
            "transition \"ask\": expected \"present\" into a place that waits, and "
            "only there; place \"held\"");
  net = Shuttle();
  net.transitions[2].does = "leave A";
  EXPECT_EQ(ErrorOf(net),
            "transition \"home\": expected \"leave A\" or \"leave B\" out of a place "
            "that chooses, and only there; place \"back\"");
}

TEST(RobotTables, ChoiceHasAWayOutForEachTrail) {
  petri::Net net = Shuttle();
  net.places[3].does = "choose";
  net.transitions[1].does = "";
  net.transitions[2].does = "leave A";
  net.transitions.push_back(net.transitions[2]);
  net.transitions[3].id = "home_b";
  net.transitions[3].does = "leave B";
  EXPECT_EQ(ErrorOf(net), "");
  net.transitions[1].does = "take";
  EXPECT_EQ(ErrorOf(net), "transition \"load\": does: expected nothing, as place \"back\" chooses");
  net.transitions[1].does = "";
  net.transitions[3].does = "leave A";
  EXPECT_EQ(ErrorOf(net),
            "place \"back\" chooses: expected one transition out of it that does "
            "\"leave A\"");
  net.transitions.pop_back();
  EXPECT_EQ(ErrorOf(net),
            "place \"back\" chooses: expected one transition out of it that does "
            "\"leave B\"");
}

// If this fails:
//   pheromonectl net tables deploy/examples/nets/robot.toml --output
//   client_fw/core/tasks/robot_net.h
TEST(RobotTables, FirmwareHasTheTablesOfTheShippedNet) {
  const Result<std::string> header = ReadFile(kSource / "client_fw/core/tasks/robot_net.h");
  ASSERT_TRUE(header.ok()) << header.error();
  EXPECT_EQ(header.value(), HeaderOf(Shipped(), "robot.toml"));
}

TEST(RobotTables, NamesCannotLeaveTheCommentsOfAHeader) {
  petri::Net net = Shuttle();
  net.name = "a\nb\\";
  net.places[0].id = "x\r#error";
  const std::string text = HeaderOf(MakeRobotTables(net).value(), "c\\\n#error");
  EXPECT_NE(text.find("// The net \"a_b_\", made by pheromonectl net tables c__#error;"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("// x_#error\n"), std::string::npos) << text;
}

}  // namespace
}  // namespace pheromone::nets
