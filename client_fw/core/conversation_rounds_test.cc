// Turns that the server grants: protocol/README.md, section 9, "Rounds".
#include <gtest/gtest.h>

#include <vector>

#include "client_fw/core/testing/conversation_harness.h"

namespace pheromone {
namespace client {
namespace {

constexpr uint8_t kOther = 9;
constexpr uint8_t kTurnMs = 20;
constexpr protocol::RoundAnswer kAnswered{5, 6};
constexpr protocol::RoundAnswer kLost{protocol::kNoIntensities, 0};
constexpr protocol::RoundAnswer kBusy{protocol::kNoIntensities,
                                      static_cast<int16_t>(protocol::Reason::kBusy)};

struct Rounds : Harness {
  explicit Rounds(const Parameters& parameters = TestParameters()) : Harness(parameters) {}

  protocol::Round Next(const std::vector<uint8_t>& turns, uint8_t open_slots = 0) {
    protocol::Round round;
    round.number = ++number;
    round.turn_ms = kTurnMs;
    round.turn_bytes = turn_bytes;
    round.slot_ms = kTestSlotMs;
    round.open_slots = open_slots;
    for (const uint8_t id : turns) {
      round.turns[round.turn_count++] = id;
    }
    return round;
  }

  void Grant(const std::vector<uint8_t>& turns, uint8_t open_slots = 0) {
    FeedEncoded(Next(turns, open_slots));
    round_ms = now_ms;
  }

  void AnswerRound(const std::vector<protocol::RoundAnswer>& answers,
                   const std::vector<uint8_t>& turns = {}, uint8_t open_slots = 0) {
    protocol::Round round = Next(turns, open_slots);
    for (const protocol::RoundAnswer& answer : answers) {
      round.answers[round.answer_count++] = answer;
    }
    FeedEncoded(round);
    round_ms = now_ms;
  }

  /// When the frame of the turn began, after the ROUND; 0 if there was none in 200 ms.
  uint32_t TurnAfter() {
    const uint32_t from_ms = round_ms;
    return RunUntilSent(200) ? began_ms - from_ms : 0;
  }

  /// What is sent in the turn of the last ROUND. The next one answers that, and has a turn.
  std::vector<uint8_t> Exchange(const protocol::RoundAnswer& answer) {
    EXPECT_NE(0u, TurnAfter());
    std::vector<uint8_t> frame = wire;
    AnswerRound({answer}, {kTestId});
    return frame;
  }

  uint8_t turn_bytes = 20;
  uint8_t number = 40;
  uint32_t round_ms = 0;
};

template <typename T>
T Decoded(const std::vector<uint8_t>& wire) {
  protocol::FrameDecoder decoder(protocol::kNoGapTimeout);
  T what;
  bool is_one = false;
  decoder.PushBlock(wire.data(), wire.size(), 0,
                    [&](const auto& message) { is_one = Decode(message, &what); });
  EXPECT_TRUE(is_one);
  return what;
}

Parameters Tracing() {
  Parameters parameters = TestParameters();
  parameters.lay_trail = true;
  return parameters;
}

TEST(RoundsTest, ATurnBeginsAtItsTimeAndIsAnsweredByTheNextRound) {
  Rounds harness;
  harness.Greet();
  harness.Grant({kOther, 3, kTestId});
  EXPECT_EQ(1u + 2 * kTurnMs, harness.TurnAfter());
  harness.SentSense();
  harness.AnswerRound({{1, 2}, {3, 4}, {500, -600}});
  EXPECT_EQ(500, harness.conversation.state().p_left);
  EXPECT_EQ(-600, harness.conversation.state().p_right);
  EXPECT_EQ(1u, harness.counters().answers);
  EXPECT_EQ(0, harness.conversation.state().flags);
  EXPECT_EQ(2u, harness.counters().rounds);
  EXPECT_EQ(1u, harness.counters().turns);
}

TEST(RoundsTest, ATurnBeginsWhenTheOneBeforeIsOver) {
  Rounds harness;
  harness.Greet();
  harness.Grant({3, kOther, kTestId});
  harness.Run(5);
  harness.FeedEncoded(protocol::SenseAnswer{kOther, 2, false, 1, 1});  // of the server: no turn
  harness.Run(2);
  protocol::Message sense;
  ASSERT_TRUE(Encode(protocol::SenseRequest{3, 2, false, {0, 0, 0}}, &sense));
  harness.Feed(sense);  // not the one before
  harness.Run(3);
  EXPECT_EQ(1, harness.frames_sent);
  sense.id = kOther;
  harness.Feed(sense);
  EXPECT_EQ(11u, harness.TurnAfter());
}

TEST(RoundsTest, WhoHasNoTurnIsSilent) {
  Rounds harness;
  harness.Greet();
  for (int i = 0; i < 10; ++i) {
    harness.Grant({kOther, 3});
    harness.Run(150);
  }
  EXPECT_EQ(1, harness.frames_sent);  // HELLO
}

TEST(RoundsTest, ARoundThatWasMissedLeavesTheRequestUnanswered) {
  Rounds harness(Tracing());
  harness.Greet();
  harness.Grant({kTestId});
  ASSERT_NE(0u, harness.TurnAfter());
  const std::vector<uint8_t> first = harness.wire;
  ++harness.number;  // a ROUND that was not heard
  harness.AnswerRound({{7, 7}}, {kTestId});
  EXPECT_EQ(0u, harness.counters().answers);
  harness.pose.x_mm += 500;
  ASSERT_NE(0u, harness.TurnAfter());
  EXPECT_EQ(first, harness.wire);  // byte for byte
  harness.AnswerRound({{7, 8}});
  EXPECT_EQ(7, harness.conversation.state().p_left);
}

TEST(RoundsTest, AnAnswerThatIsSaidAgainAfterAMissedRoundIsTaken) {
  Rounds harness(Tracing());
  harness.Greet();
  harness.Grant({kTestId});
  ASSERT_NE(0u, harness.TurnAfter());
  const protocol::TraceRequest asked = Decoded<protocol::TraceRequest>(harness.wire);
  ++harness.number;  // a ROUND that was not heard
  const auto other = static_cast<uint8_t>(asked.seq - 1);
  harness.FeedEncoded(protocol::TraceAnswer{kTestId, asked.type, false, other, 5, 5});
  EXPECT_EQ(0u, harness.counters().answers);
  harness.FeedEncoded(protocol::TraceAnswer{kTestId, asked.type, false, asked.seq, 7, 8});
  EXPECT_EQ(1u, harness.counters().answers);
  EXPECT_EQ(7, harness.conversation.state().p_left);
  harness.AnswerRound({{protocol::kNoIntensities, 0}}, {kTestId});
  EXPECT_EQ(0u, harness.counters().timeouts);
  harness.pose.x_mm += 500;
  ASSERT_NE(0u, harness.TurnAfter());
  EXPECT_NE(asked.seq, Decoded<protocol::TraceRequest>(harness.wire).seq);
}

// It was heard, but is not on disk yet: the robot drives on by queries.
TEST(RoundsTest, WhileAChangeWaitsMostTurnsAreForQueries) {
  Rounds harness(Tracing());
  harness.Greet();
  harness.Grant({kTestId});
  ASSERT_NE(0u, harness.TurnAfter());
  const std::vector<uint8_t> first = harness.wire;
  protocol::RoundAnswer answer = kBusy;
  for (int16_t i = 0; i < 10; ++i) {
    const int16_t queries = i == 0 ? 1 : 3;
    for (int16_t k = 0; k < queries; ++k) {
      harness.pose.x_mm += 50;
      harness.AnswerRound({answer}, {kTestId});
      ASSERT_NE(0u, harness.TurnAfter());
      EXPECT_EQ(harness.pose.x_mm, harness.SentSense().pose.x);
      answer = {static_cast<int16_t>(5 + 3 * i + k), 6};
    }
    harness.AnswerRound({answer}, {kTestId});
    EXPECT_EQ(answer.left, harness.conversation.state().p_left);
    ASSERT_NE(0u, harness.TurnAfter());
    EXPECT_EQ(first, harness.wire);
    answer = kBusy;
  }
  harness.AnswerRound({{70, 80}}, {kTestId});  // of the pose where it was then
  EXPECT_EQ(34, harness.conversation.state().p_left);
  ASSERT_NE(0u, harness.TurnAfter());
  harness.SentSense();
  harness.AnswerRound({{7, 8}}, {kTestId});
  EXPECT_EQ(7, harness.conversation.state().p_left);
  ASSERT_NE(0u, harness.TurnAfter());
  EXPECT_EQ(2, harness.SentTrace().seq);
}

// While the log is slow, a change that the air has lost is not repeated at once: with its answer,
// which comes late, the robot would have nothing to steer by for four rounds.
TEST(RoundsTest, AfterAChangeThatWaitedALostOneIsFollowedByAQuery) {
  Rounds harness(Tracing());
  harness.Greet();
  harness.Grant({kTestId});
  const auto query = [&] {
    harness.Exchange(kAnswered);
    EXPECT_EQ(protocol::kSense, protocol::ServiceOf(harness.sent.opcode));
  };
  for (const int queries : {1, 2}) {  // the second one waits while the log is slow
    const std::vector<uint8_t> waits = harness.Exchange(kBusy);
    for (int i = 0; i < queries; ++i) {
      query();
    }
    EXPECT_EQ(waits, harness.Exchange(kAnswered));
    query();
    const std::vector<uint8_t> change = harness.Exchange(kLost);
    EXPECT_NE(waits, change);
    query();
    EXPECT_EQ(change, harness.Exchange(kAnswered));
    query();
  }
  // One that is answered at once shows that the log is quick again.
  harness.Exchange(kAnswered);
  EXPECT_EQ(protocol::kTrace, protocol::ServiceOf(harness.sent.opcode));
  const std::vector<uint8_t> change = harness.Exchange(kLost);
  EXPECT_EQ(change, harness.Exchange(kAnswered));
}

// However long a request of TAG has waited.
TEST(RoundsTest, AfterARequestOfTagThatWaitedTheTrailGoesOnAtOnce) {
  Rounds harness(Tracing());
  harness.turn_bytes = 30;
  harness.Greet();
  harness.Grant({kTestId});
  harness.Exchange(kAnswered);
  TagExchange exchange;
  Encode(protocol::TagEraseRequest{}, &exchange.message);
  harness.conversation.Ask(&exchange);
  for (int waits = 0; waits < 10;) {
    ASSERT_NE(0u, harness.TurnAfter());
    if (harness.sent.opcode != protocol::kTagErase) {
      harness.AnswerRound({kAnswered}, {kTestId});
    } else if (++waits < 10) {
      harness.AnswerRound({kBusy}, {kTestId});
    }
  }
  const uint8_t seq = Decoded<protocol::TagEraseRequest>(harness.wire).seq;
  harness.FeedEncoded(protocol::TagWritten{kTestId, true, seq, 0, 0, 1, 1});
  ASSERT_EQ(TagExchange::kAnswered, exchange.state);
  harness.AnswerRound({kLost}, {kTestId});
  harness.Exchange(kAnswered);
  EXPECT_EQ(protocol::kTrace, protocol::ServiceOf(harness.sent.opcode));
}

TEST(RoundsTest, AnAnswerWithoutIntensitiesMeansOnceMoreOrIsTheReasonOfAnError) {
  Rounds harness(Tracing());
  harness.Greet();
  harness.Grant({kTestId});
  ASSERT_NE(0u, harness.TurnAfter());
  const std::vector<uint8_t> first = harness.wire;
  harness.AnswerRound({{protocol::kNoIntensities, 0}}, {kTestId});
  ASSERT_NE(0u, harness.TurnAfter());
  EXPECT_EQ(first, harness.wire);
  const auto off_the_map = static_cast<int16_t>(protocol::Reason::kOffTheMap);
  harness.AnswerRound({{protocol::kNoIntensities, off_the_map}}, {kTestId});
  EXPECT_EQ(protocol::Reason::kOffTheMap, harness.conversation.requests().last_error);
  EXPECT_NE(0, harness.conversation.state().flags & kOffTheMap);
  ASSERT_NE(0u, harness.TurnAfter());
  EXPECT_NE(first, harness.wire);  // that one is settled
}

TEST(RoundsTest, WhoIsListedTwiceAcknowledgesTheCommandFirst) {
  Rounds harness;
  harness.Greet();
  protocol::Command halt;
  halt.id = kTestId;
  halt.seq = 5;
  halt.code = protocol::CommandCode::kHalt;
  harness.FeedEncoded(halt);
  harness.Grant({kTestId, kTestId});
  harness.Run(2);
  EXPECT_EQ(harness.round_ms + 1, harness.began_ms);
  EXPECT_EQ(protocol::kCommandAck, harness.sent.opcode);
  ASSERT_TRUE(harness.RunUntilSent(100));
  EXPECT_EQ(harness.sent_ms, harness.began_ms);  // the next one has begun at once
  ASSERT_TRUE(harness.RunUntilSent(100));
  harness.SentSense();
  harness.AnswerRound({{protocol::kNoIntensities, 0}, {30, 40}});
  EXPECT_EQ(30, harness.conversation.state().p_left);
}

TEST(RoundsTest, ASecondTurnThatDoesNotFollowTheFirstIsNotTaken) {
  Rounds harness;
  harness.Greet();
  protocol::Command halt;
  halt.id = kTestId;
  halt.seq = 5;
  halt.code = protocol::CommandCode::kHalt;
  harness.FeedEncoded(halt);
  harness.Grant({kTestId, kOther, kTestId});
  ASSERT_TRUE(harness.RunUntilSent(100));
  EXPECT_EQ(protocol::kCommandAck, harness.sent.opcode);
  EXPECT_FALSE(harness.RunUntilSent(100));
}

TEST(RoundsTest, ARequestThatDoesNotFitWaitsForAnOpening) {
  Rounds harness;
  harness.Greet();
  protocol::Round round = harness.Next({kTestId}, 8);
  round.turn_bytes = 10;
  harness.FeedEncoded(round);
  harness.round_ms = harness.now_ms;
  EXPECT_GT(harness.TurnAfter(), 1u + kTurnMs);
  harness.SentSense();
}

TEST(RoundsTest, ANewcomerSaysHelloInAnOpeningOnly) {
  Rounds harness;
  harness.Grant({kOther, 3, 4});
  harness.Run(150);
  harness.Grant({kOther, 3, 4});
  harness.Run(150);
  EXPECT_EQ(0, harness.frames_sent);
  harness.Grant({kOther}, 4);
  const uint32_t after_ms = harness.TurnAfter();
  EXPECT_EQ(protocol::kHello, harness.sent.opcode);
  EXPECT_GT(after_ms, 1u + kTurnMs);
}

TEST(RoundsTest, AnEventIsReportedInAnOpening) {
  Rounds harness;
  harness.Greet();
  protocol::Command pick;
  pick.id = kTestId;
  pick.seq = 5;
  pick.code = protocol::CommandCode::kPickLoad;
  harness.FeedEncoded(pick);
  harness.Grant({kTestId, kTestId});
  ASSERT_NE(0u, harness.TurnAfter());
  ASSERT_TRUE(harness.RunUntilSent(100));
  harness.AnswerRound({{protocol::kNoIntensities, 0}, {30, 40}}, {kOther}, 8);
  EXPECT_GT(harness.TurnAfter(), 1u + kTurnMs);
  harness.AnswerEvent();
  ASSERT_EQ(1u, harness.events.size());
  EXPECT_EQ(protocol::EventCode::kLoadPicked, harness.events[0].code);
}

// On a full channel every robot has a turn in every round, and whoever takes one waits for the
// answer until the opening is over: an opening alone would never do.
TEST(RoundsTest, AnEventForWhichThereWasNoOpeningTakesATurnInEveryEighthRound) {
  for (const uint8_t open_slots : {uint8_t{0}, uint8_t{4}}) {
    Rounds harness;
    harness.Greet();
    harness.Grant({kTestId}, open_slots);
    ASSERT_NE(0u, harness.TurnAfter());
    harness.SentSense();
    std::vector<int> told;
    for (int round = 0; round < 32; ++round) {
      harness.conversation.behaviour()->Tell(77);
      if (harness.sent.opcode == protocol::kEvent) {
        told.push_back(round);
        harness.AnswerEvent();
        harness.AnswerRound({{protocol::kNoIntensities, 0}}, {kTestId}, open_slots);
      } else {
        harness.AnswerRound({{1, 2}}, {kTestId}, open_slots);
      }
      ASSERT_EQ(1u, harness.TurnAfter());
    }
    ASSERT_EQ(4u, told.size());
    EXPECT_EQ(8, told[1] - told[0]);
    EXPECT_EQ(8, told[2] - told[1]);
    EXPECT_EQ(4u, harness.events.size());
    EXPECT_EQ(77, harness.events[0].argument);
  }
}

TEST(RoundsTest, WithoutRoundsForTwoSecondsTheRobotSaysHelloAndContends) {
  Rounds harness;
  harness.Greet();
  harness.Grant({kTestId});
  ASSERT_NE(0u, harness.TurnAfter());
  const uint32_t silent_from_ms = harness.round_ms;
  ASSERT_TRUE(harness.RunUntilSent(4000));
  EXPECT_EQ(protocol::kHello, harness.sent.opcode);
  EXPECT_GE(harness.began_ms - silent_from_ms, 2000u);
  harness.AnswerHello();
  ASSERT_TRUE(harness.RunUntilSent(1000));
  harness.SentSense();
}

TEST(RoundsTest, ASimpleClientContendsInOpenings) {
  Parameters parameters = TestParameters();
  parameters.rounds = false;
  Rounds harness(parameters);
  ASSERT_TRUE(harness.RunUntilSent());
  protocol::HelloRequest hello;
  ASSERT_TRUE(Decode(harness.sent, &hello));
  EXPECT_EQ(0, hello.round_period);
  harness.AnswerHello();
  for (int i = 0; i < 5; ++i) {
    harness.Grant({kOther, 3, 4, 5});
    harness.Run(100);
  }
  EXPECT_EQ(1, harness.frames_sent);
  harness.Grant({kOther}, 8);
  EXPECT_GT(harness.TurnAfter(), 1u + kTurnMs);
  harness.SentSense();
}

uint8_t RoundPeriodOf(const protocol::Message& message) {
  protocol::HelloRequest hello;
  EXPECT_TRUE(Decode(message, &hello));
  return hello.round_period;
}

// Its adapter was found to be slow, while a change is under way in a turn.
TEST(RoundsTest, WhoCanNotTellTheTimeOfAByteLeaves) {
  Rounds harness(Tracing());
  harness.Greet();
  EXPECT_NE(0, RoundPeriodOf(harness.sent));
  harness.Grant({kTestId});
  ASSERT_NE(0u, harness.TurnAfter());
  const std::vector<uint8_t> change = harness.wire;
  harness.conversation.SetAdapter(16, false);
  harness.AnswerRound({{1, 2}}, {kOther}, 16);  // too late: it does not await it any more
  EXPECT_EQ(0u, harness.counters().answers);
  ASSERT_NE(0u, harness.TurnAfter());
  EXPECT_EQ(0, RoundPeriodOf(harness.sent));
  EXPECT_GT(harness.began_ms - harness.round_ms, 1u + kTurnMs);
  harness.AnswerHello();
  harness.Grant({kOther}, 16);
  EXPECT_GT(harness.TurnAfter(), 1u + kTurnMs);
  EXPECT_EQ(change, harness.wire);
  harness.Answer(1, 2);
  EXPECT_EQ(1u, harness.counters().answers);
}

TEST(RoundsTest, WhoLeavesBeforeItsTurnSaysHelloUntilItIsAnswered) {
  Rounds harness;
  harness.Greet();
  harness.Grant({kOther, kTestId});
  harness.conversation.SetAdapter(16, false);
  for (int i = 0; i < 3; ++i) {  // there may be no ROUND any more
    ASSERT_TRUE(harness.RunUntilSent(4000)) << i;
    EXPECT_EQ(0, RoundPeriodOf(harness.sent));
  }
}

TEST(RoundsTest, WhoCanTellItNowJoins) {
  Parameters parameters = TestParameters();
  parameters.rounds = false;
  parameters.adapter_ms = 16;
  Rounds harness(parameters);
  harness.Greet();
  harness.conversation.SetAdapter(1, true);
  ASSERT_TRUE(harness.RunUntilSent());
  EXPECT_EQ(parameters.period_ms / 20, RoundPeriodOf(harness.sent));
  harness.AnswerHello();
  harness.Grant({kOther, kTestId});
  EXPECT_EQ(1u + kTurnMs, harness.TurnAfter());
  harness.SentSense();
}

TEST(RoundsTest, WhoWaitsForAnotherTimeSaysNothing) {
  Rounds harness;
  harness.Greet();
  harness.conversation.SetAdapter(1, true);
  ASSERT_TRUE(harness.RunUntilSent());
  harness.SentSense();
}

// Whatever the counts say, nothing beyond the frame is read.
TEST(RoundsTest, AMalformedRoundIsIgnored) {
  Rounds harness;
  harness.Greet();
  protocol::Message message;
  Encode(harness.Next({kTestId}), &message);
  for (int counts = 0; counts < 256; ++counts) {
    if (counts != 0x10) {
      message.data[5] = static_cast<uint8_t>(counts);
      harness.Feed(message);
    }
  }
  message.length = 3;
  harness.Feed(message);
  EXPECT_EQ(0u, harness.counters().rounds);
}

}  // namespace
}  // namespace client
}  // namespace pheromone
