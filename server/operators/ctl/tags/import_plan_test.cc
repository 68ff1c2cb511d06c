#include "server/operators/ctl/tags/import_plan.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <set>
#include <vector>

#include "server/core/tags/tag.h"

namespace pheromone::ctl {
namespace {

using Content = PresentSlot::Content;

// Time keys after the plan has been carried out, without those of empty slots.
std::multiset<int64_t> After(const std::vector<PresentSlot>& slots,
                             const std::vector<ImportedFact>& facts, const ImportPlan& plan) {
  std::map<size_t, int64_t> keys;
  for (size_t i = 0; i < slots.size(); ++i) {
    if (slots[i].content != Content::kEmpty) {
      keys[i] = slots[i].time_key;
    }
  }
  std::set<size_t> used;
  for (const PlannedWrite& it : plan.writes) {
    EXPECT_TRUE(used.insert(it.slot).second) << "slot " << it.slot << " is written twice";
    EXPECT_NE(slots[it.slot].content, Content::kProtected);
    keys[it.slot] = facts[it.index].time_key;
  }
  std::multiset<int64_t> all;
  for (const auto& [slot, key] : keys) {
    all.insert(key);
  }
  return all;
}

TEST(ImportPlanTest, NineFactsOnEightEmptySlotsLeaveTheOldestOut) {
  const std::vector<PresentSlot> slots(8);
  std::vector<ImportedFact> facts;
  for (size_t i = 0; i < 9; ++i) {
    facts.push_back({i, static_cast<int64_t>(100 + i)});
  }
  const ImportPlan plan = PlanImport(slots, facts);
  EXPECT_EQ(plan.unfit, 1u);
  EXPECT_FALSE(plan.all_protected);
  EXPECT_EQ(After(slots, facts, plan),
            (std::multiset<int64_t>{101, 102, 103, 104, 105, 106, 107, 108}));
}

TEST(ImportPlanTest, AnOlderFactDropsNoNewerOne) {
  const std::vector<PresentSlot> slots = {{Content::kDroppable, 5}, {Content::kDroppable, 7}};
  EXPECT_TRUE(PlanImport(slots, {{0, 4}}).writes.empty());
  EXPECT_EQ(PlanImport(slots, {{0, 4}}).unfit, 1u);
  EXPECT_EQ(PlanImport(slots, {{0, 5}}).unfit, 1u) << "what is there stays before an equal";
  const ImportPlan plan = PlanImport(slots, {{0, 6}});
  ASSERT_EQ(plan.writes.size(), 1u);
  EXPECT_EQ(plan.writes[0].slot, 0u);
}

TEST(ImportPlanTest, ProtectedSlotsAreLeftAlone) {
  const std::vector<PresentSlot> slots = {{Content::kProtected, 1}, {Content::kProtected, 2}};
  const ImportPlan plan = PlanImport(slots, {{0, 9}});
  EXPECT_TRUE(plan.writes.empty());
  EXPECT_EQ(plan.unfit, 1u);
  EXPECT_TRUE(plan.all_protected);
}

// Of all that is there and all that comes the latest remain, however many there are.
TEST(ImportPlanTest, TheLatestOfBothRemainAndNothingIsLeftToDo) {
  std::mt19937 random(10);
  for (int round = 0; round < 5'000; ++round) {
    std::vector<PresentSlot> slots(1 + random() % 8);
    std::multiset<int64_t> expected;
    std::multiset<int64_t> movable;
    for (PresentSlot& slot : slots) {
      slot = {static_cast<Content>(random() % 3), static_cast<int64_t>(random() % 12) - 1};
      if (slot.content == Content::kProtected) {
        expected.insert(slot.time_key);
      } else if (slot.content == Content::kDroppable) {
        movable.insert(slot.time_key);
      }
    }
    const size_t room = slots.size() - expected.size();
    std::vector<ImportedFact> facts(random() % 12);
    for (size_t i = 0; i < facts.size(); ++i) {
      facts[i] = {i, static_cast<int64_t>(random() % 12) - 1};
      movable.insert(facts[i].time_key);
    }
    for (auto it = movable.rbegin(); it != movable.rend() && expected.size() < slots.size(); ++it) {
      expected.insert(*it);
    }
    const ImportPlan plan = PlanImport(slots, facts);
    ASSERT_EQ(After(slots, facts, plan), expected);
    ASSERT_EQ(plan.writes.size() + plan.unfit, facts.size());
    ASSERT_EQ(plan.all_protected, room == 0);

    std::vector<PresentSlot> again = slots;
    std::vector<ImportedFact> rest = facts;
    for (const PlannedWrite& it : plan.writes) {
      again[it.slot] = {Content::kDroppable, facts[it.index].time_key};
      rest.erase(std::find_if(rest.begin(), rest.end(),
                              [&](const ImportedFact& fact) { return fact.index == it.index; }));
    }
    ASSERT_TRUE(PlanImport(again, rest).writes.empty()) << "a second import changes something";
  }
}

// No write names a slot: the tag's own drop policy puts each where the plan says.
TEST(ImportPlanTest, ATagPutsEachFactWhereItWasPlanned) {
  constexpr uint64_t kNowMs = 1000;
  constexpr int32_t kPrivileged[] = {1};
  const tags::Policy policy{.utc_s = 100, .privileged = kPrivileged};
  const auto block_of = [](int32_t author, uint32_t time_s, int32_t value) {
    return tags::Block{.author = author,
                       .time_s = time_s,
                       .subject = {-18, 1},
                       .predicate = {0, 1},
                       .object = {-3, value}};
  };
  std::mt19937 random(11);
  const auto below = [&](uint32_t bound) { return static_cast<uint32_t>(random() % bound); };
  for (int round = 0; round < 2'000; ++round) {
    tags::Tag tag(1 + below(8));
    for (uint32_t left = below(9); left > 0; --left) {
      tag.Write({.block = block_of(1 + static_cast<int32_t>(below(3)), 1 + below(12), -1),
                 .lease_ms = below(4) == 0 ? 60'000u : 0u},
                kNowMs, policy);
    }
    std::vector<PresentSlot> slots(tag.slots().size());
    for (size_t i = 0; i < slots.size(); ++i) {
      const tags::Slot& slot = tag.slots()[i];
      if (!slot.block.is_empty()) {
        const bool is_protected = slot.is_leased() || policy.IsPrivileged(slot.block.author);
        slots[i] = {is_protected ? Content::kProtected : Content::kDroppable,
                    tags::AgeKey(slot.block, policy.utc_s)};
      }
    }
    std::vector<ImportedFact> facts(below(12));
    for (size_t i = 0; i < facts.size(); ++i) {
      facts[i] = {i, 1 + static_cast<int64_t>(below(12))};
    }
    for (const PlannedWrite& it : PlanImport(slots, facts).writes) {
      const tags::Written written =
          tag.Write({.block = block_of(2, static_cast<uint32_t>(facts[it.index].time_key),
                                       static_cast<int32_t>(it.index))},
                    kNowMs, policy);
      ASSERT_EQ(written.outcome, tags::WriteOutcome::kDone);
      ASSERT_EQ(written.slot, it.slot);
    }
  }
}

}  // namespace
}  // namespace pheromone::ctl
