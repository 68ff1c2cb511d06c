// The AVR machine against what the data sheet says, with a small image that echoes
// (testing/avr_echo_image.cc).
#include "client_fw/sim/avr/avr_machine.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <cstdlib>
#include <random>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

#include "client_fw/sim/testing/avr_echo_image.h"

namespace pheromone::sim {
namespace {

using Bytes = std::vector<uint8_t>;

constexpr int64_t kMs = 1'000'000;
constexpr int64_t kByte = 1'040'000;      // the image's: 10 bits of 16 * 104 cycles at 16 MHz
constexpr int64_t kPeerByte = 1'041'666;  // at 9600 baud
constexpr AvrPin kPtt = {'D', 4};
constexpr AvrPin kCarrier = {'D', 5};

constexpr uint8_t kPowerOnFlag = 1;
constexpr uint8_t kExternalFlag = 2;
constexpr uint8_t kBrownOutFlag = 4;
constexpr uint8_t kWatchdogFlag = 8;

struct TimedByte {
  uint8_t byte;
  int64_t time_ns;
};

// A machine that notes what comes out of it.
class Echo {
 public:
  explicit Echo(AvrMachineConfig config = {}) : machine(Complete(std::move(config))) {
    machine.OnSent(AvrMachine::kRadio, [this](uint8_t byte, int64_t at) {
      radio.push_back({byte, at});
    });
    machine.OnSent(AvrMachine::kRobot, [this](uint8_t byte, int64_t at) {
      robot.push_back({byte, at});
    });
    machine.OnPin(kPtt, [this](bool high, int64_t at) { ptt.emplace_back(high, at); });
  }

  /// Runs until the start has been reported.
  Echo& Started() {
    RunFor(10 * kMs);
    return *this;
  }
  void RunFor(int64_t ns) { machine.RunTo(machine.now_ns() + ns); }

  /// Has a letter obeyed, and waits for the answer.
  uint8_t Ask(char letter) {
    machine.Send(AvrMachine::kRobot, static_cast<uint8_t>(letter), machine.now_ns() + kPeerByte);
    const size_t before = robot.size();
    for (int ms = 0; ms < 50 && robot.size() == before; ++ms) {
      RunFor(kMs);
    }
    return robot.size() > before ? robot.back().byte : 0;
  }

  static Bytes BytesOf(const std::vector<TimedByte>& timed) {
    Bytes bytes;
    for (const TimedByte& one : timed) {
      bytes.push_back(one.byte);
    }
    return bytes;
  }

  AvrMachine machine;
  std::vector<TimedByte> radio;
  std::vector<TimedByte> robot;
  std::vector<std::pair<bool, int64_t>> ptt;

 private:
  static AvrMachineConfig Complete(AvrMachineConfig config) {
    if (config.image.empty()) {
      config.image = PHEROMONE_AVR_ECHO_IMAGE;
    }
    return config;
  }
};

std::string WhyItFails(Echo* echo, char letter) {
  try {
    echo->Ask(letter);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

// --- UARTs.

TEST(AvrUartTest, ABytePassesAtItsStopBitAndTheNextFollowsWithoutAGap) {
  Echo echo;
  echo.Started();
  const int64_t begin = echo.machine.now_ns();
  ASSERT_EQ(echo.Ask('d'), 'd');
  echo.RunFor(5 * kMs);
  ASSERT_EQ(Echo::BytesOf(echo.radio), (Bytes{'A', 'B', 'C'}));
  EXPECT_EQ(echo.radio[1].time_ns - echo.radio[0].time_ns, kByte);
  EXPECT_EQ(echo.radio[2].time_ns - echo.radio[1].time_ns, kByte);
  const int64_t asked = begin + kPeerByte;  // the letter's stop bit
  EXPECT_GE(echo.radio[0].time_ns, asked + kByte);
  EXPECT_LT(echo.radio[0].time_ns, asked + kByte + 10'000) << "a letter is obeyed within 10 us";
}

TEST(AvrUartTest, WritingToAFullTransmitterIsAnError) {
  Echo echo;
  echo.Started();
  EXPECT_EQ(WhyItFails(&echo, 'o'),
            "the firmware's UART0 was given a byte while its data register was full");
}

TEST(AvrUartTest, PttFallsAfterTheLastStopBitAndNotBefore) {
  Echo echo;
  echo.Started();
  const int64_t begin = echo.machine.now_ns();
  for (int i = 1; i <= 20; ++i) {
    echo.machine.Send(AvrMachine::kRadio, static_cast<uint8_t>(i), begin + i * kPeerByte);
  }
  echo.RunFor(40 * kMs);
  ASSERT_EQ(echo.radio.size(), 20u);
  // The image is a little faster than its peer, so each byte is a transmission of its own, or two
  // are one: every fall follows a stop bit directly, and no stop bit comes while PTT is down.
  size_t falls = 0;
  for (const auto& [high, at] : echo.ptt) {
    if (!high) {
      ++falls;
      int64_t since = 1'000'000'000;
      for (const TimedByte& sent : echo.radio) {
        if (sent.time_ns <= at) {
          since = at - sent.time_ns;
        }
      }
      EXPECT_LT(since, 5'000) << "at " << at;
    }
  }
  EXPECT_GE(falls, 1u);
  EXPECT_FALSE(echo.ptt.back().first);
  EXPECT_GT(echo.ptt.back().second, echo.radio.back().time_ns);
}

TEST(AvrUartTest, OfFiveBytesThatNobodyReadsTwoAreKeptAndThreeAreOverruns) {
  Echo echo;
  echo.Started();
  const int64_t begin = echo.machine.now_ns();
  echo.machine.Send(AvrMachine::kRobot, 'b', begin + kPeerByte);
  for (int i = 1; i <= 5; ++i) {
    echo.machine.Send(AvrMachine::kRadio, static_cast<uint8_t>('0' + i),
                      begin + kPeerByte + i * kPeerByte * 9 / 10);
  }
  echo.RunFor(30 * kMs);
  EXPECT_EQ(echo.machine.uart(AvrMachine::kRadio).overruns, 2u);
  EXPECT_EQ(Echo::BytesOf(echo.radio), (Bytes{'1', '2', '5'})) << "5 comes when they are read";
}

TEST(AvrUartTest, BytesDeliveredAtOnceArriveAByteTimeApart) {
  Echo echo;
  echo.Started();
  const int64_t at = echo.machine.now_ns() + kPeerByte;
  for (const uint8_t byte : Bytes{'a', 'b', 'c', 'd', 'e', 'f'}) {
    echo.machine.Send(AvrMachine::kRadio, byte, at);
  }
  echo.RunFor(3 * kMs);
  EXPECT_EQ(echo.machine.underway(AvrMachine::kRadio), 4u) << "two have arrived";
  echo.RunFor(20 * kMs);
  EXPECT_EQ(Echo::BytesOf(echo.radio), (Bytes{'a', 'b', 'c', 'd', 'e', 'f'}));
  EXPECT_EQ(echo.machine.uart(AvrMachine::kRadio).overruns, 0u);
  EXPECT_GE(echo.radio[5].time_ns - echo.radio[0].time_ns, 5 * kPeerByte - 1000);
}

TEST(AvrUartTest, AFlagThatRoseWhileItWasMaskedInterruptsWhenTheMaskIsSet) {
  Echo echo;
  echo.Started();
  const int64_t begin = echo.machine.now_ns();
  echo.machine.Send(AvrMachine::kRobot, 'm', begin + kPeerByte);
  echo.machine.Send(AvrMachine::kRadio, 'q', begin + 3 * kPeerByte);
  echo.RunFor(20 * kMs);
  ASSERT_EQ(Echo::BytesOf(echo.radio), Bytes{'q'});
  EXPECT_GE(echo.radio[0].time_ns, begin + kPeerByte + 5 * kMs + kByte);
}

TEST(AvrUartTest, AnotherBaudRateThanThePeersIsAnError) {
  AvrMachineConfig config;
  config.radio_baud = 38400;
  Echo echo(config);
  echo.machine.Send(AvrMachine::kRadio, 'q', kPeerByte);
  try {
    echo.Started();
    FAIL() << "was not noticed";
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "the firmware's UART0 is set to 9615 baud instead of 38400");
  }
}

TEST(AvrUartTest, AnotherCrystalThanTheImageWasBuiltForIsAnError) {
  AvrMachineConfig config;
  config.frequency_hz = 20'000'000;
  Echo echo(config);
  echo.machine.Send(AvrMachine::kRadio, 'q', kPeerByte);
  EXPECT_THROW(echo.Started(), std::runtime_error);
}

// Of a byte at 9615 baud, on a line in microseconds; none without a stop bit.
Bytes NaiveSampled(const Bytes& sent, double baud) {
  Bytes sampled;
  for (const uint8_t byte : sent) {
    std::vector<bool> line(10'000, true);
    for (size_t us = 0; us < 9 * 104; ++us) {
      line[us] = us >= 104 && (byte >> (us / 104 - 1) & 1) != 0;
    }
    const auto at = [&](int bit) { return line[static_cast<size_t>((bit + 0.5) * 1e6 / baud)]; };
    unsigned read = 0;
    for (int bit = 0; bit < 8; ++bit) {
      read |= (at(bit + 1) ? 1u : 0u) << bit;
    }
    if (at(9)) {
      sampled.push_back(static_cast<uint8_t>(read));
    }
  }
  return sampled;
}

TEST(AvrUartTest, ARobotAtAnotherRateReceivesWhatItSamples) {
  Bytes sent;
  {
    Echo echo;
    sent = Echo::BytesOf(echo.Started().robot);
  }
  ASSERT_FALSE(sent.empty());
  for (const int64_t baud : {4'800, 19'200, 38'400, 57'600, 115'200}) {
    AvrMachineConfig config;
    config.robot_baud = baud;
    Echo echo(config);
    EXPECT_EQ(NaiveSampled(sent, static_cast<double>(baud)), Echo::BytesOf(echo.Started().robot))
        << baud;
  }
}

TEST(AvrUartTest, ARobotAtAnotherRateIsNotUnderstood) {
  for (const int64_t baud : {19'200, 38'400, 57'600}) {
    AvrMachineConfig config;
    config.robot_baud = baud;
    Echo echo(config);
    echo.Started();
    EXPECT_THROW(echo.Ask('c'), std::runtime_error) << "a letter for which the image sleeps";
  }
}

// --- Time.

std::vector<std::tuple<int, int, int64_t>> Trace(int64_t quantum_ns) {
  Echo echo;
  std::vector<std::tuple<int, int, int64_t>> trace;
  echo.machine.OnSent(AvrMachine::kRadio,
                      [&](uint8_t byte, int64_t at) { trace.emplace_back(0, byte, at); });
  echo.machine.OnSent(AvrMachine::kRobot,
                      [&](uint8_t byte, int64_t at) { trace.emplace_back(1, byte, at); });
  echo.machine.OnPin(kPtt, [&](bool high, int64_t at) { trace.emplace_back(2, high, at); });
  // What happens outside, told as late as possible: in the quantum in which it happens.
  std::mt19937_64 random(7);
  int64_t next = 12 * kMs;
  for (int64_t now = 0; now < 1000 * kMs; now += quantum_ns) {
    for (; next < now + quantum_ns;
         next += kPeerByte + static_cast<int64_t>(random() % 3'000'000)) {
      const bool letter = random() % 8 == 0;
      echo.machine.Send(
          letter ? AvrMachine::kRobot : AvrMachine::kRadio,
          letter ? Bytes{'b', 'm', 'e', 's', 'c'}[random() % 5] : static_cast<uint8_t>(random()),
          next);
    }
    echo.machine.RunTo(now + quantum_ns);
  }
  EXPECT_GT(trace.size(), 500u);
  while (!trace.empty() && std::get<2>(trace.back()) >= 1000 * kMs) {
    trace.pop_back();  // of quanta that are not a part of a second
  }
  return trace;
}

TEST(AvrMachineTest, WhatComesOutDoesNotDependOnTheStepsOfTime) {
  const auto coarse = Trace(5 * kMs);
  EXPECT_EQ(Trace(1 * kMs), coarse);
  EXPECT_EQ(Trace(104'000), coarse);
  EXPECT_EQ(Trace(777'777), coarse);
  EXPECT_EQ(Trace(3'001), coarse) << "a few instructions at a time";
}

TEST(AvrMachineTest, SleepsWhileNothingHappens) {
  Echo echo;
  echo.Started();
  const uint64_t cycles = echo.machine.cycles();
  const uint64_t asleep = echo.machine.cycles_asleep();
  echo.RunFor(1000 * kMs);
  EXPECT_NEAR(static_cast<double>(echo.machine.cycles() - cycles), 16e6, 10);
  EXPECT_NEAR(static_cast<double>(echo.machine.cycles_asleep() - asleep), 16e6, 10);
}

TEST(AvrMachineTest, FirmwareThatCrashesOrSleepsForGoodIsAnError) {
  Echo crashes;
  crashes.Started();
  EXPECT_EQ(WhyItFails(&crashes, 'x'), "the firmware crashed");
  Echo sleeps;
  sleeps.Started();
  EXPECT_EQ(WhyItFails(&sleeps, 'z'), "the firmware sleeps with interrupts off");
}

TEST(AvrMachineTest, AnImageThatIsNoneIsRefused) {
  AvrMachineConfig config;
  config.image = "/dev/null";
  EXPECT_THROW(AvrMachine machine(config), std::runtime_error);
  EXPECT_THROW(ReadAvrImageSize("/proc/self/exe"), std::runtime_error) << "not an AVR's";
}

// --- Resets.

struct Report {
  uint8_t cause;
  uint8_t starts;
};

// The report after a reset of `echo`.
Report After(Echo* echo) {
  echo->robot.clear();
  echo->Started();
  EXPECT_EQ(echo->robot.size(), 4u);
  EXPECT_EQ(echo->robot[0].byte, 'R');
  return {echo->robot[1].byte, echo->robot[2].byte};
}

TEST(AvrMachineTest, WarmResetsKeepRamAndColdOnesDoNot) {
  Echo echo;
  const Report first = After(&echo);
  EXPECT_EQ(first.cause, kPowerOnFlag);
  echo.machine.Reset(AvrMachine::Cause::kExternal);
  const Report second = After(&echo);
  EXPECT_EQ(second.cause, kExternalFlag);
  EXPECT_EQ(second.starts, static_cast<uint8_t>(first.starts + 1));
  echo.machine.Reset(AvrMachine::Cause::kWatchdog);
  const Report third = After(&echo);
  EXPECT_EQ(third.cause, kWatchdogFlag);
  EXPECT_EQ(third.starts, static_cast<uint8_t>(first.starts + 2));
  echo.machine.Reset(AvrMachine::Cause::kBrownOut);
  EXPECT_EQ(After(&echo).cause, kBrownOutFlag);
  std::vector<int> starts;
  for (int i = 0; i < 8; ++i) {
    echo.machine.Reset(AvrMachine::Cause::kPowerOn);
    const Report cold = After(&echo);
    EXPECT_EQ(cold.cause, kPowerOnFlag);
    starts.push_back(cold.starts);
  }
  EXPECT_NE(starts, std::vector<int>(8, starts[0])) << "RAM is noise after power-up";
  EXPECT_EQ(echo.machine.watchdog_resets(), 0u) << "those were the test's";
}

TEST(AvrMachineTest, AWatchdogThatIsNotFedResets) {
  Echo echo;
  const Report first = After(&echo);
  echo.Ask('w');
  echo.Started();
  EXPECT_EQ(echo.machine.watchdog_resets(), 1u);
  ASSERT_GE(echo.robot.size(), 8u);
  EXPECT_EQ(echo.robot[5].byte, kWatchdogFlag);
  EXPECT_EQ(echo.robot[6].byte, static_cast<uint8_t>(first.starts + 1));
  EXPECT_EQ(echo.Ask('c'), '0') << "works as before";
}

TEST(AvrMachineTest, AResetCutsOffWhatIsBeingSentAndBytesGoOnArriving) {
  Echo echo;
  echo.Started();
  const int64_t now = echo.machine.now_ns();
  echo.machine.Send(AvrMachine::kRadio, 'a', now + kPeerByte);
  echo.machine.Send(AvrMachine::kRadio, 'b', now + 12 * kMs);
  echo.RunFor(kPeerByte + kMs / 2);  // 'a' is half out
  EXPECT_TRUE(echo.ptt.back().first);
  echo.machine.Reset(AvrMachine::Cause::kExternal);
  EXPECT_FALSE(echo.ptt.back().first);
  echo.RunFor(20 * kMs);
  EXPECT_EQ(Echo::BytesOf(echo.radio), Bytes{'b'});
}

// --- EEPROM, pins, stack.

TEST(AvrMachineTest, TheEepromOutlivesPowerLossButForTheByteBeingWritten) {
  AvrMachineConfig config;
  config.eeprom = {9, 8, 7, 6, 5, 4, 3, 2, 1};
  Echo echo(config);
  echo.Started();
  const int64_t before = echo.machine.now_ns();
  EXPECT_EQ(echo.Ask('e'), 'e');
  EXPECT_GE(echo.robot.back().time_ns - before, 3'400'000 + kPeerByte) << "3.4 ms a byte";
  Bytes expected(4096, 0xFF);
  std::copy(config.eeprom.begin(), config.eeprom.end(), expected.begin());
  expected[7] = 3;
  EXPECT_EQ(echo.machine.eeprom(), expected);

  echo.machine.Reset(AvrMachine::Cause::kPowerOn);
  echo.Started();
  EXPECT_EQ(echo.machine.eeprom(), expected);
  int intact = 0;
  for (int i = 0; i < 8; ++i) {
    echo.machine.Send(AvrMachine::kRobot, 'e', echo.machine.now_ns() + kPeerByte);
    echo.RunFor(3 * kMs);  // in the middle of it
    const uint8_t was = echo.machine.eeprom()[7];
    echo.machine.Reset(AvrMachine::Cause::kPowerOn);
    const uint8_t is = echo.machine.eeprom()[7];
    intact += is == was || is == static_cast<uint8_t>(was + 1) ? 1 : 0;
    expected[7] = is;
    EXPECT_EQ(echo.machine.eeprom(), expected) << "only that byte";
    echo.Started();
  }
  EXPECT_LT(intact, 4) << "a byte half written is arbitrary";
}

TEST(AvrMachineTest, AWarmResetDoesNotDisturbAnEepromWrite) {
  AvrMachineConfig config;
  config.eeprom = Bytes(8, 41);
  Echo echo(config);
  echo.Started();
  echo.machine.Send(AvrMachine::kRobot, 'e', echo.machine.now_ns() + kPeerByte);
  echo.RunFor(3 * kMs);
  EXPECT_EQ(echo.machine.eeprom()[7], 41);
  echo.machine.Reset(AvrMachine::Cause::kExternal);
  echo.Started();
  EXPECT_EQ(echo.machine.eeprom()[7], 42);
}

TEST(AvrMachineTest, PinsAreAsStrapsAndTheOutsideDriveThem) {
  AvrMachineConfig config;
  config.grounded = {{'A', 0}, {'A', 5}};
  Echo echo(config);
  for (const auto cause : {AvrMachine::Cause::kPowerOn, AvrMachine::Cause::kExternal}) {
    echo.machine.Reset(cause);
    After(&echo);
    EXPECT_EQ(echo.robot[3].byte, 0xFF & ~0x21) << "pulled up, but for two straps";
    echo.machine.SetPin(kCarrier, true);
    EXPECT_EQ(echo.Ask('c'), '1');
    echo.machine.Reset(AvrMachine::Cause::kExternal);
    echo.Started();
    EXPECT_EQ(echo.Ask('c'), '1') << "who drives it does not notice the reset";
    echo.machine.SetPin(kCarrier, false);
    EXPECT_EQ(echo.Ask('c'), '0');
  }
}

TEST(AvrMachineTest, KnowsHowDeepTheStackWas) {
  Echo echo;
  echo.Started();
  const int shallow = echo.machine.stack_bytes();
  EXPECT_GT(shallow, 4);
  EXPECT_LT(shallow, 100);
  EXPECT_EQ(echo.Ask('s'), 's');
  EXPECT_GE(echo.machine.stack_bytes(), kDeepStack);
  EXPECT_LT(echo.machine.stack_bytes(), shallow + kDeepStack + 20);
  EXPECT_EQ(echo.machine.image_size().static_ram_end - 0x100,
            static_cast<int>(echo.machine.image_size().static_ram_bytes));
}

}  // namespace
}  // namespace pheromone::sim
