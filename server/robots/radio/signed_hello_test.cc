// How the answers to a signed robot's HELLOs leave: plain at first, and coded for who may have lost
// one (protocol/README.md, section 18).
#include <gtest/gtest.h>

#include <algorithm>
#include <span>
#include <vector>

#include "protocol/testing/naive_mac.h"
#include "server/robots/radio/channel.h"
#include "server/robots/radio/testing/air.h"

namespace pheromone::radio {
namespace {

using testing::FrameOf;
using testing::kStart;
using Bytes = std::vector<uint8_t>;
using namespace std::chrono_literals;

constexpr uint8_t kId = 7;
constexpr size_t kPlainOpcodeAt = 3;  // behind DLE STX and ID
constexpr signing::Key kKey = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16};

class SignedHelloTest : public ::testing::Test {
 protected:
  explicit SignedHelloTest(signing::Security security = signing::Security::kRequire,
                           bool half_duplex = true)
      : signing_(security, {{kId, kKey}},
                 [](std::span<uint8_t> bytes) { std::fill(bytes.begin(), bytes.end(), 0x5A); }),
        channel_(Options(&signing_, half_duplex), [](const auto&) {}) {}

  static ChannelOptions Options(signing::Signing* signing, bool half_duplex) {
    ChannelOptions options = testing::Options(9'600, 2ms);
    options.half_duplex = half_duplex;
    options.signing = signing;
    return options;
  }

  std::vector<protocol::Message> Hear(const Bytes& data, const Bytes& added) {
    now_ += 1s;
    protocol::Message message;
    message.id = kId;
    message.opcode = 0x71;
    for (const Bytes& part : {data, added}) {
      std::copy(part.begin(), part.end(), message.data + message.length);
      message.length = static_cast<uint8_t>(message.length + part.size());
    }
    std::vector<protocol::Message> messages;
    channel_.Hear(FrameOf(message), now_, now_, &messages);
    return messages;
  }

  /// What is sent next, one frame.
  Bytes Sent() {
    now_ = std::max(now_, channel_.NextStart(now_));
    const Transmission out = channel_.Begin(now_);
    EXPECT_EQ(out.frame_ends.size(), 1u);
    return out.bytes;
  }

  static Bytes Added(const Bytes& key, uint8_t use, uint16_t counter, const Bytes& data) {
    Bytes added = {static_cast<uint8_t>(counter)};
    if (use == 4) {
      added.push_back(static_cast<uint8_t>(counter >> 8));
    }
    const Bytes mac = protocol::NaiveMac(key, use, counter, kId, 0x71, data);
    added.insert(added.end(), mac.begin(), mac.begin() + 4);
    return added;
  }

  /// The answer to a first HELLO.
  Bytes First() {
    const Bytes key(kKey.begin(), kKey.end());
    EXPECT_TRUE(Hear(kHello, Added(key, 4, number_, kHello)).empty());
    Bytes nonces(10, 0x5A);
    std::copy_n(kHello.begin(), 2, nonces.begin());
    session_ = protocol::NaiveMac(key, 6, number_++, kId, 0x71, nonces);
    sent_ = 0;
    return Sent();
  }

  /// That to a second one.
  Bytes Second() {
    const auto messages = Hear(kHello, Added(session_, 1, ++sent_, kHello));
    EXPECT_EQ(messages.size(), 1u);
    protocol::HelloAnswer answer;
    answer.id = kId;
    channel_.Answer(testing::MessageOf(answer), now_, now_);
    return Sent();
  }

  const Bytes kHello = {0x34, 0x12, 1, 0};
  signing::Signing signing_;
  Channel channel_;
  Time now_ = kStart;
  Bytes session_;
  uint16_t number_ = 0;
  uint16_t sent_ = 0;
};

TEST_F(SignedHelloTest, InGoodAirAnswersArePlain) {
  EXPECT_EQ(First()[kPlainOpcodeAt], 0xF1);
  EXPECT_EQ(Second()[kPlainOpcodeAt], 0xF1);
}

// It begins twice with 5 bytes, and has ten for each row and one more.
TEST_F(SignedHelloTest, WhoSaysAFirstHelloAgainIsAnsweredCoded) {
  First();
  const Bytes first = First();
  EXPECT_EQ(first[kPlainOpcodeAt], 0xF6);
  EXPECT_EQ(first.size(), 10u + 10 * 6);
  const Bytes second = Second();
  EXPECT_EQ(second[kPlainOpcodeAt], 0xF6);
  EXPECT_EQ(second.size(), 10u + 10 * 4);
}

TEST_F(SignedHelloTest, WhoSaysASecondHelloAgainIsAnsweredCoded) {
  First();
  EXPECT_EQ(Second()[kPlainOpcodeAt], 0xF1);
  EXPECT_EQ(Second()[kPlainOpcodeAt], 0xF6);
}

class SignedLineTest : public SignedHelloTest {
 protected:
  SignedLineTest() : SignedHelloTest(signing::Security::kRequire, false) {}
};

TEST_F(SignedLineTest, OnALineThatIsNoRadioNothingIsCoded) {
  First();
  EXPECT_EQ(First()[kPlainOpcodeAt], 0xF1);
  Second();
  EXPECT_EQ(Second()[kPlainOpcodeAt], 0xF1);
}

class AcceptingTest : public SignedHelloTest {
 protected:
  AcceptingTest() : SignedHelloTest(signing::Security::kAccept) {}
};

TEST_F(AcceptingTest, WhoDoesNotSignIsAnsweredPlain) {
  First();
  First();
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(Hear(kHello, {}).size(), 1u);
    protocol::HelloAnswer answer;
    answer.id = kId;
    channel_.Answer(testing::MessageOf(answer), now_, now_);
    EXPECT_EQ(Sent()[kPlainOpcodeAt], 0xF1);
  }
}

}  // namespace
}  // namespace pheromone::radio
