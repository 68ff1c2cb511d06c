#include "client_fw/core/tasks/cleaning.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <random>
#include <set>
#include <vector>

namespace pheromone {
namespace client {
namespace {

CleaningView ViewOf(const std::vector<ZoneTag>& tags) {
  CleaningView view{};
  for (const ZoneTag& tag : tags) {
    view.tags[view.count++] = tag;
  }
  return view;
}

// The rule again, one zone at a time: a zone is oldest if no free one is older.
std::set<uint8_t> FreeAndOldest(const std::vector<ZoneTag>& tags) {
  std::set<uint8_t> zones;
  for (uint8_t i = 0; i < static_cast<uint8_t>(tags.size()); ++i) {
    bool is_oldest = !tags[i].is_occupied;
    for (const ZoneTag& other : tags) {
      is_oldest = is_oldest && (other.is_occupied || tags[i].cleaned_s <= other.cleaned_s);
    }
    if (is_oldest) {
      zones.insert(i);
    }
  }
  return zones;
}

// All that a robot may decide, whatever its random numbers.
void ExpectTheRule(const std::vector<ZoneTag>& tags) {
  const CleaningView view = ViewOf(tags);
  const std::set<uint8_t> oldest = FreeAndOldest(tags);
  std::set<uint8_t> decided;
  for (int pick = 0; pick < 256; ++pick) {
    const CleaningDecision decision = Decide(view, static_cast<uint8_t>(pick));
    if (oldest.empty()) {
      ASSERT_EQ(decision.act, CleaningAct::kWait);
      ASSERT_EQ(decision.choices, 0);
    } else if (oldest.count(0) == 1) {
      ASSERT_EQ(decision.act, CleaningAct::kClean);
      ASSERT_EQ(decision.tag, 0);
      ASSERT_EQ(decision.choices, 1);
    } else {
      ASSERT_EQ(decision.act, CleaningAct::kMove);
      ASSERT_EQ(decision.choices, oldest.size());
      ASSERT_EQ(Decide(view, static_cast<uint8_t>(pick % decision.choices)).tag, decision.tag);
      decided.insert(decision.tag);
    }
  }
  if (!oldest.empty() && oldest.count(0) == 0) {
    ASSERT_EQ(decided, oldest);
  }
}

TEST(Cleaning, CleansItsOwnZoneIfNoneIsOlder) {
  const CleaningDecision decision = Decide(ViewOf({{false, 5}, {false, 6}, {true, 1}}), 1);
  EXPECT_EQ(decision.act, CleaningAct::kClean);
}

TEST(Cleaning, MovesToAnOlderZone) {
  const CleaningDecision decision = Decide(ViewOf({{false, 5}, {false, 6}, {false, 4}}), 7);
  EXPECT_EQ(decision.act, CleaningAct::kMove);
  EXPECT_EQ(decision.tag, 2);
  EXPECT_EQ(decision.choices, 1);
}

TEST(Cleaning, StaysWhereItIsBetweenEquals) {
  const CleaningDecision decision = Decide(ViewOf({{false, 5}, {false, 5}, {false, 5}}), 1);
  EXPECT_EQ(decision.act, CleaningAct::kClean);
}

TEST(Cleaning, WaitsWhereAllIsOccupied) {
  EXPECT_EQ(Decide(ViewOf({{true, 1}, {true, 2}}), 0).act, CleaningAct::kWait);
  EXPECT_EQ(Decide(ViewOf({}), 0).act, CleaningAct::kWait);
}

TEST(Cleaning, TimeStampsBeyond2038AreNotOld) {
  const CleaningDecision decision = Decide(ViewOf({{false, 0x80000000}, {false, 0x7FFFFFFF}}), 0);
  EXPECT_EQ(decision.act, CleaningAct::kMove);
}

TEST(Cleaning, FollowsTheRuleInAllSmallViews) {
  // Up to four zones, each occupied or of one of four time stamps.
  for (size_t zones = 0; zones <= 4; ++zones) {
    size_t views = 1;
    for (size_t i = 0; i < zones; ++i) {
      views *= 8;
    }
    for (size_t view = 0; view < views; ++view) {
      std::vector<ZoneTag> tags;
      for (size_t i = 0, rest = view; i < zones; ++i, rest /= 8) {
        tags.push_back({rest % 8 >= 4, static_cast<uint32_t>(rest % 4)});
      }
      ExpectTheRule(tags);
    }
  }
}

TEST(Cleaning, FollowsTheRuleInFullViews) {
  std::mt19937 random(2006);
  const uint32_t stamps[] = {0, 1, 1'138'451'200, std::numeric_limits<uint32_t>::max()};
  for (int i = 0; i < 2'000; ++i) {
    std::vector<ZoneTag> tags(kMaxVisibleTags);
    for (ZoneTag& tag : tags) {
      tag = {random() % 3 == 0, stamps[random() % 4]};
    }
    ExpectTheRule(tags);
  }
}

}  // namespace
}  // namespace client
}  // namespace pheromone
