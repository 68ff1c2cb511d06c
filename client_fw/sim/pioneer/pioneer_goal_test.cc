// MOVE, HEAD and DHEAD: where they end, and when. The times are those of a trapezoid of speed in
// closed form.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "client_fw/sim/pioneer/pioneer_robot.h"
#include "client_fw/sim/testing/pioneer_client.h"

namespace pheromone::sim {
namespace {

using testing::Client;
using testing::kDHead;
using testing::kEnable;
using testing::kEStop;
using testing::kHead;
using testing::kMove;
using testing::kPulse;
using testing::kRotate;
using testing::kRvel;
using testing::kSetA;
using testing::kSetO;
using testing::kSetRa;
using testing::kSetRv;
using testing::kSetV;
using testing::kStop;
using testing::kVel;
using testing::kVel2;

constexpr double kDegree = std::numbers::pi / 180;

PioneerConfig Config(const char* subclass = "p3dx-sh") {
  PioneerConfig config;
  config.model = *FindPioneerModel(subclass);
  return config;
}

double HeadingDeg(const Client& client) {
  return client.robot().drive().odometry().heading_rad / kDegree;
}

// From rest to rest, in seconds.
double TrapezoidS(double way, double top, double acceleration, double deceleration) {
  const double ramps = top * top / 2 * (1 / acceleration + 1 / deceleration);
  if (way < ramps) {
    const double peak =
        std::sqrt(2 * way * acceleration * deceleration / (acceleration + deceleration));
    return peak / acceleration + peak / deceleration;
  }
  return top / acceleration + top / deceleration + (way - ramps) / top;
}

// With a PULSE now and then, to the millisecond.
int64_t MsUntilItStands(Client* client) {
  for (int64_t ms = 1; ms < 100'000; ++ms) {
    client->Wait(1);
    if (client->robot().drive().motion() == Motion{}) {
      return ms;
    }
    if (ms % 500 == 0) {
      client->Send(kPulse);
    }
  }
  return -1;
}

TEST(PioneerMoveTest, CoversItsDistanceInTheTimeOfATrapezoid) {
  struct Case {
    int way_mm, top, acceleration, deceleration;
  };
  for (const Case& c :
       {Case{1000, 400, 300, 300}, Case{-1000, 400, 300, 300}, Case{100, 400, 300, 300},
        Case{-100, 400, 200, 600}, Case{3000, 700, 250, 500}, Case{1, 1000, 300, 300},
        Case{32'767, 1000, 2000, 2000}}) {
    SCOPED_TRACE(c.way_mm);
    Client client(Config());
    client.ConnectAndEnable();
    client.Send(kSetV, c.top);
    client.Send(kSetA, c.acceleration);
    client.Send(kSetA, -c.deceleration);
    client.Send(kMove, c.way_mm);
    const int64_t ms = MsUntilItStands(&client);
    EXPECT_NEAR(static_cast<double>(ms),
                1000 * TrapezoidS(std::abs(c.way_mm), c.top, c.acceleration, c.deceleration), 3);
    EXPECT_NEAR(client.robot().drive().odometry().x_m * 1000, c.way_mm, 0.01);
    EXPECT_EQ(client.robot().drive().odometry().heading_rad, 0);
    client.Drive(2000);
    EXPECT_EQ(client.speed_mm_s(), 0);
  }
}

TEST(PioneerHeadTest, TurnsTheShorterWayInTheTimeOfATrapezoid) {
  struct Case {
    int from_deg, to_deg;
    double way_deg;
  };
  for (const Case& c : {Case{0, 90, 90}, Case{0, -90, -90}, Case{0, 270, -90}, Case{0, 359, -1},
                        Case{170, -170, 20}, Case{-170, 170, -20}, Case{45, 765, 0},
                        Case{10, -32'000, 30}, Case{0, 179, 179}, Case{0, 181, -179}}) {
    SCOPED_TRACE(c.to_deg);
    Client client(Config());
    client.ConnectAndEnable();
    client.Send(kHead, c.from_deg);
    MsUntilItStands(&client);
    ASSERT_NEAR(HeadingDeg(client), c.from_deg, 0.001);
    client.Send(kSetRv, 60);
    client.Send(kSetRa, 50);
    client.Send(kSetRa, -80);
    client.Send(kHead, c.to_deg);
    const int64_t ms = MsUntilItStands(&client);
    EXPECT_NEAR(HeadingDeg(client), c.from_deg + c.way_deg, 0.001);
    EXPECT_NEAR(static_cast<double>(ms), 1000 * TrapezoidS(std::abs(c.way_deg), 60, 50, 80), 3);
    EXPECT_EQ(client.robot().drive().odometry().x_m, 0);
  }
}

TEST(PioneerHeadTest, DHeadTurnsByItsWholeAngle) {
  for (const int turn_deg : {30, -30, 180, 270, -720}) {
    Client client(Config());
    client.ConnectAndEnable();
    client.Send(kHead, 100);
    MsUntilItStands(&client);
    client.Send(kDHead, turn_deg);
    MsUntilItStands(&client);
    EXPECT_NEAR(HeadingDeg(client), 100 + turn_deg, 0.001);
  }
}

TEST(PioneerHeadTest, TheSetpointIsReportedWhileItTurns) {
  Client client(Config());
  client.ConnectAndEnable();
  client.Send(kHead, -90);
  client.Wait(300);
  EXPECT_LT(client.last().heading(), 0);
  EXPECT_GT(client.last().heading(), -1024);
  EXPECT_EQ(client.last().setpoint(), -1024);
  MsUntilItStands(&client);
  client.Wait(100);
  EXPECT_EQ(client.last().heading(), -1024);
  EXPECT_EQ(client.last().setpoint(), -1024);
}

TEST(PioneerGoalTest, ATurnGoesBackIfItWasTooFastToStopInTime) {
  Client client(Config());
  client.ConnectAndEnable();
  client.Send(kRotate, 100);
  client.Wait(1500);
  EXPECT_NEAR(client.turn_deg_s(), 100, 1e-6);
  const double now_deg = HeadingDeg(client);
  client.Send(kDHead, 10);  // and needs 50 degrees to stop
  client.Wait(1000);
  EXPECT_NEAR(HeadingDeg(client) - now_deg, 50, 0.1);
  client.Drive(3000);
  EXPECT_NEAR(HeadingDeg(client) - now_deg, 10, 0.001);
}

TEST(PioneerGoalTest, TranslationAndRotationAreIndependent) {
  Client client(Config());
  client.ConnectAndEnable();
  client.Send(kMove, 1500);
  client.Send(kHead, 90);
  client.Send(kVel, 200);  // ends the MOVE alone
  client.Drive(5000);
  EXPECT_NEAR(HeadingDeg(client), 90, 0.001);
  EXPECT_NEAR(client.speed_mm_s(), 200, 1e-6);
  client.Send(kDHead, 90);
  client.Send(kRvel, 30);  // ends the turn alone
  client.Drive(5000);
  EXPECT_NEAR(client.turn_deg_s(), 30, 1e-6);
  EXPECT_NEAR(client.speed_mm_s(), 200, 1e-6);
  client.Send(kHead, 0);    // ends RVEL
  client.Send(kMove, 500);  // ends VEL
  MsUntilItStands(&client);
  EXPECT_NEAR(std::remainder(HeadingDeg(client), 360), 0, 0.001);
}

TEST(PioneerGoalTest, Vel2EndsBothAndBothEndVel2) {
  Client client(Config());
  client.ConnectAndEnable();
  client.Send(kMove, 5000);
  client.Send(kHead, 90);
  client.Send(kVel2, 10 << 8 | 10);
  client.Drive(5000);
  EXPECT_NEAR(client.speed_mm_s(), 200, 1e-6);
  EXPECT_NEAR(client.turn_deg_s(), 0, 1e-6);
  client.Send(kHead, 0);
  client.Drive(3000);
  EXPECT_EQ(client.robot().drive().motion(), Motion{});
  client.Send(kVel2, 10 << 8 | 12);
  client.Drive(1000);
  client.Send(kMove, 100);
  client.Drive(5000);
  EXPECT_EQ(client.robot().drive().motion(), Motion{});
}

TEST(PioneerGoalTest, StopsAndMotorsOffEndThem) {
  for (const int command : {kStop, kEStop, kEnable}) {
    Client client(Config());
    client.ConnectAndEnable();
    client.Send(kMove, 5000);
    client.Send(kHead, 170);
    client.Wait(1000);
    client.Send(command, 0);
    client.Send(kEnable, 1);
    client.Drive(3000);
    EXPECT_EQ(client.robot().drive().motion(), Motion{}) << command;
    EXPECT_LT(client.robot().drive().odometry().x_m, 1);
  }
}

TEST(PioneerGoalTest, TheOriginMayBeResetOnTheWay) {
  Client client(Config());
  client.ConnectAndEnable();
  client.Send(kHead, 90);
  client.Send(kMove, 1000);
  client.Wait(1000);
  client.Send(kSetO);
  MsUntilItStands(&client);
  EXPECT_NEAR(client.robot().drive().true_pose().heading_rad / kDegree, 90, 0.001);
  EXPECT_NEAR(
      (client.robot().drive().left_rolled_m() + client.robot().drive().right_rolled_m()) / 2, 1,
      1e-4);
  client.Send(kHead, 0);  // of the new axes
  MsUntilItStands(&client);
  EXPECT_NEAR(HeadingDeg(client), 0, 0.001);
}

TEST(PioneerGoalTest, SilencePausesThemAndTheNextCommandGoesOn) {
  Client client(Config());
  client.ConnectAndEnable();
  client.Send(kSetV, 200);
  client.Send(kMove, 1000);
  client.Wait(5000);
  EXPECT_EQ(client.speed_mm_s(), 0);
  EXPECT_LT(client.robot().drive().odometry().x_m, 0.5);
  client.Send(kPulse);
  MsUntilItStands(&client);
  EXPECT_NEAR(client.robot().drive().odometry().x_m, 1, 1e-5);
}

TEST(PioneerGoalTest, AWallHoldsAMoveUpAndItIsTriedOn) {
  PioneerConfig config = Config();
  bool wall = true;
  config.blocked = [&wall](const PlanePose& pose) { return wall && pose.x_m > 0.2; };
  Client client(config);
  client.ConnectAndEnable();
  client.Send(kMove, 500);
  client.Drive(5000);
  EXPECT_EQ(client.last().stall(), 0x0101);
  EXPECT_NEAR(client.robot().drive().true_pose().x_m, 0.2, 1e-3);
  wall = false;
  client.Drive(5000);
  EXPECT_EQ(client.last().stall(), 0);
  EXPECT_NEAR(client.robot().drive().true_pose().x_m, 0.5, 1e-5);
}

TEST(PioneerGoalTest, NeedMotors) {
  Client client(Config());
  client.Connect();
  client.Send(kMove, 500);
  client.Send(kHead, 90);
  client.Send(kDHead, 90);
  client.Send(kRotate, 90);
  EXPECT_EQ(client.robot().counters().ignored, 4u);
  client.Send(kEnable, 1);
  client.Drive(1000);
  EXPECT_EQ(client.robot().drive().motion(), Motion{});
}

}  // namespace
}  // namespace pheromone::sim
