#include "client_fw/sim/pioneer/pioneer_reports.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <numbers>
#include <string>

#include "client_fw/sim/testing/pioneer_client.h"

namespace pheromone::sim {
namespace {

using testing::Bytes;
using testing::Framed;
using testing::Hex;
using testing::Sip;

constexpr double kPi = std::numbers::pi;

const PioneerModel& Model(const char* subclass) {
  return *FindPioneerModel(subclass);
}

Sip SipOf(const SipContent& content, const char* subclass = "p3dx-sh", int bits = 16) {
  return Sip(MakeSip(Model(subclass), SipForm::kFull, bits, content));
}

TEST(PioneerModelTest, FactorsAreThoseOfTheParameterFiles) {
  struct Row {
    const char* subclass;
    double distance_mm;
    double speed_mm_s;
    double diff_conv;
    double wheelbase_mm;
    int width_mm;
    int length_mm;
    int radius_mm;
    size_t sonars;
    int top_speed_mm_s;
    int top_turn_deg_s;
  };
  const Row rows[] = {{"p3dx", 0.485, 1, 0.0056, 357, 425, 511, 250, 16, 2200, 500},
                      {"p3dx-sh", 1, 1, 0.0056, 357, 425, 511, 250, 16, 2200, 500},
                      {"peoplebot-sh", 1, 1, 0.006, 333, 425, 513, 340, 32, 2200, 500},
                      {"p3at", 0.465, 1, 0.0034, 588, 505, 626, 500, 16, 1200, 300},
                      {"p3at-sh", 1, 1, 0.0034, 588, 505, 626, 500, 16, 1200, 300},
                      {"amigo", 0.5083, 0.6154, 0.011, 182, 279, 330, 180, 8, 1000, 300},
                      {"amigo-sh", 1, 1, 0.011, 182, 279, 330, 180, 8, 1000, 300}};
  for (const Row& row : rows) {
    SCOPED_TRACE(row.subclass);
    const PioneerModel& model = Model(row.subclass);
    EXPECT_EQ(model.subclass, row.subclass);
    EXPECT_EQ(model.distance_mm, row.distance_mm);
    EXPECT_EQ(model.diff_conv_per_mm, row.diff_conv);
    EXPECT_NEAR(model.odometry_wheelbase_mm(), row.wheelbase_mm, 0.5);
    EXPECT_EQ(model.length_mm, row.length_mm);
    EXPECT_EQ(model.width_mm, row.width_mm);
    EXPECT_EQ(model.radius_mm, row.radius_mm);
    EXPECT_EQ(model.speed_mm_s, row.speed_mm_s);
    EXPECT_EQ(model.range_mm, 1);
    EXPECT_EQ(model.vel2_unit_mm_s, 20);
    EXPECT_EQ(model.sonars.size(), row.sonars);
    EXPECT_EQ(model.top_speed_mm_s, row.top_speed_mm_s);
    EXPECT_EQ(model.top_turn_deg_s, row.top_turn_deg_s);
    EXPECT_LE(model.max_speed_mm_s, model.wheel_limit_mm_s);
  }
  EXPECT_EQ(PioneerModels().size(), std::size(rows));
}

// Every array is symmetrical: each sonar has its mirror image among the others.
TEST(PioneerModelTest, SonarsOnTheLeftAreMirroredOnTheRight) {
  for (const PioneerModel& model : PioneerModels()) {
    for (const SonarMount& sonar : model.sonars) {
      const bool mirrored =
          std::any_of(model.sonars.begin(), model.sonars.end(), [&](const SonarMount& other) {
            return std::abs(other.x_mm - sonar.x_mm) <= 5 && other.y_mm == -sonar.y_mm &&
                   other.heading_deg == -sonar.heading_deg;
          });
      EXPECT_TRUE(mirrored) << model.subclass << ' ' << sonar.x_mm << ' ' << sonar.y_mm;
    }
  }
}

TEST(PioneerModelTest, AreFoundInCapitalsToo) {
  EXPECT_EQ(FindPioneerModel("P3DX-SH"), FindPioneerModel("p3dx-sh"));
  EXPECT_EQ(FindPioneerModel("p3d"), nullptr);
  EXPECT_EQ(FindPioneerModel("p3dx-shh"), nullptr);
  EXPECT_EQ(FindPioneerModel(""), nullptr);
}

TEST(NamesPacketTest, IsTheGoldenVector) {
  EXPECT_EQ(MakeNamesPacket(Model("p3dx-sh"), "MobileSim"),
            Hex("fa fb 1d 02 4d 6f 62 69 6c 65 53 69 6d 00 50 69 6f 6e 65 65 72 00 70 33 64 78 "
                "2d 73 68 00 06 da"));
}

TEST(NamesPacketTest, ANameIsCutAfter20CharactersOrAtANul) {
  EXPECT_EQ(MakeNamesPacket(Model("p3dx"), std::string(300, 'x')),
            MakeNamesPacket(Model("p3dx"), std::string(20, 'x')));
  EXPECT_EQ(MakeNamesPacket(Model("p3dx"), std::string("ab\0cd", 5)),
            MakeNamesPacket(Model("p3dx"), "ab"));
}

TEST(SipTest, SizesAreThoseOnTheLine) {
  SipContent content;
  EXPECT_EQ(MakeSip(Model("p3dx"), SipForm::kFull, 15, content).size(), 41u);
  EXPECT_EQ(MakeSip(Model("p3dx"), SipForm::kShort, 15, content).size(), 25u);
  content.sonar.assign(16, {0, 5000});
  EXPECT_EQ(MakeSip(Model("p3dx"), SipForm::kFull, 15, content).size(), 89u);
  content.sonar.assign(kMaxSonarReadings, {0, 5000});
  EXPECT_EQ(MakeSip(Model("p3dx"), SipForm::kFull, 15, content).size(), 200u);
}

// Field by field, as the protocol's table lists them.
TEST(SipTest, EveryFieldIsAtItsPlace) {
  SipContent content;
  content.moving = true;
  content.x_mm = 0x1234;
  content.y_mm = -2;
  content.heading_rad = kPi / 2;
  content.heading_setpoint_rad = -kPi / 2;
  content.left_mm_s = -300;
  content.right_mm_s = 500;
  content.turn_rad_s = -kPi / 6;
  content.battery_v = 12.8;
  content.left_stalled = true;
  content.bumpers = {0b00100, 0b10001};
  content.motors_enabled = true;
  content.sonar_enabled = true;
  content.stop_pressed = true;
  content.sonar = {{0, 5000}, {17, 258}};
  EXPECT_EQ(SipOf(content).bytes,
            Framed(Hex("33 34 12 fe ff 00 04 d4 fe f4 01 80 23 08 00 fc 7f 00 00 02 00 88 13 11 "
                       "02 01 00 00 00 00 00 80 00 00 d4 fe 00 00 00 00 80 00")));
}

TEST(SipTest, FlagsTellOfMotorsSonarAndStalls) {
  SipContent content;
  EXPECT_EQ(SipOf(content).byte(3), 0x32);
  EXPECT_EQ(SipOf(content).flags(), 0);
  EXPECT_EQ(SipOf(content).stall(), 0);
  content.motors_enabled = true;
  content.right_stalled = true;
  EXPECT_EQ(SipOf(content).flags(), 1);
  EXPECT_EQ(SipOf(content).stall(), 0x0100);
}

TEST(SipTest, PositionsWrapAt15Or16Bits) {
  SipContent content;
  content.x_mm = -1;
  content.y_mm = 32768;
  EXPECT_EQ(SipOf(content, "p3dx-sh", 15).x(), 0x7FFF);
  EXPECT_EQ(SipOf(content, "p3dx-sh", 15).y(), 0);
  EXPECT_EQ(SipOf(content, "p3dx-sh", 16).x(), 0xFFFF);
  EXPECT_EQ(SipOf(content, "p3dx-sh", 16).y(), 32768);
  content.x_mm = 42'000;  // 86597.9 units of 0.485 mm
  EXPECT_EQ(SipOf(content, "p3dx", 15).x(), 86598 - 2 * 32768);
  EXPECT_EQ(SipOf(content, "p3dx", 16).x(), 86598 - 65536);
}

TEST(SipTest, HeadingsAreSignedModulo4096) {
  for (const int turns : {-3, -1, 0, 1, 1000}) {
    for (const int heading : {0, 1, 2047, -2048, -1}) {
      SipContent content;
      content.heading_rad = (turns + heading / 4096.0) * 2 * kPi;
      content.heading_setpoint_rad = content.heading_rad;
      EXPECT_EQ(SipOf(content).signed_word(8), heading) << turns;
      EXPECT_EQ(SipOf(content).signed_word(17), heading) << turns;
    }
  }
}

TEST(SipTest, SpeedsAndRangesSaturate) {
  SipContent content;
  content.left_mm_s = 1e9;
  content.right_mm_s = -1e9;
  content.battery_v = 1000;
  content.sonar = {{0, 1 << 20}, {1, -5}};
  const Sip sip = SipOf(content);
  EXPECT_EQ(sip.left(), 32767);
  EXPECT_EQ(sip.right(), -32768);
  EXPECT_EQ(sip.byte(14), 255);
  EXPECT_EQ(sip.word(24), 65535);
  EXPECT_EQ(sip.word(27), 0);
}

// 125 ticks a millimetre, two's complement.
TEST(EncoderPacketTest, CountsBothWheelsIn32Bits) {
  EXPECT_EQ(MakeEncoderPacket(Model("p3dx"), 1000, -0.008),
            Framed(Hex("90 48 e8 01 00 ff ff ff ff")));
  const double wrapped_mm = 4294967296.0 / 125 + 2;
  EXPECT_EQ(MakeEncoderPacket(Model("p3dx"), wrapped_mm, -1e6),
            Framed(Hex("90 fa 00 00 00 c0 a6 8c f8")));
}

TEST(IoPacketTest, TellsOfBumpersAndBattery) {
  const std::string ports = "00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 ";
  EXPECT_EQ(MakeIoPacket({}, 10), Framed(Hex("f0 04 00 ff ff ff 01 00 09 " + ports + "00 02")));
  EXPECT_EQ(MakeIoPacket({0b00001, 0b10000}, 30),
            Framed(Hex("f0 04 00 fd df ff 01 00 09 " + ports + "ff 03")));
}

TEST(ConfigPacketTest, TellsWhatTheManualLists) {
  ConfigContent content;
  content.name = "Rosa";
  content.bumpers = 5;
  content.limits = {1.0, 100 * kPi / 180, 0.3, 0.4, 50 * kPi / 180, 60 * kPi / 180};
  const Sip packet(MakeConfigPacket(Model("p3dx"), content));
  EXPECT_EQ(packet.byte(3), 0x20);
  const std::string text(packet.bytes.begin() + 4, packet.bytes.end());
  const std::string strings("Pioneer\0p3dx\0simulated\0", 23);
  ASSERT_EQ(text.substr(0, strings.size()), strings);
  const size_t tops = 4 + strings.size() + 1;
  EXPECT_EQ(packet.word(tops), 500);
  EXPECT_EQ(packet.word(tops + 2), 2200);
  const size_t after_name = tops + 10 + 5;
  EXPECT_EQ(text.substr(tops + 10 - 4, 5), std::string("Rosa\0", 5));
  EXPECT_EQ(packet.byte(after_name), 100);  // SIP cycle
  const size_t watchdog = after_name + 3 + 2 + 2 + 1 + 2 + 2;
  EXPECT_EQ(packet.word(watchdog), 2000);
  const size_t now = watchdog + 2 + 1 + 8;
  EXPECT_EQ(packet.word(now), 100);
  EXPECT_EQ(packet.word(now + 2), 1000);
  EXPECT_EQ(packet.word(now + 4), 50);
  EXPECT_EQ(packet.word(now + 6), 60);
  EXPECT_EQ(packet.word(now + 14), 300);
  EXPECT_EQ(packet.word(now + 16), 400);
  const size_t added = now + 24;  // what newer firmware adds
  EXPECT_EQ(packet.byte(added), 5);
  EXPECT_EQ(packet.byte(added + 1), 5);
  EXPECT_EQ(packet.byte(added + 4), 0);     // the baud rate cannot be changed
  EXPECT_EQ(packet.word(added + 10), 125);  // encoder ticks a millimetre
  EXPECT_EQ(packet.bytes.size(), added + 12 + 2);
}

}  // namespace
}  // namespace pheromone::sim
