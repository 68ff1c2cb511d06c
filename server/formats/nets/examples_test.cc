// The nets in deploy/examples/nets, searched naively: reachable markings as an independent model of
// the bench counts them, and the shortest traces of the readings that break it.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "server/core/petri/compose.h"
#include "server/formats/nets/system_file.h"

namespace pheromone::nets {
namespace {

namespace fs = std::filesystem;

const fs::path kNets = fs::path(PHEROMONE_SOURCE_DIR) / "deploy/examples/nets";

petri::Net Example(std::string_view file, const Parameters& chosen = {}) {
  Result<petri::Net> net = LoadSystem(kNets / file, chosen);
  EXPECT_TRUE(net.ok()) << net.error();
  return net.ok() ? std::move(net).value() : petri::Net{};
}

using Tokens = std::vector<int32_t>;
using Test = std::function<bool(const Tokens&)>;

// All that can be fired; or, reduced, one of those that only enable others, if there is one.
std::vector<size_t> Choices(const petri::Net& net, bool reduced, const petri::Marking& marking) {
  std::vector<size_t> choices;
  for (size_t i = 0; i < net.transitions.size(); ++i) {
    const std::string& id = net.transitions[i].id;
    if (!petri::IsEnabled(net, i, marking)) {
      continue;
    }
    const bool of_exit = id[0] == 'S' ? id[1] > '2' : id[1] > '3';
    if (reduced &&
        (id.ends_with(".present") || id.ends_with(".WriteRed") ||
         id.find(".release") != std::string::npos || (id.ends_with(".sense") && of_exit))) {
      return {i};
    }
    choices.push_back(i);
  }
  return choices;
}

struct Found {
  size_t markings = 0;
  int deadlock = -1;  // steps to the nearest one
  int wrong = -1;     // steps to the nearest marking that the test finds
};

Found Search(const petri::Net& net, bool reduced, const Test& is_wrong = {}) {
  Found found;
  std::map<Tokens, int> steps;
  std::vector<Tokens> queue;
  const auto see = [&](const petri::Marking& marking, int step) {
    Tokens tokens(marking.begin(), marking.end());
    if (steps.try_emplace(tokens, step).second) {
      queue.push_back(std::move(tokens));
    }
  };
  see(petri::InitialMarking(net), 0);
  for (size_t i = 0; i < queue.size() && found.deadlock < 0 && found.wrong < 0; ++i) {
    const Tokens now = queue[i];
    const int step = steps.at(now);
    const petri::Marking marking =
        Eigen::Map<const petri::Marking>(now.data(), static_cast<Eigen::Index>(now.size()));
    const std::vector<size_t> choices = Choices(net, reduced, marking);
    found.deadlock = choices.empty() ? step : -1;
    found.wrong = is_wrong && is_wrong(now) ? step : -1;
    for (const size_t choice : choices) {
      see(petri::Fire(net, choice, marking), step + 1);
    }
  }
  found.markings = queue.size();
  return found;
}

Test MoreThanOne(const petri::Net& net, const std::vector<std::string_view>& places) {
  std::vector<size_t> numbers;
  for (const std::string_view place : places) {
    numbers.push_back(petri::PlaceOf(net, place));
  }
  return [numbers](const Tokens& tokens) {
    int32_t sum = 0;
    for (const size_t number : numbers) {
      sum += tokens.at(number);
    }
    return sum > 1;
  };
}

const std::vector<std::string_view> kAtP = {"leaves",    "to_A",      "to_B",
                                            "returns_A", "returns_B", "to_nest"};

TEST(NetExamples, AllAreRead) {
  size_t files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(kNets)) {
    if (entry.path().extension() == ".toml") {
      const Result<petri::Net> net = LoadSystem(entry.path());
      EXPECT_TRUE(net.ok()) << net.error();
      ++files;
    }
  }
  EXPECT_EQ(files, 46u);
}

TEST(NetExamples, HaveTheSizesOfTheBench) {
  const auto size = [](std::string_view file) {
    const petri::Net net = Example(file);
    return std::pair(net.places.size(), net.transitions.size());
  };
  EXPECT_EQ(size("robot.toml"), std::pair(size_t{14}, size_t{15}));
  EXPECT_EQ(size("motion.toml"), std::pair(size_t{71}, size_t{53}));
  EXPECT_EQ(size("pheromone.toml"), std::pair(size_t{83}, size_t{75}));
}

TEST(NetExamples, HaveTheReachableMarkingsOfAnIndependentModel) {
  const auto markings = [](std::string_view file, int64_t robots) {
    const Found found = Search(Example(file, {{"robots", robots}}), true);
    EXPECT_EQ(found.deadlock, -1);
    return found.markings;
  };
  EXPECT_EQ(markings("motion.toml", 2), 1'282u);
  EXPECT_EQ(markings("motion.toml", 3), 10'164u);
  EXPECT_EQ(markings("pheromone.toml", 2), 61'428u);
  EXPECT_EQ(markings("identity.toml", 2), 1'980u);
}

TEST(NetExamples, ExcludeAllButOneRobotFromEachArea) {
  const petri::Net net = Example("motion.toml", {{"robots", 3}});
  EXPECT_EQ(Search(net, true, MoreThanOne(net, kAtP)).wrong, -1);
  EXPECT_EQ(Search(net, true,
                   MoreThanOne(net, {"Src.before_A", "Src.after_A", "Src.before_B", "Src.after_B"}))
                .wrong,
            -1);
}

TEST(NetExamples, BreakAsTheyAreReadLiterally) {
  const auto deadlock = [](std::string_view file, int64_t robots) {
    return Search(Example(file, {{"robots", robots}}), false).deadlock;
  };
  const auto two_at_p = [](std::string_view file, int64_t robots) {
    const petri::Net net = Example(file, {{"robots", robots}});
    return Search(net, false, MoreThanOne(net, kAtP)).wrong;
  };
  EXPECT_EQ(deadlock("broken/red_by_timer.toml", 1), 5);
  EXPECT_EQ(deadlock("broken/stop_in_queue.toml", 2), 2);
  EXPECT_EQ(deadlock("broken/stop_in_area.toml", 1), 7);
  EXPECT_EQ(two_at_p("broken/stale_green.toml", 2), 8);
  EXPECT_EQ(two_at_p("broken/green_before_busy.toml", 2), 11);
  const petri::Net loop = Example("broken/reader_ready_self_loop.toml");
  EXPECT_EQ(Search(loop, false, MoreThanOne(loop, {"ReaderReady", "psPhe3"})).wrong, 1);
}

}  // namespace
}  // namespace pheromone::nets
