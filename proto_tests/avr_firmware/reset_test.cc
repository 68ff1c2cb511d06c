// Resets and losses of power of the image that one flashes, at every moment of an exchange: what it
// left on the map is there exactly once after a reset, at most once after a loss of power, and no
// later deposit is taken for a repetition.
#include <gtest/gtest.h>

#include <cstdint>
#include <iostream>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "proto_tests/avr_firmware/firmware_world.h"
#include "protocol/byte_order.h"

namespace pheromone::firmware {
namespace {

using sim::AvrMachine;

constexpr uint8_t kTraceOne = protocol::kTrace | 1;

// What an observer of the channel makes of it: a TRACE is the nonce of the last HELLO, its seq, and
// what it says.
class Observer {
 public:
  explicit Observer(const FirmwareWorld* world) : world_(world) {}

  void Listen() {
    for (; at_ < world_->heard().size(); ++at_) {
      const protocol::Message& message = world_->heard()[at_].message;
      protocol::HelloRequest hello;
      protocol::TraceRequest trace;
      protocol::TraceAnswer answer;
      if (Decode(message, &hello)) {
        if (hello.nonce != nonce_) {
          EXPECT_TRUE(nonces.insert(hello.nonce).second) << "nonce " << hello.nonce << " again";
        }
        nonce_ = hello.nonce;
      } else if (Decode(message, &trace)) {
        Sent(message, trace.seq);
      } else if (Decode(message, &answer)) {
        if (seq_ == answer.seq) {
          answered += last_answered_ ? 0u : 1u;
          last_answered_ = true;
        }
      }
    }
  }

  /// The last TRACE has been answered.
  bool quiet() const { return last_answered_; }

  std::set<uint16_t> nonces;
  uint64_t distinct = 0;  ///< TRACEs
  uint64_t answered = 0;  ///< of them
  uint64_t repeated = 0;  ///< transmissions of one that had been sent before
  uint64_t skipped = 0;   ///< one followed another that was never answered

 private:
  void Sent(const protocol::Message& message, uint8_t seq) {
    const std::vector<uint8_t> data(message.data, message.data + message.length);
    if (seq_ == seq && sent_under_ == nonce_) {
      EXPECT_EQ(data, data_) << "a repetition says the same";
      ++repeated;
      return;
    }
    skipped += distinct != 0 && !last_answered_ ? 1u : 0u;
    ++distinct;
    seq_ = seq;
    sent_under_ = nonce_;
    data_ = data;
    last_answered_ = false;
  }

  const FirmwareWorld* world_;
  size_t at_ = 0;
  uint16_t nonce_ = 0;
  int seq_ = -1;
  uint16_t sent_under_ = 0;
  std::vector<uint8_t> data_;
  bool last_answered_ = true;
};

// A robot that stands and leaves one quantum after another.
class ResetTest : public ::testing::Test {
 protected:
  ResetTest() : observer_(&world_) {
    EXPECT_TRUE(world_.RunUntil([&] { return world_.CountHeard(0x81) >= 2; }, 10'000));
    EXPECT_TRUE(world_.Set(client::kSpeedSetting, 0));
    EXPECT_TRUE(world_.Set(client::kPeriodSetting, 100));
    EXPECT_TRUE(world_.Set(client::kLayTrailSetting, 1));
    world_.RunFor(200);  // 38 bytes of 3.4 ms, until they are stored
    EXPECT_TRUE(RunUntilSent());
  }

  void TearDown() override {
    const AvrMachine& machine = world_.robot().machine();
    EXPECT_LE(machine.image_size().static_ram_bytes + machine.stack_bytes(), 2048u);
  }

  bool RunUntilSent() {
    const size_t before = world_.heard().size();
    return world_.RunUntil([&] { return world_.CountHeard(kTraceOne, before) != 0; }, 8'000);
  }
  bool RunUntilQuiet() {
    return world_.RunUntil(
        [&] {
          observer_.Listen();
          return observer_.quiet();
        },
        8'000);
  }

  // A robot that does not know where it is anymore says so and asks for nothing: it is told.
  // Returns whether it did not know. What comes before its HELLO was on the air before the reset.
  bool TellWhereItIsIfItIsLost(size_t since) {
    EXPECT_TRUE(
        world_.RunUntil([&] { return world_.CountHeard(protocol::kHello, since) != 0; }, 8'000));
    since = world_.heard().size();
    EXPECT_TRUE(world_.RunUntil(
        [&] {
          return world_.CountHeard(kTraceOne, since) != 0 ||
                 world_.CountEvents(protocol::EventCode::kPoseLost, since) != 0;
        },
        8'000));
    if (world_.CountHeard(kTraceOne, since) != 0) {
      return false;
    }
    EXPECT_TRUE(world_.GivePose(0, 0, 0));
    return true;
  }

  FirmwareWorld world_;
  Observer observer_;
};

// From the end of one TRACE past the end of the next: its answer, the pause, the next one's making
// and sending.
constexpr int64_t kExchangeUs = 125'000;

TEST_F(ResetTest, AWarmResetAtAnyMomentOfADepositLeavesItExactlyOnce) {
  int resets = 0;
  int lost = 0;  // a change of the memory was cut
  for (int64_t us = 0; us < kExchangeUs; us += 53, ++resets) {
    ASSERT_TRUE(RunUntilSent());
    world_.RunFor(us / 1000);
    world_.ResetAfter(us % 1000 * 1000, resets % 4 == 3 ? AvrMachine::Cause::kWatchdog
                                                        : AvrMachine::Cause::kExternal);
    lost += TellWhereItIsIfItIsLost(world_.heard().size()) ? 1 : 0;
    ASSERT_TRUE(RunUntilQuiet()) << "after " << us << " us";
    ASSERT_EQ(world_.Deposits(), observer_.distinct) << "after " << us << " us";
    ASSERT_EQ(observer_.answered, observer_.distinct);
    ASSERT_EQ(observer_.skipped, 0u) << "after " << us << " us";
  }
  EXPECT_GT(observer_.repeated, static_cast<uint64_t>(resets) / 10) << "the moments matter";
  EXPECT_LT(lost, resets / 50) << "a warm reset keeps the pose";
  std::cout << resets << " resets, pose lost " << lost << " times, " << observer_.distinct
            << " deposits, " << observer_.repeated << " repetitions, " << observer_.nonces.size()
            << " nonces\n";
}

TEST_F(ResetTest, ALossOfPowerAtAnyMomentOfADepositLeavesItAtMostOnceAndTheNextOneIsNew) {
  int losses = 0;
  for (int64_t us = 0; us < kExchangeUs; us += 1'037, ++losses) {
    ASSERT_TRUE(RunUntilSent());
    world_.RunFor(us / 1000);
    world_.ResetAfter(us % 1000 * 1000,
                      losses % 4 == 3 ? AvrMachine::Cause::kBrownOut : AvrMachine::Cause::kPowerOn);
    const bool lost = TellWhereItIsIfItIsLost(world_.heard().size());
    ASSERT_EQ(lost, losses % 4 == 3)
        << "only a supply that sagged leaves it in doubt; after " << us << " us";
    const uint64_t before = observer_.answered;
    ASSERT_TRUE(world_.RunUntil(
        [&] {
          observer_.Listen();
          return observer_.answered >= before + 3;
        },
        8'000))
        << "after " << us << " us";
    ASSERT_TRUE(RunUntilQuiet());
    ASSERT_EQ(world_.Deposits(), observer_.distinct) << "after " << us << " us";
  }
  EXPECT_EQ(observer_.nonces.size(), static_cast<size_t>(losses) + 1);
  std::cout << losses << " losses of power, " << observer_.distinct << " deposits\n";
}

TEST_F(ResetTest, PowerThatComesAndGoesWhileItStartsNeverGivesTheSameNonceTwice) {
  for (int64_t ms = 1; ms < 60; ++ms) {
    for (int i = 0; i < 3; ++i) {
      world_.ResetAfter(0, AvrMachine::Cause::kPowerOn);
      world_.RunFor(ms);
    }
    world_.ResetAfter(321'000, AvrMachine::Cause::kPowerOn);
    const size_t before = world_.heard().size();
    ASSERT_TRUE(
        world_.RunUntil([&] { return world_.CountHeard(protocol::kHello, before) != 0; }, 8'000));
    observer_.Listen();
  }
  EXPECT_GE(observer_.nonces.size(), 60u);
  ASSERT_TRUE(RunUntilSent()) << "and the settings are as they were";
}

}  // namespace
}  // namespace pheromone::firmware
