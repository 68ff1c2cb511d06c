// Manners on a channel that is shared: protocol/README.md, section 9.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "client_fw/core/testing/conversation_harness.h"

namespace pheromone {
namespace client {
namespace {

using protocol::Message;

TEST(ChannelTest, NothingIsBegunWhileItIsBusy) {
  Harness harness;
  harness.GreetAndServe(1500);
  harness.busy = true;
  EXPECT_FALSE(harness.RunUntilSent(400));
  harness.busy = false;
  EXPECT_TRUE(harness.RunUntilSent(9 * kTestSlotMs + 15));
}

TEST(ChannelTest, AfterABusySpellADelayIsDrawnEvenByALoneRobot) {
  std::set<uint32_t> delays;
  for (uint8_t id = 1; id <= 20; ++id) {
    Parameters parameters = TestParameters();
    parameters.id = id;
    Harness harness(parameters);
    harness.GreetAndServe(1500);
    harness.busy = true;
    harness.Run(300);
    harness.busy = false;
    const uint32_t free_ms = harness.now_ms;
    ASSERT_TRUE(harness.RunUntilSent());
    EXPECT_GE(harness.began_ms - free_ms, kTestSlotMs);
    EXPECT_LE(harness.began_ms - free_ms, 9u * kTestSlotMs);
    delays.insert(harness.began_ms - free_ms);
  }
  EXPECT_GE(delays.size(), 5u);
}

// A turn that comes while another station sends is lost, and the next delay is a new one: those
// whose turn was at the same moment would collide for ever if they kept theirs, or all took the
// first slot.
TEST(ChannelTest, EachBusySpellHasADelayOfItsOwn) {
  std::set<uint32_t> delays;
  Harness harness;
  harness.GreetAndServe(1500);
  for (int i = 0; i < 20; ++i) {
    harness.busy = true;
    harness.Run(250);
    harness.busy = false;
    const uint32_t free_ms = harness.now_ms;
    ASSERT_TRUE(harness.RunUntilSent());
    delays.insert((harness.began_ms - free_ms) / kTestSlotMs);
    harness.Answer(0, 0);
  }
  EXPECT_GE(delays.size(), 5u);
}

TEST(ChannelTest, EachRetryHasADelayOfItsOwn) {
  std::set<uint32_t> delays;
  Harness harness;
  harness.GreetAndServe(1500);
  for (int i = 0; i < 30; ++i) {
    ASSERT_TRUE(harness.RunUntilSent());
    const uint32_t retries = harness.counters().retries;
    const uint32_t missed_ms = harness.sent_ms + kTestWindowMs + 1;
    ASSERT_TRUE(harness.RunUntilSent());
    ASSERT_EQ(retries + 1, harness.counters().retries);
    delays.insert((harness.began_ms - missed_ms) / kTestSlotMs);
    harness.Answer(0, 0);
    harness.Serve(150);  // the window shrinks again
  }
  EXPECT_GE(delays.size(), 5u);
  EXPECT_LE(*delays.rbegin(), 17u);
}

TEST(ChannelTest, NothingIsBegunInsideAForeignFrame) {
  Harness harness;
  harness.GreetAndServe(1500);
  ASSERT_TRUE(harness.RunUntilSent());
  harness.Answer(0, 0);
  harness.Run(160);
  const int before = harness.frames_sent;
  harness.FeedByte(protocol::kDle);
  harness.FeedByte(protocol::kStx);
  for (int i = 0; i < 15; ++i) {  // slowly, over the beginning of the next period
    harness.FeedByte(0x55);
    harness.Run(10);
    EXPECT_FALSE(harness.leaving);
  }
  EXPECT_EQ(before, harness.frames_sent);
}

// Other robots send requests for `ms` without a pause.
void Crowd(uint32_t ms, Harness* harness) {
  for (uint32_t i = 0; i < ms; i += kTestIdleMs - 1) {
    harness->FeedEncoded(protocol::SenseRequest{kTestId + 1, 2, false, {}});
    harness->Run(kTestIdleMs - 1);
  }
}

// Timers are 16 bits wide, and 65 s are no time at all for them.
TEST(ChannelTest, RobotIsNotMuteAfterALongBusySpell) {
  for (const uint32_t busy_ms : {30000u, 33000u, 40000u, 60000u, 66000u, 100000u}) {
    for (const bool told : {false, true}) {  // HELLO never answered, or the channel lost later
      Harness harness;
      if (told) {
        harness.GreetAndServe(1500);
      }
      const int before = harness.frames_sent;
      Crowd(busy_ms, &harness);
      EXPECT_EQ(before, harness.frames_sent);
      EXPECT_TRUE(harness.RunUntilSent(2000)) << busy_ms;
      EXPECT_EQ(told ? protocol::kSense | 2 : protocol::kHello, harness.sent.opcode);
    }
  }
}

// COMMANDs spare the HELLO, so that the grid of the periods is as old as the last request.
TEST(ChannelTest, RobotIsNotMuteAfterALongBusySpellWithCommands) {
  for (const uint32_t busy_ms : {30000u, 33000u, 40000u, 60000u, 66000u, 100000u}) {
    Harness harness;
    harness.GreetAndServe(1500);
    protocol::Command command;
    command.id = kTestId;
    command.code = protocol::CommandCode::kResume;
    for (uint32_t ms = 0; ms < busy_ms; ms += 400) {
      harness.FeedEncoded(command);
      Crowd(400, &harness);
    }
    EXPECT_EQ(kFailSafe, harness.conversation.state().flags);
    const uint32_t answers = harness.counters().answers;
    harness.Serve(4000);
    EXPECT_EQ(1u, harness.counters().hellos);
    EXPECT_GE(harness.counters().answers, answers + 15) << busy_ms;
    EXPECT_EQ(kStraight, harness.conversation.state().wheels);
  }
}

// Lets `bytes` arrive just before a period begins, and expects the client to wait for the window.
void ExpectHeldBy(const std::vector<uint8_t>& bytes) {
  Harness harness;
  harness.GreetAndServe(1500);
  ASSERT_TRUE(harness.RunUntilSent());
  harness.Answer(0, 0);
  harness.Run(harness.began_ms + 199 - harness.now_ms);
  for (const uint8_t byte : bytes) {
    harness.FeedByte(byte);
  }
  harness.Run(kTestWindowMs);
  EXPECT_FALSE(harness.leaving);
  EXPECT_TRUE(harness.RunUntilSent(kTestIdleMs + 9 * kTestSlotMs + 17));
}

TEST(ChannelTest, WaitsForTheAnswerToAForeignRequest) {
  Message message;
  ASSERT_TRUE(Encode(protocol::SenseRequest{kTestId + 1, 2, false, {}}, &message));
  ExpectHeldBy(FrameOf(message));
}

TEST(ChannelTest, WaitsAfterExactlyTheRequestsOfTheProtocolsList) {
  for (int opcode = 0; opcode < 0x80; ++opcode) {
    const bool opens = (opcode >= 0x01 && opcode <= 0x4F) || opcode == 0x52 ||
                       (opcode >= 0x61 && opcode <= 0x6F) || opcode == 0x71 || opcode == 0x72;
    if (opcode == protocol::kDle) {
      continue;  // cannot be an opcode
    }
    Harness harness;
    harness.hello.response_window_ms = 200;
    harness.GreetAndServe(1500);
    ASSERT_TRUE(harness.RunUntilSent());
    harness.Answer(0, 0);
    harness.Run(harness.began_ms + 199 - harness.now_ms);
    Message message;
    message.id = kTestId + 1;
    message.opcode = static_cast<uint8_t>(opcode);
    harness.Feed(message);
    EXPECT_EQ(!opens, harness.RunUntilSent(kTestIdleMs + 9 * kTestSlotMs + 17)) << opcode;
  }
}

TEST(ChannelTest, WaitsForTheAckOfAForeignCommand) {
  Message message;
  protocol::Command command;
  command.id = kTestId + 1;
  Encode(command, &message);
  ExpectHeldBy(FrameOf(message));
}

TEST(ChannelTest, WaitsAfterADamagedFrameWhichTheServerMayHaveUnderstood) {
  Message message;
  ASSERT_TRUE(Encode(protocol::SenseRequest{kTestId + 1, 2, false, {}}, &message));
  std::vector<uint8_t> frame = FrameOf(message);
  frame[4] ^= 0x01;
  ExpectHeldBy(frame);
}

TEST(ChannelTest, ForeignAnswerFreesTheChannel) {
  Harness harness;
  harness.hello.response_window_ms = 200;
  harness.GreetAndServe(1500);
  ASSERT_TRUE(harness.RunUntilSent());
  harness.Answer(0, 0);
  harness.Run(harness.began_ms + 199 - harness.now_ms);
  harness.FeedEncoded(protocol::SenseRequest{kTestId + 1, 2, false, {}});
  harness.Run(5);
  harness.FeedEncoded(protocol::SenseAnswer{kTestId + 1, 2, false, 0, 0});
  EXPECT_TRUE(harness.RunUntilSent(kTestIdleMs + 9 * kTestSlotMs + 17));
}

// The delay is in where the period lies: as long as the channel is free it begins there, with the
// next slot.
TEST(ChannelTest, PeriodKeepsItsPlaceWhileTheChannelIsFreeThere) {
  Harness harness;
  harness.GreetAndServe(1500);
  ASSERT_TRUE(harness.RunUntilSent());
  for (int i = 0; i < 20; ++i) {
    const uint32_t last_ms = harness.began_ms;
    harness.Answer(0, 0);
    harness.Run(10);
    harness.FeedEncoded(protocol::SenseAnswer{kTestId + 1, 2, false, 0, 0});
    ASSERT_TRUE(harness.RunUntilSent());
    EXPECT_GE(harness.began_ms - last_ms, 200u);
    EXPECT_LT(harness.began_ms - last_ms, 200u + kTestSlotMs);
  }
}

// Two that ask as fast as they can must not shut each other out.
TEST(ChannelTest, DelayIsRandomAfterAnExchangeThatWasFollowedAtOnceWhileOthersAreHeard) {
  Parameters parameters = TestParameters();
  parameters.period_ms = 0;
  Harness harness(parameters);
  harness.GreetAndServe(1500);
  ASSERT_TRUE(harness.RunUntilSent());
  std::set<uint32_t> delays;
  for (int i = 0; i < 40; ++i) {
    harness.FeedEncoded(protocol::SenseAnswer{kTestId + 1, 2, false, 0, 0});
    harness.Answer(0, 0);
    const uint32_t answered_ms = harness.now_ms;
    ASSERT_TRUE(harness.RunUntilSent());
    delays.insert(harness.began_ms - answered_ms);
  }
  EXPECT_GE(delays.size(), 5u);
  EXPECT_LE(*delays.rbegin(), kTestIdleMs + 8u * kTestSlotMs);
}

TEST(ChannelTest, ByteWithoutAFrameKeepsTheChannelBusyForTheIdleTime) {
  Harness harness;
  harness.GreetAndServe(1500);
  ASSERT_TRUE(harness.RunUntilSent());
  harness.Answer(0, 0);
  harness.Run(harness.began_ms + 199 - harness.now_ms);
  harness.FeedByte(0x55);  // of a frame whose beginning was missed
  harness.Run(kTestIdleMs - 1);
  EXPECT_FALSE(harness.leaving);
  EXPECT_TRUE(harness.RunUntilSent(1 + 9 * kTestSlotMs + 17));
}

// Whoever begins within a slot of another cannot have noticed it.
TEST(ChannelTest, TransmissionsBeginWithASlotCountedFromTheLastByte) {
  for (uint8_t id = 20; id < 40; ++id) {
    Parameters parameters = TestParameters();
    parameters.id = id;
    Harness harness(parameters);
    harness.GreetAndServe(1500 + id);
    harness.busy = true;
    harness.Run(300);
    harness.FeedByte(0x55);
    const uint32_t last_byte_ms = harness.now_ms;
    harness.busy = false;
    ASSERT_TRUE(harness.RunUntilSent());
    EXPECT_EQ(0u, (harness.began_ms - last_byte_ms - kTestIdleMs) % kTestSlotMs) << int{id};
  }
}

TEST(ChannelTest, TimeOfBytesFollowsTheBaudRateAndIsRoundedUp) {
  EXPECT_EQ(4, BytesMs(3, 9600));
  EXPECT_EQ(2, BytesMs(3, 19'200));
  EXPECT_EQ(1, BytesMs(3, 38'400));
  EXPECT_EQ(1, BytesMs(3, 115'200));
  EXPECT_EQ(1, BytesMs(3, 4'000'000));
  EXPECT_EQ(100, BytesMs(3, 300));
  EXPECT_EQ(146, BytesMs(protocol::kMaxFrame, 9600));
}

TEST(ChannelTest, IdleTimeFollowsTheBaudRate) {
  for (const uint32_t baud : {1200u, 9600u, 115'200u}) {
    Parameters parameters = TestParameters();
    parameters.baud = baud;
    Harness harness(parameters);
    harness.GreetAndServe(1500);
    harness.busy = true;
    harness.Run(300);
    harness.FeedByte(0x55);
    const uint32_t last_byte_ms = harness.now_ms;
    harness.busy = false;
    ASSERT_TRUE(harness.RunUntilSent());
    const uint32_t idle_ms = kTestSlotMs + BytesMs(3, baud);
    EXPECT_EQ(0u, (harness.began_ms - last_byte_ms - idle_ms) % kTestSlotMs) << baud;
  }
}

// Lets the server answer this robot and `others`, each of which is heard every 320 ms; returns how
// long the last whole period of this robot was.
uint32_t PeriodAmong(int others, Harness* harness) {
  uint32_t period_ms = 0;
  uint32_t began_ms = 0;
  for (int ms = 0; ms < 12000; ++ms) {
    const int turn = ms % 320;
    if (turn % 10 == 0 && turn / 10 < others) {
      const auto id = static_cast<uint8_t>(20 + turn / 10);
      harness->FeedEncoded(protocol::SenseAnswer{id, 2, false, 0, 0});
    }
    const int before = harness->frames_sent;
    harness->Serve(1);
    if (harness->frames_sent != before) {
      period_ms = harness->began_ms - began_ms;
      began_ms = harness->began_ms;
    }
  }
  return period_ms;
}

TEST(ChannelTest, PeriodIsStretchedWhenThereAreMoreRobotsThanItHolds) {
  for (const int others : {1, 2, 3, 7, 31}) {
    Harness harness;
    harness.GreetAndServe(1500);
    const uint32_t period_ms = PeriodAmong(others, &harness);
    // For each robot 28 ms for 26 bytes, the response window, and two slots; two slots less.
    const auto needed_ms = static_cast<uint32_t>(
        (others + 1) * (28 + kTestWindowMs + 2 * kTestSlotMs) - 2 * kTestSlotMs);
    const uint32_t expected_ms = std::max(needed_ms, 200u);
    EXPECT_GE(period_ms, expected_ms) << others;
    EXPECT_LE(period_ms, expected_ms + 9 * kTestSlotMs + kTestIdleMs) << others;
    EXPECT_EQ(needed_ms > 200, harness.conversation.congested()) << others;
    EXPECT_EQ(needed_ms > 200, harness.counters().stretched_periods != 0) << others;
    EXPECT_EQ(1u, harness.counters().hellos) << others;
    harness.Serve(9000);  // they have gone
    EXPECT_FALSE(harness.conversation.congested()) << others;
  }
}

// Lets the server speak to each of `ids` three times a second, and tells whether a period of 200 ms
// is too short for that many. It is for more than two.
bool CongestedBy(const std::vector<uint8_t>& ids) {
  Harness harness;
  harness.GreetAndServe(1500);
  for (int i = 0; i < 30; ++i) {
    for (const uint8_t id : ids) {
      harness.FeedEncoded(protocol::SenseAnswer{id, 2, false, 0, 0});
    }
    harness.Serve(320);
  }
  return harness.conversation.congested();
}

TEST(ChannelTest, EveryIdIsARobotOfItsOwn) {
  EXPECT_FALSE(CongestedBy({20, 52}));
  EXPECT_TRUE(CongestedBy({20, 52, 84}));
  EXPECT_TRUE(CongestedBy({1, 253, 254}));
}

TEST(ChannelTest, WhatIsForAllIsNotForARobot) {
  EXPECT_FALSE(CongestedBy({20, 52, protocol::kBroadcastId}));
}

// As many as there are IDs, on modems that are as slow as can be told.
TEST(ChannelTest, PeriodHasALimitHoweverManyRobotsThereAre) {
  Harness harness;
  harness.hello.slot_ms = 255;
  harness.hello.response_window_ms = 255;
  harness.GreetAndServe(5000);
  for (uint8_t id = 1; id < protocol::kBroadcastId; ++id) {
    harness.FeedEncoded(protocol::SenseAnswer{id, 2, false, 0, 0});
  }
  ASSERT_TRUE(harness.conversation.congested());
  ASSERT_TRUE(harness.RunUntilSent(10'000));
  harness.Answer(0, 0);
  const uint32_t began_ms = harness.began_ms;
  for (int i = 0; i < 15; ++i) {  // they stay
    EXPECT_FALSE(harness.RunUntilSent(2000));
    for (uint8_t id = 1; id < protocol::kBroadcastId; ++id) {
      harness.FeedEncoded(protocol::SenseAnswer{id, 2, false, 0, 0});
    }
  }
  EXPECT_TRUE(harness.RunUntilSent(35'000));
  EXPECT_GE(harness.began_ms - began_ms, 30'000u);
}

// A link without other stations may have any window.
TEST(ChannelTest, PeriodOfALoneRobotIsNotStretchedByALongResponseWindow) {
  Harness harness;
  harness.hello.response_window_ms = 255;
  harness.GreetAndServe(3000);
  EXPECT_FALSE(harness.conversation.congested());
  EXPECT_EQ(0u, harness.counters().stretched_periods);
}

// Two that began at the same moment have not heard each other.
TEST(ChannelTest, AfterAMissDelaysAreRandomForASecondAlthoughNobodyWasHeard) {
  Parameters parameters = TestParameters();
  parameters.period_ms = 0;
  Harness harness(parameters);
  harness.GreetAndServe(1500);
  ASSERT_TRUE(harness.RunUntilSent());
  const uint32_t missed_ms = harness.now_ms + kTestWindowMs + 1;
  ASSERT_TRUE(harness.RunUntilSent());
  std::set<uint32_t> delays;
  while (harness.now_ms < missed_ms + 900) {
    harness.Answer(0, 0);
    const uint32_t answered_ms = harness.now_ms;
    ASSERT_TRUE(harness.RunUntilSent());
    delays.insert(harness.began_ms - answered_ms);
  }
  EXPECT_GE(delays.size(), 5u);
}

// What looks like silence is a full channel; HELLO would only make it fuller.
TEST(ChannelTest, ServerThatAnswersOthersNeedsNoHello) {
  Harness harness;
  harness.GreetAndServe(1500);
  for (int i = 0; i < 100; ++i) {
    harness.Run(20);
    harness.FeedEncoded(protocol::SenseAnswer{kTestId + 1, 2, false, 0, 0});
  }
  EXPECT_EQ(kFailSafe, harness.conversation.state().flags);
  EXPECT_EQ(1u, harness.counters().hellos);
  harness.Serve(1000);
  EXPECT_EQ(kStraight, harness.conversation.state().wheels);
  EXPECT_TRUE(harness.events.empty());
}

TEST(ChannelTest, OwnEchoIsRecognised) {
  Harness harness;
  harness.Greet();
  ASSERT_TRUE(harness.RunUntilSent());
  harness.Feed(harness.sent);  // as a modem might
  EXPECT_EQ(1u, harness.counters().own_id_heard);
  EXPECT_EQ(0u, harness.counters().heard);
  harness.Answer(0, 0);
  EXPECT_EQ(kStraight, harness.conversation.state().wheels);
}

TEST(ChannelTest, DamagedAnswerIsNotBelieved) {
  Harness harness;
  harness.Greet();
  ASSERT_TRUE(harness.RunUntilSent());
  std::vector<uint8_t> frame = FrameOf(harness.AnswerToSent(0, 0));
  frame[5] ^= 0x01;
  for (const uint8_t byte : frame) {
    harness.FeedByte(byte);
  }
  EXPECT_EQ(kStill, harness.conversation.state().wheels);
  EXPECT_EQ(1u, harness.conversation.decoder_counters().crc_errors);
  ASSERT_TRUE(harness.RunUntilSent());
  EXPECT_EQ(1u, harness.counters().retries);
}

TEST(ChannelTest, AnswerThatNobodyAwaitsIsCounted) {
  Harness harness;
  harness.GreetAndServe(1500);
  ASSERT_TRUE(harness.RunUntilSent());
  harness.Answer(0, 0);
  harness.Answer(4096, 0);  // once more
  EXPECT_EQ(kStraight, harness.conversation.state().wheels);
  EXPECT_EQ(1u, harness.counters().late_answers);
}

TEST(ChannelTest, AnswerOfAnotherTypeIsNotBelieved) {
  Harness harness;
  harness.Greet();
  ASSERT_TRUE(harness.RunUntilSent());
  harness.FeedEncoded(protocol::SenseAnswer{kTestId, 1, false, 0, 0});
  harness.FeedEncoded(protocol::SenseAnswer{kTestId, 2, true, 0, 0});
  EXPECT_EQ(kStill, harness.conversation.state().wheels);
  EXPECT_EQ(2u, harness.counters().late_answers);
  harness.Answer(0, 0);
  EXPECT_EQ(kStraight, harness.conversation.state().wheels);
}

}  // namespace
}  // namespace client
}  // namespace pheromone
