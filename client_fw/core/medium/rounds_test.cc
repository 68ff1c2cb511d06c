// Rounds by itself: what a ROUND grants, and when a turn of ours has come (protocol/README.md,
// section 9, "Rounds").
#include "client_fw/core/medium/rounds.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <initializer_list>

#include "protocol/byte_order.h"
#include "protocol/messages.h"

namespace pheromone {
namespace client {
namespace {

constexpr uint8_t kUs = 7;
constexpr uint8_t kThreeBytesMs = 4;  // at 9600 baud
constexpr uint8_t kEachTurnMs = 20;

protocol::Message RoundOf(uint8_t number, std::initializer_list<uint8_t> turns,
                          uint8_t open_slots = 0, uint8_t answers = 0) {
  protocol::Round round;
  round.number = number;
  round.turn_ms = kEachTurnMs;
  round.turn_bytes = 33;
  round.slot_ms = 3;
  round.open_slots = open_slots;
  round.answer_count = answers;
  for (uint8_t i = 0; i < answers; ++i) {
    round.answers[i] = {static_cast<int16_t>(100 + i), static_cast<int16_t>(-i)};
  }
  for (const uint8_t id : turns) {
    round.turns[round.turn_count++] = id;
  }
  protocol::Message message;
  EXPECT_TRUE(Encode(round, &message));
  return message;
}

class TurnsTest : public ::testing::Test {
 protected:
  bool Grant(const protocol::Message& round) {
    EXPECT_TRUE(rounds_.OnRound(round.data, round.length));
    return rounds_.Grant(round.data);
  }

  // ms until it is not kNone any more, looking each ms; -1 if not within `patience_ms`.
  int Await(client::Rounds::Turn expected, bool receiving = false, int patience_ms = 500) {
    for (int ms = 0; ms <= patience_ms; ++ms) {
      const client::Rounds::Turn turn = rounds_.TurnDue(receiving);
      if (turn != client::Rounds::kNone) {
        EXPECT_EQ(turn, expected);
        return ms;
      }
      rounds_.Advance(1);
    }
    return -1;
  }

  client::Rounds rounds_{kUs, kThreeBytesMs};
};

TEST_F(TurnsTest, OursBeginsAfterThoseBeforeIt) {
  EXPECT_TRUE(Grant(RoundOf(5, {1, 2, kUs, 9})));
  EXPECT_EQ(rounds_.values().number, 5);
  EXPECT_EQ(rounds_.values().turn_bytes, 33);
  EXPECT_EQ(rounds_.values().slot_ms, 3);
  EXPECT_EQ(rounds_.reserved_ms(), protocol::kBeforeTurnsMs + 4 * kEachTurnMs);
  EXPECT_EQ(Await(client::Rounds::kDue), protocol::kBeforeTurnsMs + 2 * kEachTurnMs);
  EXPECT_EQ(rounds_.values().turn, 2);
  EXPECT_EQ(Await(client::Rounds::kDue), -1) << "it is told once";
}

TEST_F(TurnsTest, NoneIsOursInARoundOfOthers) {
  EXPECT_FALSE(Grant(RoundOf(5, {1, 2})));
  EXPECT_EQ(Await(client::Rounds::kDue), -1);
}

TEST_F(TurnsTest, OursBeginsAtOnceWhenTheOneBeforeHasSent) {
  Grant(RoundOf(1, {1, kUs}));
  rounds_.Advance(9);
  rounds_.OnFrameOf(9);  // not the one before us
  EXPECT_EQ(rounds_.TurnDue(false), client::Rounds::kNone);
  rounds_.OnFrameOf(1);
  EXPECT_EQ(rounds_.TurnDue(false), client::Rounds::kDue);
}

TEST_F(TurnsTest, OneThatHasTwoTurnsBeforeOursSendsTwice) {
  Grant(RoundOf(1, {1, 1, kUs}));
  rounds_.OnFrameOf(1);
  EXPECT_EQ(rounds_.TurnDue(false), client::Rounds::kNone);
  rounds_.OnFrameOf(1);
  EXPECT_EQ(rounds_.TurnDue(false), client::Rounds::kDue);
}

TEST_F(TurnsTest, TwoOfOursFollowEachOther) {
  Grant(RoundOf(1, {kUs, kUs, 1}));
  EXPECT_EQ(rounds_.values().turns, 2);
  EXPECT_EQ(Await(client::Rounds::kDue), protocol::kBeforeTurnsMs);
  EXPECT_EQ(rounds_.values().turn, 0);
  EXPECT_EQ(Await(client::Rounds::kDue), 0);
  EXPECT_EQ(rounds_.values().turn, 1);
}

TEST_F(TurnsTest, AFrameThatDoesNotEndMakesUsMissOurs) {
  Grant(RoundOf(1, {1, kUs}));
  const int late = Await(client::Rounds::kMissed, true);
  EXPECT_GT(late, protocol::kBeforeTurnsMs + kEachTurnMs);
  EXPECT_LT(late, protocol::kBeforeTurnsMs + 2 * kEachTurnMs) << "before the next one's";
}

TEST_F(TurnsTest, AnswersAreThoseOfTheTurnsOfTheRoundBefore) {
  const protocol::Message round = RoundOf(1, {kUs}, 0, 2);
  const uint8_t* const second = client::Rounds::AnswerIn(round.data, 1);
  ASSERT_NE(second, nullptr);
  EXPECT_EQ(static_cast<int16_t>(protocol::GetU16(second)), 101);
  EXPECT_EQ(static_cast<int16_t>(protocol::GetU16(second + 2)), -1);
  EXPECT_EQ(client::Rounds::AnswerIn(round.data, 2), nullptr);
  EXPECT_EQ(client::Rounds::AnswerIn(round.data, 255), nullptr);
}

TEST_F(TurnsTest, TheNumbersOfRoundsWrap) {
  Grant(RoundOf(255, {kUs}));
  EXPECT_TRUE(rounds_.Follows(RoundOf(0, {kUs}).data));
  EXPECT_FALSE(rounds_.Follows(RoundOf(1, {kUs}).data));
  EXPECT_FALSE(rounds_.Follows(RoundOf(255, {kUs}).data));
}

TEST_F(TurnsTest, DataOfAnotherLengthIsNoRound) {
  const protocol::Message round = RoundOf(1, {kUs, 1}, 0, 3);
  for (int length = 0; length < 256; ++length) {
    EXPECT_EQ(rounds_.OnRound(round.data, static_cast<uint8_t>(length)), length == round.length)
        << length;
  }
}

TEST_F(TurnsTest, AnOpeningEndsAfterItsSlotsUnlessSomethingIsSentInIt) {
  Grant(RoundOf(1, {1}, 4));
  rounds_.KeepOpen(rounds_.reserved_ms(), 3);
  EXPECT_EQ(rounds_.OpenSlots(), 4);
  const uint16_t turns_ms = protocol::kBeforeTurnsMs + kEachTurnMs;
  rounds_.Advance(turns_ms + 4 * 3);
  EXPECT_TRUE(rounds_.open());
  rounds_.KeepOpen(0, 3);  // somebody has sent: its slots begin again
  rounds_.Advance(4 * 3);
  EXPECT_TRUE(rounds_.open());
  rounds_.Advance(kThreeBytesMs);
  EXPECT_FALSE(rounds_.open());
  EXPECT_EQ(rounds_.OpenSlots(), 0);
  rounds_.KeepOpen(0, 3);
  EXPECT_FALSE(rounds_.open()) << "nothing opens it again";
}

TEST_F(TurnsTest, AnOpeningUntilTheNextRoundHasNoSlotsToChooseFrom) {
  Grant(RoundOf(1, {}, protocol::kOpenUntilNextRound));
  rounds_.KeepOpen(0, 3);
  EXPECT_EQ(rounds_.OpenSlots(), 0);
  rounds_.Advance(kRoundsMs - 1);
  EXPECT_TRUE(rounds_.open());
}

TEST_F(TurnsTest, WithoutARoundForTwoSecondsThereAreNone) {
  Grant(RoundOf(1, {kUs}));
  EXPECT_EQ(rounds_.left_ms(), 2000);
  rounds_.Advance(2000);
  EXPECT_EQ(rounds_.left_ms(), 0);
  EXPECT_EQ(rounds_.TurnDue(false), client::Rounds::kNone) << "a turn of long ago";
  EXPECT_EQ(rounds_.values().turns, 0);
}

}  // namespace
}  // namespace client
}  // namespace pheromone
