// The server's end of a signed link, against a client that computes with OpenSSL what section 18 of
// protocol/README.md says.
#include "server/robots/signing/signing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <random>
#include <span>
#include <vector>

#include "protocol/frame.h"
#include "protocol/messages.h"
#include "protocol/testing/naive_mac.h"

namespace pheromone::signing {
namespace {

using Bytes = std::vector<uint8_t>;
using protocol::Message;

constexpr uint8_t kRobot = 7;
constexpr Key kKey = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16};
constexpr uint8_t kSenseT = 0x01;
constexpr std::chrono::nanoseconds kNow{0};

Message Make(uint8_t id, uint8_t opcode, const Bytes& data) {
  Message message;
  message.id = id;
  message.opcode = opcode;
  message.length = static_cast<uint8_t>(data.size());
  std::copy(data.begin(), data.end(), message.data);
  return message;
}

Bytes DataOf(const Message& message) {
  return {message.data, message.data + message.length};
}

Bytes Joined(std::initializer_list<Bytes> parts) {
  Bytes all;
  for (const Bytes& part : parts) {
    all.insert(all.end(), part.begin(), part.end());
  }
  return all;
}

Bytes Part(const Bytes& of, size_t begin, size_t size) {
  return {of.begin() + static_cast<std::ptrdiff_t>(begin),
          of.begin() + static_cast<std::ptrdiff_t>(begin + size)};
}

Bytes TagOf(const Bytes& mac) {
  return Part(mac, 0, 4);
}

class Client {
 public:
  explicit Client(uint8_t id = kRobot, const Key& key = kKey)
      : id_(id), key_(key.begin(), key.end()) {}

  Message Hello(uint16_t boot) {
    boot_ = {static_cast<uint8_t>(boot), static_cast<uint8_t>(boot >> 8)};
    number_ = next_number_++;
    const Bytes data = Joined({boot_, {1, 10}});
    return Make(id_, 0x71,
                Joined({data,
                        {static_cast<uint8_t>(number_), static_cast<uint8_t>(number_ >> 8)},
                        TagOf(protocol::NaiveMac(key_, 4, number_, id_, 0x71, data))}));
  }

  /// Whether the answer is right; then the session is the new one.
  bool Take(const Message& answer) {
    const Bytes all = DataOf(answer);
    if (answer.id != id_ || answer.opcode != 0xF1 || all.size() != 34 || Part(all, 0, 2) != boot_ ||
        TagOf(protocol::NaiveMac(key_, 5, number_, id_, 0xF1, Part(all, 0, 30))) !=
            Part(all, 30, 4)) {
      return false;
    }
    session_ = protocol::NaiveMac(key_, 6, number_, id_, 0x71, Part(all, 0, 10));
    const Bytes mask = protocol::NaiveMac(key_, 7, number_, id_, 0x71, Part(all, 0, 10));
    group_ = Part(all, 10, 16);
    for (size_t i = 0; i < 16; ++i) {
      group_[i] = static_cast<uint8_t>(group_[i] ^ mask[i]);
    }
    group_heard = 0;
    for (int i = 0; i < 4; ++i) {
      group_heard |= static_cast<uint32_t>(all[static_cast<size_t>(26 + i)]) << (8 * i);
    }
    sent = heard = 0;
    return true;
  }

  Message Frame(uint8_t opcode, const Bytes& data) {
    ++sent;
    return Make(id_, opcode,
                Joined({data,
                        {static_cast<uint8_t>(sent)},
                        TagOf(protocol::NaiveMac(session_, 1, sent, id_, opcode, data))}));
  }

  /// Whether this is what the server's next frame has to be.
  bool IsNext(const Message& message, const Bytes& data) {
    ++heard;
    return message.id == id_ &&
           DataOf(message) ==
               Joined({data,
                       {static_cast<uint8_t>(heard)},
                       TagOf(protocol::NaiveMac(session_, 2, heard, id_, message.opcode, data))});
  }

  bool IsNextToAll(const Message& message, const Bytes& data) {
    ++group_heard;
    return DataOf(message) ==
           Joined({data,
                   {static_cast<uint8_t>(group_heard), static_cast<uint8_t>(group_heard >> 8)},
                   TagOf(protocol::NaiveMac(group_, 3, group_heard, 0xFF, message.opcode, data))});
  }

  uint32_t sent = 0;
  uint32_t heard = 0;
  uint32_t group_heard = 0;

 private:
  uint8_t id_;
  Bytes key_;
  Bytes boot_;
  uint16_t number_ = 0;
  uint16_t next_number_ = 0;
  Bytes session_;
  Bytes group_;
};

class SigningTest : public testing::Test {
 protected:
  bool Greets(Client* robot, uint16_t boot = 0x0102) { return Greets(robot, &signing, boot); }
  static bool Greets(Client* robot, Signing* with, uint16_t boot) {
    Message message = robot->Hello(boot);
    return with->Open(&message, kNow) == Opened::kGreeting && with->Sign(&message) &&
           robot->Take(message);
  }

  bool Opens(const Message& message, std::chrono::nanoseconds now = kNow) {
    return Opens(&signing, message, now);
  }
  static bool Opens(Signing* with, Message message, std::chrono::nanoseconds now = kNow) {
    return with->Open(&message, now) == Opened::kMessage;
  }

  std::mt19937 random{1};
  const Signing::Random fill = [this](std::span<uint8_t> bytes) {
    std::generate(bytes.begin(), bytes.end(), [this] { return static_cast<uint8_t>(random()); });
  };
  Signing signing{Security::kRequire, {{kRobot, kKey}}, fill};
  Client client;
};

TEST_F(SigningTest, TakesTheSignatureOffAndPutsItOn) {
  ASSERT_TRUE(Greets(&client));
  for (uint8_t i = 0; i < 3; ++i) {
    const Bytes data = {i, 2, 3, 4, 5, 6};
    Message message = client.Frame(kSenseT, data);
    ASSERT_EQ(signing.Open(&message, kNow), Opened::kMessage);
    EXPECT_EQ(DataOf(message), data);
    Message answer = Make(kRobot, 0x81, {i, 0, 0, 1});
    ASSERT_TRUE(signing.Sign(&answer));
    EXPECT_TRUE(client.IsNext(answer, {i, 0, 0, 1}));
  }
  EXPECT_EQ(signing.counters(), SigningCounters());
}

TEST_F(SigningTest, RefusesWhatIsRepeatedReorderedOrChanged) {
  ASSERT_TRUE(Greets(&client));
  const Message first = client.Frame(kSenseT, {1, 2, 3, 4, 5, 6});
  const Message second = client.Frame(kSenseT, {1, 2, 3, 4, 5, 7});
  EXPECT_TRUE(Opens(second));
  EXPECT_FALSE(Opens(second));
  EXPECT_FALSE(Opens(first));
  const Message third = client.Frame(kSenseT, {1, 2, 3, 4, 5, 8});
  for (size_t bit = 0; bit < 8u * third.length; ++bit) {
    Message changed = third;
    changed.data[bit / 8] = static_cast<uint8_t>(changed.data[bit / 8] ^ (1u << (bit % 8)));
    EXPECT_FALSE(Opens(changed)) << bit;
  }
  EXPECT_EQ(signing.counters().wrong_tags, 2 + 8u * third.length);
  EXPECT_TRUE(Opens(third));
}

TEST_F(SigningTest, AForgedOpcodeOrIdIsAnotherFrame) {
  Signing two{Security::kRequire, {{kRobot, kKey}, {8, kKey}}, fill};
  ASSERT_TRUE(Greets(&client, &two, 5));
  Message as_deposit = client.Frame(kSenseT, {1, 2, 3, 4, 5, 6});
  Message as_other = as_deposit;
  as_deposit.opcode = 0x21;
  as_other.id = 8;
  EXPECT_FALSE(Opens(&two, as_deposit));
  EXPECT_FALSE(Opens(&two, as_other));
}

TEST_F(SigningTest, TwoHundredAndFiftyFiveLostFramesDoNotMatter) {
  ASSERT_TRUE(Greets(&client));
  for (int i = 0; i < 255; ++i) {
    client.Frame(kSenseT, {});
  }
  EXPECT_TRUE(Opens(client.Frame(kSenseT, {1})));
  for (int i = 0; i < 256; ++i) {
    client.Frame(kSenseT, {});
  }
  EXPECT_FALSE(Opens(client.Frame(kSenseT, {1})));
  EXPECT_TRUE(Greets(&client));
  EXPECT_TRUE(Opens(client.Frame(kSenseT, {1})));
}

TEST_F(SigningTest, UnsignedFramesAreIgnored) {
  EXPECT_FALSE(Opens(Make(kRobot, 0x71, {1, 0, 1, 0})));
  EXPECT_FALSE(Opens(Make(kRobot, kSenseT, {1, 2, 3, 4, 5, 6})));
  EXPECT_FALSE(Opens(Make(8, 0x71, {1, 0, 1, 0})));
  ASSERT_TRUE(Greets(&client));
  EXPECT_FALSE(Opens(Make(kRobot, kSenseT, {1, 2, 3, 4, 5, 6})));
  EXPECT_FALSE(Opens(Make(kRobot, 0x72, {})));
  EXPECT_EQ(signing.counters().unknown_robots, 1u);
  EXPECT_EQ(signing.counters().unsigned_frames, 3u);  // one is long enough to have a tag
  EXPECT_EQ(signing.counters().wrong_tags, 1u);
}

TEST_F(SigningTest, ARepeatedHelloEndsNothing) {
  const Message of_earlier_boot = client.Hello(1);
  const Message earlier = client.Hello(2);
  ASSERT_TRUE(Greets(&client, 2));
  EXPECT_TRUE(Opens(client.Frame(kSenseT, {1})));
  Message message = earlier;
  EXPECT_EQ(signing.Open(&message, kNow), Opened::kIgnore);
  message = of_earlier_boot;
  ASSERT_EQ(signing.Open(&message, kNow), Opened::kGreeting);
  EXPECT_TRUE(signing.Sign(&message));
  EXPECT_FALSE(client.Take(message));  // to the robot, it answers another HELLO
  EXPECT_TRUE(Opens(client.Frame(kSenseT, {2})));
  Message command = Make(kRobot, 0xD1, {1, 1});
  ASSERT_TRUE(signing.Sign(&command));
  EXPECT_TRUE(client.IsNext(command, {1, 1}));
}

TEST_F(SigningTest, EachGreetingHasANonceOfItsOwn) {
  Message first = client.Hello(1);
  ASSERT_EQ(signing.Open(&first, kNow), Opened::kGreeting);
  Message again = first;
  ASSERT_TRUE(signing.Sign(&first) && signing.Sign(&again));
  EXPECT_NE(Part(DataOf(first), 2, 8), Part(DataOf(again), 2, 8));
}

TEST_F(SigningTest, ASecondHelloIsAFrameOfTheSession) {
  ASSERT_TRUE(Greets(&client));
  Message hello = client.Frame(0x71, {2, 1, 1, 10});
  ASSERT_EQ(signing.Open(&hello, kNow), Opened::kMessage);
  EXPECT_EQ(DataOf(hello), Bytes({2, 1, 1, 10}));
  const Bytes data = {2, 1, 1, 0, 0, 100, 0, 1, 0, 2, 0, 5, 20, 0, 0};
  Message answer = Make(kRobot, 0xF1, data);
  ASSERT_TRUE(signing.Sign(&answer));
  EXPECT_TRUE(client.IsNext(answer, data));
}

TEST_F(SigningTest, TheOldSessionGoesOnUntilAFrameOfTheNewOne) {
  ASSERT_TRUE(Greets(&client));
  ASSERT_TRUE(Opens(client.Frame(kSenseT, {1})));
  Client before = client;
  ASSERT_TRUE(Greets(&client));
  EXPECT_TRUE(Opens(before.Frame(kSenseT, {2})));
  EXPECT_TRUE(Opens(client.Frame(kSenseT, {3})));
  EXPECT_FALSE(Opens(before.Frame(kSenseT, {4})));
}

TEST_F(SigningTest, OfAnEarlierSessionNothingIsAccepted) {
  ASSERT_TRUE(Greets(&client));
  std::vector<Message> heard;
  for (uint8_t i = 0; i < 20; ++i) {
    heard.push_back(client.Frame(kSenseT, {i}));
    ASSERT_TRUE(Opens(heard.back()));
  }
  ASSERT_TRUE(Greets(&client));
  ASSERT_TRUE(Opens(client.Frame(kSenseT, {1})));
  Signing restarted{Security::kRequire, {{kRobot, kKey}}, fill};
  for (const Message& message : heard) {
    EXPECT_FALSE(Opens(message));
    EXPECT_FALSE(Opens(&restarted, message));
  }
}

TEST_F(SigningTest, WithoutASessionNothingIsSentToARobot) {
  Message command = Make(kRobot, 0xD1, {1, 1});
  EXPECT_FALSE(signing.Sign(&command));
  EXPECT_EQ(command.length, 2);
  Message to_other = Make(9, 0xD1, {1, 1});
  EXPECT_FALSE(signing.Sign(&to_other));
}

TEST_F(SigningTest, ToAllByTheGroupsKey) {
  Message before = Make(0xFF, 0xD1, {1, 1});
  ASSERT_TRUE(signing.Sign(&before));
  ASSERT_TRUE(Greets(&client));
  EXPECT_EQ(client.group_heard, 1u);
  for (uint8_t i = 0; i < 3; ++i) {
    Message halt = Make(0xFF, 0xD1, {i, 1});
    ASSERT_TRUE(signing.Sign(&halt));
    EXPECT_TRUE(client.IsNextToAll(halt, {i, 1}));
  }
}

TEST_F(SigningTest, AnAnswerWithoutRoomForItsSignatureIsAnError) {
  ASSERT_TRUE(Greets(&client));
  Message answer = Make(kRobot, 0xC6, Bytes(60, 1));
  ASSERT_TRUE(signing.Sign(&answer));
  EXPECT_EQ(answer.opcode, 0xFE);
  EXPECT_TRUE(client.IsNext(answer, {0x46, 2, 0}));
  Message fits = Make(kRobot, 0xC6, Bytes(59, 1));
  ASSERT_TRUE(signing.Sign(&fits));
  EXPECT_TRUE(client.IsNext(fits, Bytes(59, 1)));
}

TEST_F(SigningTest, WhileTooManyTagsAreWrongNoneIsLookedAt) {
  ASSERT_TRUE(Greets(&client));
  const Message wrong = Make(kRobot, kSenseT, {1, 2, 3, 4, 5, 6});
  for (int i = 0; i < kMostWrongTags; ++i) {
    EXPECT_FALSE(Opens(wrong, std::chrono::milliseconds(500)));
  }
  EXPECT_FALSE(Opens(client.Frame(kSenseT, {1}), std::chrono::milliseconds(999)));
  EXPECT_TRUE(Opens(client.Frame(kSenseT, {1}), std::chrono::milliseconds(1500)));
}

TEST_F(SigningTest, ARevokedKeyEndsAllSessionsAndTheGroupsKey) {
  Signing two{Security::kRequire, {{kRobot, kKey}, {8, kKey}}, fill};
  ASSERT_TRUE(Greets(&client, &two, 5));
  two.SetKeys({{kRobot, kKey}, {8, kKey}, {9, kKey}});
  EXPECT_TRUE(two.has_session(kRobot));  // one more key changes nothing
  two.SetKeys({{kRobot, kKey}, {9, kKey}});
  EXPECT_FALSE(two.has_session(kRobot));
  EXPECT_FALSE(Opens(&two, client.Frame(kSenseT, {1})));
  Message halt = Make(0xFF, 0xD1, {1, 1});
  ASSERT_TRUE(two.Sign(&halt));
  EXPECT_FALSE(client.IsNextToAll(halt, {1, 1}));
  Message revoked = Client(8).Hello(1);
  EXPECT_EQ(two.Open(&revoked, kNow), Opened::kIgnore);
  EXPECT_EQ(two.counters().unknown_robots, 1u);
}

TEST_F(SigningTest, ALinkThatAcceptsBothServesBoth) {
  Signing both{Security::kAccept, {{kRobot, kKey}}, fill};
  Message plain = Make(8, kSenseT, {1, 2, 3, 4, 5, 6});
  Message plain_answer = Make(8, 0x81, {1, 2, 3, 4});
  EXPECT_EQ(both.Open(&plain, kNow), Opened::kMessage);
  EXPECT_EQ(plain.length, 6);
  EXPECT_TRUE(both.Sign(&plain_answer));
  EXPECT_EQ(plain_answer.length, 4);
  Message halt = Make(0xFF, 0xD1, {1, 1});
  EXPECT_TRUE(both.Sign(&halt));
  EXPECT_EQ(halt.length, 2);
  ASSERT_TRUE(Greets(&client, &both, 5));
  EXPECT_EQ(client.group_heard, 0xFFFFFFFFu);
  const Message unsigned_frame = Make(kRobot, kSenseT, {1, 2, 3, 4, 5, 6});
  EXPECT_FALSE(Opens(&both, unsigned_frame));
  EXPECT_TRUE(Opens(&both, Make(kRobot, 0x71, {1, 0, 1, 0})));
  EXPECT_TRUE(Opens(&both, unsigned_frame));
}

}  // namespace
}  // namespace pheromone::signing
