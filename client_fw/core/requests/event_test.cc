// EVENTs, settings over the radio, the load, and trails that are lost.
#include <gtest/gtest.h>

#include "client_fw/core/testing/conversation_harness.h"

namespace pheromone {
namespace client {
namespace {

using protocol::Command;
using protocol::CommandCode;
using protocol::EventCode;
using protocol::Reason;

class EventTest : public testing::Test {
 protected:
  EventTest() { harness_.GreetAndServe(1500); }

  // Sends a COMMAND and returns the result of its ACK.
  int16_t Send(CommandCode code, uint8_t id = 0, uint32_t value = 0) {
    Command command;
    command.id = kTestId;
    command.seq = ++seq_;
    command.code = code;
    command.arguments[0] = id;
    protocol::PutU32(command.arguments + 1, value);
    do {  // to a quiet place
      EXPECT_TRUE(harness_.RunUntilSent());
      if (harness_.sent.opcode == protocol::kEvent) {
        harness_.AnswerEvent();
      } else {
        harness_.Answer(0, 0);
      }
    } while (harness_.sent.opcode == protocol::kEvent);
    harness_.FeedEncoded(command);
    protocol::CommandAck ack;
    ack.result = -1;
    EXPECT_TRUE(harness_.RunUntilSent(17));
    EXPECT_TRUE(Decode(harness_.sent, &ack));
    EXPECT_EQ(seq_, ack.seq);
    return ack.result;
  }

  void ExpectEvent(EventCode code, int16_t argument = 0) {
    harness_.Serve(600);
    ASSERT_EQ(1u, harness_.events.size());
    EXPECT_EQ(code, harness_.events[0].code);
    EXPECT_EQ(argument, harness_.events[0].argument);
    harness_.events.clear();
  }

  Harness harness_;
  uint8_t seq_ = 0;
};

TEST_F(EventTest, LoadIsPickedAndDroppedAndReported) {
  EXPECT_FALSE(harness_.conversation.state().load);
  EXPECT_EQ(0, Send(CommandCode::kPickLoad));
  EXPECT_TRUE(harness_.conversation.state().load);
  ExpectEvent(EventCode::kLoadPicked);
  EXPECT_EQ(0, Send(CommandCode::kDropLoad));
  EXPECT_FALSE(harness_.conversation.state().load);
  ExpectEvent(EventCode::kLoadDropped);
  EXPECT_EQ(2u, harness_.counters().events);
}

TEST_F(EventTest, ParameterIsSetAtOnceAndToBeSaved) {
  EXPECT_EQ(0, Send(CommandCode::kSetParameter, kSpeedSetting, 321));
  EXPECT_EQ((WheelSpeeds{321, 321}), harness_.conversation.state().wheels);
  EXPECT_TRUE(harness_.conversation.behaviour()->Take(kSaveSettings));
  EXPECT_FALSE(harness_.conversation.behaviour()->Take(kSaveSettings));
  EXPECT_EQ(0, Send(CommandCode::kGetParameter, kSpeedSetting));
  ExpectEvent(EventCode::kParameterValue, 321);
}

TEST_F(EventTest, WhatIsRefusedIsNotSaved) {
  EXPECT_EQ(static_cast<int>(Reason::kBadValue),
            Send(CommandCode::kSetParameter, kSpeedSetting, 2201));
  EXPECT_EQ(static_cast<int>(Reason::kBadValue),
            Send(CommandCode::kSetParameter, kSpeedSetting, 0x10000u));
  EXPECT_EQ(static_cast<int>(Reason::kBadValue), Send(CommandCode::kSetParameter, 99, 1));
  EXPECT_EQ(static_cast<int>(Reason::kBadValue), Send(CommandCode::kGetParameter, 99));
  EXPECT_EQ(static_cast<int>(Reason::kUnknownPheromone),
            Send(CommandCode::kSetParameter, kTypeSetting, 3));
  EXPECT_EQ(2, harness_.conversation.state().parameters.type);
  EXPECT_EQ(200, harness_.conversation.state().parameters.speed_mm_s);
  EXPECT_FALSE(harness_.conversation.behaviour()->Take(kSaveSettings));
  harness_.Serve(600);
  EXPECT_TRUE(harness_.events.empty());
}

TEST_F(EventTest, CommandsThatLastForNowAreNotSaved) {
  EXPECT_EQ(0, Send(CommandCode::kFollowType, 1));
  EXPECT_EQ(0, Send(CommandCode::kSpeed, 100));
  EXPECT_EQ(100, harness_.conversation.state().parameters.speed_mm_s);
  EXPECT_FALSE(harness_.conversation.behaviour()->Take(kSaveSettings));
}

TEST_F(EventTest, IsRepeatedToTheByteUntilItIsAnsweredAndHoldsUpItsSuccessor) {
  EXPECT_EQ(0, Send(CommandCode::kPickLoad));
  harness_.Serve(1);
  do {
    ASSERT_TRUE(harness_.RunUntilSent());
    if (harness_.sent.opcode != protocol::kEvent) {
      harness_.Answer(0, 0);
    }
  } while (harness_.sent.opcode != protocol::kEvent);
  const std::vector<uint8_t> first = harness_.wire;
  for (int i = 0; i < 8; ++i) {  // over the retries of a period
    ASSERT_TRUE(harness_.RunUntilSent());
    if (harness_.sent.opcode == protocol::kHello) {
      harness_.AnswerHello();
    } else if (harness_.sent.opcode == protocol::kEvent) {
      EXPECT_EQ(first, harness_.wire);
    }
  }
  while (harness_.sent.opcode != protocol::kEvent) {
    ASSERT_TRUE(harness_.RunUntilSent());
  }
  harness_.AnswerEvent();
  ASSERT_TRUE(harness_.RunUntilSent());
  EXPECT_EQ(protocol::kSense | 2, harness_.sent.opcode);
  harness_.Answer(0, 0);
  EXPECT_EQ(kStraight, harness_.conversation.state().wheels);
  EXPECT_EQ(0u, harness_.counters().lost_traces);
}

TEST_F(EventTest, AnswerWithAnotherSeqIsNotBelieved) {
  EXPECT_EQ(0, Send(CommandCode::kPickLoad));
  do {
    ASSERT_TRUE(harness_.RunUntilSent());
    if (harness_.sent.opcode != protocol::kEvent) {
      harness_.Answer(0, 0);
    }
  } while (harness_.sent.opcode != protocol::kEvent);
  const uint8_t seq = harness_.sent.data[0];
  harness_.FeedEncoded(protocol::EventAck{kTestId, static_cast<uint8_t>(seq + 1)});
  EXPECT_EQ(0u, harness_.counters().events);
  harness_.FeedEncoded(protocol::EventAck{kTestId, seq});
  EXPECT_EQ(1u, harness_.counters().events);
}

TEST_F(EventTest, SharesItsCounterWithTraces) {
  Parameters parameters = TestParameters();
  parameters.lay_trail = true;
  Harness harness(parameters);
  harness.hello.last_seq = 10;
  harness.Greet();
  ASSERT_TRUE(harness.RunUntilSent());
  EXPECT_EQ(11, harness.SentTrace().seq);
  harness.AnswerError(Reason::kOffTheMap, 11);  // which is an event
  ASSERT_TRUE(harness.RunUntilSent());
  EXPECT_EQ(12, harness.SentTrace().seq);
  harness.Answer(0, 0);
  ASSERT_TRUE(harness.RunUntilSent());
  ASSERT_EQ(protocol::kEvent, harness.sent.opcode);
  EXPECT_EQ(13, harness.sent.data[0]);
  harness.AnswerEvent();
  EXPECT_EQ(EventCode::kOffTheMap, harness.events[0].code);
  ASSERT_TRUE(harness.RunUntilSent());
  EXPECT_EQ(14, harness.SentTrace().seq);
}

TEST_F(EventTest, OffTheMapIsReportedAlthoughNothingCanBeAsked) {
  harness_.pose.x_mm = 40000;
  harness_.Serve(600);
  ASSERT_EQ(1u, harness_.events.size());  // once, not every period
  EXPECT_EQ(EventCode::kOffTheMap, harness_.events[0].code);
  EXPECT_EQ(kStill, harness_.conversation.state().wheels);
}

TEST_F(EventTest, FailSafeStopIsReportedWhenTheServerIsBack) {
  harness_.Run(1500);
  EXPECT_EQ(kFailSafe, harness_.conversation.state().flags);
  harness_.Serve(1500);
  ASSERT_EQ(1u, harness_.events.size());
  EXPECT_EQ(EventCode::kFailSafeStop, harness_.events[0].code);
}

Parameters LosingParameters(LostTrail behaviour) {
  Parameters parameters = TestParameters();
  parameters.lost_after_ms = 1000;
  parameters.faintest = 10;
  parameters.lost_trail = behaviour;
  return parameters;
}

TEST(LostTrailTest, IsReportedOnceAfterTheTimeAndEndsWithASmell) {
  Harness harness(LosingParameters(LostTrail::kStop));
  harness.GreetAndServe(2000, 10, 0);
  harness.Serve(700, 9, -9);
  EXPECT_FALSE(harness.conversation.state().trail_lost);
  EXPECT_NE(kStill, harness.conversation.state().wheels);
  harness.Serve(1400, 9, -9);
  EXPECT_TRUE(harness.conversation.state().trail_lost);
  EXPECT_EQ(kTrailLost, harness.conversation.state().flags);
  EXPECT_EQ(kStill, harness.conversation.state().wheels);
  ASSERT_EQ(1u, harness.events.size());
  EXPECT_EQ(EventCode::kTrailLost, harness.events[0].code);
  harness.Serve(300, 0, -10);  // a repellent is also sensed
  EXPECT_FALSE(harness.conversation.state().trail_lost);
  EXPECT_EQ(0, harness.conversation.state().flags);
  EXPECT_NE(kStill, harness.conversation.state().wheels);
  EXPECT_EQ(1u, harness.events.size());
}

// Each antenna by itself, and of either sign.
TEST(LostTrailTest, FromTheFaintestIntensityOnSomethingIsSensed) {
  const struct {
    int16_t left;
    int16_t right;
    bool is_sensed;
  } cases[] = {{10, 0, true}, {0, 10, true}, {-10, 0, true}, {0, -10, true},  //
               {9, 0, false}, {0, 9, false}, {-9, 0, false}, {0, -9, false},  //
               {0, 0, false}, {9, 9, false}, {-9, -9, false}};
  for (const auto& it : cases) {
    for (const uint8_t faintest : {uint8_t{10}, uint8_t{0}}) {
      Parameters parameters = LosingParameters(LostTrail::kStop);
      parameters.faintest = faintest;
      Harness harness(parameters);
      harness.GreetAndServe(3000, it.left, it.right);
      EXPECT_EQ(faintest == 10 && !it.is_sensed, harness.conversation.state().trail_lost)
          << it.left << ", " << it.right << " of " << int{faintest};
    }
  }
}

TEST(LostTrailTest, StraightIsStraightForEveryLaw) {
  for (const Law law : {Law::kDifferential, Law::kPaper, Law::kFuzzy}) {
    Parameters parameters = LosingParameters(LostTrail::kStraight);
    parameters.law = law;
    Harness harness(parameters);
    harness.GreetAndServe(4000, 0, 0);
    EXPECT_TRUE(harness.conversation.state().trail_lost);
    EXPECT_EQ(kStraight, harness.conversation.state().wheels);
  }
}

// On the spot, at 100 mm/s, towards the side where more was sensed last; then it stands.
TEST(LostTrailTest, SearchTurnsToTheLastSideFromTheFirstEmptyAnswerAndEndsAtAStand) {
  for (const Law law : {Law::kCareful, Law::kDifferential, Law::kPaper, Law::kFuzzy}) {
    for (const bool left : {false, true}) {
      Parameters parameters = LosingParameters(LostTrail::kSearch);
      parameters.law = law;
      Harness harness(parameters);
      harness.GreetAndServe(1000, left ? 900 : 800, left ? 800 : 900);
      harness.Serve(300);  // a period and an exchange
      const WheelSpeeds searching = left ? WheelSpeeds{-100, 100} : WheelSpeeds{100, -100};
      EXPECT_EQ(searching, harness.conversation.state().wheels);
      EXPECT_FALSE(harness.conversation.state().trail_lost);
      EXPECT_TRUE(harness.events.empty());
      harness.Serve(1300);
      EXPECT_EQ(kStill, harness.conversation.state().wheels);
      EXPECT_EQ(kTrailLost, harness.conversation.state().flags);
      ASSERT_EQ(1u, harness.events.size());
      EXPECT_EQ(EventCode::kTrailLost, harness.events[0].code);
      harness.Serve(300, 4096, 4096);
      EXPECT_EQ(0, harness.conversation.state().flags);
      EXPECT_NE(searching, harness.conversation.state().wheels);
    }
  }
}

TEST(LostTrailTest, SearchIsNoFasterThanTheRobotMayDrive) {
  Parameters parameters = LosingParameters(LostTrail::kSearch);
  parameters.speed_mm_s = 60;
  Harness harness(parameters);
  harness.GreetAndServe(1000, 800, 900);
  harness.Serve(300);
  EXPECT_EQ((WheelSpeeds{60, -60}), harness.conversation.state().wheels);
}

// Switched on where there is nothing, it does not drive away.
TEST(LostTrailTest, ByDefaultARobotThatNeverSensedATrailLooksAroundAndStands) {
  Parameters parameters;
  parameters.id = kTestId;
  parameters.type = 2;
  parameters.start_released = true;
  Harness harness(parameters);
  harness.Greet();
  bool looked = false;
  for (int i = 0; i < 70; ++i) {
    harness.Serve(100);
    const WheelSpeeds wheels = harness.conversation.state().wheels;
    looked |= wheels.left_mm_s != 0;
    ASSERT_EQ(0, wheels.left_mm_s + wheels.right_mm_s);
  }
  EXPECT_TRUE(looked);
  EXPECT_EQ(kStill, harness.conversation.state().wheels);
  EXPECT_EQ(kTrailLost, harness.conversation.state().flags);
}

TEST(LostTrailTest, SpiralTurnsLeftInWideningCircles) {
  Harness harness(LosingParameters(LostTrail::kSpiral));
  harness.GreetAndServe(2000);
  int last_left = 0;
  for (int i = 0; i < 20; ++i) {
    harness.Serve(1000);
    const WheelSpeeds wheels = harness.conversation.state().wheels;
    EXPECT_EQ(200, wheels.right_mm_s);
    EXPECT_GT(wheels.left_mm_s, last_left);
    EXPECT_LT(wheels.left_mm_s, 200);
    last_left = wheels.left_mm_s;
    if (last_left > 190) {
      break;
    }
  }
  harness.Serve(500, 4096, 4096);
  EXPECT_EQ(kStraight, harness.conversation.state().wheels);
}

TEST(LostTrailTest, FailSafeStopsALostRobotToo) {
  Harness harness(LosingParameters(LostTrail::kSpiral));
  harness.GreetAndServe(3000);
  EXPECT_NE(kStill, harness.conversation.state().wheels);
  harness.Run(600);
  EXPECT_EQ(kStill, harness.conversation.state().wheels);
  EXPECT_EQ(kFailSafe, harness.conversation.state().flags);
}

TEST(LostTrailTest, NeverMeansNever) {
  Parameters parameters = LosingParameters(LostTrail::kStop);
  parameters.lost_after_ms = 0;
  Harness harness(parameters);
  harness.GreetAndServe(5000);
  EXPECT_EQ(kStraight, harness.conversation.state().wheels);
  EXPECT_TRUE(harness.events.empty());
}

}  // namespace
}  // namespace client
}  // namespace pheromone
