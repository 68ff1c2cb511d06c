// MediumAccess by itself: when a robot may send (protocol/README.md, section 9). At 9600 baud a
// byte takes 1.04 ms, counted as 2.
#include "client_fw/core/medium/medium_access.h"

#include <gtest/gtest.h>

#include <climits>
#include <cstdint>
#include <set>
#include <vector>

#include "client_fw/core/testing/frames.h"
#include "protocol/frame.h"
#include "protocol/messages.h"
#include "protocol/signing.h"

namespace pheromone {
namespace client {
namespace {

constexpr uint8_t kUs = 7;
constexpr uint8_t kSlotMs = 3;
constexpr uint8_t kWindowMs = 30;
constexpr int kIdleMs = kSlotMs + 4;  // a slot and three bytes

std::vector<uint8_t> SenseOf(uint8_t id) {
  return FrameOf(protocol::SenseRequest{id, 1, false, {0, 0, 0}});
}
std::vector<uint8_t> AnswerTo(uint8_t id) {
  return FrameOf(protocol::SenseAnswer{id, 1, false, 1, 2});
}

class MediumAccessTest : public ::testing::Test {
 protected:
  MediumAccessTest() { medium_.Tune(kSlotMs, kWindowMs); }

  static Parameters Ours() {
    Parameters parameters;
    parameters.id = kUs;
    parameters.boot_counter = 1;
    return parameters;
  }

  // One millisecond of the loop.
  void Step(bool busy = false) {
    medium_.Advance(1);
    medium_.Poll(busy);
  }
  void Run(int ms, bool busy = false) {
    for (int i = 0; i < ms; ++i) {
      Step(busy);
    }
  }
  // A byte each millisecond.
  void Hear(const std::vector<uint8_t>& bytes) {
    for (const uint8_t byte : bytes) {
      Step();
      medium_.Hear(byte, false);
    }
  }
  // ms until it may begin; -1 if it may not for `patience_ms`.
  int Await(bool busy = false, bool urgent = false, int patience_ms = 3000) {
    for (int ms = 1; ms <= patience_ms; ++ms) {
      Step(busy);
      if (medium_.MayBegin(urgent)) {
        return ms;
      }
    }
    return -1;
  }
  void BeAlone() { Run(1100); }
  // Whether an answer to another is awaited, some time after the channel has become idle.
  bool IsHeld() {
    Run(kIdleMs + kSlotMs);
    medium_.Contend(MediumAccess::kAtOnce);
    return Await(false, false, 2 * kSlotMs) < 0;
  }

  MediumAccess medium_{Ours()};
};

TEST_F(MediumAccessTest, NobodySendsIntoACarrier) {
  medium_.Contend(MediumAccess::kAtOnce);
  EXPECT_EQ(Await(true, false, 1900), -1);
  EXPECT_GT(Await(), 0);
}

TEST_F(MediumAccessTest, ACarrierThatNeverEndsIsIgnoredAfterTwoSeconds) {
  medium_.Contend(MediumAccess::kAtOnce);
  const int waited = Await(true, false, 4000);
  EXPECT_GT(waited, 2000);
  EXPECT_LT(waited, 2500) << "two seconds and the longest frame";
  EXPECT_EQ(medium_.state().counters.ignored_carriers, 1u);
}

// Two that drew different delays are so far apart that the second has heard the first.
TEST_F(MediumAccessTest, BehindAnAdapterDelaysAreTwiceAsFarApartAsItHoldsBytesBack) {
  for (const uint8_t adapter_ms : {uint8_t{0}, uint8_t{1}, uint8_t{4}, uint8_t{16}}) {
    Parameters parameters = Ours();
    parameters.adapter_ms = adapter_ms;
    medium_ = MediumAccess(parameters);
    medium_.Tune(kSlotMs, kWindowMs);
    std::set<int> delays;
    for (int i = 0; i < 200; ++i) {
      medium_.OnSent();
      Run(kIdleMs);
      medium_.Contend(MediumAccess::kBackOff);
      delays.insert(Await());
    }
    // They are long: with one other robot at most it draws from half of them.
    EXPECT_EQ(delays.size(), adapter_ms == 0 ? kMinWindow : kMinWindow / 2) << int{adapter_ms};
    int before = INT_MIN / 2;
    for (const int delay : delays) {
      EXPECT_GE(delay - before, kSlotMs + 2 * adapter_ms) << int{adapter_ms};
      before = delay;
    }
  }
}

// The next slot, however long it takes until it begins.
TEST_F(MediumAccessTest, WhoGoesFirstWaitsForNoMoreThanTheChannel) {
  for (int i = 0; i < 20; ++i) {
    Hear(SenseOf(9));
    medium_.Contend(MediumAccess::kFirst);
    EXPECT_EQ(Await(false, false, kWindowMs / 2), -1) << "the answer is due";
    Hear(AnswerTo(9));
    EXPECT_LE(Await(), kIdleMs);
  }
}

// Who asked waits for its own adapter, too, before it goes on, and is heard late.
TEST_F(MediumAccessTest, BehindAnAdapterAWindowIsLonger) {
  Parameters parameters = Ours();
  parameters.adapter_ms = 16;
  medium_ = MediumAccess(parameters);
  medium_.Tune(kSlotMs, kWindowMs);
  BeAlone();
  Hear(SenseOf(9));
  Run(kWindowMs + 2 * parameters.adapter_ms);
  EXPECT_TRUE(IsHeld());
  Run(parameters.adapter_ms);
  EXPECT_FALSE(IsHeld());
}

TEST_F(MediumAccessTest, AFrameOfAnotherOpensAWindowForItsAnswer) {
  BeAlone();
  Hear(SenseOf(9));
  EXPECT_TRUE(IsHeld());
  Run(kWindowMs);
  EXPECT_FALSE(IsHeld());
  EXPECT_EQ(medium_.state().census.robots(), 1);
}

// Its own slots of 20 ms would leave a newcomer no room among those of the others.
TEST_F(MediumAccessTest, TheAnswerToTheHelloOfAnotherTellsTheSlotUntilOurOwnDoes) {
  protocol::HelloAnswer answer;
  answer.id = 9;
  answer.slot_ms = 5;
  protocol::Message message;
  Encode(answer, &message);
  const auto hear = [&](uint8_t added) {
    protocol::Message sent = message;
    sent.length = static_cast<uint8_t>(sent.length + added);
    Hear(FrameOf(sent));
  };
  for (const uint8_t added : {uint8_t{0}, protocol::kSignature}) {
    medium_.Tune(0, 0);
    hear(protocol::kSignature + 1);
    EXPECT_EQ(medium_.state().slot_ms, 20) << "another message";
    hear(added);
    EXPECT_EQ(medium_.state().slot_ms, 5);
    medium_.Tune(kSlotMs, kWindowMs);
    hear(added);
    EXPECT_EQ(medium_.state().slot_ms, kSlotMs);
    medium_ = MediumAccess(Ours());
  }
}

TEST_F(MediumAccessTest, TheAnswerEndsTheWindow) {
  BeAlone();
  Hear(SenseOf(9));
  Hear(AnswerTo(9));
  EXPECT_FALSE(IsHeld());
}

TEST_F(MediumAccessTest, AFrameThatIsIncompleteHoldsUsUntilItsGapTimeout) {
  BeAlone();
  std::vector<uint8_t> frame = SenseOf(9);
  frame.resize(8);
  Hear(frame);
  medium_.Contend(MediumAccess::kAtOnce);
  EXPECT_GT(Await(), Ours().gap_timeout_ms - 1);
  EXPECT_EQ(medium_.state().decoder.timeouts, 1u);
}

TEST_F(MediumAccessTest, DamagedFramesOpenWindowsUntilMostAreDamaged) {
  BeAlone();
  std::vector<uint8_t> damaged = SenseOf(9);
  damaged[6] ^= 0x20;
  for (int i = 0; i < 8; ++i) {
    Hear(damaged);
    EXPECT_TRUE(IsHeld()) << i;
  }
  for (int i = 0; i < 3; ++i) {
    Hear(damaged);
    EXPECT_FALSE(IsHeld()) << i;
  }
  EXPECT_EQ(medium_.state().counters.ignored_damage, 3u);
  EXPECT_EQ(medium_.state().decoder.crc_errors, 11u);
}

TEST_F(MediumAccessTest, NoiseThatGoesOnDoesNotHoldUsForEver) {
  BeAlone();
  for (int i = 0; i < 400; ++i) {
    Step();
    medium_.Hear(0x55, false);
  }
  medium_.Contend(MediumAccess::kAtOnce);
  bool began = false;
  for (int i = 0; i < 100 && !began; ++i) {
    Step();
    medium_.Hear(0x55, false);
    began = medium_.MayBegin(false);
  }
  EXPECT_TRUE(began);
  EXPECT_EQ(medium_.state().counters.ignored_noise, 1u);
}

// README: "Before every transmission, even on an idle channel, wait a random number of slots below
// the contention window CW, which is at least 8 slots".
TEST_F(MediumAccessTest, WithOthersAboutTheDelayIsRandomWholeSlots) {
  std::vector<int> seen(9);
  for (int i = 0; i < 400; ++i) {
    Hear(SenseOf(9));
    Hear(AnswerTo(9));
    Run(100);
    medium_.Contend(MediumAccess::kRandom);
    const int slots = (Await() + kSlotMs - 1) / kSlotMs;
    ASSERT_GE(slots, 1);
    ASSERT_LE(slots, 8);
    ++seen[static_cast<size_t>(slots)];
  }
  for (size_t slots = 1; slots <= 8; ++slots) {
    EXPECT_GT(seen[slots], 20) << slots << " slots: expected 50";
    EXPECT_LT(seen[slots], 90) << slots << " slots: expected 50";
  }
}

TEST_F(MediumAccessTest, OneThatIsAloneDoesNotWait) {
  BeAlone();
  int waited_ms = 0;
  for (int i = 0; i < 200; ++i) {
    medium_.Contend(MediumAccess::kRandom);
    waited_ms += Await();
    medium_.OnBegin();
    medium_.OnSent();
    medium_.OnOutcome(MediumAccess::kAnswered);
    Run(kIdleMs);
  }
  EXPECT_LT(waited_ms, 200 * 2) << "but for a pause now and then, in which it listens";
}

TEST_F(MediumAccessTest, AMissedAnswerWidensTheWindow) {
  Hear(SenseOf(9));
  int longest = 0;
  for (int i = 0; i < 100; ++i) {
    medium_.OnOutcome(MediumAccess::kMissed);
    medium_.Contend(MediumAccess::kBackOff);
    const int waited = Await();
    longest = waited > longest ? waited : longest;
  }
  EXPECT_GT(longest, 8 * kSlotMs + kIdleMs);
}

TEST_F(MediumAccessTest, WhileTheServerGrantsTurnsOnlyWhatIsUrgentIsSentInOpenings) {
  protocol::Round round;
  round.number = 1;
  round.turn_ms = 20;
  round.turn_bytes = 33;
  round.slot_ms = 5;
  round.open_slots = 6;
  round.turn_count = 1;
  round.turns[0] = 9;
  protocol::Message message;
  ASSERT_TRUE(Encode(round, &message));
  medium_.Tune(0, 0);
  ASSERT_TRUE(medium_.rounds()->OnRound(message.data, message.length));
  EXPECT_FALSE(medium_.Grant(message.data));
  EXPECT_EQ(medium_.state().slot_ms, 5) << "the ROUND tells it before HELLO is answered";
  medium_.Contend(MediumAccess::kRandom);
  EXPECT_EQ(Await(false, false, 60), -1);
  ASSERT_TRUE(medium_.rounds()->OnRound(message.data, message.length));
  medium_.Grant(message.data);
  medium_.Contend(MediumAccess::kRandom);
  const int waited = Await(false, true, 60);
  EXPECT_GT(waited, 20) << "the turn of another";
  EXPECT_LE(waited, 21 + 6 * 5);
}

TEST_F(MediumAccessTest, BeforeTheServerHasToldItASlotIsTwentyMilliseconds) {
  medium_.Tune(0, 0);
  EXPECT_EQ(medium_.state().slot_ms, 20);
  EXPECT_EQ(medium_.state().window_ms, Ours().first_window_ms);
  medium_.Tune(4, 50);
  EXPECT_EQ(medium_.state().slot_ms, 4);
  EXPECT_EQ(medium_.state().window_ms, 50);
}

}  // namespace
}  // namespace client
}  // namespace pheromone
