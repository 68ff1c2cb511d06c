// The image that one flashes, unmodified: it follows a path, stops when it has to, and recovers by
// itself from everything that can fall silent.
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <numbers>
#include <vector>

#include "client_fw/core/steering/diagnostics.h"
#include "proto_tests/avr_firmware/firmware_world.h"

namespace pheromone::firmware {
namespace {

using sim::AvrMachine;

constexpr uint8_t kSenseAnswer = protocol::kSense | protocol::kFromServer | 1;

// Asks and is answered, now.
bool Served(FirmwareWorld* world) {
  const size_t before = world->heard().size();
  return world->RunUntil([&] { return world->CountHeard(kSenseAnswer, before) >= 3; }, 8'000);
}

bool Stands(const FirmwareWorld& world) {
  return world.robot().pioneer().drive().motion() == sim::Motion{};
}

TEST(AvrFirmwareTest, FollowsThePathAndKeepsToItsBudgets) {
  FirmwareWorld world;
  ASSERT_TRUE(Served(&world));
  EXPECT_LT(world.now_ms(), 3'000) << "it takes that long to begin";
  double worst_m = 0;
  int64_t along_mm = 0;
  const bool arrived = world.RunUntil(
      [&] {
        const FirmwareWorld::Place place = world.WhereIsTheRobot();
        worst_m = std::max(worst_m, place.off_path_m);
        along_mm = static_cast<int64_t>(place.along_m * 1000);
        return along_mm > 5'000;
      },
      60'000);
  EXPECT_TRUE(arrived) << along_mm << " mm along the path";
  EXPECT_LT(worst_m, 0.2) << "it began 0.1 m beside it";

  const AvrMachine& machine = world.robot().machine();
  const int used = static_cast<int>(machine.image_size().static_ram_bytes) + machine.stack_bytes();
  EXPECT_LE(used, 2048);
  EXPECT_EQ(machine.uart(AvrMachine::kRadio).overruns, 0u);
  EXPECT_EQ(machine.uart(AvrMachine::kRobot).overruns, 0u);
  EXPECT_EQ(machine.watchdog_resets(), 0u);
  EXPECT_GT(machine.cycles_asleep() * 10, machine.cycles() * 5) << "it sleeps most of the time";
  EXPECT_EQ(world.CountHeard(protocol::kHello), 1u);
  const size_t exchanges = world.CountHeard(kSenseAnswer);
  std::cout << "5 m in " << world.now_ms() << " ms, at most " << worst_m * 1000 << " mm off; flash "
            << machine.image_size().flash_bytes << ", static RAM "
            << machine.image_size().static_ram_bytes << ", deepest stack " << machine.stack_bytes()
            << " bytes; " << exchanges << " exchanges, awake "
            << 100 * (machine.cycles() - machine.cycles_asleep()) / machine.cycles() << " %, "
            << (machine.cycles() - machine.cycles_asleep()) / exchanges << " cycles an exchange\n";
}

TEST(AvrFirmwareTest, TheSameSeedGivesTheSameRun) {
  std::vector<uint64_t> hashes;
  std::vector<std::pair<int64_t, std::vector<uint8_t>>> runs[2];
  for (auto& run : runs) {
    FirmwareWorld world(5);
    world.RunFor(10'000);
    for (const HeardFrame& frame : world.heard()) {
      run.emplace_back(
          frame.end_ms,
          std::vector<uint8_t>(frame.message.data, frame.message.data + frame.message.length));
    }
    hashes.push_back(world.service().StateHash());
  }
  EXPECT_GT(runs[0].size(), 60u);
  EXPECT_EQ(runs[0], runs[1]);
  EXPECT_EQ(hashes[0], hashes[1]);
}

// The clock of the AVR's millisecond counter has 16 bits.
TEST(AvrFirmwareTest, GoesOnWithoutAHiccupWhenItsClockWraps) {
  FirmwareWorld world;
  ASSERT_TRUE(Served(&world));
  ASSERT_TRUE(world.Set(client::kSpeedSetting, 10));
  const size_t before = world.heard().size();
  const int64_t begin_ms = world.now_ms();
  int64_t longest_ms = 0;
  int64_t last_ms = begin_ms;
  world.RunFor(150'000);
  for (size_t i = before; i < world.heard().size(); ++i) {
    if (world.heard()[i].message.opcode == kSenseAnswer) {
      longest_ms = std::max(longest_ms, world.heard()[i].end_ms - last_ms);
      last_ms = world.heard()[i].end_ms;
    }
  }
  EXPECT_LT(longest_ms, 450) << "two periods";
  EXPECT_GT(last_ms, begin_ms + 149'000);
  EXPECT_EQ(world.CountHeard(protocol::kHello), 1u);
  EXPECT_EQ(world.CountHeard(protocol::kEvent), 0u) << "no fail-safe stop";
}

// Wheel speeds of the VEL2 commands that go to the Pioneer, ARIA's encoding: arcos.md section 3 in
// other words, the low byte is the right wheel's, and a negative word is sent negated.
class Vel2Tap {
 public:
  explicit Vel2Tap(FirmwareWorld* world) {
    world->robot().OnCommandByte([this](uint8_t byte, int64_t time_ns) {
      packet_.push_back(byte);
      if (packet_.size() == 1 && byte != 0xFA) {
        packet_.clear();
      } else if (packet_.size() >= 3 && packet_.size() == 3u + packet_[2]) {
        if (packet_[3] == 0x37 && emergency_ms < 0) {  // E_STOP
          emergency_ms = time_ns / 1'000'000;
        }
        if (packet_[3] == 0x20) {
          const bool zero = packet_[5] == 0 && packet_[6] == 0;
          if (zero && !zero_) {
            stopped_ms = time_ns / 1'000'000;
          }
          zero_ = zero;
          ++commands;
        }
        packet_.clear();
      }
    });
  }

  bool zero() const { return zero_; }
  int commands = 0;
  int64_t emergency_ms = -1;  // of the first E_STOP
  int64_t stopped_ms = -1;    // when the last zero was said that followed something else

 private:
  std::vector<uint8_t> packet_;
  bool zero_ = true;
};

TEST(AvrFirmwareTest, WhenTheRadioFallsSilentAnEStopIsSentWithinHalfASecondAndZeroSpeedAfterIt) {
  for (int phase_ms = 0; phase_ms < 200; phase_ms += 23) {
    FirmwareWorld world;
    Vel2Tap wheels(&world);
    ASSERT_TRUE(Served(&world));
    world.RunFor(2'000 + phase_ms);
    ASSERT_FALSE(wheels.zero()) << "it drives";
    world.StopServer();
    ASSERT_TRUE(world.RunUntil([&] { return wheels.zero(); }, 1'000));
    const int64_t answered_ms = world.LastHeard(kSenseAnswer)->end_ms;
    EXPECT_LE(wheels.emergency_ms - answered_ms, 500);
    EXPECT_GE(wheels.emergency_ms - answered_ms, 450) << "not before it must";
    EXPECT_GT(wheels.stopped_ms, wheels.emergency_ms);
    EXPECT_LE(wheels.stopped_ms, wheels.emergency_ms + 20);
    const int before = wheels.commands;
    world.RunFor(3'000);
    EXPECT_TRUE(Stands(world));
    EXPECT_GE(wheels.commands - before, 5) << "and it goes on to say so";
    EXPECT_EQ(world.robot().pioneer().counters().watchdog_stops, 0u);
  }
}

// --- Motion never begins by itself.

constexpr int64_t kLongEnoughMs = 5'000;

double DistanceM(const sim::PlanePose& a, const sim::PlanePose& b) {
  return std::hypot(a.x_m - b.x_m, a.y_m - b.y_m);
}

TEST(AvrSafetyTest, AnImageThatWasJustFlashedStandsUntilItIsReleased) {
  FirmwareWorld world(1, {}, {});
  ASSERT_TRUE(Served(&world));
  world.RunFor(kLongEnoughMs);
  EXPECT_EQ(DistanceM(world.robot().true_pose(), {}), 0);
  ASSERT_TRUE(world.Command(protocol::CommandCode::kResume));
  world.RunFor(kLongEnoughMs);
  EXPECT_GT(DistanceM(world.robot().true_pose(), {}), 0.5);
}

TEST(AvrSafetyTest, AfterEveryResetARobotThatDroveStands) {
  for (const AvrMachine::Cause cause :
       {AvrMachine::Cause::kExternal, AvrMachine::Cause::kWatchdog, AvrMachine::Cause::kBrownOut,
        AvrMachine::Cause::kPowerOn}) {
    FirmwareWorld world(1, {}, {});
    ASSERT_TRUE(Served(&world));
    ASSERT_TRUE(world.Command(protocol::CommandCode::kResume));
    world.RunFor(2'000);
    ASSERT_FALSE(Stands(world));
    world.ResetAfter(0, cause);
    world.RunFor(2'000);
    EXPECT_TRUE(Stands(world)) << static_cast<int>(cause);
    const sim::PlanePose stood = world.robot().true_pose();
    world.RunFor(kLongEnoughMs);
    EXPECT_EQ(DistanceM(world.robot().true_pose(), stood), 0) << static_cast<int>(cause);
  }
}

TEST(AvrSafetyTest, ARobotThatWasHaltedStaysSoOverAWarmResetWhateverItsSettingsSay) {
  FirmwareWorld world;
  ASSERT_TRUE(Served(&world));
  ASSERT_TRUE(world.Command(protocol::CommandCode::kHalt));
  world.RunFor(2'000);
  for (const AvrMachine::Cause cause :
       {AvrMachine::Cause::kExternal, AvrMachine::Cause::kWatchdog}) {
    const sim::PlanePose stood = world.robot().true_pose();
    world.ResetAfter(0, cause);
    ASSERT_TRUE(Served(&world));
    world.RunFor(kLongEnoughMs);
    EXPECT_EQ(DistanceM(world.robot().true_pose(), stood), 0);
  }
}

// The Pioneer rolls on while our processor starts, and that is in the pose too.
TEST(AvrSafetyTest, AWarmResetKeepsThePoseToTheMillimetre) {
  for (int after_ms = 0; after_ms < 300; after_ms += 37) {
    FirmwareWorld world;
    ASSERT_TRUE(Served(&world));
    world.RunFor(4'000 + after_ms);
    const sim::PlanePose before = world.robot().true_pose();
    ASSERT_GT(before.x_m, 0.3);
    const size_t heard = world.heard().size();
    world.ResetAfter(100'000, AvrMachine::Cause::kWatchdog);
    ASSERT_TRUE(
        world.RunUntil([&] { return world.CountHeard(protocol::kSense | 1, heard) != 0; }, 8'000));
    EXPECT_EQ(world.robot().pioneer().counters().sessions, 1u);
    EXPECT_EQ(world.CountEvents(protocol::EventCode::kPoseLost), 0u);
    world.RunFor(3'000);
    EXPECT_GT(world.robot().true_pose().x_m, before.x_m + 0.2) << "it drives on";
    EXPECT_LT(world.WhereIsTheRobot().off_path_m, 0.1);
    // What it reports now, standing, is where it is.
    ASSERT_TRUE(world.Command(protocol::CommandCode::kHalt));
    world.RunFor(2'000);
    protocol::SenseRequest sense;
    ASSERT_TRUE(Decode(world.LastHeard(protocol::kSense | 1)->message, &sense));
    EXPECT_NEAR(sense.pose.x, world.robot().true_pose().x_m * 1000, 3);
    EXPECT_NEAR(sense.pose.y, world.robot().true_pose().y_m * 1000, 3);
  }
}

TEST(AvrSafetyTest, ASupplyThatSaggedLosesThePoseAndTheRobotStandsUntilItWasGivenOne) {
  FirmwareWorld world;
  ASSERT_TRUE(Served(&world));
  world.RunFor(3'000);
  const size_t heard = world.heard().size();
  world.ResetAfter(0, AvrMachine::Cause::kBrownOut);
  world.RunFor(kLongEnoughMs);
  EXPECT_TRUE(Stands(world));
  EXPECT_EQ(world.CountEvents(protocol::EventCode::kPoseLost, heard), 1u);
  EXPECT_EQ(world.CountHeard(protocol::kSense | 1, heard), 0u) << "it does not ask from anywhere";
  const sim::PlanePose stood = world.robot().true_pose();
  ASSERT_TRUE(world.GivePose(
      static_cast<int32_t>(std::lround(stood.x_m * 1000)),
      static_cast<int32_t>(std::lround(stood.y_m * 1000)),
      static_cast<uint16_t>(std::lround(stood.heading_rad / (2 * std::numbers::pi) * 65536))));
  world.RunFor(kLongEnoughMs);
  EXPECT_EQ(DistanceM(world.robot().true_pose(), stood), 0) << "it waits to be released";
  ASSERT_TRUE(world.Command(protocol::CommandCode::kResume));
  world.RunFor(kLongEnoughMs);
  EXPECT_GT(world.robot().true_pose().x_m, stood.x_m + 0.5);
  EXPECT_LT(world.WhereIsTheRobot().off_path_m, 0.1) << "it knows where it is";
}

TEST(AvrSafetyTest, AWallThatStallsItStopsItForGoodAndIsReported) {
  sim::PioneerConfig pioneer;
  bool wall = true;
  pioneer.blocked = [&wall](const sim::PlanePose& pose) { return wall && pose.x_m > 0.6; };
  FirmwareWorld world(1, {}, FirmwareWorld::Released(), pioneer);
  ASSERT_TRUE(Served(&world));
  ASSERT_TRUE(world.RunUntil([&] { return world.CountEvents(protocol::EventCode::kObstacle) != 0; },
                             10'000));
  wall = false;
  world.RunFor(kLongEnoughMs);
  EXPECT_TRUE(Stands(world)) << "it does not drive on when the obstacle goes away";
  EXPECT_LE(world.robot().true_pose().x_m, 0.65);
  ASSERT_TRUE(world.Command(protocol::CommandCode::kResume));
  world.RunFor(2'000);
  EXPECT_FALSE(Stands(world));
}

// The value of a diagnostic, by COMMAND 9 and EVENT 8; -1 if it does not come.
int Ask(FirmwareWorld* world, client::Diagnostic diagnostic) {
  const size_t before = world->heard().size();
  if (!world->Command(protocol::CommandCode::kGetParameter, {diagnostic}) ||
      !world->RunUntil(
          [&] { return world->CountEvents(protocol::EventCode::kParameterValue, before) != 0; },
          5'000)) {
    return -1;
  }
  protocol::EventReport event;
  return Decode(world->LastHeard(protocol::kEvent)->message, &event) ? event.argument : -1;
}

TEST(AvrDiagnosticsTest, FramingErrorsAndOverrunsOfBothUartsAreCounted) {
  FirmwareWorld world;
  ASSERT_TRUE(Served(&world));
  EXPECT_EQ(Ask(&world, client::kRadioFramingErrors), 0);
  const struct {
    AvrMachine::Port port;
    sim::AvrByteFault fault;
    client::Diagnostic diagnostic;
    int times;
  } cases[] = {
      {AvrMachine::kRadio, sim::AvrByteFault::kNoStopBit, client::kRadioFramingErrors, 1},
      {AvrMachine::kRadio, sim::AvrByteFault::kOverrun, client::kRadioOverruns, 2},
      {AvrMachine::kRobot, sim::AvrByteFault::kNoStopBit, client::kRobotFramingErrors, 3},
      {AvrMachine::kRobot, sim::AvrByteFault::kOverrun, client::kRobotOverruns, 4},
  };
  for (const auto& it : cases) {
    for (int i = 0; i < it.times; ++i) {
      world.robot().Disturb(it.port, it.fault);
      world.RunFor(300);
    }
  }
  for (const auto& it : cases) {
    EXPECT_EQ(Ask(&world, it.diagnostic), it.times) << int{it.diagnostic};
  }
}

// The image counts nothing else of the conversation and the channel (PHEROMONE_ALL_COUNTERS=0).
TEST(AvrDiagnosticsTest, RequestsMissingAnswersAndDamagedFramesAreCounted) {
  for (const double byte_error : {0.0, 0.01}) {
    SCOPED_TRACE(byte_error);
    FirmwareWorld world(1, {.byte_error = byte_error});
    ASSERT_TRUE(Served(&world));
    world.RunFor(10'000);
    const size_t heard = world.CountHeard(protocol::kSense | 1);  // intact
    ASSERT_GT(heard, 0u);
    EXPECT_GE(Ask(&world, client::kRequestCount), static_cast<int>(heard));
    EXPECT_EQ(Ask(&world, client::kTimeoutCount) > 0, byte_error > 0);
    EXPECT_EQ(Ask(&world, client::kCrcErrorCount) > 0, byte_error > 0);
  }
}

TEST(AvrDiagnosticsTest, TheCauseOfTheLastResetIsToldOverTheRadio) {
  FirmwareWorld world;
  ASSERT_TRUE(Served(&world));
  EXPECT_EQ(Ask(&world, client::kResetCause), client::kPowerOnReset);
  world.RunFor(1'000);  // or the EVENT, not acknowledged, would be sent again after the reset
  const std::pair<AvrMachine::Cause, int> causes[] = {
      {AvrMachine::Cause::kExternal, client::kExternalReset},
      {AvrMachine::Cause::kWatchdog, client::kWatchdogReset},
      {AvrMachine::Cause::kBrownOut, client::kBrownOutReset}};
  for (const auto& [cause, value] : causes) {
    world.ResetAfter(0, cause);
    EXPECT_EQ(Ask(&world, client::kResetCause), value);
    world.RunFor(1'000);
  }
}

TEST(AvrDiagnosticsTest, TheLedFlashesOnceWhileItIsHaltedAndThriceWithoutAServer) {
  FirmwareWorld world(1, {}, {});
  int flashes = 0;
  world.robot().OnLed([&](bool on) { flashes += on ? 1 : 0; });
  const auto flashes_in = [&](int64_t ms) {
    flashes = 0;
    world.RunFor(ms);
    return flashes;
  };
  ASSERT_TRUE(Served(&world));
  world.RunFor(3'000);
  EXPECT_EQ(flashes_in(5 * 1'536), 5);
  world.StopServer();
  world.RunFor(4'000);
  EXPECT_EQ(flashes_in(4 * 2'560), 12);
}

TEST(AvrFirmwareTest, AServerThatIsRestartedIsUsedAgainWithoutAnybodyHelping) {
  FirmwareWorld world;
  ASSERT_TRUE(Served(&world));
  world.StopServer();
  world.RunFor(20'000);
  EXPECT_TRUE(Stands(world));
  const size_t before = world.heard().size();
  world.StartServer();
  ASSERT_TRUE(Served(&world));
  EXPECT_GE(world.CountHeard(protocol::kHelloAnswer, before), 1u);
  world.RunFor(1'000);
  EXPECT_FALSE(Stands(world));
  EXPECT_EQ(world.robot().machine().watchdog_resets(), 0u);
}

TEST(AvrFirmwareTest, AnUnpluggedPioneerIsFoundAgainWithoutAReset) {
  FirmwareWorld world;
  ASSERT_TRUE(Served(&world));
  world.RunFor(2'000);
  EXPECT_EQ(world.robot().pioneer().counters().sessions, 1u);
  const sim::PlanePose before = world.robot().true_pose();
  world.robot().set_cable(false);
  world.RunFor(5'000);
  EXPECT_TRUE(Stands(world)) << "by its own watchdog";
  EXPECT_GE(world.robot().pioneer().counters().watchdog_stops, 1u);
  world.robot().set_cable(true);
  ASSERT_TRUE(world.RunUntil(
      [&] { return world.robot().pioneer().counters().sessions == 2 && !Stands(world); }, 10'000));
  ASSERT_TRUE(Served(&world));
  world.RunFor(3'000);
  EXPECT_GT(world.robot().true_pose().x_m, before.x_m + 0.3);
  EXPECT_LT(world.WhereIsTheRobot().off_path_m, 0.15) << "it still knows where it is";
  EXPECT_EQ(world.robot().machine().watchdog_resets(), 0u);
}

// The longest way: a second and a fifth at each of the four rates.
constexpr int64_t kAllRatesMs = 4 * 1'200 + 1'000;

bool DrivesWithin(FirmwareWorld* world, int64_t ms) {
  const uint64_t before = world->robot().pioneer().counters().sessions;
  return world->RunUntil(
      [&] { return world->robot().pioneer().counters().sessions > before && !Stands(*world); }, ms);
}

class AvrRateTest : public testing::TestWithParam<int64_t> {};
class AvrOtherRateTest : public AvrRateTest {};  // than that of the session before

TEST_P(AvrRateTest, APioneerLeftAtThisRateIsFoundAndObeys) {
  FirmwareWorld world;
  world.robot().set_robot_baud(GetParam());
  ASSERT_TRUE(DrivesWithin(&world, kAllRatesMs + 3'000));
  world.RunFor(10'000);
  EXPECT_GT(world.robot().true_pose().x_m, 1.0);
  EXPECT_LT(world.WhereIsTheRobot().off_path_m, 0.2);
  const sim::PioneerCounters pioneer = world.robot().pioneer().counters();
  EXPECT_EQ(pioneer.sessions, 1u);
  EXPECT_EQ(pioneer.bad_checksums, 0u);
  EXPECT_EQ(world.robot().machine().uart(AvrMachine::kRobot).overruns, 0u);
  EXPECT_EQ(world.robot().machine().uart(AvrMachine::kRadio).overruns, 0u);
}

TEST_P(AvrOtherRateTest, ASessionOfAnotherProgramIsClosed) {
  FirmwareWorld world;
  ASSERT_TRUE(DrivesWithin(&world, 5'000));
  world.robot().set_robot_baud(GetParam());
  const uint64_t closes = world.robot().pioneer().counters().closes;
  ASSERT_TRUE(DrivesWithin(&world, kAllRatesMs + 3'000));
  EXPECT_EQ(world.robot().pioneer().counters().closes, closes + 1);
}

TEST_P(AvrRateTest, AfterACutCableAndAfterARestartOfThePioneerItIsFoundAgain) {
  FirmwareWorld world;
  world.robot().set_robot_baud(GetParam());
  ASSERT_TRUE(DrivesWithin(&world, kAllRatesMs + 3'000));
  world.robot().set_cable(false);
  world.RunFor(7'000);
  EXPECT_TRUE(Stands(world));
  world.robot().set_cable(true);
  ASSERT_TRUE(DrivesWithin(&world, 2 * kAllRatesMs));
  world.RunFor(1'000);
  world.robot().RestartPioneer();
  ASSERT_TRUE(DrivesWithin(&world, 2 * kAllRatesMs));
}

TEST_P(AvrRateTest, AWarmResetGoesOnInTheSessionAtThisRate) {
  FirmwareWorld world;
  world.robot().set_robot_baud(GetParam());
  ASSERT_TRUE(DrivesWithin(&world, kAllRatesMs + 3'000));
  world.RunFor(1'000);
  const double before_m = world.robot().true_pose().x_m;
  world.ResetAfter(100'000, AvrMachine::Cause::kWatchdog);
  world.RunFor(5'000);
  EXPECT_GT(world.robot().true_pose().x_m, before_m + 0.2) << "it drives on";
  EXPECT_EQ(world.robot().pioneer().counters().sessions, 1u);
  EXPECT_EQ(world.CountEvents(protocol::EventCode::kPoseLost), 0u);
}

TEST(AvrDiagnosticsTest, TheLedFlashesTwiceWhileThePioneerIsLookedFor) {
  FirmwareWorld world;
  int flashes = 0;
  world.robot().OnLed([&](bool on) { flashes += on ? 1 : 0; });
  world.robot().set_robot_baud(115'200);
  world.RunFor(4'000);
  flashes = 0;
  world.RunFor(4 * 2'048);
  EXPECT_EQ(flashes, 8);
  EXPECT_TRUE(Stands(world));
}

INSTANTIATE_TEST_SUITE_P(Rates, AvrRateTest, testing::Values(9600, 38'400, 19'200, 57'600));
INSTANTIATE_TEST_SUITE_P(Rates, AvrOtherRateTest, testing::Values(38'400, 19'200, 57'600));

TEST(AvrFirmwareTest, ADamagedChannelDoesNotStopIt) {
  sim::RadioConfig radio;
  radio.byte_error = 0.01;  // one exchange in four is lost
  FirmwareWorld world(1, radio);
  ASSERT_TRUE(world.RunUntil([&] { return world.WhereIsTheRobot().along_m > 4; }, 60'000));
  EXPECT_LT(world.WhereIsTheRobot().off_path_m, 0.2);
}

}  // namespace
}  // namespace pheromone::firmware
