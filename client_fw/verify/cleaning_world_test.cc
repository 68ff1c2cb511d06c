// The world that the search runs through, against real tags with their whole history, and the
// search against one that is naive.

#include "client_fw/verify/cleaning_world.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <functional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "client_fw/verify/cleaning_check.h"
#include "client_fw/verify/cleaning_symmetry.h"
#include "client_fw/verify/explore.h"
#include "server/core/tags/tag.h"

namespace pheromone::verify {
namespace {

TEST(Grid, AZoneSeesThoseBesideIt) {
  const CleaningWorld world({.columns = 4, .rows = 3});
  const std::vector<size_t> in_sight = {2, 3, 2, 3, 4, 3,
                                        3, 4, 3, 2, 3, 2};  // the paper's figure 1
  for (size_t zone = 0; zone < 12; ++zone) {
    EXPECT_EQ(world.neighbours(zone).size(), in_sight[zone]) << zone + 1;
  }
  EXPECT_EQ(world.neighbours(4), (std::vector<uint8_t>{1, 3, 5, 7}));
}

std::vector<std::vector<uint8_t>> AllStarts(const CleaningWorld& world) {
  std::vector<std::vector<uint8_t>> starts;
  world.EachStart([&](const std::vector<uint8_t>& start) {
    starts.push_back(start);
    return true;
  });
  return starts;
}

TEST(Grid, AllStarts) {
  EXPECT_EQ(AllStarts(CleaningWorld({.robots = 2})).size(), 78u);
  EXPECT_EQ(AllStarts(CleaningWorld({.columns = 3, .robots = 3})).size(), 165u);
}

// One tag for each zone, on which all robots wrote all that they have written.
class Tags {
 public:
  explicit Tags(size_t zones) : tags_(zones) {}

  void Do(const CleaningStep& step, int time, int lease) {
    const auto now_ms = static_cast<uint64_t>(time) * 1'000;
    for (tags::Tag& tag : tags_) {
      tag.Expire(now_ms);
    }
    tags::Tag& tag = tags_[step.zone];
    const int32_t author = step.robot + 1;
    switch (step.action) {
      case CleaningAction::kDecidesToClean:
        seen_[step.robot] = tag.generation();
        break;
      case CleaningAction::kBreaksDown:
      case CleaningAction::kIsRefused:
      case CleaningAction::kClaims: {
        if (step.action == CleaningAction::kBreaksDown && !is_claiming_[step.robot]) {
          break;
        }
        const tags::Written written = tag.Write({.block = BlockOf(author, time, kOccupied),
                                                 .expected = seen_[step.robot],
                                                 .lease_ms = static_cast<uint32_t>(lease) * 1'000},
                                                now_ms, {});
        EXPECT_EQ(written.outcome == tags::WriteOutcome::kDone,
                  step.action != CleaningAction::kIsRefused);
        slot_[step.robot] = written.slot;
        break;
      }
      case CleaningAction::kFinishes:
        tag.Write({.block = BlockOf(author, time, kCleaned), .is_state = true}, now_ms, {});
        EXPECT_EQ(tag.Erase(slot_[step.robot], author, std::nullopt, {}),
                  tags::WriteOutcome::kDone);
        break;
      default:
        break;
    }
    is_claiming_[step.robot] = step.action == CleaningAction::kDecidesToClean;
  }

  void ExpireAt(int time) {
    for (tags::Tag& tag : tags_) {
      tag.Expire(static_cast<uint64_t>(time) * 1'000);
    }
  }

  bool IsOccupied(size_t zone) const { return Newest(zone, kOccupied) > 0; }
  uint32_t CleanedAt(size_t zone) const { return Newest(zone, kCleaned); }

 private:
  static constexpr int32_t kOccupied = 11;
  static constexpr int32_t kCleaned = 12;

  static tags::Block BlockOf(int32_t author, int time, int32_t predicate) {
    return {author, static_cast<uint32_t>(time) + 1, {0, 1}, {0, predicate}, {0, 1}};
  }

  uint32_t Newest(size_t zone, int32_t predicate) const {
    uint32_t newest = 0;
    for (const tags::Slot& slot : tags_[zone].slots()) {
      if (!slot.block.is_empty() && slot.block.predicate.value == predicate) {
        newest = std::max(newest, slot.block.time_s);
      }
    }
    return newest;
  }

  std::vector<tags::Tag> tags_;
  std::array<uint16_t, kMaxCleaners> seen_{};
  std::array<uint8_t, kMaxCleaners> slot_{};
  std::array<bool, kMaxCleaners> is_claiming_{};
};

// What a state says of the tags is what is on tags that were never forgotten.
void ExpectTheTags(const CleaningLimits& limits, uint32_t seed) {
  CleaningWorld world(limits);
  Tags tags(world.zones());
  std::mt19937 random(seed);
  const std::vector<std::vector<uint8_t>> starts = AllStarts(world);
  CleaningState state = world.Start(starts[random() % starts.size()]);
  std::vector<CleaningSuccessor> next;
  int time = 0;
  for (int i = 0; i < 2'000; ++i) {
    world.Next(state, &next);
    ASSERT_FALSE(next.empty());
    const CleaningSuccessor chosen = next[random() % next.size()];
    tags.Do(chosen.step, time, limits.lease);
    time += chosen.step.passed;
    tags.ExpireAt(time);
    state = chosen.state;
    std::vector<size_t> free;
    for (size_t zone = 0; zone < world.zones(); ++zone) {
      const bool is_occupied =
          std::any_of(state.cleaners.begin(), state.cleaners.end(),
                      [&](const Cleaner& it) { return it.has_sign && it.zone == zone; });
      ASSERT_EQ(tags.IsOccupied(zone), is_occupied);
      if (!is_occupied) {
        free.push_back(zone);
      }
    }
    for (const size_t a : free) {
      for (const size_t b : free) {
        ASSERT_EQ(tags.CleanedAt(a) < tags.CleanedAt(b), state.rank[a] < state.rank[b]);
      }
    }
  }
}

TEST(World, AgreesWithTagsThatKeepTheirHistory) {
  for (uint32_t seed = 0; seed < 20; ++seed) {
    ExpectTheTags({}, seed);
    ExpectTheTags({.columns = 3, .robots = 4, .clean_max = 7, .move_max = 2}, seed);
    ExpectTheTags({.columns = 2, .rows = 2, .robots = 3, .crashes = 1}, seed);
  }
}

std::string RobotsOf(const CleaningState& state) {
  std::vector<std::string> robots;
  for (const Cleaner& it : state.cleaners) {
    robots.push_back({static_cast<char>(it.phase), static_cast<char>(it.zone),
                      static_cast<char>(it.timer), it.is_stale, it.has_sign});
  }
  std::sort(robots.begin(), robots.end());
  std::string key;
  for (const std::string& robot : robots) {
    key += robot;
  }
  return key;
}

// All that is in a state, robots in any order.
std::string KeyOf(const CleaningState& state) {
  return std::string(state.rank.begin(), state.rank.end()) + RobotsOf(state) +
         (state.is_newest_now ? '1' : '0');
}

size_t CountedOneByOne(const CleaningLimits& limits,
                       const std::function<std::string(const CleaningState&)>& key = KeyOf) {
  CleaningWorld world(limits);
  std::vector<CleaningSuccessor> successors;
  bool is_first = true;
  const Model<CleaningState> model{
      .key = key,
      .next =
          [&](const CleaningState& state, const Model<CleaningState>::Visit& visit) {
            if (std::exchange(is_first, false)) {
              for (const std::vector<uint8_t>& start : AllStarts(world)) {
                visit("start", world.Start(start));
              }
            }
            world.NextInAllOrders(state, &successors);
            for (const CleaningSuccessor& successor : successors) {
              visit("", successor.state);
            }
          },
      .wrong = [](const CleaningState&) { return ""; },
      .max_states = 1'000'000};
  return Explore(world.Start(AllStarts(world).front()), model).states;
}

TEST(Search, FindsTheStatesThatANaiveSearchCounts) {
  for (const CleaningLimits& limits :
       {CleaningLimits{.columns = 2, .rows = 2}, CleaningLimits{.columns = 3, .rows = 2},
        CleaningLimits{.columns = 2, .rows = 3, .robots = 3, .clean_min = 2, .clean_max = 2},
        CleaningLimits{.columns = 3, .rows = 2, .clean_max = 6, .crashes = 1}}) {
    EXPECT_EQ(ProveCleaning(limits).unfolded_states, CountedOneByOne(limits));
  }
}

// What robots can tell of the time stamps: of each two zones that are seen together, and not
// occupied, which was cleaned before; and which were cleaned just now, as long as more may be.
std::string KeyOfSight(const CleaningWorld& world, const CleaningState& state) {
  std::string key = RobotsOf(state);
  const uint8_t newest = *std::max_element(state.rank.begin(), state.rank.end());
  for (size_t a = 0; a < world.zones(); ++a) {
    key += state.is_newest_now && state.rank[a] == newest ? '!' : '.';
    for (size_t b = 0; b < a; ++b) {
      const auto is_occupied = [&](size_t zone) {
        return std::any_of(state.cleaners.begin(), state.cleaners.end(),
                           [&](const Cleaner& it) { return it.has_sign && it.zone == zone; });
      };
      const auto sees = [&](size_t from, size_t zone) {
        const std::vector<uint8_t>& beside = world.neighbours(from);
        return from == zone || std::find(beside.begin(), beside.end(), zone) != beside.end();
      };
      bool together = false;
      for (size_t from = 0; from < world.zones(); ++from) {
        together = together || (sees(from, a) && sees(from, b));
      }
      if (together && !is_occupied(a) && !is_occupied(b)) {
        key += state.rank[a] < state.rank[b] ? '<' : state.rank[a] == state.rank[b] ? '=' : '>';
      }
    }
  }
  return key;
}

TEST(Reduced, TimeStampsAreToldApartByWhatRobotsSeeTogether) {
  for (CleaningLimits limits :
       {CleaningLimits{.columns = 6, .rows = 1}, CleaningLimits{.columns = 3, .rows = 2},
        CleaningLimits{.columns = 5, .rows = 1, .robots = 3, .clean_min = 2, .clean_max = 2}}) {
    const CleaningWorld world(limits);
    const auto by_sight = [&](const CleaningState& state) { return KeyOfSight(world, state); };
    const size_t expected = CountedOneByOne(limits, by_sight);
    EXPECT_LT(expected, CountedOneByOne(limits));
    limits.reduced = true;
    EXPECT_EQ(CountedOneByOne(limits), expected);
    EXPECT_EQ(CountedOneByOne(limits, by_sight), expected);
  }
}

// Of orders that lead to the same, one is enough.
TEST(Reduced, AProofIsTheSame) {
  for (CleaningLimits limits :
       {CleaningLimits{.columns = 3, .rows = 2}, CleaningLimits{.columns = 4, .rows = 2},
        CleaningLimits{.columns = 4, .rows = 1, .robots = 3, .clean_min = 2, .clean_max = 3},
        CleaningLimits{.columns = 7, .rows = 1}, CleaningLimits{.columns = 6, .rows = 1, .asks = 1},
        CleaningLimits{.columns = 3, .rows = 2, .lease = 4},
        CleaningLimits{.columns = 3, .rows = 2, .crashes = 1},
        CleaningLimits{.columns = 3, .rows = 3, .closed = 16},
        CleaningLimits{.columns = 3, .rows = 2, .claims_unconditionally = true}}) {
    const CleaningResult all = ProveCleaning(limits);
    limits.reduced = true;
    const CleaningResult some = ProveCleaning(limits);
    EXPECT_EQ(some.verdict, all.verdict);
    EXPECT_EQ(some.gaps, all.gaps);
    EXPECT_EQ(some.first, all.first);
    EXPECT_EQ(some.wrong, all.wrong);
    EXPECT_LT(some.states, all.states);
  }
}

TEST(Reduced, TheQueriesAreTheSame) {
  for (const int time : {4, 7, 11}) {
    CleaningLimits limits{.columns = 4, .rows = 2, .clean_min = time, .clean_max = time};
    limits.rates_percent = {3, 7, 5, 10, 4, 8, 5, 2};
    limits.lease = 3 * time;
    CleaningLimits reduced = limits;
    reduced.reduced = true;
    const CleaningStarts starts = {{0, 7}, {3, 3}};
    const CleaningResult clean = CheckCleanAfter(limits, starts, {80, 20});
    const CleaningResult clean_too = CheckCleanAfter(reduced, starts, {80, 20});
    EXPECT_EQ(clean_too.verdict, clean.verdict) << time;
    EXPECT_EQ(clean_too.longest, clean.longest) << time;
    const CleaningResult levels = CheckLevels(limits, starts, {20, 45}, 150);
    const CleaningResult levels_too = CheckLevels(reduced, starts, {20, 45}, 150);
    EXPECT_EQ(levels_too.verdict, levels.verdict) << time;
    EXPECT_EQ(levels_too.levels, levels.levels) << time;
    EXPECT_EQ(levels_too.wrong_time, levels.wrong_time) << time;
    EXPECT_LT(levels_too.steps, levels.steps) << time;
  }
}

// Five robots in one zone that may each take many different times: millions of states within the
// first moment, and 1.6 million starts of six robots.
CleaningLimits AnyTimes(int robots) {
  return {.columns = 6,
          .rows = 5,
          .robots = robots,
          .clean_min = 1,
          .clean_max = 250,
          .move_min = 1,
          .move_max = 250,
          .lease = 0,
          .rates_percent = std::vector<int>(30, 5),
          .reduced = true};
}

TEST(Memory, CountsWhatHappensWithinAMoment) {
  const CleaningStarts five_in_one = {{7, 7, 7, 7, 7}};
  constexpr size_t kMost = size_t{6} << 20;
  const SearchLimits search{.max_bytes = kMost};
  const CleaningLimits limits = AnyTimes(5);
  for (const CleaningResult& result : {ProveCleaning(limits, five_in_one, search),
                                       CheckCleanAfter(limits, five_in_one, {80, 30}, search),
                                       CheckLevels(limits, five_in_one, {20, 51}, 240, search)}) {
    EXPECT_EQ(result.verdict, Verdict::kUnknown) << result.wrong;
    EXPECT_GT(result.bytes, kMost);
    EXPECT_LT(result.bytes, 2 * kMost);
  }
}

TEST(Memory, CountsStarts) {
  constexpr size_t kMost = size_t{6} << 20;
  const SearchLimits search{.max_bytes = kMost};
  const CleaningLimits limits = AnyTimes(6);
  for (const CleaningResult& result :
       {ProveCleaning(limits, {}, search), CheckCleanAfter(limits, {}, {80, 30}, search),
        CheckLevels(limits, {}, {20, 51}, 240, search)}) {
    EXPECT_EQ(result.verdict, Verdict::kUnknown) << result.wrong;
    EXPECT_LT(result.bytes, 2 * kMost);
    EXPECT_LT(result.states, 1'000'000u) << "of 1.6 million starts";
  }
}

// Each zone's highest level, by a search whose states have the levels of all zones.
TEST(Levels, AreThoseOfASearchThroughAllCombinations) {
  const CleaningLimits limits{.columns = 3,
                              .rows = 2,
                              .clean_min = 6,
                              .clean_max = 7,
                              .rates_percent = {3, 9, 5, 10, 4, 8}};
  constexpr int kHorizon = 70;
  CleaningWorld world(limits);
  CleaningState first = world.Start({0, 3});
  first.tick = kSoilingStep;
  std::fill_n(first.level.begin(), world.zones(), uint8_t{20});
  std::vector<int> highest(world.zones(), 20);
  std::vector<CleaningSuccessor> successors;
  const Model<CleaningState> model{
      .key =
          [&](const CleaningState& state) {
            return KeyOf(state) + std::to_string(state.tick) + "/" + std::to_string(state.clock) +
                   std::string(state.level.begin(), state.level.end());
          },
      .next =
          [&](const CleaningState& state, const Model<CleaningState>::Visit& visit) {
            if (state.clock >= kHorizon) {
              return;
            }
            for (size_t zone = 0; zone < world.zones(); ++zone) {
              highest[zone] = std::max<int>(highest[zone], state.level[zone]);
            }
            world.Next(state, &successors);
            for (const CleaningSuccessor& successor : successors) {
              visit("", successor.state);
              for (size_t zone = 0; zone < world.zones(); ++zone) {
                highest[zone] = std::max<int>(highest[zone], successor.state.level[zone]);
              }
            }
          },
      .wrong = [](const CleaningState&) { return ""; },
      .max_states = 1'000'000};
  ASSERT_EQ(Explore(first, model).verdict, Verdict::kProved);
  const CleaningResult result = CheckLevels(limits, {{0, 3}}, {20, 101}, kHorizon);
  EXPECT_EQ(result.verdict, Verdict::kProved);
  EXPECT_EQ(result.levels, highest);
}

TEST(Symmetry, OfFloors) {
  EXPECT_EQ(FloorSymmetries(GridNeighbours(4, 3), {}, 0).size(), 4u);
  EXPECT_EQ(FloorSymmetries(GridNeighbours(3, 3), {}, 0).size(), 8u);
  EXPECT_EQ(FloorSymmetries(GridNeighbours(3, 3), {}, 1).size(), 2u) << "a closed corner";
  EXPECT_EQ(FloorSymmetries(GridNeighbours(3, 1), {5, 5, 6}, 0).size(), 1u);
  const CleaningNeighbours ring = {{4, 1}, {0, 2}, {1, 3}, {2, 4}, {3, 0}};
  EXPECT_EQ(FloorSymmetries(ring, {}, 0).size(), 10u);
  EXPECT_EQ(FloorSymmetries({{1}, {2}, {0}}, {}, 0).size(), 3u) << "who is seen need not see";
  EXPECT_EQ(FloorSymmetries(CleaningNeighbours(5), {}, 0).size(), 1u) << "120 are too many";
}

// All states from all starts until all zones are below 20 %, with all that is in them.
size_t CountedUntilClean(const CleaningLimits& limits) {
  constexpr int kBelow = 20;
  CleaningWorld world(limits);
  world.LimitSoil(kBelow);
  std::vector<CleaningSuccessor> successors;
  bool is_first = true;
  const auto soiled = [&](const std::vector<uint8_t>& start) {
    CleaningState state = world.Start(start);
    state.tick = kSoilingStep;
    std::fill_n(state.level.begin(), world.zones(), uint8_t{kBelow});
    return state;
  };
  const Model<CleaningState> model{
      .key =
          [&](const CleaningState& state) {
            return KeyOf(state) + std::to_string(state.tick) + "/" +
                   std::string(state.level.begin(), state.level.end());
          },
      .next =
          [&](const CleaningState& state, const Model<CleaningState>::Visit& visit) {
            if (std::exchange(is_first, false)) {
              for (const std::vector<uint8_t>& start : AllStarts(world)) {
                visit("start", soiled(start));
              }
            }
            if (std::all_of(state.level.begin(), state.level.begin() + world.zones(),
                            [](uint8_t level) { return level < kBelow; })) {
              return;
            }
            world.Next(state, &successors);
            for (const CleaningSuccessor& successor : successors) {
              visit("", successor.state);
            }
          },
      .wrong = [](const CleaningState&) { return ""; },
      .max_states = 1'000'000};
  return Explore(soiled(AllStarts(world).front()), model).states;
}

// Directions on the floor are taken for equal only where zones soil alike, although the neighbours
// of each are the same.
TEST(Symmetry, IsUsedWhereRatesHaveItToo) {
  CleaningLimits limits{.columns = 3, .rows = 2, .rates_percent = {4, 9, 6, 6, 9, 4}};
  const CleaningResult turned = CheckCleanAfter(limits, {}, {80, 20});
  EXPECT_EQ(turned.verdict, Verdict::kProved);
  EXPECT_EQ(turned.unfolded_states, CountedUntilClean(limits));
  EXPECT_LT(turned.states, turned.unfolded_states * 6 / 10) << "by half a turn the same";

  limits.rates_percent = {4, 9, 6, 5, 9, 4};
  const CleaningResult uneven = CheckCleanAfter(limits, {}, {80, 20});
  EXPECT_EQ(uneven.verdict, Verdict::kProved);
  EXPECT_EQ(uneven.states, CountedUntilClean(limits));
}

// Soil apart, the four directions of a grid are equal for all starts, and for given ones not.
TEST(Symmetry, OfAProofIsThatOfNeighboursAndStarts) {
  const CleaningLimits limits{.columns = 3, .rows = 2, .rates_percent = {4, 9, 6, 5, 9, 4}};
  const CleaningResult anywhere = ProveCleaning(limits);
  EXPECT_LT(anywhere.states, anywhere.unfolded_states * 3 / 10);
  const CleaningResult given = ProveCleaning(limits, {{0, 0}});
  EXPECT_EQ(given.states, given.unfolded_states);
  EXPECT_EQ(given.first[0], 0);
  EXPECT_GT(given.first[5], 0) << "the farthest";
}

TEST(World, LimitsThatCannotBeExploredAreNamed) {
  EXPECT_EQ(WhatIsWrong({}), "");
  EXPECT_EQ(WhatIsWrong({.columns = 9, .rows = 7}), "zones: found 63, expected 1 to 62");
  EXPECT_EQ(WhatIsWrong({.robots = 7}), "robots: found 7, expected 1 to 6");
  EXPECT_EQ(WhatIsWrong({.crashes = 2}), "crashes: found 2, expected 0 to 1");
  EXPECT_EQ(WhatIsWrong({.clean_min = 3, .clean_max = 2}),
            "shortest cleaning: found 3, expected 1 to 2");
  EXPECT_EQ(WhatIsWrong({.neighbours = {{1}, {0, 0}}}),
            "zone 2: found zone 1 beside it, expected different other zones of the floor");
  EXPECT_EQ(WhatIsWrong({.rates_percent = {5}}),
            "soiling rates: found 1, expected one for each of 12 zones");
}

}  // namespace
}  // namespace pheromone::verify
