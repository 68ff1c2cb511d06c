// What the AVR's board owes the core, seen at the pins of the whole image: the ID, the boot number,
// PTT, the carrier's line, sleep, and no byte lost.
#include <gtest/gtest.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client_fw/core/steering/settings.h"
#include "client_fw/sim/avr/avr_machine.h"
#include "client_fw/sim/avr/avr_settings.h"
#include "protocol/decoder.h"
#include "protocol/messages.h"

namespace pheromone::conformance {
namespace {

using sim::AvrMachine;
using sim::AvrMachineConfig;
using sim::AvrPin;

constexpr int64_t kMs = 1'000'000;
constexpr int64_t kByteNs = 1'040'000;  // as the chip has it: 9615 baud
constexpr int64_t kBitNs = kByteNs / 10;
constexpr AvrPin kPtt = {'D', 4};
constexpr AvrPin kCarrier = {'D', 5};

AvrMachineConfig Config() {
  AvrMachineConfig config;
  config.image = PHEROMONE_AVR_CLIENT_IMAGE;
  return config;
}

struct Edge {
  bool high;
  int64_t time_ns;
};

struct Sent {
  uint8_t byte;
  int64_t time_ns;
};

// A machine whose radio is listened to.
class Board {
 public:
  explicit Board(const AvrMachineConfig& config = Config()) : machine(config) {
    machine.SetPin(kCarrier, true);
    machine.OnSent(AvrMachine::kRadio, [this](uint8_t byte, int64_t time_ns) {
      radio.push_back({byte, time_ns});
      if (decoder_.Push(byte, static_cast<uint32_t>(time_ns / kMs))) {
        protocol::HelloRequest hello;
        if (Decode(decoder_.message(), &hello)) {
          hellos.push_back(hello);
        }
      }
    });
    machine.OnSent(AvrMachine::kRobot, [this](uint8_t byte, int64_t time_ns) {
      robot.push_back({byte, time_ns});
    });
    machine.OnPin(kPtt, [this](bool high, int64_t time_ns) { ptt.push_back({high, time_ns}); });
  }

  void RunFor(int64_t ms) { machine.RunTo(machine.now_ns() + ms * kMs); }

  // The next HELLO; none within two seconds: nothing.
  std::optional<protocol::HelloRequest> NextHello() {
    const size_t had = hellos.size();
    for (int i = 0; i < 200 && hellos.size() == had; ++i) {
      RunFor(10);
    }
    return hellos.size() == had ? std::nullopt : std::optional(hellos.back());
  }

  AvrMachine machine;
  std::vector<Sent> radio;
  std::vector<Sent> robot;
  std::vector<Edge> ptt;
  std::vector<protocol::HelloRequest> hellos;

 private:
  protocol::FrameDecoder decoder_{protocol::kNoGapTimeout};
};

uint8_t IdWith(const AvrMachineConfig& config) {
  Board board(config);
  const auto hello = board.NextHello();
  return hello ? hello->id : uint8_t{0};
}

TEST(AvrBoard, TakesItsIdFromTheStraps) {
  AvrMachineConfig config = Config();
  config.grounded = {{'A', 0}, {'A', 3}, {'A', 7}};
  config.eeprom = std::vector<uint8_t>(256, 0xFF);
  config.eeprom[255] = 42;
  EXPECT_EQ(IdWith(config), 0x89);
}

TEST(AvrBoard, TakesItsIdFromEepromWithoutStrapsAndIsOneIfThatIsErased) {
  AvrMachineConfig config = Config();
  EXPECT_EQ(IdWith(config), 1);
  config.eeprom = std::vector<uint8_t>(256, 0xFF);
  config.eeprom[255] = 42;
  EXPECT_EQ(IdWith(config), 42);
}

// The machine refuses a rate that is not the peers'. Without a Pioneer, CLOSE follows SYNC0 after a
// second, and SYNC0 after 200 ms more: by the firmware's own clock.
TEST(AvrBoard, WorksWithTheSlowestAndTheFastestOfTheUsualCrystals) {
  for (const uint32_t hz : {7'372'800u, 20'000'000u}) {
    AvrMachineConfig config = Config();
    config.image = PHEROMONE_AVR_IMAGES "/client_avr_" + std::to_string(hz) + ".elf";
    config.frequency_hz = hz;
    Board board(config);
    // A silent robot, whose port follows: after each SYNC0 comes the next rate.
    const int64_t bauds[] = {9'600, 38'400, 19'200, 57'600};
    for (int ms = 0; ms < 7'000; ++ms) {
      board.RunFor(1);
      board.machine.set_robot_baud(bauds[(board.robot.size() / 6 + 1) / 2 % 4]);
    }
    ASSERT_TRUE(board.NextHello()) << hz;
    std::vector<int64_t> at_ns;  // of each command's first byte
    for (size_t i = 0; i < board.robot.size(); i += 6) {
      ASSERT_EQ(board.robot[i].byte, 0xFA);
      at_ns.push_back(board.robot[i].time_ns);
    }
    ASSERT_GE(at_ns.size(), 9u);
    for (size_t i = 2; i < at_ns.size(); ++i) {  // the first waited for the line
      const int64_t expected_ns = (i % 2 == 1 ? 1'000 : 200) * kMs;
      EXPECT_NEAR(static_cast<double>(at_ns[i] - at_ns[i - 1]), static_cast<double>(expected_ns),
                  2.0 * kMs)
          << hz << ", command " << i;
    }
  }
}

TEST(AvrBoard, HasANewNonceAfterPowerUpAndTheSameAfterAWarmReset) {
  Board board;
  const auto first = board.NextHello();
  ASSERT_TRUE(first);
  for (const auto cause : {AvrMachine::Cause::kExternal, AvrMachine::Cause::kWatchdog}) {
    board.machine.Reset(cause);
    const auto again = board.NextHello();
    ASSERT_TRUE(again);
    EXPECT_EQ(again->nonce, first->nonce);
  }
  uint16_t last = first->nonce;
  for (const auto cause : {AvrMachine::Cause::kPowerOn, AvrMachine::Cause::kBrownOut}) {
    board.machine.Reset(cause);
    const auto fresh = board.NextHello();
    ASSERT_TRUE(fresh);
    EXPECT_EQ(fresh->nonce, last + 1);
    last = fresh->nonce;
  }
}

TEST(AvrBoard, RaisesPttForTheWholeTransmissionAndNoLonger) {
  Board board;
  ASSERT_TRUE(board.NextHello());
  board.RunFor(20);
  ASSERT_EQ(board.ptt.size(), 2u);
  EXPECT_TRUE(board.ptt[0].high);
  EXPECT_FALSE(board.ptt[1].high);
  const int64_t first_bit_ns = board.radio.front().time_ns - kByteNs;
  const int64_t end_ns = board.radio.back().time_ns;
  EXPECT_LE(board.ptt[0].time_ns, first_bit_ns);
  EXPECT_GE(board.ptt[1].time_ns, end_ns);
  EXPECT_LT(board.ptt[1].time_ns, end_ns + kMs / 10);
}

// From PTT's edge to the first start bit, and from the last stop bit to PTT's other edge.
TEST(AvrBoard, KeysTheTransmitterForItsLeadAndTail) {
  struct Case {
    uint16_t lead_ms;
    uint16_t tail_ms;
  };
  for (const auto& [lead_ms, tail_ms] : {Case{0, 0}, Case{1, 1}, Case{0, 30}, Case{25, 0},
                                         Case{50, 7}, Case{255, 256}, Case{500, 500}}) {
    client::Settings settings;
    settings.ptt_lead_ms = lead_ms;
    settings.ptt_tail_ms = tail_ms;
    AvrMachineConfig config = Config();
    config.eeprom = sim::AvrEepromWith(settings, 1);
    Board board(config);
    for (size_t transmission = 0; transmission < 3; ++transmission) {
      const std::string which = std::to_string(lead_ms) + ", " + std::to_string(tail_ms) + ", " +
                                std::to_string(transmission);
      const size_t began = board.radio.size();
      ASSERT_TRUE(board.NextHello()) << which;
      board.RunFor(tail_ms + 2);
      ASSERT_EQ(board.ptt.size(), 2 * transmission + 2) << which;
      const Edge keyed = board.ptt[2 * transmission];
      const Edge unkeyed = board.ptt[2 * transmission + 1];
      EXPECT_TRUE(keyed.high && !unkeyed.high) << which;
      const int64_t lead_ns = board.radio[began].time_ns - kByteNs - keyed.time_ns;
      EXPECT_NEAR(static_cast<double>(lead_ns), lead_ms * 1e6, kBitNs) << which;
      const int64_t tail_ns = unkeyed.time_ns - board.radio.back().time_ns;
      EXPECT_NEAR(static_cast<double>(tail_ns), tail_ms * 1e6, kBitNs) << which;
      // No gap within it.
      EXPECT_EQ(board.radio.back().time_ns - board.radio[began].time_ns,
                static_cast<int64_t>(board.radio.size() - began - 1) * kByteNs)
          << which;
    }
  }
}

TEST(AvrBoard, SendsAFrameWithoutGaps) {
  Board board;
  ASSERT_TRUE(board.NextHello());
  for (size_t i = 1; i < board.radio.size(); ++i) {
    EXPECT_NEAR(static_cast<double>(board.radio[i].time_ns - board.radio[i - 1].time_ns), kByteNs,
                kByteNs / 100.0);
  }
}

TEST(AvrBoard, IsSilentWhileThereIsACarrier) {
  Board board;
  board.machine.SetPin(kCarrier, false);
  board.RunFor(2000);
  EXPECT_TRUE(board.radio.empty());
  board.machine.SetPin(kCarrier, true);
  EXPECT_TRUE(board.NextHello());
}

TEST(AvrBoard, IgnoresACarrierThatNeverEnds) {
  Board board;
  board.machine.SetPin(kCarrier, false);
  board.RunFor(3000);
  EXPECT_FALSE(board.radio.empty());
}

TEST(AvrBoard, LosesNoByteWhenBothLinesAreBusyAllTheTime) {
  Board board;
  constexpr int kBytes = 3000;
  for (int i = 0; i < kBytes; ++i) {
    const int64_t at_ns = 200 * kMs + i * kByteNs;
    board.machine.Send(AvrMachine::kRadio, 0x55, at_ns);
    board.machine.Send(AvrMachine::kRobot, 0x55, at_ns + kByteNs / 3);
  }
  board.RunFor(200 + kBytes * kByteNs / kMs + 100);
  for (const auto port : {AvrMachine::kRadio, AvrMachine::kRobot}) {
    EXPECT_EQ(board.machine.uart(port).received, uint64_t{kBytes});
    EXPECT_EQ(board.machine.uart(port).overruns, 0u);
  }
  EXPECT_EQ(board.machine.watchdog_resets(), 0u);
}

TEST(AvrBoard, SleepsMostOfTheTime) {
  Board board;
  board.RunFor(2000);
  EXPECT_GT(board.machine.cycles_asleep(), board.machine.cycles() * 8 / 10);
  EXPECT_EQ(board.machine.watchdog_resets(), 0u);
}

}  // namespace
}  // namespace pheromone::conformance
