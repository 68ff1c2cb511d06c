// The image that one flashes, unmodified: it follows a path, stops when it has to, and recovers by
// itself from everything that can fall silent.
#include <gtest/gtest.h>

#include <iostream>
#include <vector>

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
  int64_t stopped_ms = -1;  // when the last zero was said that followed something else

 private:
  std::vector<uint8_t> packet_;
  bool zero_ = true;
};

TEST(AvrFirmwareTest, WhenTheRadioFallsSilentZeroSpeedIsSentWithinHalfASecond) {
  for (int phase_ms = 0; phase_ms < 200; phase_ms += 23) {
    FirmwareWorld world;
    Vel2Tap wheels(&world);
    ASSERT_TRUE(Served(&world));
    world.RunFor(2'000 + phase_ms);
    ASSERT_FALSE(wheels.zero()) << "it drives";
    world.StopServer();
    ASSERT_TRUE(world.RunUntil([&] { return wheels.zero(); }, 1'000));
    const int64_t answered_ms = world.LastHeard(kSenseAnswer)->end_ms;
    EXPECT_LE(wheels.stopped_ms - answered_ms, 500);
    EXPECT_GE(wheels.stopped_ms - answered_ms, 450) << "not before it must";
    const int before = wheels.commands;
    world.RunFor(3'000);
    EXPECT_TRUE(Stands(world));
    EXPECT_GE(wheels.commands - before, 5) << "and it goes on to say so";
    EXPECT_EQ(world.robot().pioneer().counters().watchdog_stops, 0u);
  }
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

TEST(AvrFirmwareTest, ADamagedChannelDoesNotStopIt) {
  sim::RadioConfig radio;
  radio.byte_error = 0.01;  // one exchange in four is lost
  FirmwareWorld world(1, radio);
  ASSERT_TRUE(world.RunUntil([&] { return world.WhereIsTheRobot().along_m > 4; }, 60'000));
  EXPECT_LT(world.WhereIsTheRobot().off_path_m, 0.2);
}

}  // namespace
}  // namespace pheromone::firmware
