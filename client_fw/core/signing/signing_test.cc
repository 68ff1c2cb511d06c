// A robot's end of a signed link against a server's that is naive (testing/naive_signer.h).
#include "client_fw/core/signing/signing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "client_fw/core/testing/naive_signer.h"
#include "protocol/frame.h"
#include "protocol/opcodes.h"

namespace pheromone {
namespace client {
namespace {

using protocol::Message;

constexpr uint8_t kId = 7;

Message MessageOf(uint8_t id, uint8_t opcode, const std::vector<uint8_t>& data) {
  Message message;
  message.id = id;
  message.opcode = opcode;
  message.length = static_cast<uint8_t>(data.size());
  std::copy(data.begin(), data.end(), message.data);
  return message;
}

std::vector<uint8_t> DataOf(const Message& message) {
  return {message.data, message.data + message.length};
}

FrameView ViewOf(const Message& message) {
  return {message.id, message.opcode, message.data, message.length};
}

class SigningTest : public ::testing::Test {
 protected:
  // As sent by the robot.
  Message Hello(uint16_t number) {
    Message hello = MessageOf(kId, protocol::kHello, {0x34, 0x12, 1, 5});
    uint8_t signature[Signing::kLongest];
    const uint8_t size = robot.SignHello(ViewOf(hello), number, signature);
    NaiveSigner::Add(&hello, {signature, signature + size});
    return hello;
  }

  Message Sent(uint8_t opcode, const std::vector<uint8_t>& data) {
    Message message = MessageOf(kId, opcode, data);
    uint8_t signature[Signing::kLongest];
    const uint8_t size = robot.Sign(ViewOf(message), signature);
    NaiveSigner::Add(&message, {signature, signature + size});
    return message;
  }

  Message Answer() { return server.Greeting(kId); }

  // HELLO, its answer, and the first frame of the session.
  void Greet(uint16_t number = 0) {
    Message hello = Hello(number);
    ASSERT_TRUE(server.Open(&hello));
    ASSERT_TRUE(robot.TakeAnswer(ViewOf(Answer())));
    Message second = Sent(protocol::kHello, {0x34, 0x12, 1, 5});
    ASSERT_TRUE(server.Open(&second));
    ASSERT_FALSE(server.greets);
  }

  Message FromServer(const std::vector<uint8_t>& data, uint8_t id = kId,
                     uint8_t opcode = protocol::kFromServer | 1) {
    Message message = MessageOf(id, opcode, data);
    server.Sign(&message);
    return message;
  }

  NaiveSigner server;
  Signing robot{server.key.data()};
};

TEST_F(SigningTest, WithoutAKeyItIsOff) {
  EXPECT_FALSE(Signing(nullptr).on());
  EXPECT_TRUE(robot.on());
}

TEST_F(SigningTest, HelloIsSignedByTheRobotsKeyUnderItsNumber) {
  Message hello = Hello(0xABCD);
  EXPECT_EQ(10, hello.length);
  ASSERT_TRUE(server.Open(&hello));
  EXPECT_EQ((std::vector<uint16_t>{0xABCD}), server.hellos);
  EXPECT_EQ((std::vector<uint8_t>{0x34, 0x12, 1, 5}), DataOf(hello));
}

TEST_F(SigningTest, FramesOfASessionAreSignedOneByOne) {
  Greet();
  for (int i = 0; i < 600; ++i) {  // the counter's low byte comes round twice
    const std::vector<uint8_t> data(static_cast<size_t>(i % 60), static_cast<uint8_t>(i));
    Message sent = Sent(protocol::kPing, data);
    ASSERT_EQ(data.size() + 5, sent.length);
    Message copy = sent;
    ASSERT_TRUE(server.Open(&sent)) << i;
    EXPECT_EQ(data, DataOf(sent));
    EXPECT_FALSE(server.Open(&copy)) << "a repetition has a counter of its own";
  }
}

TEST_F(SigningTest, ServersFramesAreVerifiedOneByOne) {
  Greet();
  for (int i = 0; i < 600; ++i) {
    const Message frame = FromServer({static_cast<uint8_t>(i), 2, 3, 4});
    ASSERT_EQ(5, robot.Verify(ViewOf(frame))) << i;
    ASSERT_EQ(Signing::kForged, robot.Verify(ViewOf(frame))) << "replayed";
  }
}

TEST_F(SigningTest, AnEarlierFrameIsForgedAfterALaterOne) {
  Greet();
  const Message first = FromServer({1});
  const Message second = FromServer({2});
  EXPECT_EQ(5, robot.Verify(ViewOf(second)));
  EXPECT_EQ(Signing::kForged, robot.Verify(ViewOf(first)));
  EXPECT_EQ(5, robot.Verify(ViewOf(FromServer({3}))));
}

TEST_F(SigningTest, OfServersFrames255MayBeLostInSuccession) {
  Greet();
  for (int i = 0; i < 255; ++i) {
    FromServer({1});
  }
  EXPECT_EQ(5, robot.Verify(ViewOf(FromServer({2}))));
  for (int i = 0; i < 256; ++i) {
    FromServer({1});
  }
  EXPECT_EQ(Signing::kForged, robot.Verify(ViewOf(FromServer({2}))));
  Greet(1);
  EXPECT_EQ(5, robot.Verify(ViewOf(FromServer({2}))));
}

TEST_F(SigningTest, EachBitOfAFrameCounts) {
  Greet();
  const Message frame = FromServer({1, 2, 3});
  for (int bit = 0; bit < 8 * frame.length; ++bit) {
    Message changed = frame;
    changed.data[bit / 8] = static_cast<uint8_t>(changed.data[bit / 8] ^ (1u << (bit % 8)));
    ASSERT_EQ(Signing::kForged, robot.Verify(ViewOf(changed))) << bit;
  }
  Message other = frame;
  other.opcode ^= 2;
  EXPECT_EQ(Signing::kForged, robot.Verify(ViewOf(other)));
  Message shorter = frame;
  --shorter.length;
  EXPECT_EQ(Signing::kForged, robot.Verify(ViewOf(shorter)));
  EXPECT_EQ(5, robot.Verify(ViewOf(frame))) << "what was forged has changed nothing";
}

TEST_F(SigningTest, UnsignedFramesAreForged) {
  const Message unsigned_frame = MessageOf(kId, protocol::kFromServer | 1, {1, 2, 3, 4});
  EXPECT_EQ(Signing::kForged, robot.Verify(ViewOf(unsigned_frame)));
  Greet();
  EXPECT_EQ(Signing::kForged, robot.Verify(ViewOf(unsigned_frame)));
  for (uint8_t size = 0; size <= 8; ++size) {  // shorter than a signature, too
    const std::vector<uint8_t> data(size, 0);
    EXPECT_EQ(Signing::kForged, robot.Verify(ViewOf(MessageOf(kId, protocol::kError, data))));
    EXPECT_EQ(Signing::kForged, robot.Verify(ViewOf(MessageOf(0xFF, protocol::kRound, data))));
  }
}

TEST_F(SigningTest, OwnFramesSentBackAreForged) {
  Greet();
  Message sent = Sent(protocol::kPing, {1, 2});
  sent.opcode = protocol::kPingAnswer;
  EXPECT_EQ(Signing::kForged, robot.Verify(ViewOf(sent)));
}

TEST_F(SigningTest, FramesToAllAreVerifiedByTheGroupsKey) {
  Greet();
  for (int i = 0; i < 300; ++i) {
    const Message round = FromServer({1, 2, 3}, 0xFF, protocol::kRound);
    ASSERT_EQ(9, round.length);
    ASSERT_EQ(6, robot.Verify(ViewOf(round)));
    ASSERT_EQ(Signing::kForged, robot.Verify(ViewOf(round)));
  }
  server.group_sent += 65535;
  EXPECT_EQ(6, robot.Verify(ViewOf(FromServer({1}, 0xFF, protocol::kRound))));
  server.group_sent += 65536;
  EXPECT_EQ(Signing::kForged, robot.Verify(ViewOf(FromServer({1}, 0xFF, protocol::kRound))));
}

TEST_F(SigningTest, FramesToAllOfBeforeHelloAreForged) {
  const Message before = FromServer({1, 2, 3}, 0xFF, protocol::kRound);
  EXPECT_EQ(Signing::kForged, robot.Verify(ViewOf(before))) << "there is no key yet";
  Greet();
  EXPECT_EQ(Signing::kForged, robot.Verify(ViewOf(before)));
}

// Whoever has the group's key, any robot, must not speak for the server to one of them.
TEST_F(SigningTest, TheGroupsKeySignsNothingToOneRobot) {
  Greet();
  Message frame = MessageOf(kId, protocol::kCommand, {1, 1});
  const auto mac =
      protocol::NaiveMac(server.group_key, 2, 1, kId, protocol::kCommand, DataOf(frame));
  NaiveSigner::Add(&frame, {1, mac[0], mac[1], mac[2], mac[3]});
  EXPECT_EQ(Signing::kForged, robot.Verify(ViewOf(frame)));
}

TEST_F(SigningTest, ALinkThatTakesUnsignedFramesDoesNotSignThoseToAll) {
  server.accepts_unsigned = true;
  Greet();
  const Message round = MessageOf(0xFF, protocol::kRound, {1, 2, 3});
  EXPECT_EQ(0, robot.Verify(ViewOf(round)));
  EXPECT_EQ(0, robot.Verify(ViewOf(round)));
  EXPECT_EQ(5, robot.Verify(ViewOf(FromServer({1}))));
  EXPECT_EQ(Signing::kForged, robot.Verify(ViewOf(MessageOf(kId, protocol::kError, {1}))));
}

TEST_F(SigningTest, AnswerToAnotherHelloIsNotTaken) {
  Message first = Hello(0);
  ASSERT_TRUE(server.Open(&first));
  const Message answer = Answer();
  Message second = Hello(1);
  EXPECT_FALSE(robot.TakeAnswer(ViewOf(answer)));
  EXPECT_FALSE(robot.has_session());
  ASSERT_TRUE(server.Open(&second));
  EXPECT_TRUE(robot.TakeAnswer(ViewOf(Answer())));
  EXPECT_TRUE(robot.has_session());
}

// A piece of the keys in each pass of a loop, none in that in which the answer was taken.
TEST_F(SigningTest, WhereverTheLoopIsInDerivingTheKeysTheyAreReadyWhenNeeded) {
  for (int passes = 0; passes < 6; ++passes) {
    Message hello = Hello(static_cast<uint16_t>(passes));
    ASSERT_TRUE(server.Open(&hello));
    ASSERT_TRUE(robot.TakeAnswer(ViewOf(Answer())));
    for (int i = 0; i < passes; ++i) {
      ASSERT_EQ(robot.Derive(), i < 4);
    }
    Message second = Sent(protocol::kHello, {0x34, 0x12, 1, 5});
    ASSERT_TRUE(server.Open(&second)) << passes;
    ASSERT_FALSE(robot.Derive());
    ASSERT_EQ(robot.Verify(ViewOf(FromServer({9, 9}, protocol::kBroadcastId))), 6);
  }
}

TEST_F(SigningTest, AnAnswerIsTakenOnce) {
  Message hello = Hello(0);
  ASSERT_TRUE(server.Open(&hello));
  const Message answer = Answer();
  ASSERT_TRUE(robot.TakeAnswer(ViewOf(answer)));
  Message first = Sent(protocol::kPing, {});
  ASSERT_TRUE(server.Open(&first));
  const Message frame = FromServer({1});
  ASSERT_EQ(5, robot.Verify(ViewOf(frame)));
  EXPECT_FALSE(robot.TakeAnswer(ViewOf(answer))) << "counters would begin again";
  EXPECT_EQ(Signing::kForged, robot.Verify(ViewOf(frame)));
}

TEST_F(SigningTest, EachBitOfAnAnswerCounts) {
  Message hello = Hello(0);
  ASSERT_TRUE(server.Open(&hello));
  const Message answer = Answer();
  EXPECT_EQ(34, answer.length);
  for (int bit = 0; bit < 8 * answer.length; ++bit) {
    Message changed = answer;
    changed.data[bit / 8] = static_cast<uint8_t>(changed.data[bit / 8] ^ (1u << (bit % 8)));
    ASSERT_FALSE(robot.TakeAnswer(ViewOf(changed))) << bit;
  }
  for (uint8_t length = 0; length < answer.length; ++length) {
    Message shorter = answer;
    shorter.length = length;
    ASSERT_FALSE(robot.TakeAnswer(ViewOf(shorter)));
  }
  EXPECT_TRUE(robot.TakeAnswer(ViewOf(answer)));
}

// Held back, while frames to all were heard.
TEST_F(SigningTest, AnAnswerDoesNotSetTheCounterOfFramesToAllBack) {
  Greet();
  Message hello = Hello(1);
  ASSERT_TRUE(server.Open(&hello));
  const Message answer = Answer();
  const Message halt = FromServer({1, 1}, 0xFF, protocol::kCommand);
  ASSERT_EQ(6, robot.Verify(ViewOf(halt)));
  ASSERT_TRUE(robot.TakeAnswer(ViewOf(answer)));
  EXPECT_EQ(Signing::kForged, robot.Verify(ViewOf(halt)));
  EXPECT_EQ(6, robot.Verify(ViewOf(FromServer({2, 1}, 0xFF, protocol::kCommand))));
}

TEST_F(SigningTest, AServerWithAnotherGroupKeyMayCountAnew) {
  Greet();
  server.group_key[3] ^= 1;
  server.group_sent = 0;
  Greet(1);
  EXPECT_EQ(6, robot.Verify(ViewOf(FromServer({1}, 0xFF, protocol::kRound))));
}

TEST_F(SigningTest, FourSecondHellosFollowAnAnswer) {
  EXPECT_FALSE(robot.TakeSecondHello());
  Greet();
  for (int i = 0; i < 4; ++i) {
    EXPECT_TRUE(robot.second_hello_due());
    EXPECT_TRUE(robot.TakeSecondHello());
  }
  EXPECT_FALSE(robot.second_hello_due());
  EXPECT_FALSE(robot.TakeSecondHello());
  Greet(1);
  robot.GreetAnew();
  EXPECT_FALSE(robot.TakeSecondHello());
}

TEST_F(SigningTest, AnAnswerOfAnotherKeyIsNotTaken) {
  Message hello = Hello(0);
  ASSERT_TRUE(server.Open(&hello));
  NaiveSigner other = server;
  other.key[15] ^= 1;
  EXPECT_FALSE(robot.TakeAnswer(ViewOf(other.Greeting(kId))));
  EXPECT_TRUE(robot.TakeAnswer(ViewOf(Answer())));
}

// A robot that says HELLO because of a silence still hears the server, which knows of nothing.
TEST_F(SigningTest, TheSessionHoldsUntilHelloIsAnswered) {
  Greet();
  Message hello = Hello(1);
  EXPECT_EQ(5, robot.Verify(ViewOf(FromServer({1}))));
  EXPECT_EQ(6, robot.Verify(ViewOf(FromServer({1, 2}, 0xFF, protocol::kRound))));
  NaiveSigner other = server;
  other.key[15] ^= 1;
  EXPECT_FALSE(robot.TakeAnswer(ViewOf(other.Greeting(kId))));
  EXPECT_EQ(6, robot.Verify(ViewOf(FromServer({1, 2}, 0xFF, protocol::kRound))));
  Message between = Sent(protocol::kCommandAck, {1, 2, 3, 4});
  EXPECT_TRUE(server.Open(&between));
  ASSERT_TRUE(server.Open(&hello));
  ASSERT_TRUE(robot.TakeAnswer(ViewOf(Answer())));
  const Message of_before = FromServer({1});  // the server has not heard of the new one yet
  EXPECT_EQ(Signing::kForged, robot.Verify(ViewOf(of_before)));
  Message first = Sent(protocol::kPing, {});
  ASSERT_TRUE(server.Open(&first));
  EXPECT_EQ(5, robot.Verify(ViewOf(FromServer({1}))));
}

}  // namespace
}  // namespace client
}  // namespace pheromone
