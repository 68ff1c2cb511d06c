// COMMANDs are executed once and acknowledged as often as they come.
#include <gtest/gtest.h>

#include "client_fw/core/testing/conversation_harness.h"

namespace pheromone {
namespace client {
namespace {

using protocol::Command;
using protocol::CommandCode;
using protocol::Reason;

class CommandTest : public testing::Test {
 protected:
  // In the quiet part of a period, where the ACK is the next frame.
  CommandTest() {
    harness_.GreetAndServe(1500);
    EXPECT_TRUE(harness_.RunUntilSent());
    harness_.Answer(0, 0);
    EXPECT_EQ(kStraight, harness_.conversation.state().wheels);
  }

  void Send(uint8_t seq, CommandCode code, int argument = 0) {
    Command command;
    command.id = kTestId;
    command.seq = seq;
    command.code = code;
    command.arguments[0] = static_cast<uint8_t>(argument & 0xFF);
    command.arguments[1] = static_cast<uint8_t>((argument >> 8) & 0xFF);
    harness_.FeedEncoded(command);
  }

  void ExpectAck(uint8_t seq, CommandCode code, Reason result) {
    ASSERT_TRUE(harness_.RunUntilSent(17));
    protocol::CommandAck ack;
    ASSERT_TRUE(Decode(harness_.sent, &ack));
    EXPECT_EQ(kTestId, ack.id);
    EXPECT_EQ(seq, ack.seq);
    EXPECT_EQ(code, ack.code);
    EXPECT_EQ(static_cast<int16_t>(result), ack.result);
  }

  Harness harness_;
};

TEST_F(CommandTest, HaltAndResume) {
  Send(1, CommandCode::kHalt);
  EXPECT_EQ(kStill, harness_.conversation.state().wheels);
  EXPECT_EQ(kHalted, harness_.conversation.state().flags);
  ExpectAck(1, CommandCode::kHalt, Reason::kNone);
  harness_.Serve(1000);
  ASSERT_TRUE(harness_.RunUntilSent());
  harness_.Answer(0, 0);
  EXPECT_EQ(kStill, harness_.conversation.state().wheels);
  Send(2, CommandCode::kResume);
  EXPECT_EQ(kStraight, harness_.conversation.state().wheels);
  ExpectAck(2, CommandCode::kResume, Reason::kNone);
}

TEST_F(CommandTest, HaltOutlastsAFailSafeStop) {
  Send(1, CommandCode::kHalt);
  harness_.Run(2000);
  harness_.Serve(2000);
  EXPECT_EQ(kHalted, harness_.conversation.state().flags);
}

TEST_F(CommandTest, SpeedTakesEffectAtOnce) {
  Send(1, CommandCode::kSpeed, 350);
  EXPECT_EQ((WheelSpeeds{350, 350}), harness_.conversation.state().wheels);
  EXPECT_EQ(350, harness_.conversation.state().parameters.speed_mm_s);
  ExpectAck(1, CommandCode::kSpeed, Reason::kNone);
}

TEST_F(CommandTest, SpeedOutOfRangeIsABadValue) {
  Send(1, CommandCode::kSpeed, -1);
  ExpectAck(1, CommandCode::kSpeed, Reason::kBadValue);
  Send(2, CommandCode::kSpeed, 1001);
  ExpectAck(2, CommandCode::kSpeed, Reason::kBadValue);
  EXPECT_EQ(kStraight, harness_.conversation.state().wheels);
  EXPECT_EQ(2u, harness_.counters().refused_commands);
}

TEST_F(CommandTest, FollowTypeChangesWhatIsAskedFor) {
  Send(1, CommandCode::kFollowType, 1);
  ExpectAck(1, CommandCode::kFollowType, Reason::kNone);
  ASSERT_TRUE(harness_.RunUntilSent());
  EXPECT_EQ(1, harness_.SentSense().type);
}

TEST_F(CommandTest, FollowTypeThatDoesNotExistIsRefused) {
  Send(1, CommandCode::kFollowType, 3);
  ExpectAck(1, CommandCode::kFollowType, Reason::kUnknownPheromone);
  Send(2, CommandCode::kFollowType, 16);
  ExpectAck(2, CommandCode::kFollowType, Reason::kBadValue);
  EXPECT_EQ(2, harness_.conversation.state().parameters.type);
}

TEST_F(CommandTest, GoToIsNotPermitted) {
  Send(1, CommandCode::kGoTo, 500);
  ExpectAck(1, CommandCode::kGoTo, Reason::kNotPermitted);
}

TEST_F(CommandTest, UnknownOrMalformedCommandIsNotAcknowledged) {
  protocol::Message message;
  message.id = kTestId;
  message.opcode = protocol::kCommand;
  message.length = 2;
  message.data[0] = 1;
  message.data[1] = 99;
  harness_.Feed(message);
  message.data[1] = static_cast<uint8_t>(CommandCode::kSpeed);  // without its argument
  harness_.Feed(message);
  EXPECT_EQ(2u, harness_.counters().malformed);
  EXPECT_FALSE(harness_.RunUntilSent(50));
}

TEST_F(CommandTest, RepetitionIsAcknowledgedAgainButNotExecuted) {
  Send(1, CommandCode::kSpeed, 350);
  ExpectAck(1, CommandCode::kSpeed, Reason::kNone);
  Send(2, CommandCode::kHalt);
  ExpectAck(2, CommandCode::kHalt, Reason::kNone);
  Send(3, CommandCode::kResume);
  ExpectAck(3, CommandCode::kResume, Reason::kNone);
  Send(3, CommandCode::kResume);
  ExpectAck(3, CommandCode::kResume, Reason::kNone);
  EXPECT_EQ(3u, harness_.counters().commands);
  EXPECT_EQ(1u, harness_.counters().repeated_commands);
  EXPECT_EQ(4u, harness_.counters().acks);

  Send(4, CommandCode::kSpeed, 9999);
  ExpectAck(4, CommandCode::kSpeed, Reason::kBadValue);
  Send(4, CommandCode::kSpeed, 9999);
  ExpectAck(4, CommandCode::kSpeed, Reason::kBadValue);  // the stored result
}

TEST_F(CommandTest, NewEpochForgetsTheLastCommand) {
  Send(1, CommandCode::kSpeed, 350);
  ExpectAck(1, CommandCode::kSpeed, Reason::kNone);
  ASSERT_TRUE(harness_.RunUntilSent());
  harness_.AnswerError(Reason::kSayHello);
  ASSERT_TRUE(harness_.RunUntilSent());
  harness_.hello.epoch = 10;
  harness_.AnswerHello();
  Send(1, CommandCode::kSpeed, 100);
  EXPECT_EQ(100, harness_.conversation.state().parameters.speed_mm_s);
}

TEST_F(CommandTest, SameEpochRemembersTheLastCommand) {
  Send(1, CommandCode::kSpeed, 350);
  ExpectAck(1, CommandCode::kSpeed, Reason::kNone);
  ASSERT_TRUE(harness_.RunUntilSent());
  harness_.AnswerError(Reason::kSayHello);
  ASSERT_TRUE(harness_.RunUntilSent());
  harness_.AnswerHello();
  Send(1, CommandCode::kSpeed, 350);
  EXPECT_EQ(1u, harness_.counters().repeated_commands);
}

TEST_F(CommandTest, BroadcastHaltIsObeyedWithoutAck) {
  Command command;
  command.id = protocol::kBroadcastId;
  command.code = CommandCode::kHalt;
  for (int i = 0; i < 3; ++i) {
    harness_.FeedEncoded(command);
  }
  EXPECT_EQ(kHalted, harness_.conversation.state().flags);
  EXPECT_FALSE(harness_.RunUntilSent(50));
  EXPECT_EQ(0u, harness_.counters().acks);
}

TEST_F(CommandTest, BroadcastHaltOfAWrongLengthIsIgnored) {
  protocol::Message message;
  message.id = protocol::kBroadcastId;
  message.opcode = protocol::kCommand;
  message.data[1] = static_cast<uint8_t>(CommandCode::kHalt);
  for (const uint8_t length : {uint8_t{0}, uint8_t{1}, uint8_t{3}, uint8_t{64}}) {
    message.length = length;
    harness_.Feed(message);
  }
  EXPECT_EQ(kStraight, harness_.conversation.state().wheels);
}

TEST_F(CommandTest, OtherBroadcastsAndOthersCommandsAreIgnored) {
  Command command;
  command.id = protocol::kBroadcastId;
  command.code = CommandCode::kSpeed;
  harness_.FeedEncoded(command);
  command.id = kTestId + 1;
  command.code = CommandCode::kHalt;
  harness_.FeedEncoded(command);
  EXPECT_EQ(kStraight, harness_.conversation.state().wheels);
  EXPECT_EQ(0u, harness_.counters().commands);
}

TEST_F(CommandTest, AckWaitsForTheChannelButNotLongerThanTheWindow) {
  harness_.busy = true;
  Send(1, CommandCode::kHalt);
  harness_.Run(kTestWindowMs - 1);
  EXPECT_FALSE(harness_.leaving);
  harness_.busy = false;
  ExpectAck(1, CommandCode::kHalt, Reason::kNone);
  harness_.busy = true;
  Send(2, CommandCode::kResume);
  harness_.Run(kTestWindowMs + 1);
  harness_.busy = false;
  EXPECT_FALSE(harness_.RunUntilSent(50));
  EXPECT_EQ(1u, harness_.counters().dropped_acks);
  EXPECT_EQ(kStraight, harness_.conversation.state().wheels);
}

TEST_F(CommandTest, CommandInTheMiddleOfAnExchangeLeavesItIntact) {
  ASSERT_TRUE(harness_.RunUntilSent());
  const protocol::Message answer = harness_.AnswerToSent(2048, 0);
  Send(1, CommandCode::kSpeed, 100);
  harness_.Run(5);
  EXPECT_FALSE(harness_.leaving);  // the answer's turn
  harness_.Feed(answer);
  EXPECT_EQ((WheelSpeeds{50, 100}), harness_.conversation.state().wheels);
  ExpectAck(1, CommandCode::kSpeed, Reason::kNone);
}

}  // namespace
}  // namespace client
}  // namespace pheromone
