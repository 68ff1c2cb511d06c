// The rules of a half-duplex channel: what the server may send, and when.
#include "server/robots/radio/channel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "server/robots/radio/testing/air.h"

namespace pheromone::radio {
namespace {

using testing::FrameOf;
using testing::Halt;
using testing::kStart;
using testing::MessageOf;
using testing::Sense;
using namespace std::chrono_literals;

// "F1 to 3", in order.
std::vector<std::string> Names(const Transmission& out) {
  std::vector<std::string> names;
  protocol::FrameDecoder decoder(protocol::kNoGapTimeout);
  decoder.PushBlock(out.bytes.data(), out.bytes.size(), 0, [&names](const auto& message) {
    constexpr char kDigits[] = "0123456789ABCDEF";
    names.push_back(std::string{kDigits[message.opcode / 16], kDigits[message.opcode % 16]} +
                    " to " + std::to_string(message.id));
  });
  EXPECT_EQ(names.size(), out.frame_ends.size());
  return names;
}

using Frames = std::vector<std::string>;

class ChannelTest : public ::testing::Test {
 protected:
  explicit ChannelTest(const ChannelOptions& options = testing::Options(9'600, 2ms))
      : options_(options),
        channel_(options_, [this](const auto& message) { dropped_.push_back(message); }) {}

  void Hear(const std::vector<uint8_t>& bytes, Time at) {
    std::vector<protocol::Message> messages;
    channel_.Hear(bytes, at, at, &messages);
  }

  /// Robot `id` asks at `at`, and the answer is there at `answered_at`.
  void Ask(uint8_t id, Time at, Time answered_at) {
    Hear(FrameOf(Sense(id)), at);
    channel_.Answer(MessageOf(protocol::SenseAnswer{id, 1, false, 1, 2}), at, answered_at);
  }
  void Ask(uint8_t id, Time at) { Ask(id, at, at); }

  void Refuse(uint8_t id, Time at) {
    Hear(FrameOf(Sense(id)), at);
    channel_.Answer(MessageOf(protocol::ErrorAnswer{id, 1, protocol::Reason::kOffTheMap, 0}), at,
                    at);
  }

  Duration Earliest() const { return options_.timing.EarliestAnswer(); }
  Duration Latest() const { return options_.timing.LatestAnswer(options_.response_window); }
  Duration Idle() const { return options_.timing.Idle(); }
  Duration Lasts(size_t bytes) const { return static_cast<int64_t>(bytes) * options_.timing.byte; }

  const ChannelOptions options_;
  std::vector<protocol::Message> dropped_;
  Channel channel_;
};

TEST_F(ChannelTest, NothingIsDueIfNothingWaits) {
  EXPECT_EQ(channel_.NextStart(kStart), kNever);
  EXPECT_TRUE(channel_.Begin(kStart).bytes.empty());
  Hear(FrameOf(Sense(1)), kStart);
  EXPECT_EQ(channel_.NextStart(kStart), kNever);
}

// --- Answers.

TEST_F(ChannelTest, AnAnswerBeginsWhenTheRobotsModemHasTurnedRound) {
  Ask(1, kStart);
  const Time due = kStart + Earliest();
  EXPECT_EQ(channel_.NextStart(kStart), due);
  EXPECT_TRUE(channel_.Begin(due - 1ns).bytes.empty()) << "too early";
  EXPECT_EQ(Names(channel_.Begin(due)), Frames{"81 to 1"});
  EXPECT_EQ(channel_.NextStart(due), kNever);
}

TEST_F(ChannelTest, AnAnswerThatCanStillReachTheRobotIsSent) {
  Ask(1, kStart, kStart + Latest());
  EXPECT_LE(channel_.NextStart(kStart + Latest()), kStart + Latest());
  EXPECT_EQ(Names(channel_.Begin(kStart + Latest())), Frames{"81 to 1"});
  EXPECT_TRUE(dropped_.empty());
}

TEST_F(ChannelTest, AnAnswerThatCannotReachTheRobotIsDropped) {
  Ask(1, kStart, kStart + Latest() + 1ns);
  EXPECT_EQ(channel_.NextStart(kStart + Latest() + 1ns), kNever);
  ASSERT_EQ(dropped_.size(), 1u);
  EXPECT_EQ(dropped_[0].id, 1);
  EXPECT_EQ(channel_.counters().late_answers, 1u);
}

TEST_F(ChannelTest, AnAnswerThatACarrierHeldBackForTooLongIsDropped) {
  Ask(1, kStart);
  EXPECT_TRUE(channel_.Begin(kStart + Latest() + 1ns).bytes.empty());
  EXPECT_EQ(dropped_.size(), 1u);
  EXPECT_EQ(channel_.NextStart(kStart + Latest() + 1ns), kNever);
}

TEST_F(ChannelTest, AnAnswerWaitsForTheOneBefore) {
  Ask(1, kStart);
  Ask(2, kStart);
  const Time due = kStart + Earliest();
  const Transmission first = channel_.Begin(due);
  EXPECT_EQ(Names(first), Frames{"81 to 1"});
  const Time end = due + Lasts(first.bytes.size());
  EXPECT_EQ(channel_.sent_at(), end);
  EXPECT_TRUE(channel_.Begin(end - 1ns).bytes.empty());
}

TEST_F(ChannelTest, WhatTheModemSaysAboutTheEndCounts) {
  Ask(1, kStart);
  channel_.Send(Halt(2));
  const Time due = kStart + Earliest();
  channel_.Begin(due);
  const Time end = due + 50ms;
  channel_.OnSent(end);
  EXPECT_EQ(channel_.sent_at(), end);
  EXPECT_EQ(channel_.NextStart(due), end + Idle());
}

// --- ERRORs.

TEST_F(ChannelTest, OneErrorLeavesInAWindow) {
  Refuse(1, kStart);
  Refuse(2, kStart + options_.response_window - 1ns);
  ASSERT_EQ(dropped_.size(), 1u);
  EXPECT_EQ(dropped_[0].id, 2);
  EXPECT_EQ(channel_.counters().withheld_errors, 1u);
  Refuse(3, kStart + options_.response_window);
  EXPECT_EQ(dropped_.size(), 1u);
}

TEST_F(ChannelTest, AnErrorDoesNotHoldBackOtherAnswers) {
  Refuse(1, kStart);
  channel_.Begin(kStart + Earliest());
  const Time later = channel_.sent_at() + 1ms;
  Ask(2, later);
  EXPECT_EQ(Names(channel_.Begin(later + Earliest())), Frames{"81 to 2"});
}

// --- COMMANDs.

TEST_F(ChannelTest, ACommandWaitsUntilTheChannelIsFree) {
  Hear(FrameOf(Sense(1)), kStart);
  channel_.Send(Halt(2));
  EXPECT_EQ(channel_.NextStart(kStart), kStart + Idle());
  Hear({0x55}, kStart + Idle() - 1ns);
  EXPECT_TRUE(channel_.Begin(kStart + Idle()).bytes.empty()) << "somebody is talking";
  EXPECT_EQ(Names(channel_.Begin(kStart + 2 * Idle())), Frames{"D1 to 2"});
}

TEST_F(ChannelTest, AFrameThatNeverEndsHoldsACommandBackForTheGapTimeout) {
  std::vector<uint8_t> half = FrameOf(Sense(1));
  half.resize(half.size() / 2);
  Hear(half, kStart);
  channel_.Send(Halt(2));
  EXPECT_EQ(channel_.NextStart(kStart),
            kStart + std::max<Duration>(Idle(), std::chrono::milliseconds(testing::kGapTimeoutMs)));
}

TEST_F(ChannelTest, ACommandRidesOnAnAnswerToTheSameRobot) {
  channel_.Send(Halt(2));
  channel_.Send(Halt(1));
  Ask(1, kStart);
  EXPECT_EQ(Names(channel_.Begin(kStart + Earliest())), (Frames{"81 to 1", "D1 to 1"}));
}

TEST_F(ChannelTest, AnAnswerGoesBeforeACommandThatWaitsForLonger) {
  channel_.Send(Halt(2));
  Ask(1, kStart);
  EXPECT_EQ(Names(channel_.Begin(kStart + Earliest())), Frames{"81 to 1"});
}

TEST_F(ChannelTest, TheServerIsSilentForTheAckOfACommand) {
  channel_.Send(Halt(1, 1));
  channel_.Send(Halt(2, 2));
  EXPECT_EQ(Names(channel_.Begin(kStart)), Frames{"D1 to 1"});
  // It may begin W after the COMMAND's end, which the robot hears a turnaround later, and is itself
  // heard a turnaround and a byte later.
  const Time begun = channel_.sent_at() + 2ms + options_.response_window + 2ms + Lasts(1);
  EXPECT_GE(channel_.NextStart(kStart), begun);
  EXPECT_LT(channel_.NextStart(kStart), kNever);
}

TEST_F(ChannelTest, TheServerIsSilentNoLongerOnceTheAckIsThere) {
  channel_.Send(Halt(1, 1));
  channel_.Send(Halt(2, 2));
  channel_.Begin(kStart);
  const Time acknowledged = channel_.sent_at() + 2ms;
  Hear(FrameOf(MessageOf(protocol::CommandAck{1, 1, protocol::CommandCode::kHalt, 0})),
       acknowledged);
  EXPECT_EQ(channel_.NextStart(acknowledged), acknowledged + Idle());
}

TEST_F(ChannelTest, AnAckIsAwaitedAfterACommandThatRodeOnAnAnswer) {
  channel_.Send(Halt(1));
  channel_.Send(Halt(2));
  Ask(1, kStart);
  channel_.Begin(kStart + Earliest());
  EXPECT_GE(channel_.NextStart(kStart), channel_.sent_at() + options_.response_window);
}

TEST_F(ChannelTest, NobodyAcknowledgesACommandToAll) {
  channel_.Send(Halt(protocol::kBroadcastId));
  channel_.Send(Halt(1));
  EXPECT_EQ(Names(channel_.Begin(kStart)), Frames{"D1 to 255"});
  EXPECT_EQ(channel_.NextStart(kStart), channel_.sent_at() + Idle());
}

TEST_F(ChannelTest, ANewerCommandReplacesTheOneThatHasNotLeft) {
  channel_.Send(MessageOf(protocol::Command{1, 8, protocol::CommandCode::kSpeed, {100}}));
  channel_.Send(Halt(2));
  channel_.Send(Halt(1));
  ASSERT_EQ(dropped_.size(), 1u);
  EXPECT_EQ(dropped_[0].id, 1);
  EXPECT_EQ(dropped_[0].length, 4);
  EXPECT_EQ(Names(channel_.Begin(kStart)), Frames{"D1 to 1"});
  EXPECT_EQ(Names(channel_.Begin(kStart + 1s)), Frames{"D1 to 2"});
  EXPECT_EQ(channel_.NextStart(kStart + 2s), kNever);
}

TEST_F(ChannelTest, ARepeatedCommandIsNotSentOnceTheFirstIsAcknowledged) {
  channel_.Send(Halt(1, 8));
  ASSERT_EQ(Names(channel_.Begin(kStart)), Frames{"D1 to 1"});
  channel_.Send(Halt(1, 8));
  channel_.Send(Halt(2, 8));
  const auto ack = [](uint8_t id, uint8_t seq) {
    return FrameOf(MessageOf(protocol::CommandAck{id, seq, protocol::CommandCode::kHalt, 0}));
  };
  Hear(ack(1, 7), kStart + 1s);
  Hear(ack(1, 8), kStart + 1s);
  EXPECT_EQ(Names(channel_.Begin(kStart + 2s)), Frames{"D1 to 2"});
  EXPECT_EQ(channel_.NextStart(kStart + 3s), kNever);
  channel_.Send(Halt(1, 9));
  Hear(ack(1, 8), kStart + 3s);
  EXPECT_EQ(Names(channel_.Begin(kStart + 4s)), Frames{"D1 to 1"}) << "another one";
  ASSERT_EQ(dropped_.size(), 1u) << "a recording has to know";
  EXPECT_EQ(dropped_[0].id, 1);
}

// --- The carrier.

TEST_F(ChannelTest, ACarrierHoldsTheServerBackUntilItIsGone) {
  EXPECT_TRUE(channel_.IsClear(false, kStart));
  for (Duration after{}; after < 100ms; after += 5ms) {
    EXPECT_FALSE(channel_.IsClear(true, kStart + after));
  }
  EXPECT_TRUE(channel_.IsClear(false, kStart + 100ms));
  EXPECT_EQ(channel_.counters().ignored_carriers, 0u);
}

TEST_F(ChannelTest, ACarrierThatIsStuckIsIgnoredInTheEnd) {
  Time at = kStart;
  while (!channel_.IsClear(true, at)) {
    at += 5ms;
    ASSERT_LT(at, kStart + 1min);
  }
  EXPECT_EQ(at, kStart + Channel::kLongestCarrier);
  EXPECT_EQ(channel_.counters().ignored_carriers, 1u);
}

TEST_F(ChannelTest, ACarrierThatWasNotLookedAtMeanwhileIsANewOne) {
  EXPECT_FALSE(channel_.IsClear(true, kStart));
  EXPECT_FALSE(channel_.IsClear(true, kStart + 10s)) << "nothing waited in between";
}

// --- Bounds.

TEST_F(ChannelTest, TheOldestMessagesAreDroppedWhenTooManyWait) {
  size_t bytes = 0;
  size_t sent = 0;
  for (uint8_t id = 1; bytes <= 2 * Channel::kMaxQueue; id = id % 250 + 1) {
    const protocol::Message answer = MessageOf(protocol::SenseAnswer{id, 1, false, 1, 2});
    channel_.Answer(answer, kStart, kStart);
    bytes += FrameOf(answer).size();
    ++sent;
  }
  EXPECT_EQ(channel_.counters().dropped_answers, dropped_.size());
  EXPECT_EQ(dropped_.at(0).id, 1);
  EXPECT_EQ(dropped_.at(1).id, 2);
  channel_.DropAll();
  EXPECT_EQ(dropped_.size(), sent);
}

TEST_F(ChannelTest, AllThatWaitsIsReportedAsDropped) {
  channel_.Send(Halt(1));
  Ask(2, kStart);
  channel_.DropAll();
  EXPECT_EQ(dropped_.size(), 2u);
  EXPECT_EQ(channel_.NextStart(kStart), kNever);
}

// An answer that waits for the next ROUND is not in the queue.
TEST_F(ChannelTest, AnswersThatWaitForARoundAreReportedAsDropped) {
  testing::Air air(options_);
  air.Join(1, 100ms);
  air.Join(2, 100ms);
  air.AdvanceTo(air.now() + 1s);
  while (air.sent().empty() || !air.sent().back().round() ||
         air.sent().back().round()->turn_count != 2) {
    air.AdvanceTo(air.now() + 1ms);
  }
  const protocol::Round round = *air.sent().back().round();
  const Time first = air.TurnBegins(air.sent().back(), 0) + options_.timing.turnaround +
                     Lasts(FrameOf(Sense(1)).size());
  air.AdvanceTo(first);
  ASSERT_EQ(air.dropped().size(), 0u);
  air.channel().DropAll();
  ASSERT_EQ(air.dropped().size(), 1u);
  EXPECT_EQ(air.dropped()[0].id, round.turns[0]);
}

// --- Kinds of lines.

class FullDuplexTest : public ChannelTest {
 protected:
  FullDuplexTest() : ChannelTest({}) {}
};

TEST_F(FullDuplexTest, EverythingLeavesAtOnceInItsOrder) {
  channel_.Send(Halt(9));
  Ask(1, kStart - 1h, kStart);
  Refuse(2, kStart);
  Refuse(3, kStart);
  EXPECT_EQ(channel_.NextStart(kStart), kStart);
  EXPECT_EQ(Names(channel_.Begin(kStart)), (Frames{"D1 to 9", "81 to 1", "FE to 2", "FE to 3"}));
  EXPECT_EQ(channel_.NextStart(kStart), kNever);
  EXPECT_TRUE(dropped_.empty());
}

ChannelOptions Keyed() {
  ChannelOptions options = testing::Options(9'600, 2ms);
  options.timing.keyed = true;
  options.timing.lead = 25ms;
  options.timing.tail = 5ms;
  options.response_window =
      std::chrono::ceil<std::chrono::milliseconds>(options.timing.ResponseWindow());
  return options;
}

class KeyedTest : public ChannelTest {
 protected:
  KeyedTest() : ChannelTest(Keyed()) {}
};

TEST_F(KeyedTest, TheBytesLeaveAfterTheLead) {
  Ask(1, kStart);
  const Time due = kStart + Earliest();
  EXPECT_EQ(channel_.NextStart(kStart), due);
  const Transmission out = channel_.Begin(due);
  EXPECT_EQ(channel_.sent_at(), due + 25ms + Lasts(out.bytes.size()));
}

TEST_F(KeyedTest, TheLeadIsPartOfTheWindow) {
  Ask(1, kStart, kStart + 2ms);
  EXPECT_FALSE(channel_.Begin(kStart + Latest()).bytes.empty());
}

}  // namespace
}  // namespace pheromone::radio
