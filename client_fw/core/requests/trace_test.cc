// Requests that change the server's state are executed once, and what ERROR answers do.
#include <gtest/gtest.h>

#include "client_fw/core/testing/conversation_harness.h"

namespace pheromone {
namespace client {
namespace {

using protocol::Reason;

Parameters TraceParameters() {
  Parameters parameters = TestParameters();
  parameters.lay_trail = true;
  return parameters;
}

TEST(TraceTest, EachHasTheNextSeqAndAFreshPose) {
  Harness harness(TraceParameters());
  harness.hello.last_seq = 254;
  harness.Greet();
  for (const int seq : {255, 0, 1, 2}) {
    harness.pose.x_mm = 100 + seq;
    ASSERT_TRUE(harness.RunUntilSent());
    const protocol::TraceRequest trace = harness.SentTrace();
    EXPECT_EQ(seq, trace.seq);
    EXPECT_EQ(100 + seq, trace.pose.x);
    EXPECT_FALSE(trace.wide);
    harness.Answer(2048, 0);
    EXPECT_EQ((WheelSpeeds{100, 200}), harness.conversation.state().wheels);
  }
  EXPECT_EQ(0u, harness.counters().duplicates);
}

TEST(TraceTest, WideOneHasItsOwnService) {
  Parameters parameters = TraceParameters();
  parameters.wide = true;
  Harness harness(parameters);
  harness.pose = {-70000, 80000, 0x1010};
  harness.Greet();
  ASSERT_TRUE(harness.RunUntilSent());
  EXPECT_TRUE(harness.SentTrace().wide);
  EXPECT_EQ(-70000, harness.SentTrace().pose.x);
  harness.Answer(0, 0);
  EXPECT_EQ(kStraight, harness.conversation.state().wheels);
}

TEST(TraceTest, LongestPossibleFrameFits) {
  Parameters parameters = TraceParameters();
  parameters.wide = true;
  parameters.id = 0x10;
  Harness harness(parameters);
  harness.hello.last_seq = 0x0F;
  harness.pose = {0x00101010, 0x00101010, 0x1010};
  harness.Greet();
  ASSERT_TRUE(harness.RunUntilSent());
  EXPECT_EQ(0x10, harness.SentTrace().seq);
  EXPECT_EQ(0x00101010, harness.SentTrace().pose.y);
  EXPECT_GE(harness.wire.size(), 4u + 15u + 10u);  // ten bytes doubled at least
}

// Sends until it is something else than HELLO, which is answered.
void RunUntilAsked(Harness* harness) {
  do {
    ASSERT_TRUE(harness->RunUntilSent());
    if (harness->sent.opcode == protocol::kHello) {
      harness->AnswerHello();
    }
  } while (harness->sent.opcode == protocol::kHello);
}

TEST(TraceTest, RetryIsTheSameToTheByte) {
  Harness harness(TraceParameters());
  harness.Greet();
  ASSERT_TRUE(harness.RunUntilSent());
  const std::vector<uint8_t> first = harness.wire;
  uint32_t repeated = 0;
  for (int i = 0; i < 16; ++i) {  // over the end of the first period's retries
    harness.pose.x_mm += 10;
    RunUntilAsked(&harness);
    if (protocol::ServiceOf(harness.sent.opcode) == protocol::kTrace) {
      EXPECT_EQ(first, harness.wire);
      ++repeated;
    } else {
      EXPECT_EQ(harness.pose.x_mm, harness.SentSense().pose.x);
    }
  }
  EXPECT_GE(repeated, 7u);
  EXPECT_EQ(repeated, harness.counters().duplicates);
  while (harness.wire != first) {
    RunUntilAsked(&harness);
  }
  harness.Answer(0, 0);
  ASSERT_TRUE(harness.RunUntilSent());
  harness.SentSense();  // its intensities were old
  harness.Answer(0, 0);
  ASSERT_TRUE(harness.RunUntilSent());
  EXPECT_EQ(2, harness.SentTrace().seq);
  EXPECT_EQ(harness.pose.x_mm, harness.SentTrace().pose.x);
}

Parameters AdapterParameters() {
  Parameters parameters = TraceParameters();
  parameters.rounds = false;
  parameters.buffered_link = true;
  parameters.adapter_ms = 16;
  return parameters;
}

// It waits for the log: a robot that is alone draws no delay after it.
TEST(TraceTest, BehindAnAdapterAChangeWithoutAnAnswerIsNoSignOfOthers) {
  Harness harness(AdapterParameters());
  harness.GreetAndServe(1500);
  constexpr uint32_t kSoonMs = kTestIdleMs + (kMinWindow + 1) * kTestSlotMs;  // it listens at times
  for (int i = 0; i < 20; ++i) {
    ASSERT_TRUE(harness.RunUntilSent());
    harness.SentTrace();
    ASSERT_TRUE(harness.RunUntilSent());
    ASSERT_EQ(harness.sent.opcode, protocol::kPing);
    harness.AnswerPing();
    const uint32_t answered_ms = harness.now_ms;
    ASSERT_TRUE(harness.RunUntilSent());
    harness.SentSense();
    EXPECT_LE(harness.began_ms, answered_ms + kSoonMs);
    harness.Answer(0, 0);
    ASSERT_TRUE(harness.RunUntilSent());
    harness.SentTrace();
    harness.Answer(0, 0);  // old
    ASSERT_TRUE(harness.RunUntilSent());
    harness.SentSense();
    harness.Answer(0, 0);
  }
}

// Behind an adapter a delay as after a collision is long: a robot that drew one would stop.
TEST(TraceTest, BehindAnAdapterAQueryFollowsDirectly) {
  const Parameters parameters = AdapterParameters();
  Harness harness(parameters);
  harness.GreetAndServe(1500);
  constexpr uint32_t kSoonMs = kTestIdleMs + 2 * kTestSlotMs;
  for (int i = 0; i < 20; ++i) {
    harness.FeedEncoded(protocol::SenseAnswer{8, 2, false, 0, 0});  // others are about
    ASSERT_TRUE(harness.RunUntilSent());
    const uint8_t seq = harness.SentTrace().seq;
    const uint32_t unanswered_ms = harness.sent_ms + kTestWindowMs + 1 + parameters.adapter_ms;
    ASSERT_TRUE(harness.RunUntilSent());
    harness.SentSense();
    EXPECT_LE(harness.began_ms, unanswered_ms + kTestSlotMs);
    harness.Answer(0, 0);
    ASSERT_TRUE(harness.RunUntilSent());
    EXPECT_EQ(harness.SentTrace().seq, seq);
    harness.Answer(0, 0);  // old
    const uint32_t answered_ms = harness.now_ms;
    ASSERT_TRUE(harness.RunUntilSent());
    harness.SentSense();
    EXPECT_LE(harness.began_ms, answered_ms + kSoonMs);
    harness.Answer(0, 0);
  }
}

// A slow log is no reason to stop: protocol/README.md, section 8.
TEST(TraceTest, WhileItWaitsTheRobotDrivesOnByQueries) {
  Harness harness(TraceParameters());
  harness.Greet();
  ASSERT_TRUE(harness.RunUntilSent());
  harness.Answer(0, 0);
  ASSERT_TRUE(harness.RunUntilSent());
  const std::vector<uint8_t> first = harness.wire;
  const uint32_t since_ms = harness.now_ms;
  uint8_t before = harness.sent.opcode;
  int repeated = 0;
  while (harness.now_ms - since_ms < 5'000) {
    ASSERT_TRUE(harness.RunUntilSent());
    if (harness.sent.opcode == protocol::kSense + 2) {
      harness.Answer(0, 0);
    } else {
      EXPECT_EQ(first, harness.wire);
      repeated += before == harness.sent.opcode ? 1 : 0;
    }
    before = harness.sent.opcode;
    EXPECT_EQ(kStraight, harness.conversation.state().wheels);
  }
  EXPECT_EQ(0u, harness.counters().fail_safe_stops);
  EXPECT_EQ(1, repeated);  // then it is each second one
  while (harness.sent.opcode == protocol::kSense + 2) {
    ASSERT_TRUE(harness.RunUntilSent());
  }
  harness.Answer(0, 0);
  ASSERT_TRUE(harness.RunUntilSent());
  harness.SentSense();  // since the intensities of the change were old
  harness.Answer(0, 0);
  ASSERT_TRUE(harness.RunUntilSent());
  EXPECT_EQ(3, harness.SentTrace().seq);
}

// The query's refusal is not the change's.
TEST(TraceTest, ARefusedQueryLeavesTheChangeWaiting) {
  Harness harness(TraceParameters());
  harness.Greet();
  ASSERT_TRUE(harness.RunUntilSent());
  const std::vector<uint8_t> first = harness.wire;
  harness.AnswerError(Reason::kBusy, 1);
  ASSERT_TRUE(harness.RunUntilSent());
  harness.SentSense();
  harness.AnswerError(Reason::kOffTheMap, 0);
  RunUntilAsked(&harness);
  EXPECT_EQ(first, harness.wire);
  EXPECT_EQ(0u, harness.counters().lost_traces);
}

TEST(TraceTest, AnswerToAnotherSeqIsNotBelieved) {
  Harness harness(TraceParameters());
  harness.Greet();
  ASSERT_TRUE(harness.RunUntilSent());
  harness.FeedEncoded(protocol::TraceAnswer{kTestId, 2, false, 9, 0, 0});
  EXPECT_EQ(kStill, harness.conversation.state().wheels);
  EXPECT_EQ(1u, harness.counters().late_answers);
}

TEST(TraceTest, AnswerToAnOldPoseSettlesTheRequestButDoesNotSteer) {
  Harness harness(TraceParameters());
  harness.Greet();
  ASSERT_TRUE(harness.RunUntilSent());
  const protocol::Message first = harness.sent;
  while (harness.now_ms - harness.began_ms < 600 || harness.sent.opcode == protocol::kHello) {
    ASSERT_TRUE(harness.RunUntilSent());
    if (harness.sent.opcode == protocol::kHello) {
      harness.AnswerHello();
    } else if (harness.counters().hellos > 1 && harness.sent.opcode == first.opcode) {
      break;
    }
  }
  harness.Feed(Harness::AnswerTo(first, 0, 0));
  EXPECT_EQ(1u, harness.counters().stale_answers);
  EXPECT_EQ(kStill, harness.conversation.state().wheels);
  ASSERT_TRUE(harness.RunUntilSent(8 * kTestSlotMs + 16 + 200));
  harness.SentSense();
  harness.Answer(0, 0);
  ASSERT_TRUE(harness.RunUntilSent(8 * kTestSlotMs + 16 + 200));
  EXPECT_EQ(2, harness.SentTrace().seq);
  harness.Answer(0, 0);
  EXPECT_EQ(kStraight, harness.conversation.state().wheels);
}

TEST(TraceTest, WarmResetRepeatsThePendingRequest) {
  Harness before(TraceParameters());
  before.Greet();
  ASSERT_TRUE(before.RunUntilSent());

  // At a time whose low half is small, so that no pose could be mistaken for one taken at 0.
  Harness after(TraceParameters(), 0x10000, before.memory);
  after.pose.x_mm += 500;
  after.hello.last_seq = 1;
  after.Greet();
  ASSERT_TRUE(after.RunUntilSent());
  EXPECT_EQ(before.wire, after.wire);
  after.Answer(0, 0);
  EXPECT_EQ(kStill, after.conversation.state().wheels);  // whose pose nobody knows any more
  EXPECT_EQ(1u, after.counters().stale_answers);
  ASSERT_TRUE(after.RunUntilSent());
  EXPECT_EQ(2, after.SentTrace().seq);
  EXPECT_EQ(after.pose.x_mm, after.SentTrace().pose.x);
}

TEST(TraceTest, PowerUpForgetsThePendingRequest) {
  RequestMemory memory = {};
  memory.nonce = 0x1233;  // another boot's
  memory.seq = 5;
  memory.opcode = protocol::kTrace | 2;
  memory.length = 7;
  const Conversation conversation(TraceParameters(), &memory);
  EXPECT_EQ(0x1234, memory.nonce);
  EXPECT_EQ(0, memory.opcode);
  EXPECT_EQ(0, memory.seq);
}

TEST(TraceTest, MemoryThatCannotBeIsForgotten) {
  RequestMemory memory = {};
  memory.nonce = 0x1234;
  memory.opcode = protocol::kTrace | 2;
  memory.length = kMaxPending + 1;
  const Conversation conversation(TraceParameters(), &memory);
  EXPECT_EQ(0, memory.opcode);
}

TEST(TraceTest, NewEpochDropsThePendingRequest) {
  Harness harness(TraceParameters());
  harness.Greet();
  ASSERT_TRUE(harness.RunUntilSent());
  harness.AnswerError(Reason::kSayHello, 1);
  harness.hello.epoch = 10;
  harness.hello.last_seq = 77;
  harness.pose.x_mm = 3333;
  harness.Greet();
  EXPECT_EQ(1u, harness.counters().lost_traces);
  ASSERT_TRUE(harness.RunUntilSent());
  EXPECT_EQ(78, harness.SentTrace().seq);
  EXPECT_EQ(3333, harness.SentTrace().pose.x);
}

TEST(TraceTest, SameEpochKeepsThePendingRequest) {
  Harness harness(TraceParameters());
  harness.Greet();
  ASSERT_TRUE(harness.RunUntilSent());
  const std::vector<uint8_t> first = harness.wire;
  harness.AnswerError(Reason::kSayHello, 1);
  harness.hello.last_seq = 1;
  harness.Greet();
  ASSERT_TRUE(harness.RunUntilSent());
  EXPECT_EQ(first, harness.wire);
}

// Also if its answer says that the server has not seen it: it may still arrive there.
TEST(TraceTest, DroppedRequestHasUsedItsNumber) {
  for (const bool new_epoch : {false, true}) {
    Harness harness(TraceParameters());
    harness.Greet();
    ASSERT_TRUE(harness.RunUntilSent());
    ASSERT_EQ(1, harness.SentTrace().seq);
    if (new_epoch) {
      harness.AnswerError(Reason::kSayHello, 1);
      harness.hello.epoch = 10;
    } else {
      harness.AnswerError(Reason::kReadOnly, 1);
      do {
        harness.Step();
      } while (harness.conversation.requests().greeted);
    }
    harness.Greet();
    EXPECT_EQ(1u, harness.counters().lost_traces);
    ASSERT_TRUE(harness.RunUntilSent());
    EXPECT_EQ(2, harness.SentTrace().seq) << new_epoch;
  }
}

// Of a network that delivers it again after the reset; its nonce is the right one.
TEST(TraceTest, LateHelloAnswerDoesNotTakeNumbersBack) {
  Harness before(TraceParameters());
  before.hello.last_seq = 250;
  before.GreetAndServe(1500);
  const uint8_t last = before.memory.seq;
  ASSERT_GT(static_cast<uint8_t>(last - 250), 3);
  Harness after(TraceParameters(), 0x10000, before.memory);
  after.hello.last_seq = 250;
  after.Greet();
  ASSERT_TRUE(after.RunUntilSent());
  EXPECT_EQ(static_cast<uint8_t>(last + 1), after.SentTrace().seq);
}

TEST(TraceTest, AfterPowerUpItGoesOnFromHellosAnswer) {
  for (const int last : {0, 1, 127, 128, 129, 200, 255}) {
    Harness harness(TraceParameters());
    harness.hello.last_seq = static_cast<uint8_t>(last);
    harness.Greet();
    ASSERT_TRUE(harness.RunUntilSent());
    EXPECT_EQ(static_cast<uint8_t>(last + 1), harness.SentTrace().seq);
  }
}

TEST(TraceTest, WarmResetKeepsTheFirstRequestWhichMayNotHaveArrived) {
  Harness before(TraceParameters());
  before.Greet();
  ASSERT_TRUE(before.RunUntilSent());
  Harness after(TraceParameters(), 0x10000, before.memory);
  after.Greet();
  ASSERT_TRUE(after.RunUntilSent());
  EXPECT_EQ(before.wire, after.wire);
}

TEST(TraceTest, RequestThatIsBehindIsGivenUp) {
  for (const int ahead : {0, 1, 127, 128, 255}) {
    const bool behind = ahead == 1 || ahead == 127;
    Harness harness(TraceParameters());
    harness.Greet();
    ASSERT_TRUE(harness.RunUntilSent());
    const std::vector<uint8_t> first = harness.wire;
    harness.hello.last_seq = static_cast<uint8_t>(1 + ahead);
    do {
      ASSERT_TRUE(harness.RunUntilSent());
    } while (harness.sent.opcode != protocol::kHello);
    harness.AnswerHello();
    EXPECT_EQ(behind ? 1u : 0u, harness.counters().lost_traces) << ahead;
    ASSERT_TRUE(harness.RunUntilSent());
    EXPECT_EQ(behind, first != harness.wire) << ahead;
    EXPECT_EQ(static_cast<uint8_t>(behind ? ahead + 2 : 1), harness.SentTrace().seq);
    harness.Answer(0, 0);
  }
}

TEST(TraceTest, OldPoseStaysOldWhenTheClockComesRound) {
  for (const bool pause : {false, true}) {
    Harness harness(TraceParameters());
    harness.Greet();
    ASSERT_TRUE(harness.RunUntilSent());
    const protocol::Message first = harness.sent;
    const uint32_t posed_ms = harness.began_ms;
    if (pause) {
      harness.now_ms = posed_ms + 0x10000;
    }
    do {
      ASSERT_TRUE(harness.RunUntilSent());
      if (harness.sent.opcode == protocol::kHello) {
        harness.AnswerHello();
      }
    } while (harness.sent.opcode != first.opcode || harness.now_ms - posed_ms < 0x10000);
    ASSERT_LT(harness.now_ms - posed_ms, 0x10000u + 500);
    harness.Feed(Harness::AnswerTo(first, 0, 0));
    EXPECT_EQ(1u, harness.counters().stale_answers);
    EXPECT_EQ(kStill, harness.conversation.state().wheels);
  }
}

TEST(ErrorTest, SayHelloIsObeyedAtOnce) {
  Harness harness;
  harness.GreetAndServe(1500);
  ASSERT_TRUE(harness.RunUntilSent());
  harness.AnswerError(Reason::kSayHello);
  ASSERT_TRUE(harness.RunUntilSent(30));
  EXPECT_EQ(protocol::kHello, harness.sent.opcode);
  harness.AnswerHello();
  ASSERT_TRUE(harness.RunUntilSent(30));
  harness.Answer(0, 0);
  EXPECT_EQ(0u, harness.counters().fail_safe_stops);
}

TEST(ErrorTest, OffTheMapStopsUntilAnAnswerComes) {
  Harness harness;
  harness.GreetAndServe(1500);
  ASSERT_TRUE(harness.RunUntilSent());
  harness.AnswerError(Reason::kOffTheMap);
  EXPECT_EQ(kStill, harness.conversation.state().wheels);
  EXPECT_EQ(kOffTheMap, harness.conversation.state().flags);
  ASSERT_TRUE(harness.RunUntilSent());  // it may have been carried back
  harness.Answer(0, 0);
  EXPECT_EQ(kStraight, harness.conversation.state().wheels);
}

TEST(ErrorTest, CoordinateOutOfRangeIsNeverSent) {
  for (const bool lay_trail : {false, true}) {
    Parameters parameters = TestParameters();
    parameters.lay_trail = lay_trail;
    Harness harness(parameters);
    harness.GreetAndServe(1500);
    harness.pose.x_mm = 32768;
    const uint32_t requests = harness.counters().requests;
    harness.Serve(400);
    EXPECT_EQ(requests, harness.counters().requests);
    EXPECT_EQ(kStill, harness.conversation.state().wheels);
    EXPECT_EQ(kOffTheMap, harness.conversation.state().flags);
    harness.pose.x_mm = 32767;
    harness.Serve(400);
    ASSERT_EQ(1u, harness.events.size());
    EXPECT_EQ(protocol::EventCode::kOffTheMap, harness.events[0].code);
    EXPECT_EQ(kStraight, harness.conversation.state().wheels);
  }
}

TEST(ErrorTest, FarAwayIsOffTheMapEvenForWideMessages) {
  Parameters parameters = TestParameters();
  parameters.wide = true;
  Harness harness(parameters);
  harness.pose.y_mm = kFarAway;
  harness.GreetAndServe(400);
  EXPECT_EQ(0u, harness.counters().requests);
  EXPECT_EQ(kNoAnswerYet | kOffTheMap, harness.conversation.state().flags);
}

TEST(ErrorTest, BusyServerIsAskedAgainWithTheSameRequest) {
  Harness harness(TraceParameters());
  harness.Greet();
  ASSERT_TRUE(harness.RunUntilSent());
  const std::vector<uint8_t> first = harness.wire;
  harness.AnswerError(Reason::kBusy, 1);
  ASSERT_TRUE(harness.RunUntilSent(16 * kTestSlotMs + 16));
  harness.SentSense();  // meanwhile
  harness.Answer(0, 0);
  ASSERT_TRUE(harness.RunUntilSent(16 * kTestSlotMs + 200));
  EXPECT_EQ(first, harness.wire);
  EXPECT_EQ(1u, harness.counters().retries);
  EXPECT_EQ(0u, harness.counters().timeouts);
}

TEST(ErrorTest, OtherReasonsGiveTheRequestUp) {
  Harness harness(TraceParameters());
  harness.Greet();
  ASSERT_TRUE(harness.RunUntilSent());
  const uint32_t period_ms = harness.began_ms;
  harness.AnswerError(Reason::kMapFull, 1);
  EXPECT_EQ(Reason::kMapFull, harness.conversation.requests().last_error);
  EXPECT_EQ(1u, harness.counters().lost_traces);
  ASSERT_TRUE(harness.RunUntilSent());
  EXPECT_EQ(2, harness.SentTrace().seq);
  EXPECT_GE(harness.began_ms - period_ms, 200u - 8 * kTestSlotMs);
}

// By another robot with the same ID, for example.
TEST(ErrorTest, ReusedNumberIsGivenUpForTheNext) {
  Harness harness(TraceParameters());
  harness.Greet();
  ASSERT_TRUE(harness.RunUntilSent());
  harness.AnswerError(Reason::kSequenceReused, 1);
  EXPECT_EQ(1u, harness.counters().lost_traces);
  ASSERT_TRUE(harness.RunUntilSent());
  EXPECT_EQ(2, harness.SentTrace().seq);
}

TEST(ErrorTest, RefusalOfAnotherRequestIsNotBelieved) {
  Harness harness(TraceParameters());
  harness.Greet();
  ASSERT_TRUE(harness.RunUntilSent());
  harness.AnswerError(Reason::kMapFull, 2);  // another seq
  harness.FeedEncoded(
      protocol::ErrorAnswer{kTestId, protocol::kTrace | 1, Reason::kMapFull, 1});  // another type
  EXPECT_EQ(0u, harness.counters().errors);
  EXPECT_EQ(2u, harness.counters().late_answers);
  harness.Answer(0, 0);
  EXPECT_EQ(kStraight, harness.conversation.state().wheels);
}

}  // namespace
}  // namespace client
}  // namespace pheromone
