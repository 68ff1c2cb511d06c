// Buffered links (TCP, UDP, USB, pty): an answer may come when its request has long been given up.
#include <gtest/gtest.h>

#include "client_fw/core/testing/conversation_harness.h"

namespace pheromone {
namespace client {
namespace {

Parameters BufferedParameters() {
  Parameters parameters = TestParameters();
  parameters.buffered_link = true;
  parameters.rounds = false;
  parameters.gap_timeout_ms = protocol::kNoGapTimeout;
  return parameters;
}

TEST(ResyncTest, PingAfterATimeoutIsPrecededByAPadByte) {
  Harness harness(BufferedParameters());
  harness.Greet();
  ASSERT_TRUE(harness.RunUntilSent());
  EXPECT_EQ(protocol::kDle, harness.wire[0]);
  ASSERT_TRUE(harness.RunUntilSent());
  EXPECT_EQ(protocol::kPing, harness.sent.opcode);
  EXPECT_EQ(0x00, harness.wire[0]);
  EXPECT_EQ(protocol::kDle, harness.wire[1]);
  EXPECT_EQ(1u, harness.counters().resyncs);
}

// Whoever hears others is on a radio channel, where a PING takes the place of a request.
TEST(ResyncTest, NotOnAChannelThatOthersShare) {
  for (const bool with_others : {false, true}) {
    Harness harness(BufferedParameters());
    harness.GreetAndServe(1500);
    if (with_others) {
      protocol::Message other;
      Encode(protocol::SenseAnswer{8, 2, false, 0, 0}, &other);
      harness.Feed(other);
    }
    ASSERT_TRUE(harness.RunUntilSent());
    ASSERT_EQ(2, harness.SentSense().type);
    ASSERT_TRUE(harness.RunUntilSent());
    EXPECT_EQ(harness.sent.opcode == protocol::kPing, !with_others);
    EXPECT_EQ(harness.counters().resyncs, with_others ? 0u : 1u);
  }
}

TEST(ResyncTest, PadByteFreesAReceiverStuckAnywhereInAFrame) {
  Harness harness(BufferedParameters());
  harness.Greet();
  ASSERT_TRUE(harness.RunUntilSent());
  const std::vector<uint8_t> broken = harness.wire;
  ASSERT_TRUE(harness.RunUntilSent());
  for (size_t cut = 0; cut <= broken.size(); ++cut) {
    protocol::FrameDecoder server(protocol::kNoGapTimeout);
    for (size_t i = 0; i < cut; ++i) {
      server.Push(broken[i], 0);
    }
    server.Push(protocol::kDle, 0);  // the worst place
    bool complete = false;
    for (const uint8_t byte : harness.wire) {
      complete = server.Push(byte, 0);
    }
    EXPECT_TRUE(complete) << cut;
  }
}

TEST(ResyncTest, LateAnswerIsNotSteeredOn) {
  Harness harness(BufferedParameters());
  harness.GreetAndServe(1500);
  ASSERT_TRUE(harness.RunUntilSent());
  const protocol::Message late = harness.AnswerToSent(4096, 0);
  harness.Run(kTestWindowMs + 1);
  harness.Feed(late);  // in the back-off
  EXPECT_EQ(kStraight, harness.conversation.state().wheels);
  ASSERT_TRUE(harness.RunUntilSent());
  ASSERT_EQ(protocol::kPing, harness.sent.opcode);
  harness.Feed(late);  // before the echo
  EXPECT_EQ(kStraight, harness.conversation.state().wheels);
  EXPECT_EQ(2u, harness.counters().late_answers);
  harness.AnswerPing();
  ASSERT_TRUE(harness.RunUntilSent());
  EXPECT_EQ(2, harness.SentSense().type);
  harness.Answer(0, 4096);
  EXPECT_EQ((WheelSpeeds{200, 0}), harness.conversation.state().wheels);
}

// The case the PING is for: without it, the answer to the first request would be taken for the
// answer to the second.
TEST(ResyncTest, AnswersOfADelayedStreamAreSortedOut) {
  Harness harness(BufferedParameters());
  harness.GreetAndServe(1500);
  std::vector<protocol::Message> delayed;
  ASSERT_TRUE(harness.RunUntilSent());
  delayed.push_back(harness.AnswerToSent(4096, 0));
  ASSERT_TRUE(harness.RunUntilSent());
  ASSERT_EQ(protocol::kPing, harness.sent.opcode);
  delayed.push_back(harness.sent);
  delayed.back().opcode = protocol::kPingAnswer;
  ASSERT_TRUE(harness.RunUntilSent());  // that PING has timed out too
  ASSERT_EQ(protocol::kPing, harness.sent.opcode);
  for (const protocol::Message& message : delayed) {
    harness.Feed(message);
  }
  EXPECT_EQ(kStraight, harness.conversation.state().wheels);
  EXPECT_EQ(2u, harness.counters().late_answers);
  EXPECT_EQ(2u, harness.counters().resyncs);
  harness.AnswerPing();
  ASSERT_TRUE(harness.RunUntilSent());
  EXPECT_EQ(2, harness.SentSense().type);
}

TEST(ResyncTest, EachPingIsFresh) {
  Harness harness(BufferedParameters());
  harness.Greet();
  ASSERT_TRUE(harness.RunUntilSent());
  ASSERT_TRUE(harness.RunUntilSent());
  const std::vector<uint8_t> first = harness.wire;
  ASSERT_TRUE(harness.RunUntilSent());
  ASSERT_EQ(protocol::kPing, harness.sent.opcode);
  EXPECT_NE(first, harness.wire);
}

TEST(ResyncTest, EchoOfAnotherLengthIsNotBelieved) {
  Harness harness(BufferedParameters());
  harness.Greet();
  ASSERT_TRUE(harness.RunUntilSent());
  ASSERT_TRUE(harness.RunUntilSent());
  protocol::Message echo = harness.sent;
  echo.opcode = protocol::kPingAnswer;
  echo.length = static_cast<uint8_t>(echo.length - 1);
  harness.Feed(echo);
  EXPECT_EQ(1u, harness.counters().late_answers);
}

TEST(ResyncTest, SilenceMeansHelloFirstAndThenThePing) {
  Harness harness(BufferedParameters());
  harness.GreetAndServe(1500);
  harness.Run(200 * kTestSlotMs);
  while (harness.sent.opcode != protocol::kHello) {
    ASSERT_TRUE(harness.RunUntilSent());
  }
  harness.AnswerHello();
  ASSERT_TRUE(harness.RunUntilSent());
  ASSERT_EQ(protocol::kPing, harness.sent.opcode);
  harness.AnswerPing();
  ASSERT_TRUE(harness.RunUntilSent());
  harness.Answer(0, 0);
  EXPECT_EQ(kStraight, harness.conversation.state().wheels);
}

// Such a link loses nothing: the server's log is slow, or another server has to take over.
TEST(ResyncTest, AfterTheEchoTheRobotSensesAndThenRepeatsItsTrace) {
  Parameters parameters = BufferedParameters();
  parameters.lay_trail = true;
  Harness harness(parameters);
  harness.Greet();
  ASSERT_TRUE(harness.RunUntilSent());
  const std::vector<uint8_t> first = harness.wire;
  const protocol::Message late = harness.AnswerToSent(0, 0);
  ASSERT_TRUE(harness.RunUntilSent());
  harness.Feed(late);
  harness.AnswerPing();
  ASSERT_TRUE(harness.RunUntilSent());
  harness.SentSense();
  harness.Answer(0, 0);
  EXPECT_EQ(kStraight, harness.conversation.state().wheels);
  ASSERT_TRUE(harness.RunUntilSent());
  EXPECT_EQ(first, harness.wire);  // the server repeats its stored answer
  harness.Answer(0, 0);
  ASSERT_TRUE(harness.RunUntilSent());
  harness.SentSense();  // since the change's intensities were old
}

TEST(ResyncTest, GreetingAgainGoesOnWithTheSameNumbers) {
  Parameters parameters = BufferedParameters();
  parameters.lay_trail = true;
  Harness harness(parameters);
  harness.Greet();
  ASSERT_TRUE(harness.RunUntilSent());
  const std::vector<uint8_t> first = harness.wire;
  harness.conversation.GreetAgain();
  ASSERT_TRUE(harness.RunUntilSent());
  protocol::HelloRequest hello;
  ASSERT_TRUE(Decode(harness.sent, &hello));
  EXPECT_EQ(0x1234, hello.nonce);
  harness.hello.last_seq = first[4];
  harness.AnswerHello();
  ASSERT_TRUE(harness.RunUntilSent());
  EXPECT_EQ(first, harness.wire);  // the epoch is the same, and it is unanswered
  harness.conversation.GreetAgain();
  ASSERT_TRUE(harness.RunUntilSent());
  ++harness.hello.epoch;
  harness.AnswerHello();
  ASSERT_TRUE(harness.RunUntilSent());
  EXPECT_NE(first, harness.wire);
  EXPECT_EQ(first[4] + 1, harness.SentTrace().seq);
}

TEST(ResyncTest, UnbufferedLinkDoesNotPing) {
  Harness harness;
  harness.Greet();
  ASSERT_TRUE(harness.RunUntilSent());
  ASSERT_TRUE(harness.RunUntilSent());
  EXPECT_EQ(protocol::kSense | 2, harness.sent.opcode);
  EXPECT_EQ(protocol::kDle, harness.wire[0]);
}

}  // namespace
}  // namespace client
}  // namespace pheromone
