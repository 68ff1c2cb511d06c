#include "server/core/tags/tag.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "server/core/tags/testing/naive_tag.h"

namespace pheromone::tags {
namespace {

constexpr int64_t kNowS = 1'138'458'000;  // 2006-01-28T14:20:00Z
constexpr int32_t kOperator = 1;
constexpr int32_t kPrivileged[] = {kOperator};
constexpr Policy kPolicy = {.utc_s = kNowS, .privileged = kPrivileged};

Block Fact(int32_t author, int64_t time_s, int32_t predicate = 2) {
  return {.author = author,
          .time_s = static_cast<uint32_t>(time_s),
          .subject = {-17, author},
          .predicate = {1, predicate},
          .object = {-3, 244}};
}

// A tag on which robots 10, 11, ... have written at successive seconds.
Tag FullTag(size_t slots = kDefaultSlots) {
  Tag tag(slots);
  for (size_t i = 0; i < slots; ++i) {
    const auto author = static_cast<int32_t>(10 + i);
    tag.Write({.block = Fact(author, kNowS - 100 + static_cast<int64_t>(i))}, 0, kPolicy);
  }
  return tag;
}

std::vector<int32_t> Authors(const Tag& tag) {
  std::vector<int32_t> authors;
  for (const Slot& slot : tag.slots()) {
    authors.push_back(slot.block.author);
  }
  return authors;
}

TEST(TagTest, TheOldestBlockIsDroppedFirst) {
  Tag tag = FullTag(3);
  const Written written = tag.Write({.block = Fact(20, kNowS)}, 0, kPolicy);
  EXPECT_EQ(written.outcome, WriteOutcome::kDone);
  EXPECT_EQ(written.slot, 0);
  EXPECT_TRUE(written.dropped);
  EXPECT_EQ(Authors(tag), (std::vector<int32_t>{20, 11, 12}));
}

TEST(TagTest, OfEquallyOldBlocksTheFirstIsDropped) {
  Tag tag(3);
  for (const int32_t author : {10, 11, 12}) {
    tag.Write({.block = Fact(author, author == 10 ? kNowS : kNowS - 5)}, 0, kPolicy);
  }
  EXPECT_EQ(tag.Write({.block = Fact(20, kNowS)}, 0, kPolicy).slot, 1);
}

TEST(TagTest, PrivilegedBlocksAreNeverDropped) {
  Tag tag(2);
  tag.Write({.block = Fact(kOperator, 1)}, 0, kPolicy);
  for (int32_t author = 10; author < 100; ++author) {
    EXPECT_EQ(tag.Write({.block = Fact(author, kNowS)}, 0, kPolicy).slot, 1);
  }
  EXPECT_EQ(tag.slots()[0].block.author, kOperator);
}

TEST(TagTest, ProtectedBlocksLeaveTwoOfEightSlots) {
  Tag tag;
  for (int32_t i = 0; i < 6; ++i) {
    EXPECT_EQ(tag.Write({.block = Fact(kOperator, kNowS, i + 1)}, 0, kPolicy).outcome,
              WriteOutcome::kDone);
  }
  EXPECT_EQ(tag.Write({.block = Fact(kOperator, kNowS, 7)}, 0, kPolicy).outcome,
            WriteOutcome::kFull);
  EXPECT_EQ(tag.Write({.block = Fact(10, kNowS), .lease_ms = 1000}, 0, kPolicy).outcome,
            WriteOutcome::kFull);
  EXPECT_EQ(tag.Write({.block = Fact(10, kNowS)}, 0, kPolicy).outcome, WriteOutcome::kDone);
  // In place of one of them there is room.
  EXPECT_EQ(tag.Write({.block = Fact(kOperator, kNowS, 3), .is_state = true}, 0, kPolicy).outcome,
            WriteOutcome::kDone);
}

TEST(TagTest, NotesLeaveASlotForARecordOfANet) {
  const auto record = [](int32_t author) {
    Block block = Fact(author, kNowS);
    block.subject = {kNetRecordType, 0};
    return block;
  };
  Tag tag;
  tag.Write({.block = record(kOperator), .slot = 0}, 0, kPolicy);
  tag.Write({.block = record(kOperator), .slot = 1}, 0, kPolicy);
  for (int32_t author = 10; author < 14; ++author) {
    EXPECT_EQ(tag.Write({.block = Fact(author, kNowS), .lease_ms = 9'000}, 0, kPolicy).outcome,
              WriteOutcome::kDone);
  }
  EXPECT_EQ(tag.Write({.block = Fact(14, kNowS), .lease_ms = 9'000}, 0, kPolicy).outcome,
            WriteOutcome::kFull);
  EXPECT_EQ(tag.Write({.block = record(15), .lease_ms = 9'000}, 0, kPolicy).outcome,
            WriteOutcome::kDone);
  EXPECT_EQ(tag.Write({.block = record(16), .lease_ms = 9'000}, 0, kPolicy).outcome,
            WriteOutcome::kFull);
  EXPECT_EQ(
      tag.Write({.block = Fact(10, kNowS + 1), .lease_ms = 9'000, .is_state = true}, 0, kPolicy)
          .outcome,
      WriteOutcome::kDone)
      << "a lease can be extended meanwhile";
}

TEST(TagTest, AWildClockCannotPinASlot) {
  Tag tag = FullTag(3);
  tag.Write({.block = Fact(20, kNowS + 86'401)}, 0, kPolicy);  // in slot 0
  EXPECT_EQ(tag.Write({.block = Fact(21, kNowS)}, 0, kPolicy).slot, 0);
  // A day ahead is another time zone, or a clock not far off.
  tag.Write({.block = Fact(22, kNowS + 86'400)}, 0, kPolicy);  // in slot 1
  EXPECT_EQ(tag.Write({.block = Fact(23, kNowS)}, 0, kPolicy).slot, 2);
}

TEST(TagTest, AStateReplacesTheAuthorsOwn) {
  Tag tag;
  tag.Write({.block = Fact(10, kNowS - 9)}, 0, kPolicy);
  tag.Write({.block = Fact(11, kNowS - 8), .is_state = true}, 0, kPolicy);
  const Written written = tag.Write({.block = Fact(10, kNowS), .is_state = true}, 0, kPolicy);
  EXPECT_EQ(written.slot, 0);
  EXPECT_FALSE(written.dropped);
  EXPECT_EQ(tag.used(), 2u);
  EXPECT_EQ(tag.slots()[0].block.time_s, kNowS);
}

TEST(TagTest, OfTwoRobotsThatReadTheSameOnlyOneWrites) {
  Tag tag;
  const uint16_t seen = tag.generation();
  const auto claim = [&](int32_t author) {
    return tag.Write({.block = Fact(author, kNowS), .expected = seen, .lease_ms = 60'000}, 0,
                     kPolicy);
  };
  EXPECT_EQ(claim(10).outcome, WriteOutcome::kDone);
  EXPECT_EQ(claim(11).outcome, WriteOutcome::kGenerationChanged);
  EXPECT_EQ(tag.used(), 1u);
}

TEST(TagTest, TheExpectedGenerationOfANamedSlotIsThatSlots) {
  Tag tag = FullTag(2);
  const uint16_t seen = tag.slots()[1].generation;
  tag.Write({.block = Fact(20, kNowS), .slot = 0}, 0, kPolicy);
  EXPECT_EQ(tag.Write({.block = Fact(21, kNowS), .slot = 1, .expected = seen}, 0, kPolicy).outcome,
            WriteOutcome::kDone);
  EXPECT_EQ(tag.Write({.block = Fact(22, kNowS), .slot = 1, .expected = seen}, 0, kPolicy).outcome,
            WriteOutcome::kGenerationChanged);
}

TEST(TagTest, ALeasedBlockStaysUntilItsLeaseEnds) {
  Tag tag;
  tag.Write({.block = Fact(10, 1), .lease_ms = 60'000}, 1000, kPolicy);
  for (int32_t author = 11; author < 40; ++author) {
    tag.Write({.block = Fact(author, kNowS)}, 1000, kPolicy);
  }
  EXPECT_EQ(tag.slots()[0].block.author, 10);
  EXPECT_EQ(tag.NextExpiry(), 61'000u);
  tag.Expire(60'999);
  EXPECT_EQ(tag.slots()[0].block.author, 10);
  tag.Expire(61'000);
  EXPECT_TRUE(tag.slots()[0].block.is_empty());
  EXPECT_EQ(tag.NextExpiry(), std::nullopt);
}

TEST(TagTest, ProtectedBlocksAreChangedByTheirAuthorAndPrivilegedOnes) {
  Tag tag;
  tag.Write({.block = Fact(10, kNowS), .lease_ms = 60'000}, 0, kPolicy);
  tag.Write({.block = Fact(kOperator, kNowS)}, 0, kPolicy);
  for (const uint8_t slot : {uint8_t{0}, uint8_t{1}}) {
    EXPECT_EQ(tag.Write({.block = Fact(11, kNowS), .slot = slot}, 0, kPolicy).outcome,
              WriteOutcome::kProtected);
    EXPECT_EQ(tag.Erase(slot, 11, {}, kPolicy), WriteOutcome::kProtected);
  }
  EXPECT_EQ(tag.Erase(1, 10, {}, kPolicy), WriteOutcome::kProtected);
  EXPECT_EQ(tag.Erase(0, 10, {}, kPolicy), WriteOutcome::kDone);
  EXPECT_EQ(tag.Erase(1, kOperator, {}, kPolicy), WriteOutcome::kDone);
  EXPECT_EQ(tag.used(), 0u);
}

TEST(TagTest, ErasingAnEmptySlotChangesNothing) {
  Tag tag;
  EXPECT_EQ(tag.Erase(3, 10, {}, kPolicy), WriteOutcome::kDone);
  EXPECT_EQ(tag, Tag());
}

TEST(TagTest, SlotsBeyondTheTagsAreRefused) {
  Tag tag;
  EXPECT_EQ(tag.Write({.block = Fact(10, kNowS), .slot = 8}, 0, kPolicy).outcome,
            WriteOutcome::kNoSuchSlot);
  EXPECT_EQ(tag.Erase(8, 10, {}, kPolicy), WriteOutcome::kNoSuchSlot);
}

// Any operations leave the tag as a naive restatement of the rules has it, and no privileged or
// leased block is lost to another author.
TEST(TagTest, RandomOperationsFollowTheRules) {
  std::mt19937_64 random(14);
  const auto below = [&](uint64_t bound) { return random() % bound; };
  for (int sequence = 0; sequence < 10'000; ++sequence) {
    const size_t size = 1 + below(sequence % 10 == 0 ? kMaxSlots : 9);
    Tag tag(size);
    testing::NaiveTag naive{.slots = std::vector<testing::NaiveSlot>(size),
                            .privileged = {kOperator, 3}};
    constexpr int32_t kBoth[] = {kOperator, 3};
    uint64_t now_ms = 0;
    for (int step = 0; step < 40; ++step) {
      now_ms += below(3) * 400;
      const int64_t utc_s = kNowS + static_cast<int64_t>(now_ms / 1000);
      const Policy policy = {.utc_s = utc_s, .privileged = kBoth};
      const auto author = static_cast<int32_t>(1 + below(6));
      const auto slot = static_cast<uint8_t>(below(size + 1));
      std::optional<uint16_t> expected;
      if (below(3) == 0) {
        const uint16_t right =
            slot < size && below(2) == 0 ? tag.slots()[slot].generation : tag.generation();
        expected = static_cast<uint16_t>(right + (below(4) == 0 ? 1 : 0));
      }
      tag.Expire(now_ms);
      naive.Expire(now_ms);
      if (below(5) == 0) {
        ASSERT_EQ(tag.Erase(slot, author, expected, policy), naive.Erase(slot, author, expected));
      } else {
        WriteRequest request{.block = Fact(author, utc_s - 50 + static_cast<int64_t>(below(100)),
                                           static_cast<int32_t>(1 + below(3))),
                             .expected = expected,
                             .lease_ms = below(3) == 0 ? static_cast<uint32_t>(below(4000)) : 0,
                             .is_state = below(2) == 0};
        if (below(10) == 0) {
          request.block.time_s += 86'400 + static_cast<uint32_t>(below(100));
        }
        if (below(3) == 0) {
          request.block.subject = {kNetRecordType, 7};
        }
        if (below(2) == 0) {
          request.slot = slot;
        }
        size_t at = 0;
        const WriteOutcome outcome = naive.Write(request, now_ms, utc_s, &at);
        const Written written = tag.Write(request, now_ms, policy);
        ASSERT_EQ(written.outcome, outcome);
        if (outcome == WriteOutcome::kDone) {
          ASSERT_EQ(written.slot, at);
        }
      }
      ASSERT_EQ(tag.generation(), static_cast<uint16_t>(naive.changes));
      for (size_t i = 0; i < size; ++i) {
        const Slot& slot_there = tag.slots()[i];
        ASSERT_EQ(slot_there.block, naive.slots[i].block.value_or(Block{}));
        ASSERT_EQ(slot_there.lease_end_ms, naive.slots[i].lease_end_ms);
        ASSERT_EQ(slot_there.generation, static_cast<uint16_t>(naive.slots[i].changes));
      }
    }
  }
}

}  // namespace
}  // namespace pheromone::tags
