// What the robot does when it is told to move.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "client_fw/sim/pioneer/pioneer_robot.h"
#include "client_fw/sim/testing/pioneer_client.h"

namespace pheromone::sim {
namespace {

using testing::Bytes;
using testing::Client;
using testing::Command;
using testing::Framed;
using testing::Hex;
using testing::kClose;
using testing::kEnable;
using testing::kEStop;
using testing::kPulse;
using testing::kRvel;
using testing::kSetA;
using testing::kSetO;
using testing::kSetRa;
using testing::kSetRv;
using testing::kSetV;
using testing::kStop;
using testing::kVel;
using testing::kVel2;
using testing::Sip;

PioneerConfig Config(const char* subclass = "p3dx-sh") {
  PioneerConfig config;
  config.model = *FindPioneerModel(subclass);
  return config;
}

TEST(PioneerMotionTest, MotorsAreOffUntilTheyAreEnabled) {
  Client client(Config());
  client.Connect();
  client.Send(kVel, 200);
  client.Wait(1000);
  EXPECT_FALSE(client.last().motors());
  EXPECT_FALSE(client.last().moving());
  client.Send(kEnable, 1);  // what was commanded before is forgotten
  client.Wait(1000);
  EXPECT_TRUE(client.last().motors());
  EXPECT_EQ(client.speed_mm_s(), 0);
  client.Send(kVel, 200);
  client.Wait(1000);
  EXPECT_TRUE(client.last().moving());
  client.Send(kEnable, 0);
  client.Wait(1000);
  EXPECT_FALSE(client.last().motors());
  EXPECT_EQ(client.speed_mm_s(), 0);
}

TEST(PioneerMotionTest, VelAndRvelAreReportedAsWheelSpeeds) {
  Client client(Config());
  client.ConnectAndEnable();
  client.Send(Hex("fa fb 06 0b 3b 96 00 a1 3b"));  // VEL 150
  client.Send(Hex("fa fb 06 15 3b 14 00 29 3b"));  // RVEL 20
  client.Wait(1900);
  EXPECT_NEAR(client.speed_mm_s(), 150, 1e-6);
  EXPECT_NEAR(client.turn_deg_s(), 20, 1e-6);
  // w = (vR - vL) / 2 * DiffConvFactor
  const double half = 20 * std::numbers::pi / 180 / 0.0056;
  EXPECT_EQ(client.last().left(), std::lround(150 - half));
  EXPECT_EQ(client.last().right(), std::lround(150 + half));
  EXPECT_EQ(client.last().signed_word(23 + 8), 200);  // 0.1 deg/s
}

struct Vel2Case {
  const char* hex;
  int left;
  int right;
};

// Both encodings end in the same wheel speeds.
TEST(PioneerMotionTest, Vel2IsUnderstoodInBothEncodings) {
  for (const Vel2Case& vel2 : {Vel2Case{"fa fb 06 20 3b 0a 0a 2a 45", 200, 200},
                               Vel2Case{"fa fb 06 20 3b 0c 0a 2c 45", 200, 240},
                               Vel2Case{"fa fb 06 20 3b fb 05 1b 40", 100, -100},
                               Vel2Case{"fa fb 06 20 1b fb 04 1b 1f", -100, 100},
                               Vel2Case{"fa fb 06 20 1b 0a 09 2a 24", -200, -200}}) {
    SCOPED_TRACE(vel2.hex);
    const auto byte = [](int speed) { return static_cast<uint8_t>(speed / 20); };
    const Bytes raw = Framed({32, 0x3B, byte(vel2.right), byte(vel2.left)});
    for (const Bytes& command : {Hex(vel2.hex), raw}) {
      Client client(Config());
      client.ConnectAndEnable();
      client.Send(command);
      client.Wait(1900);
      EXPECT_NEAR(client.last().left(), vel2.left, 1);
      EXPECT_NEAR(client.last().right(), vel2.right, 1);
    }
  }
}

TEST(PioneerMotionTest, EveryPairOfVel2BytesMeansItsWheelSpeeds) {
  PioneerConfig config = Config();
  config.model.wheel_limit_mm_s = 10'000;
  config.model.max_speed_mm_s = 10'000;
  config.model.max_turn_deg_s = 10'000;
  config.model.acceleration_mm_s2 = 100'000'000;
  config.model.turn_acceleration_deg_s2 = 100'000'000;
  Client client(config);
  client.ConnectAndEnable();
  for (int left = -127; left <= 127; left += 2) {
    for (int right = -127; right <= 127; right += 2) {
      client.Send(kVel, 0);  // a change of sign takes two ticks
      client.Wait(2);
      const int word = (left * 256 | (right & 0xFF));
      client.Send(kVel2, word);  // as ARIA does: a signed 16-bit word
      client.Wait(2);
      ASSERT_NEAR(client.robot().drive().left_m_s() * 1000, left * 20, 1e-6);
      ASSERT_NEAR(client.robot().drive().right_m_s() * 1000, right * 20, 1e-6);
    }
  }
}

TEST(PioneerMotionTest, Vel2IsRecomposedUnderTheLimitsOfTranslationAndRotation) {
  Client client(Config());
  client.ConnectAndEnable();
  client.Send(kSetV, 300);
  client.Send(kSetRv, 10);
  client.Send(kVel2, 50 << 8 | 60);  // 1000 and 1200 mm/s
  client.Drive(5000);
  EXPECT_NEAR(client.speed_mm_s(), 300, 1e-6);
  EXPECT_NEAR(client.turn_deg_s(), 10, 1e-6);  // of 32
}

TEST(PioneerMotionTest, TheWaysOfMotionExcludeEachOther) {
  Client client(Config());
  client.ConnectAndEnable();
  client.Send(kVel2, 10 << 8 | 20);
  client.Send(kVel, 100);  // forgets VEL2's rotation
  client.Drive(3000);
  EXPECT_NEAR(client.speed_mm_s(), 100, 1e-6);
  EXPECT_NEAR(client.turn_deg_s(), 0, 1e-6);
  client.Send(kRvel, 30);  // keeps VEL's translation
  client.Drive(3000);
  EXPECT_NEAR(client.speed_mm_s(), 100, 1e-6);
  EXPECT_NEAR(client.turn_deg_s(), 30, 1e-6);
}

TEST(PioneerMotionTest, StopDeceleratesAndEmergencyStopDoesNot) {
  for (const int command : {kStop, kEStop}) {
    Client client(Config());
    client.ConnectAndEnable();
    client.Send(kVel, 300);
    client.Drive(1500);
    client.Send(command);
    client.Wait(500);
    EXPECT_NEAR(client.speed_mm_s(), command == kStop ? 150 : 0, 1e-6);
    client.Wait(600);
    EXPECT_EQ(client.speed_mm_s(), 0);
    EXPECT_TRUE(client.last().motors());  // stay enabled
  }
}

TEST(PioneerMotionTest, AccelerationsAreSettableAndRevertWithTheSession) {
  Client client(Config());
  client.ConnectAndEnable();
  client.Send(kSetA, 500);
  client.Send(Hex("fa fb 06 05 1b 2c 01 31 1c"));  // SETA -300
  client.Send(kSetV, 400);
  client.Send(kSetRa, 50);
  client.Send(kSetRa, -40);
  client.Send(kSetRv, 30);
  const MotionLimits& limits = client.robot().limits();
  EXPECT_DOUBLE_EQ(limits.acceleration_m_s2, 0.5);
  EXPECT_DOUBLE_EQ(limits.deceleration_m_s2, 0.3);
  EXPECT_DOUBLE_EQ(limits.speed_m_s, 0.4);
  EXPECT_NEAR(limits.turn_acceleration_rad_s2, 0.872665, 1e-6);
  EXPECT_NEAR(limits.turn_deceleration_rad_s2, 0.698132, 1e-6);
  EXPECT_NEAR(limits.turn_rad_s, 0.523599, 1e-6);
  client.Send(kVel, 1000);
  client.Wait(500);
  EXPECT_NEAR(client.speed_mm_s(), 250, 1e-6);
  client.Wait(1000);
  EXPECT_NEAR(client.speed_mm_s(), 400, 1e-6);
  client.Send(kClose);
  EXPECT_DOUBLE_EQ(limits.speed_m_s, 1.0);
  EXPECT_DOUBLE_EQ(limits.acceleration_m_s2, 0.3);
}

TEST(PioneerMotionTest, SettingsEndAtTheModelsCeilings) {
  Client client(Config());
  client.ConnectAndEnable();
  client.Send(kSetV, 30'000);
  client.Send(kSetRv, 30'000);
  client.Send(kSetA, 0);
  client.Send(kSetRa, 0);
  const MotionLimits& limits = client.robot().limits();
  EXPECT_DOUBLE_EQ(limits.speed_m_s, 2.2);
  EXPECT_NEAR(limits.turn_rad_s, 500 * std::numbers::pi / 180, 1e-9);
  EXPECT_DOUBLE_EQ(limits.acceleration_m_s2, 0.3);  // 0 is none
  EXPECT_GT(limits.turn_acceleration_rad_s2, 0);
}

TEST(PioneerWatchdogTest, TwoSilentSecondsStopTheRobotAndTheNextCommandResumes) {
  Client client(Config());
  client.ConnectAndEnable();
  client.Send(kVel, 300);
  client.Wait(1999);
  EXPECT_NEAR(client.speed_mm_s(), 300, 1e-6);
  client.Wait(1100);
  EXPECT_NEAR(client.speed_mm_s(), 0, 1e-6);  // decelerated at 300 mm/s^2
  client.Wait(10'000);
  EXPECT_FALSE(client.last().moving());
  EXPECT_TRUE(client.last().motors());
  client.Send(kPulse);
  client.Wait(1100);
  EXPECT_NEAR(client.speed_mm_s(), 300, 1e-6);
  EXPECT_EQ(client.robot().counters().watchdog_stops, 1u);
}

TEST(PioneerWatchdogTest, APulseEveryHalfSecondKeepsItDriving) {
  Client client(Config());
  client.ConnectAndEnable();
  client.Send(kVel, 300);
  client.Drive(30'000);
  EXPECT_NEAR(client.speed_mm_s(), 300, 1e-6);
  EXPECT_EQ(client.robot().counters().watchdog_stops, 0u);
}

TEST(PioneerWatchdogTest, DamagedCommandsAreSilence) {
  Client client(Config());
  client.ConnectAndEnable();
  client.Send(kVel, 300);
  Bytes bad = Command(kPulse);
  bad.back() ^= 1;
  for (int i = 0; i < 8; ++i) {
    client.Wait(500);
    client.Send(bad);
  }
  EXPECT_EQ(client.speed_mm_s(), 0);
}

TEST(PioneerWatchdogTest, MobileSimDrivesOn) {
  PioneerConfig config = Config();
  config.watchdog_ms = 0;
  Client client(config);
  client.ConnectAndEnable();
  client.Send(kVel, 300);
  client.Wait(60'000);
  EXPECT_NEAR(client.speed_mm_s(), 300, 1e-6);
}

TEST(PioneerOdometryTest, HeadingAndYGrowWhenTheRightWheelIsFaster) {
  Client client(Config());
  client.ConnectAndEnable();
  client.Send(kVel2, 10 << 8 | 12);
  client.Wait(1900);
  EXPECT_GT(client.last().heading(), 0);
  EXPECT_LT(client.last().heading(), 2048);
  EXPECT_GT(client.last().y(), 0);
  EXPECT_LT(client.last().y(), 0x4000);
}

TEST(PioneerOdometryTest, WrapsAtTheConfiguredBitsAndUnwrapsToTheTruth) {
  for (const int bits : {15, 16}) {
    PioneerConfig config = Config("p3dx");
    config.position_bits = bits;
    Client client(config);
    client.ConnectAndEnable();
    client.Send(kVel, 1000);
    client.Drive(80'000);
    int64_t units = 0;
    int wraps = 0;
    for (size_t i = 1; i < client.sips().size(); ++i) {
      // Modulo 32768, folded: right for both.
      int delta = (client.sips()[i].x() - client.sips()[i - 1].x()) & 0x7FFF;
      delta -= delta >= 16384 ? 32768 : 0;
      wraps += client.sips()[i].x() < client.sips()[i - 1].x() ? 1 : 0;
      units += delta;
    }
    units += client.sips()[0].x();
    EXPECT_NEAR(static_cast<double>(units) * 0.485, client.robot().drive().true_pose().x_m * 1000,
                0.485);
    EXPECT_EQ(wraps, bits == 15 ? 4 : 2) << bits;  // 78 m are 161 400 units
  }
}

TEST(PioneerOdometryTest, BackwardsBeginsAtTheTop) {
  Client client(Config());
  client.ConnectAndEnable();
  client.Send(kVel, -200);
  client.Wait(1000);
  EXPECT_EQ(client.last().x(), 32768 - 133);  // 200^2 / (2 * 300) + 200 / 3 mm
  EXPECT_EQ(client.last().left(), -200);
}

TEST(PioneerOdometryTest, SetOZeroesItEvenWithALoneTypeByte) {
  for (const Bytes& seto : {Command(kSetO), Framed({kSetO, 0x3B})}) {
    Client client(Config(), {3, 4, 1});
    client.ConnectAndEnable();
    client.Send(kVel2, 10 << 8 | 12);
    client.Wait(1900);
    client.Send(kEStop);
    client.Send(seto);
    client.Wait(100);
    EXPECT_EQ(client.last().x(), 0);
    EXPECT_EQ(client.last().y(), 0);
    EXPECT_EQ(client.last().heading(), 0);
    EXPECT_GT(client.robot().drive().true_pose().x_m, 3);  // the robot itself stays where it is
  }
}

TEST(PioneerOdometryTest, GoesOnInTheNextSession) {
  Client client(Config());
  client.ConnectAndEnable();
  client.Send(kVel, 200);
  client.Wait(1900);
  client.Send(kClose);
  client.Wait(2000);
  client.Connect();
  client.Wait(100);
  EXPECT_GT(client.last().x(), 300);
}

TEST(PioneerObstacleTest, AStallIsReported) {
  PioneerConfig config = Config();
  config.blocked = [](const PlanePose& pose) { return pose.x_m > 0.2; };
  Client client(config);
  client.ConnectAndEnable();
  client.Send(kVel, 200);
  client.Drive(3000);
  EXPECT_EQ(client.last().stall(), 0x0101);
  EXPECT_FALSE(client.last().moving());
  EXPECT_NEAR(client.last().x(), 200, 1);
  client.Send(kVel, -200);
  client.Wait(500);
  EXPECT_EQ(client.last().stall(), 0);
}

// Any client, well-behaved or not: between two SIPs no wheel changes its speed by more than the
// accelerations allow, and the reported pose is the true one, rounded.
TEST(PioneerPropertyTest, SipsAreBoundedAndTrueForRandomCommands) {
  std::mt19937 random(3);
  Client client(Config());
  client.ConnectAndEnable();
  size_t seen = 0;
  for (int i = 0; i < 3000; ++i) {
    const int ids[] = {kVel, kRvel, kVel2, kStop, kPulse, kVel2};
    client.Send(ids[random() % 6], static_cast<int>(random() % 65536) - 32768);
    client.Wait(static_cast<int64_t>(random() % 300));
    for (seen = std::max<size_t>(seen, 1); seen < client.sips().size(); ++seen) {
      const Sip& before = client.sips()[seen - 1];
      const Sip& after = client.sips()[seen];
      // 0.1 s of 300 mm/s^2 and of 100 deg/s^2 over half a wheelbase, and the rounding.
      const double most = 0.1 * (300 + 100 * std::numbers::pi / 180 / 0.0056) + 1;
      ASSERT_LE(std::abs(after.left() - before.left()), most);
      ASSERT_LE(std::abs(after.right() - before.right()), most);
      ASSERT_LE(std::abs(after.left()), 1200);
      ASSERT_LE(std::abs(after.right()), 1200);
    }
  }
  client.Send(kEStop);
  client.Wait(100);
  const PlanePose& truth = client.robot().drive().true_pose();
  const auto wrapped = [](double units, int bits) {
    return static_cast<int>(std::llround(units)) & ((1 << bits) - 1);
  };
  EXPECT_EQ(client.last().x(), wrapped(truth.x_m * 1000, 15));
  EXPECT_EQ(client.last().y(), wrapped(truth.y_m * 1000, 15));
  EXPECT_EQ(client.last().heading() & 4095,
            wrapped(truth.heading_rad / 2 / std::numbers::pi * 4096, 12));
}

Bytes Journey(uint64_t seed, int64_t step_ms) {
  PioneerConfig config = Config();
  PioneerErrors most;
  most.scale = 0.05;
  most.slip = 0.1;
  config.errors = DrawPioneerErrors(most, seed);
  // The odometry alone would not show the errors; a wall does.
  config.blocked = [](const PlanePose& pose) { return pose.x_m > 0.3; };
  PioneerRobot robot(config, {});
  Bytes all;
  int64_t now_ms = 0;
  for (const Bytes& command :
       {Command(0), Command(1), Command(2), Command(1), Command(kEnable, 1), Command(kVel, 400),
        Command(kVel2, 10 << 8 | 12), Command(kPulse), Command(kVel, 300), Command(kPulse)}) {
    robot.OnBytes(command, now_ms * 1'000'000);
    for (int64_t end_ms = now_ms + 840; now_ms < end_ms;) {
      now_ms += step_ms;
      robot.AdvanceTo(now_ms * 1'000'000);
      const Bytes out = robot.TakeOutput();
      all.insert(all.end(), out.begin(), out.end());
    }
  }
  return all;
}

TEST(PioneerPropertyTest, SameSeedSameBytesHoweverTimeIsCutUp) {
  const Bytes once = Journey(1, 840);
  EXPECT_EQ(Journey(1, 1), once);
  EXPECT_EQ(Journey(1, 7), once);
  EXPECT_EQ(Journey(1, 120), once);
  EXPECT_NE(Journey(2, 840), once);
}

}  // namespace
}  // namespace pheromone::sim
