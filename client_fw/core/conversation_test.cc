// Periods, retries and the fail-safe.
#include "client_fw/core/conversation.h"

#include <gtest/gtest.h>

#include <set>

#include "client_fw/core/testing/conversation_harness.h"

namespace pheromone {
namespace client {
namespace {

using protocol::Reason;

TEST(ConversationTest, AsksOnceAPeriodWithThePoseOfThatMoment) {
  Harness harness;
  harness.GreetAndServe(1500);  // nobody else about for over a second: no random delay
  ASSERT_TRUE(harness.RunUntilSent());
  harness.Answer(0, 0);
  for (int i = 0; i < 10; ++i) {
    const uint32_t last_ms = harness.began_ms;
    harness.Run(100);
    harness.pose = {1000 + i, -2000 - i, static_cast<BinaryAngle>(100 * i)};
    ASSERT_TRUE(harness.RunUntilSent());
    EXPECT_EQ(200u, harness.began_ms - last_ms);
    const protocol::SenseRequest sense = harness.SentSense();
    EXPECT_EQ(kTestId, sense.id);
    EXPECT_EQ(2, sense.type);
    EXPECT_FALSE(sense.wide);
    EXPECT_EQ(1000 + i, sense.pose.x);
    EXPECT_EQ(-2000 - i, sense.pose.y);
    EXPECT_EQ(100 * i, sense.pose.heading);
    harness.Answer(0, 0);
  }
  EXPECT_EQ(0u, harness.counters().retries);
  EXPECT_EQ(0u, harness.counters().late_periods);
}

TEST(ConversationTest, SteersByTheChosenLaw) {
  for (const Law law : {Law::kDifferential, Law::kPaper}) {
    Parameters parameters = TestParameters();
    parameters.law = law;
    Harness harness(parameters);
    harness.Greet();
    ASSERT_TRUE(harness.RunUntilSent());
    harness.Answer(1024, 0);
    const WheelSpeeds expected = law == Law::kPaper ? WheelSpeeds{150, 50} : WheelSpeeds{150, 200};
    EXPECT_EQ(expected, harness.conversation.state().wheels);
    EXPECT_EQ(1024, harness.conversation.state().p_left);
    EXPECT_EQ(0, harness.conversation.state().p_right);
  }
}

TEST(ConversationTest, CoordinatesAreInTheServersUnit) {
  Harness harness;
  harness.hello.pose_unit_10um = 1000;  // centimetres
  harness.pose = {12344, -12345, 5};
  harness.Greet();
  ASSERT_TRUE(harness.RunUntilSent());
  EXPECT_EQ(1234, harness.SentSense().pose.x);
  EXPECT_EQ(-1235, harness.SentSense().pose.y);
}

TEST(ConversationTest, WideRequestsReachFarther) {
  Parameters parameters = TestParameters();
  parameters.wide = true;
  Harness harness(parameters);
  harness.pose = {1000000, -1000000, 7};
  harness.Greet();
  ASSERT_TRUE(harness.RunUntilSent());
  EXPECT_TRUE(harness.SentSense().wide);
  EXPECT_EQ(1000000, harness.SentSense().pose.x);
  harness.Answer(0, 4096);
  EXPECT_EQ((WheelSpeeds{200, 0}), harness.conversation.state().wheels);
}

TEST(ConversationTest, SaysNothingWithoutAPose) {
  Harness harness;
  harness.pose_known = false;
  harness.Greet();
  EXPECT_FALSE(harness.RunUntilSent(400));
  harness.pose_known = true;
  EXPECT_TRUE(harness.RunUntilSent(1000));
}

TEST(ConversationTest, MissIsCountedOneMillisecondAfterTheWindow) {
  Harness harness;
  harness.Greet();
  ASSERT_TRUE(harness.RunUntilSent());
  harness.Run(kTestWindowMs);
  EXPECT_EQ(0u, harness.counters().timeouts);
  harness.Step();
  EXPECT_EQ(1u, harness.counters().timeouts);
}

TEST(ConversationTest, AnAdapterOfOurOwnMakesTheWindowLonger) {
  Parameters parameters = TestParameters();
  parameters.adapter_ms = 16;
  Harness harness(parameters);
  harness.Greet();
  ASSERT_TRUE(harness.RunUntilSent());
  harness.Run(kTestWindowMs + 16);
  EXPECT_EQ(0u, harness.counters().timeouts);
  harness.Run(1);
  EXPECT_EQ(1u, harness.counters().timeouts);
}

TEST(ConversationTest, AnswerNeedOnlyBeginInTheWindow) {
  Harness harness;
  harness.Greet();
  ASSERT_TRUE(harness.RunUntilSent());
  harness.Run(kTestWindowMs);
  for (const uint8_t byte : FrameOf(harness.AnswerToSent(2048, 0))) {
    harness.FeedByte(byte);
    harness.Run(2);
  }
  EXPECT_EQ(0u, harness.counters().timeouts);
  EXPECT_EQ(1u, harness.counters().answers);
  EXPECT_EQ((WheelSpeeds{100, 200}), harness.conversation.state().wheels);
}

TEST(ConversationTest, AnswerThatBreaksOffIsAMissAfterTheGapTimeout) {
  Harness harness;
  harness.Greet();
  ASSERT_TRUE(harness.RunUntilSent());
  harness.Run(kTestWindowMs);
  const std::vector<uint8_t> frame = FrameOf(harness.AnswerToSent(0, 0));
  for (size_t i = 0; i < 6; ++i) {
    harness.FeedByte(frame[i]);
  }
  harness.Run(20);
  EXPECT_EQ(0u, harness.counters().timeouts);
  harness.Step();
  EXPECT_EQ(1u, harness.counters().timeouts);
  EXPECT_EQ(1u, harness.conversation.decoder_counters().timeouts);
}

// In a trial, clients waiting for an end that never came brought a channel down to 0.4 %.
TEST(ConversationTest, FrameThatNeverEndsDoesNotHoldUpALinkWithoutGapTimeout) {
  Parameters parameters = TestParameters();
  parameters.gap_timeout_ms = protocol::kNoGapTimeout;
  Harness harness(parameters);
  harness.Greet();
  harness.FeedByte(protocol::kDle);
  harness.FeedByte(protocol::kStx);
  harness.FeedByte(99);
  EXPECT_FALSE(harness.RunUntilSent(200));
  EXPECT_TRUE(harness.RunUntilSent(200));
}

TEST(ConversationTest, RetryCarriesAFreshPose) {
  Harness harness;
  harness.Greet();
  ASSERT_TRUE(harness.RunUntilSent());
  harness.pose.x_mm = 4321;
  ASSERT_TRUE(harness.RunUntilSent());
  EXPECT_EQ(4321, harness.SentSense().pose.x);
  EXPECT_EQ(1u, harness.counters().retries);
  harness.Answer(0, 0);
  EXPECT_EQ(kStraight, harness.conversation.state().wheels);
}

TEST(ConversationTest, FiveRetriesThenTheNextPeriod) {
  Parameters parameters = TestParameters();
  parameters.period_ms = 2000;
  parameters.fail_safe_ms = 5000;
  Harness harness(parameters);
  harness.Greet();
  ASSERT_TRUE(harness.RunUntilSent());
  for (int i = 0; i < 5; ++i) {  // in windows of 8 slots, since nobody else is heard
    const uint32_t missed_ms = harness.sent_ms + kTestWindowMs + 1;
    ASSERT_TRUE(harness.RunUntilSent());
    EXPECT_LE(harness.began_ms - missed_ms, 8 * kTestSlotMs);
  }
  EXPECT_EQ(5u, harness.counters().retries);
  EXPECT_EQ(6u, harness.counters().requests);
  const uint32_t last_ms = harness.began_ms;
  ASSERT_TRUE(harness.RunUntilSent());
  EXPECT_EQ(1u, harness.counters().abandoned);
  EXPECT_EQ(5u, harness.counters().retries);
  EXPECT_EQ(2000u, harness.began_ms - last_ms);
}

TEST(ConversationTest, BackOffIsARandomNumberOfWholeSlots) {
  std::set<uint32_t> delays;
  for (uint8_t id = 1; id <= 40; ++id) {
    Parameters parameters = TestParameters();
    parameters.id = id;
    Harness harness(parameters);
    harness.GreetAndServe(id % 2 == 0 ? 0 : 1500);
    for (uint8_t other = 200; other < 204; ++other) {
      harness.FeedEncoded(protocol::SenseAnswer{other, 2, false, 0, 0});
    }
    ASSERT_TRUE(harness.RunUntilSent());
    const uint32_t missed_ms = harness.sent_ms + kTestWindowMs + 1;
    ASSERT_TRUE(harness.RunUntilSent());
    delays.insert(harness.began_ms - missed_ms);
    EXPECT_EQ(0u, (harness.began_ms - missed_ms) % kTestSlotMs);
  }
  EXPECT_GT(delays.size(), 10u);
  EXPECT_EQ(15u * kTestSlotMs, *delays.rbegin());  // of 16 slots: four others are about
}

// A period that was given up says nothing about the next one: its window is the smallest again.
TEST(ConversationTest, AfterAPeriodThatWasGivenUpDelaysAreShortAgain) {
  std::set<uint32_t> delays;
  for (uint8_t id = 1; id <= 60; ++id) {
    Parameters parameters = TestParameters();
    parameters.id = id;
    parameters.fail_safe_ms = 5000;  // no HELLO in between
    parameters.period_ms = 0;        // the next one begins at once
    Harness harness(parameters);
    harness.GreetAndServe(1500);
    for (uint8_t other = 200; other < 204; ++other) {
      harness.FeedEncoded(protocol::SenseAnswer{other, 2, false, 0, 0});
    }
    for (int attempt = 0; attempt <= kMaxRetries; ++attempt) {
      ASSERT_TRUE(harness.RunUntilSent());
    }
    const uint32_t missed_ms = harness.sent_ms + kTestWindowMs + 1;
    harness.Run(kTestWindowMs + 2);
    ASSERT_EQ(1u, harness.counters().abandoned);
    ASSERT_TRUE(harness.RunUntilSent());
    delays.insert(harness.began_ms - missed_ms);
  }
  ASSERT_GE(delays.size(), 5u);
  EXPECT_LE(*delays.rbegin(), kMinWindow * kTestSlotMs);
}

TEST(ConversationTest, PeriodCountsFromTheLastSendingSoThatItMovesToAFreePlace) {
  Harness harness;
  harness.GreetAndServe(1500);
  ASSERT_TRUE(harness.RunUntilSent());
  harness.Answer(0, 0);
  const uint32_t planned_ms = harness.began_ms + 200;
  harness.busy = true;
  harness.Run(planned_ms + 50 - harness.now_ms);
  harness.busy = false;
  ASSERT_TRUE(harness.RunUntilSent());
  harness.Answer(0, 0);
  const uint32_t moved_ms = harness.began_ms;
  EXPECT_GE(moved_ms - planned_ms, 50u);
  ASSERT_TRUE(harness.RunUntilSent());
  EXPECT_EQ(200u, harness.began_ms - moved_ms);
}

TEST(ConversationTest, PeriodThatPassedDuringAnExchangeBeginsAtOnce) {
  Harness harness;
  harness.hello.response_window_ms = 250;
  harness.GreetAndServe(1500);
  ASSERT_TRUE(harness.RunUntilSent());
  harness.Run(240);
  harness.Answer(0, 0);
  EXPECT_EQ(1u, harness.counters().late_periods);
  EXPECT_TRUE(harness.RunUntilSent(16));
}

// A pause now and then is for others that could not be heard.
TEST(ConversationTest, AsFastAsItGoesMeansAtOnceAfterTheAnswerButForAFewPauses) {
  for (const uint16_t period_ms : {uint16_t{0}, uint16_t{1}}) {
    Parameters parameters = TestParameters();
    parameters.period_ms = period_ms;
    Harness harness(parameters);
    harness.GreetAndServe(1500);
    ASSERT_TRUE(harness.RunUntilSent());
    int pauses = 0;
    for (int i = 0; i < 640; ++i) {
      harness.Answer(0, 0);
      const uint32_t answered_ms = harness.now_ms;
      ASSERT_TRUE(harness.RunUntilSent(16 + 8 * kTestSlotMs));
      if (harness.began_ms != answered_ms + 1) {
        ++pauses;
        EXPECT_GT(harness.began_ms, answered_ms + 7 * kTestSlotMs);
      }
    }
    EXPECT_GE(pauses, 1);
    EXPECT_LE(pauses, 25);  // 10 on the average
  }
}

TEST(FailSafeTest, StopsWhenAnswersStop) {
  Harness harness;
  harness.GreetAndServe(1500);
  ASSERT_TRUE(harness.RunUntilSent());
  harness.Answer(0, 0);
  harness.Run(499);
  EXPECT_EQ(kStraight, harness.conversation.state().wheels);
  harness.Step();
  EXPECT_EQ(kStill, harness.conversation.state().wheels);
  EXPECT_EQ(kFailSafe, harness.conversation.state().flags);
  EXPECT_EQ(1u, harness.counters().fail_safe_stops);
}

TEST(FailSafeTest, SaysHelloAgainAfterTheSilenceAndGoesOnWithAnAnswer) {
  Harness harness;
  harness.GreetAndServe(1500);
  harness.Run(200 * kTestSlotMs);
  EXPECT_EQ(kFailSafe, harness.conversation.state().flags);
  const uint32_t abandoned = harness.counters().abandoned;
  while (harness.sent.opcode != protocol::kHello) {
    ASSERT_TRUE(harness.RunUntilSent());
  }
  EXPECT_LE(harness.counters().abandoned, abandoned + 1);
  harness.hello.pose_unit_10um = 1000;  // as reconfigured meanwhile
  harness.AnswerHello();
  EXPECT_EQ(kStill, harness.conversation.state().wheels);
  ASSERT_TRUE(harness.RunUntilSent());
  EXPECT_EQ(100, harness.SentSense().pose.x);
  harness.Answer(0, 0);
  EXPECT_EQ(kStraight, harness.conversation.state().wheels);
  EXPECT_EQ(1u, harness.counters().fail_safe_stops);
}

// In bad air HELLO and its answer arrive more seldom than a request: robots that said it after
// every silence would say little else.
TEST(FailSafeTest, HelloIsSaidAgainOnlyWhenARequestWasGivenUp) {
  Parameters parameters = TestParameters();
  parameters.fail_safe_ms = 100;
  Harness harness(parameters);
  harness.hello.slot_ms = 1;
  harness.Greet();
  for (int bad = 0; bad < 20; ++bad) {
    const uint32_t silent_from_ms = harness.now_ms;
    for (int tries = 0; tries <= kMaxRetries; ++tries) {
      ASSERT_TRUE(harness.RunUntilSent());
      ASSERT_EQ(protocol::kSense | 2, harness.sent.opcode) << bad << ' ' << tries;
    }
    EXPECT_GT(harness.now_ms - silent_from_ms, 200u) << "slots";
    harness.Answer(0, 0);
    ASSERT_EQ(kStraight, harness.conversation.state().wheels);
  }
  EXPECT_EQ(1u, harness.counters().hellos);
  for (int tries = 0; tries <= kMaxRetries; ++tries) {
    ASSERT_TRUE(harness.RunUntilSent());
    ASSERT_EQ(protocol::kSense | 2, harness.sent.opcode) << tries;
  }
  ASSERT_TRUE(harness.RunUntilSent());
  EXPECT_EQ(protocol::kHello, harness.sent.opcode);
  EXPECT_EQ(1u, harness.counters().abandoned);
}

TEST(FailSafeTest, OthersAnswersDoNotCount) {
  Harness harness;
  harness.GreetAndServe(1500);
  for (int i = 0; i < 60; ++i) {
    harness.Run(10);
    harness.FeedEncoded(protocol::SenseAnswer{kTestId + 1, 2, false, 4096, 0});
  }
  EXPECT_EQ(kFailSafe, harness.conversation.state().flags);
  EXPECT_EQ(60u, harness.counters().heard);
  EXPECT_EQ(0, harness.conversation.state().p_left);
}

TEST(FailSafeTest, ErrorsDoNotCountAsAnswersButSpareTheHello) {
  Harness harness;
  harness.GreetAndServe(1500);
  for (int i = 0; i < 5; ++i) {
    ASSERT_TRUE(harness.RunUntilSent());
    ASSERT_EQ(protocol::kSense | 2, harness.sent.opcode);
    harness.AnswerError(Reason::kReadOnly);
  }
  EXPECT_EQ(kFailSafe, harness.conversation.state().flags);
  EXPECT_EQ(Reason::kReadOnly, harness.conversation.requests().last_error);
  EXPECT_EQ(5u, harness.counters().errors);
  EXPECT_EQ(1u, harness.counters().hellos);
}

TEST(FailSafeTest, PauseOfTheWholeLoopStopsTheRobot) {
  // 65 536 ms is no time at all for 16 bits of clock.
  for (const uint32_t pause_ms : {30001u, 65536u, 65600u, 0x80000000u}) {
    Harness harness;
    harness.GreetAndServe(1500);
    ASSERT_EQ(kStraight, harness.conversation.state().wheels);
    harness.now_ms += pause_ms;
    harness.Step();
    EXPECT_EQ(kStill, harness.conversation.state().wheels) << pause_ms;
    EXPECT_EQ(1u, harness.counters().fail_safe_stops);
    harness.Serve(1000);
    EXPECT_EQ(kStraight, harness.conversation.state().wheels) << pause_ms;
    EXPECT_EQ(1u, harness.counters().hellos) << "the server answers the next request";
  }
}

TEST(FailSafeTest, LastsAndHelloGoesOnHoweverLongTheServerIsSilent) {
  Harness harness;
  harness.GreetAndServe(1500);
  uint32_t silent_ms = 1000;
  harness.Run(silent_ms);
  for (const uint32_t until_ms : {20000u, 40000u, 70000u, 140000u}) {
    for (; silent_ms < until_ms; ++silent_ms) {
      harness.Step();
      ASSERT_EQ(kFailSafe, harness.conversation.state().flags) << silent_ms;
      ASSERT_EQ(kStill, harness.conversation.state().wheels) << silent_ms;
    }
    const uint32_t hellos = harness.counters().hellos;
    harness.Run(2000);  // HELLO's pauses are up to 1.6 s and the window
    silent_ms += 2000;
    EXPECT_GT(harness.counters().hellos, hellos) << until_ms;
    EXPECT_EQ(protocol::kHello, harness.sent.opcode);
  }
  EXPECT_EQ(1u, harness.counters().fail_safe_stops);
  harness.Serve(3000);
  EXPECT_EQ(kStraight, harness.conversation.state().wheels);
}

TEST(FailSafeTest, ClockMayWrap) {
  for (const uint32_t before_ms : {100u, 700u, 1501u, 1620u}) {
    Harness harness(TestParameters(), 0u - before_ms);
    harness.GreetAndServe(5000);
    EXPECT_EQ(kStraight, harness.conversation.state().wheels);
    EXPECT_EQ(0u, harness.counters().fail_safe_stops);
    EXPECT_EQ(1u, harness.counters().hellos);
    harness.Run(700);
    EXPECT_EQ(kStill, harness.conversation.state().wheels);
  }
}

}  // namespace
}  // namespace client
}  // namespace pheromone
