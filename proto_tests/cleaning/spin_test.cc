// The search through the real code (client_fw/verify) against a model of the same rules that Spin
// judges: the verdicts of the bounded queries, and on small grids each single state.
//
// The model keeps times where the search keeps their order, and stops at a horizon where the search
// goes on: that the states are the same also says that their order is enough.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <iterator>
#include <set>
#include <sstream>
#include <string>
#include <tuple>
#include <vector>

#include "client_fw/verify/cleaning_check.h"
#include "client_fw/verify/cleaning_world.h"
#include "server/base/file.h"
#include "server/base/result.h"
#include "server/base/testing/temporary_folder.h"

namespace pheromone::verify {
namespace {

// What Spin's verifier prints.
std::string Spin(const std::string& defines) {
  const TemporaryFolder folder;
  const std::string command = "cd " + folder.string() + " && spin " + defines +
                              " -a " PHEROMONE_SOURCE_DIR
                              "/proto_tests/cleaning/cleaning.pml >spin.txt 2>&1 && cc -w -O0 "
                              "-DSAFETY -DMEMLIM=2000 -o pan pan.c && ./pan -m1000000 -n >out.txt";
  EXPECT_EQ(std::system(command.c_str()), 0) << command;
  const Result<std::string> out = ReadFile(folder / "out.txt");
  EXPECT_TRUE(out.ok()) << out.error();
  return out.ok() ? out.value() : "";
}

bool HasErrors(const std::string& out) {
  EXPECT_NE(out.find("errors: "), std::string::npos) << out;
  EXPECT_EQ(out.find("max search depth too small"), std::string::npos);
  EXPECT_EQ(out.find("out of memory"), std::string::npos);
  return out.find("errors: 0") == std::string::npos;
}

void ExpectTheVerdict(int time, int horizon, Verdict expected) {
  const CleaningLimits limits{.clean_min = time, .clean_max = time, .rates_percent = PaperRates()};
  EXPECT_EQ(CheckLevels(limits, {{5, 6}}, {20, 51}, horizon).verdict, expected);
  const std::string out =
      Spin("-DCOLUMNS=4 -DROWS=3 -DSTART_A=5 -DSTART_B=6 -DSOIL=4 -DD=" + std::to_string(time) +
           " -DHORIZON=" + std::to_string(horizon));
  EXPECT_EQ(HasErrors(out), expected == Verdict::kRefuted) << out;
}

TEST(Spin, AgreesWithTheVerdicts) {
  ExpectTheVerdict(8, 300, Verdict::kProved);
  ExpectTheVerdict(8, 360, Verdict::kRefuted);
}

// Millions of states for Spin.
TEST(Spin, AgreesWithTheOtherVerdicts) {
  if (std::getenv("PHEROMONE_ALL_VERDICTS") == nullptr) {
    GTEST_SKIP() << "only in spin_long_test";
  }
  ExpectTheVerdict(5, 240, Verdict::kProved);
  ExpectTheVerdict(6, 240, Verdict::kProved);
  ExpectTheVerdict(8, 240, Verdict::kProved);
  ExpectTheVerdict(7, 480, Verdict::kProved);
}

TEST(Spin, AgreesThatClaimsNeedACondition) {
  const std::string small = "-DCOLUMNS=2 -DROWS=2 -DD=5 -DHORIZON=60";
  EXPECT_FALSE(HasErrors(Spin(small)));
  EXPECT_TRUE(HasErrors(Spin(small + " -DUNCONDITIONAL")));
  EXPECT_EQ(ProveCleaning({.columns = 2, .rows = 2, .claims_unconditionally = true}).verdict,
            Verdict::kRefuted);
}

struct Robot {
  int phase;
  int zone;
  int timer;
  int stale;
};

// A state in text: the robots in order of what they do, and for each zone that it is occupied, or
// how many different time stamps of others are older.
std::string Canonical(std::vector<Robot> robots, const std::vector<int>& stamps, bool is_now) {
  std::sort(robots.begin(), robots.end(), [](const Robot& a, const Robot& b) {
    return std::tie(a.zone, a.phase, a.timer, a.stale) <
           std::tie(b.zone, b.phase, b.timer, b.stale);
  });
  std::ostringstream text;
  for (const Robot& it : robots) {
    text << it.phase << ' ' << it.zone << ' ' << it.timer << ' ' << it.stale << ", ";
  }
  for (const int stamp : stamps) {  // -1: occupied
    std::set<int> older;
    std::copy_if(stamps.begin(), stamps.end(), std::inserter(older, older.end()),
                 [&](int other) { return other >= 0 && other < stamp; });
    text << (stamp < 0 ? "-" : std::to_string(older.size())) << ' ';
  }
  const bool may_stamp = std::any_of(robots.begin(), robots.end(), [](const Robot& it) {
    return it.phase == static_cast<int>(CleanerPhase::kCleaning) && it.timer == 0;
  });
  text << (is_now && may_stamp);  // whether the next time stamp will equal the newest
  return text.str();
}

std::set<std::string> StatesBySpin(size_t zones, const std::string& defines) {
  std::istringstream out(Spin(defines + " -DREPORT"));
  std::set<std::string> states;
  std::string line;
  while (std::getline(out, line)) {
    std::istringstream words(line);
    std::string word;
    int clock = 0;
    if (!(words >> word >> clock) || word != "state") {
      continue;
    }
    std::vector<Robot> robots(2);
    for (Robot& it : robots) {
      words >> it.phase >> it.zone >> it.timer >> it.stale;
    }
    std::vector<int> stamps;
    bool is_now = false;
    for (size_t zone = 0; zone < zones; ++zone) {
      int occupied = 0;
      int stamp = 0;
      words >> occupied >> stamp;
      stamps.push_back(occupied != 0 ? -1 : stamp);
      is_now = is_now || (occupied == 0 && stamp == clock);
    }
    EXPECT_FALSE(words.fail()) << line;
    states.insert(Canonical(robots, stamps, is_now));
  }
  return states;
}

std::set<std::string> StatesOfTheCode(const CleaningLimits& limits) {
  CleaningWorld world(limits);
  std::set<std::string> known;
  std::vector<CleaningState> waiting;
  const auto add = [&](const CleaningState& state) {
    std::vector<Robot> robots;
    std::vector<int> stamps(state.rank.begin(),
                            state.rank.begin() + static_cast<ptrdiff_t>(world.zones()));
    for (size_t i = 0; i < 2; ++i) {
      const Cleaner& it = state.cleaners[i];
      robots.push_back({static_cast<int>(it.phase), it.zone, it.timer, it.is_stale ? 1 : 0});
      if (it.has_sign) {
        stamps[it.zone] = -1;
      }
    }
    if (known.insert(Canonical(robots, stamps, state.is_newest_now)).second) {
      waiting.push_back(state);
    }
  };
  world.EachStart([&](const std::vector<uint8_t>& start) {
    add(world.Start(start));
    return true;
  });
  std::vector<CleaningSuccessor> next;
  while (!waiting.empty()) {
    const CleaningState state = waiting.back();
    waiting.pop_back();
    world.Next(state, &next);
    for (const CleaningSuccessor& successor : next) {
      add(successor.state);
    }
  }
  return known;
}

void ExpectTheStates(int columns, int rows, int time, int horizon) {
  const std::set<std::string> spin =
      StatesBySpin(static_cast<size_t>(columns) * static_cast<size_t>(rows),
                   "-DCOLUMNS=" + std::to_string(columns) + " -DROWS=" + std::to_string(rows) +
                       " -DD=" + std::to_string(time) + " -DHORIZON=" + std::to_string(horizon));
  const std::set<std::string> code =
      StatesOfTheCode({.columns = columns, .rows = rows, .clean_min = time, .clean_max = time});
  std::cout << columns << " x " << rows << ": " << code.size() << " states\n";
  std::vector<std::string> only_one;
  std::set_symmetric_difference(spin.begin(), spin.end(), code.begin(), code.end(),
                                std::back_inserter(only_one));
  EXPECT_TRUE(only_one.empty()) << only_one.size() << " of " << spin.size() << " and "
                                << code.size() << ", the first: " << only_one.front();
}

TEST(Spin, FindsTheSameStates) {
  ExpectTheStates(2, 2, 5, 60);
  ExpectTheStates(2, 2, 2, 60);
  ExpectTheStates(3, 2, 5, 120);
}

}  // namespace
}  // namespace pheromone::verify
