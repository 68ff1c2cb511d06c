// Odometry from SIPs: counters that wrap, lengths of counts, and axes that change with a session.

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "client_fw/core/testing/pioneer_harness.h"

namespace pheromone {
namespace client {
namespace {

constexpr double kPi = 3.14159265358979323846;

// As a Pioneer tells a count that it keeps in `bits` bits.
uint16_t Wrapped(int64_t count, int bits) {
  return static_cast<uint16_t>(static_cast<uint64_t>(count) & ((uint64_t{1} << bits) - 1));
}

class PioneerOdometryTest : public ::testing::Test {
 protected:
  // The first SIP of the session was 0, 0, 0, so that the Pioneer's axes are ours.
  void ConnectAs(const std::string& subclass) {
    harness_.subclass = subclass;
    harness_.Connect();
    harness_.mute = true;  // from here on the tests send the SIPs
  }

  const Odometry& odometry() const { return harness_.pioneer.odometry(); }

  PioneerHarness harness_;
};

TEST_F(PioneerOdometryTest, IsUnknownBeforeTheFirstSipWhichIsTheReference) {
  harness_.on = false;
  harness_.Run(100);
  EXPECT_FALSE(harness_.pioneer.known());
  harness_.on = true;
  harness_.sip.x = 0xFFFF;
  harness_.sip.y = 0x7FFF;
  harness_.Connect();
  EXPECT_EQ(0, odometry().x_mm);
  EXPECT_EQ(0, odometry().y_mm);
  EXPECT_EQ(0, odometry().heading);
  harness_.Tell(4, 0x7FFA, 0);  // 5 counts on, 5 back
  EXPECT_EQ(2, odometry().x_mm);
  EXPECT_EQ(-2, odometry().y_mm);
}

// 42 m each way, in steps of a Pioneer at 2 m/s, whose last ones do not divide the way.
TEST_F(PioneerOdometryTest, FollowsDrivesOf42MetresWhereverTheCountersWrap) {
  for (const int bits : {15, 16}) {
    for (const bool along_y : {false, true}) {
      for (const int direction : {1, -1}) {
        PioneerHarness harness;
        harness.Connect();
        for (int64_t count = 0; count <= 86'598; count += 409) {
          const uint16_t told = Wrapped(direction * count, bits);
          harness.Tell(along_y ? 0 : told, along_y ? told : 0, 0);
          const Odometry& pose = harness.pioneer.odometry();
          const auto mm = static_cast<double>(direction * count) * 0.485;
          ASSERT_NEAR(along_y ? 0 : mm, pose.x_mm, 1) << count;
          ASSERT_NEAR(along_y ? mm : 0, pose.y_mm, 1) << count;
        }
      }
    }
  }
}

TEST_F(PioneerOdometryTest, MinusOneMayComeWith15BitsOrWith16) {
  ConnectAs("p3dx-sh");
  for (const uint16_t minus_one : {uint16_t{0x7FFF}, uint16_t{0xFFFF}}) {
    harness_.Tell(minus_one, minus_one, 0);
    EXPECT_EQ(-1, odometry().x_mm);
    EXPECT_EQ(-1, odometry().y_mm);
    harness_.Tell(0, 0, 0);
    EXPECT_EQ(0, odometry().x_mm);
    EXPECT_EQ(0, odometry().y_mm);
  }
}

TEST_F(PioneerOdometryTest, TheLongestStepGoesTheShorterWay) {
  ConnectAs("p3dx-sh");
  harness_.Tell(16'383, 16'384, 0);
  EXPECT_EQ(16'383, odometry().x_mm);
  EXPECT_EQ(-16'384, odometry().y_mm);
}

TEST_F(PioneerOdometryTest, StepsOfOneCountAreNotRounded) {
  ConnectAs("p3dx");
  for (int count = 1; count <= 100'000; ++count) {
    harness_.Tell(Wrapped(count, 16), Wrapped(-count, 16), 0);
  }
  EXPECT_NEAR(48'500, odometry().x_mm, 1);
  EXPECT_NEAR(-48'500, odometry().y_mm, 1);
  for (int count = 100'000; count >= 0; --count) {
    harness_.Tell(Wrapped(count, 16), Wrapped(-count, 16), 0);
  }
  EXPECT_EQ(0, odometry().x_mm);
  EXPECT_EQ(0, odometry().y_mm);
}

TEST_F(PioneerOdometryTest, LostSipsLoseNothing) {
  ConnectAs("p3dx-sh");
  harness_.Tell(100, 50, 7);
  Bytes damaged = NaivePacket(harness_.sip.Body());
  damaged[5] ^= 1;
  harness_.ToClient(damaged);
  harness_.Tell(900, 450, 63);
  EXPECT_EQ(900, odometry().x_mm);
  EXPECT_EQ(450, odometry().y_mm);
  EXPECT_EQ(63 * 16, odometry().heading);
}

TEST_F(PioneerOdometryTest, HeadingsCount4096ATurn) {
  ConnectAs("p3dx");
  for (const int th : {0, 1, 1024, 2048, 4095, 4096, 5120, -1, -1024, -4096, 32767, -32768}) {
    harness_.Tell(0, 0, static_cast<uint16_t>(th));
    const int modulo = (th % 4096 + 4096) % 4096;
    EXPECT_EQ(modulo * 65'536 / 4096, odometry().heading) << th;
  }
}

TEST_F(PioneerOdometryTest, TheSubclassTellsTheLengthOfACount) {
  const std::vector<std::pair<std::string, int>> lengths = {
      {"p3dx", 485},     {"P3DX", 485},     {"perfpb", 485},        {"perfpb+", 485},
      {"p3dx-sh", 1000}, {"P3DX-SH", 1000}, {"peoplebot-sh", 1000}, {"unheard-of", 485},
  };
  for (const auto& [subclass, mm_in_1000_counts] : lengths) {
    PioneerHarness harness;
    harness.subclass = subclass;
    harness.Connect();
    harness.Tell(1000, 2000, 0);
    EXPECT_EQ(mm_in_1000_counts, harness.pioneer.odometry().x_mm) << subclass;
    EXPECT_EQ(2 * mm_in_1000_counts, harness.pioneer.odometry().y_mm) << subclass;
  }
  PioneerHarness harness(5000, 5083);  // an AmigoBot
  harness.subclass = "amigo";
  harness.Connect();
  harness.Tell(10'000, 0, 0);
  EXPECT_EQ(5083, harness.pioneer.odometry().x_mm);
}

TEST_F(PioneerOdometryTest, IsZeroAtFirstWhereverThePioneerLooks) {
  harness_.subclass = "p3dx-sh";
  harness_.sip.th = 1024;  // a quarter turn: along its y is our x
  harness_.sip.x = 300;
  harness_.Connect();
  harness_.Tell(300, 1000, 1024);
  EXPECT_EQ(1000, odometry().x_mm);
  EXPECT_EQ(0, odometry().y_mm);
  EXPECT_EQ(0, odometry().heading);
  harness_.Tell(200, 1000, 2048);
  EXPECT_EQ(1000, odometry().x_mm);
  EXPECT_EQ(100, odometry().y_mm);
  EXPECT_EQ(16'384, odometry().heading);
}

// Each session counts from somewhere else and along other axes; the reference is exact
// trigonometry.
TEST_F(PioneerOdometryTest, ContinuesFromTheLastPoseInANewSession) {
  std::mt19937 random(5);
  PioneerHarness harness;
  double x_mm = 0;
  double y_mm = 0;
  double way_mm = 0;
  int heading = 0;  // 4096 a turn
  for (int session = 0; session < 40; ++session) {
    const int first_th = static_cast<int>(random() % 4096);
    int64_t x = static_cast<int64_t>(random());
    int64_t y = static_cast<int64_t>(random());
    harness.mute = false;
    harness.sip = Sip();
    harness.sip.x = Wrapped(x, 15);
    harness.sip.y = Wrapped(y, 15);
    harness.sip.th = static_cast<uint16_t>(first_th);
    harness.Connect();
    harness.mute = true;
    const double turned = (heading - first_th) * 2 * kPi / 4096;
    int th = first_th;
    for (int step = 0; step < 50; ++step) {
      const int dx = static_cast<int>(random() % 401) - 200;
      const int dy = static_cast<int>(random() % 401) - 200;
      th += static_cast<int>(random() % 101) - 50;
      x += dx;
      y += dy;
      harness.Tell(Wrapped(x, 15), Wrapped(y, 15), static_cast<uint16_t>(th));
      x_mm += 0.485 * (dx * std::cos(turned) - dy * std::sin(turned));
      y_mm += 0.485 * (dx * std::sin(turned) + dy * std::cos(turned));
      way_mm += 0.485 * std::hypot(dx, dy);
      const Odometry& pose = harness.pioneer.odometry();
      // Half the grain of a coefficient, 0.5/4850, and the error of the sine, 2/16384.
      ASSERT_NEAR(x_mm, pose.x_mm, 1.5 + way_mm * 0.0003);
      ASSERT_NEAR(y_mm, pose.y_mm, 1.5 + way_mm * 0.0003);
      ASSERT_EQ(static_cast<uint16_t>((heading + th - first_th) * 16), pose.heading);
    }
    heading += th - first_th;
    harness.Run(1100);  // silence
    ASSERT_FALSE(harness.pioneer.known());
    ASSERT_NEAR(x_mm, harness.pioneer.odometry().x_mm, 1.5 + way_mm * 0.0003);
  }
}

TEST_F(PioneerOdometryTest, AnEndlessDriveOnlyWraps) {
  ConnectAs("p3dx-sh");
  int64_t count = 0;
  for (int i = 0; i < 140'000; ++i) {  // 2293 km
    count += 16'383;
    harness_.Tell(Wrapped(count, 16), 0, 0);
  }
  EXPECT_EQ(static_cast<int32_t>(static_cast<uint32_t>(count)), odometry().x_mm);
}

}  // namespace
}  // namespace client
}  // namespace pheromone
