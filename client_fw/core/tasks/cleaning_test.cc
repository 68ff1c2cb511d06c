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

ZoneTag Tag(bool is_occupied, uint32_t cleaned_s, bool is_closed = false, uint32_t wanted_s = 0) {
  return {is_occupied, is_closed, cleaned_s, wanted_s};
}

CleaningView ViewOf(const std::vector<ZoneTag>& tags) {
  CleaningView view{};
  for (const ZoneTag& tag : tags) {
    view.tags[view.count++] = tag;
  }
  return view;
}

bool MayBeCleaned(const ZoneTag& tag) {
  return !tag.is_occupied && !tag.is_closed;
}

// Whether the first goes before the second or at the same time: one that waits to be cleaned again,
// or was never cleaned, before any other.
bool IsNoYounger(const ZoneTag& a, const ZoneTag& b) {
  const bool a_waits = a.cleaned_s == 0 || a.wanted_s >= a.cleaned_s;
  const bool b_waits = b.cleaned_s == 0 || b.wanted_s >= b.cleaned_s;
  return a_waits || (!b_waits && a.cleaned_s <= b.cleaned_s);
}

// The rule again, one zone at a time: a zone is oldest if no free one is older.
std::set<uint8_t> FreeAndOldest(const std::vector<ZoneTag>& tags) {
  std::set<uint8_t> zones;
  for (uint8_t i = 0; i < static_cast<uint8_t>(tags.size()); ++i) {
    bool is_oldest = MayBeCleaned(tags[i]);
    for (const ZoneTag& other : tags) {
      is_oldest = is_oldest && (!MayBeCleaned(other) || IsNoYounger(tags[i], other));
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
  const CleaningDecision decision = Decide(ViewOf({Tag(false, 5), Tag(false, 6), Tag(true, 1)}), 1);
  EXPECT_EQ(decision.act, CleaningAct::kClean);
}

TEST(Cleaning, MovesToAnOlderZone) {
  const CleaningDecision decision =
      Decide(ViewOf({Tag(false, 5), Tag(false, 6), Tag(false, 4)}), 7);
  EXPECT_EQ(decision.act, CleaningAct::kMove);
  EXPECT_EQ(decision.tag, 2);
  EXPECT_EQ(decision.choices, 1);
}

TEST(Cleaning, StaysWhereItIsBetweenEquals) {
  const CleaningDecision decision =
      Decide(ViewOf({Tag(false, 5), Tag(false, 5), Tag(false, 5)}), 1);
  EXPECT_EQ(decision.act, CleaningAct::kClean);
}

TEST(Cleaning, WaitsWhereAllIsOccupied) {
  EXPECT_EQ(Decide(ViewOf({Tag(true, 1), Tag(true, 2)}), 0).act, CleaningAct::kWait);
  EXPECT_EQ(Decide(ViewOf({}), 0).act, CleaningAct::kWait);
}

TEST(Cleaning, KeepsAwayFromClosedZones) {
  const CleaningDecision decision = Decide(ViewOf({Tag(false, 1, true), Tag(false, 9)}), 0);
  EXPECT_EQ(decision.act, CleaningAct::kMove);
  EXPECT_EQ(decision.tag, 1);
  EXPECT_EQ(Decide(ViewOf({Tag(false, 9), Tag(false, 1, true)}), 0).act, CleaningAct::kClean);
  EXPECT_EQ(Decide(ViewOf({Tag(false, 1, true), Tag(true, 1)}), 0).act, CleaningAct::kWait);
}

TEST(Cleaning, CleansAgainWhereThatIsWantedSinceTheLastCleaning) {
  const CleaningDecision wanted = Decide(ViewOf({Tag(false, 5), Tag(false, 8, false, 9)}), 0);
  EXPECT_EQ(wanted.act, CleaningAct::kMove);
  EXPECT_EQ(Decide(ViewOf({Tag(false, 5), Tag(false, 9, false, 9)}), 0).act, CleaningAct::kMove)
      << "in the same second, which came first is not known";
  EXPECT_EQ(Decide(ViewOf({Tag(false, 5), Tag(false, 10, false, 9)}), 0).act, CleaningAct::kClean)
      << "it was cleaned since";
  EXPECT_EQ(Decide(ViewOf({Tag(false, 0), Tag(false, 8, false, 9)}), 0).act, CleaningAct::kClean)
      << "as one that was never cleaned";
  EXPECT_EQ(Decide(ViewOf({Tag(false, 5), Tag(false, 8, true, 9)}), 0).act, CleaningAct::kClean)
      << "a closed zone stays closed";
}

TEST(Cleaning, TimeStampsBeyond2038AreNotOld) {
  const CleaningDecision decision =
      Decide(ViewOf({Tag(false, 0x80000000), Tag(false, 0x7FFFFFFF)}), 0);
  EXPECT_EQ(decision.act, CleaningAct::kMove);
}

TEST(Cleaning, FollowsTheRuleInAllSmallViews) {
  // Up to three zones, each occupied or not, closed or not, of one of three time stamps, and one of
  // three signs.
  constexpr size_t kKinds = 2 * 2 * 3 * 3;
  for (size_t zones = 0, views = 1; zones <= 3; ++zones, views *= kKinds) {
    for (size_t view = 0; view < views; ++view) {
      std::vector<ZoneTag> tags;
      for (size_t i = 0, rest = view; i < zones; ++i, rest /= kKinds) {
        const size_t kind = rest % kKinds;
        tags.push_back(Tag(kind % 2 == 1, static_cast<uint32_t>(kind / 4 % 3), kind / 2 % 2 == 1,
                           static_cast<uint32_t>(kind / 12)));
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
      tag = Tag(random() % 3 == 0, stamps[random() % 4], random() % 5 == 0, stamps[random() % 4]);
    }
    ExpectTheRule(tags);
  }
}

}  // namespace
}  // namespace client
}  // namespace pheromone
