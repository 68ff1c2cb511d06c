// How a conversation begins.
#include <gtest/gtest.h>

#include <set>

#include "client_fw/core/testing/conversation_harness.h"

namespace pheromone {
namespace client {
namespace {

using protocol::Reason;

TEST(HelloTest, IsSaidFirstWithTheBootCounter) {
  Parameters parameters = TestParameters();
  parameters.firmware_version = 3;
  parameters.period_ms = 130;
  Harness harness(parameters);
  ASSERT_TRUE(harness.RunUntilSent());
  protocol::HelloRequest hello;
  ASSERT_TRUE(Decode(harness.sent, &hello));
  EXPECT_EQ(kTestId, hello.id);
  EXPECT_EQ(0x1234, hello.nonce);
  EXPECT_EQ(3, hello.firmware_version);
  EXPECT_EQ(6, hello.round_period);  // in units of 20 ms
}

TEST(HelloTest, IsRepeatedWithGrowingBackOffUntilAnswered) {
  Harness harness;
  ASSERT_TRUE(harness.RunUntilSent());
  uint32_t window_ms = 101;  // before HELLO's answer
  for (const uint32_t half : {50u, 100u, 200u, 400u, 400u, 400u, 400u}) {
    const uint32_t missed_ms = harness.sent_ms + window_ms;
    window_ms = 256;  // the longest that a server can announce
    ASSERT_TRUE(harness.RunUntilSent());
    ASSERT_EQ(protocol::kHello, harness.sent.opcode);
    const uint32_t waited_ms = harness.began_ms - missed_ms;
    EXPECT_GE(waited_ms, half);
    EXPECT_LE(waited_ms, 2 * half + 20);  // a slot, as long as nobody has told how long it is
  }
  EXPECT_EQ(8u, harness.counters().hellos);
  EXPECT_EQ(7u, harness.counters().timeouts);
  EXPECT_FALSE(harness.conversation.requests().greeted);

  harness.AnswerHello();
  EXPECT_TRUE(harness.conversation.requests().greeted);
  harness.Serve(5000);
  EXPECT_EQ(8u, harness.counters().hellos);
}

TEST(HelloTest, AServerWithSlowModemsIsHeardAtTheSecondAttempt) {
  Harness harness;
  ASSERT_TRUE(harness.RunUntilSent());
  ASSERT_TRUE(harness.RunUntilSent());
  harness.Run(250);
  harness.AnswerHello();
  EXPECT_TRUE(harness.conversation.requests().greeted);
}

// Robots that were switched on together, or that a server's restart has made silent, would say it
// together for ever.
TEST(HelloTest, EachRepetitionHasADelayOfItsOwn) {
  std::set<uint32_t> of_one;
  std::set<uint32_t> of_many;
  for (uint8_t id = 1; id <= 20; ++id) {
    Parameters parameters = TestParameters();
    parameters.id = id;
    Harness harness(parameters);
    ASSERT_TRUE(harness.RunUntilSent());
    for (int repetition = 1; repetition <= 14; ++repetition) {
      const uint32_t missed_ms = harness.sent_ms + 101;
      ASSERT_TRUE(harness.RunUntilSent());
      if (id == 1 && repetition >= 4) {  // the back-off grows no more
        of_one.insert(harness.began_ms - missed_ms);
      }
      if (repetition == 4) {
        of_many.insert(harness.began_ms - missed_ms);
      }
    }
  }
  // In slots of 20 ms, of which 400 ms are 20.
  EXPECT_GE(of_one.size(), 5u);
  EXPECT_GE(of_many.size(), 8u);
}

TEST(HelloTest, WheelsStandStillUntilTheFirstIntensities) {
  Harness harness;
  harness.Run(700);
  EXPECT_EQ(kStill, harness.conversation.state().wheels);
  EXPECT_EQ(kNoAnswerYet, harness.conversation.state().flags);
  harness.Greet();
  EXPECT_EQ(kStill, harness.conversation.state().wheels);
  ASSERT_TRUE(harness.RunUntilSent());
  EXPECT_EQ(kStill, harness.conversation.state().wheels);
  harness.Answer(0, 0);
  EXPECT_EQ((WheelSpeeds{200, 200}), harness.conversation.state().wheels);
  EXPECT_EQ(0, harness.conversation.state().flags);
  EXPECT_EQ(0u, harness.counters().fail_safe_stops);
}

TEST(HelloTest, AnswerToAnotherBootIsNotBelieved) {
  Harness harness;
  ASSERT_TRUE(harness.RunUntilSent());
  harness.hello.nonce = 0x1235;
  harness.AnswerHello();
  EXPECT_FALSE(harness.conversation.requests().greeted);
  EXPECT_EQ(1u, harness.counters().late_answers);
  harness.hello.nonce = 0x1234;
  harness.AnswerHello();
  EXPECT_TRUE(harness.conversation.requests().greeted);
}

TEST(HelloTest, AnswerForAnotherRobotIsNotBelieved) {
  Harness harness;
  ASSERT_TRUE(harness.RunUntilSent());
  harness.hello.id = kTestId + 1;
  harness.AnswerHello();
  EXPECT_FALSE(harness.conversation.requests().greeted);
  EXPECT_EQ(1u, harness.counters().heard);
}

TEST(HelloTest, WrongVersionKeepsTheRobotStoppedAndAskingSlowly) {
  Harness harness;
  harness.hello.protocol_version = protocol::kProtocolVersion + 1;
  harness.Serve(20000);
  EXPECT_FALSE(harness.conversation.requests().greeted);
  EXPECT_EQ(kNoAnswerYet | kWrongVersion, harness.conversation.state().flags);
  EXPECT_EQ(kStill, harness.conversation.state().wheels);
  EXPECT_EQ(0u, harness.counters().requests);
  // 20 s in steps of 0.4 to 0.8 s, the first ones shorter.
  EXPECT_GE(harness.counters().hellos, 24u);
  EXPECT_LE(harness.counters().hellos, 54u);

  harness.hello.protocol_version = protocol::kProtocolVersion;
  harness.Serve(3000);
  EXPECT_EQ(0, harness.conversation.state().flags);
}

TEST(HelloTest, MissingTypeKeepsTheRobotStopped) {
  Harness harness;
  harness.hello.type_mask = 0x0002;  // type 1 only
  harness.Serve(3000);
  EXPECT_FALSE(harness.conversation.requests().greeted);
  EXPECT_EQ(kNoAnswerYet | kTypeMissing, harness.conversation.state().flags);
  EXPECT_EQ(0u, harness.counters().requests);

  harness.hello.type_mask = 0x0004;
  harness.Serve(3000);
  EXPECT_EQ(0, harness.conversation.state().flags);
  EXPECT_EQ((WheelSpeeds{200, 200}), harness.conversation.state().wheels);
}

TEST(HelloTest, TypeOutsideOfTheProtocolIsMissing) {
  Parameters parameters = TestParameters();
  parameters.type = 0;
  Harness harness(parameters);
  harness.hello.type_mask = 0xFFFF;
  harness.Serve(1000);
  EXPECT_EQ(kNoAnswerYet | kTypeMissing, harness.conversation.state().flags);
}

TEST(HelloTest, RefusalIsAnsweredByLaterHellos) {
  Harness harness;
  ASSERT_TRUE(harness.RunUntilSent());
  harness.AnswerError(Reason::kBusy);
  EXPECT_EQ(1u, harness.counters().errors);
  EXPECT_EQ(Reason::kBusy, harness.conversation.requests().last_error);
  harness.Greet();
}

TEST(HelloTest, CountsNewEpochs) {
  Harness harness;
  harness.Greet();
  EXPECT_EQ(1u, harness.counters().epochs);  // the memory knew of epoch 0
  ASSERT_TRUE(harness.RunUntilSent());
  harness.AnswerError(Reason::kSayHello);
  harness.Greet();
  EXPECT_EQ(1u, harness.counters().epochs);
  ASSERT_TRUE(harness.RunUntilSent());
  harness.AnswerError(Reason::kSayHello);
  harness.hello.epoch = 10;
  harness.Greet();
  EXPECT_EQ(2u, harness.counters().epochs);
  EXPECT_EQ(10, harness.memory.epoch);
}

TEST(HelloTest, ServersParametersAreKept) {
  Harness harness;
  harness.Greet();
  EXPECT_EQ(100, harness.conversation.server().pose_unit_10um);
  EXPECT_EQ(200, harness.conversation.server().antenna_distance_mm);
  EXPECT_EQ(kTestWindowMs, harness.conversation.server().response_window_ms);
}

}  // namespace
}  // namespace client
}  // namespace pheromone
