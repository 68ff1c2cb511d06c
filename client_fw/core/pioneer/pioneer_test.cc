#include "client_fw/core/pioneer/pioneer.h"

#include <gtest/gtest.h>

#include <random>

#include "client_fw/core/testing/pioneer_harness.h"

namespace pheromone {
namespace client {
namespace {

Heard Did(PioneerCommand command, int argument = 0) {
  return {0, static_cast<uint8_t>(command), argument};
}

const Heard kSync0 = Did(PioneerCommand::kSync0);
const Heard kSync1 = Did(PioneerCommand::kSync1);
const Heard kSync2 = Did(PioneerCommand::kSync2);
const Heard kClose = Did(PioneerCommand::kClose);
const Heard kOpen = Did(PioneerCommand::kOpen);
const Heard kSonarOff = Did(PioneerCommand::kSonar, 0);
const Heard kDecelerate = Did(PioneerCommand::kSetAcceleration, -500);
const Heard kEnable = Did(PioneerCommand::kEnable, 1);
const Heard kEmergency = Did(PioneerCommand::kEmergencyStop);
const Heard kStandStill = Did(PioneerCommand::kVel2, 0);

// Both wheels at 200 mm/s: ten units each.
const Heard kStraight = Did(PioneerCommand::kVel2, 10 * 256 + 10);

using Commands = std::vector<Heard>;

TEST(PioneerTest, OpensASessionWithMotorsOnSonarsOffAKnownDecelerationAndStandingStill) {
  PioneerHarness harness;
  harness.sip.flags = 0;
  harness.Run(300);
  EXPECT_EQ((Commands{kSync0, kSync1, kSync2, kOpen, kSonarOff, kDecelerate, kEnable, kStandStill}),
            harness.heard);
  EXPECT_TRUE(harness.pioneer.known());
  EXPECT_EQ(kMotorsOn, harness.pioneer.flags());
}

TEST(PioneerTest, WaitsASecondForEachEchoAndThenClosesAndBeginsAgain) {
  PioneerHarness harness;
  harness.on = false;
  harness.Run(3000);
  ASSERT_EQ((Commands{kSync0, kClose, kSync0, kClose, kSync0}), harness.heard);
  EXPECT_EQ(6000u, harness.heard[1].at_ms);
  EXPECT_EQ(6200u, harness.heard[2].at_ms);
  EXPECT_EQ(7200u, harness.heard[3].at_ms);
  EXPECT_FALSE(harness.pioneer.known());
}

TEST(PioneerTest, RecoversFromAnyLostEcho) {
  for (int sync = 0; sync < 3; ++sync) {
    PioneerHarness harness;
    for (int i = 0; i < 1000 && harness.synced < sync; ++i) {
      harness.Step();
    }
    harness.lost_replies = 1;
    harness.Connect();
    EXPECT_EQ(0, harness.lost_replies);
  }
}

TEST(PioneerTest, RecoversFromALostOpen) {
  PioneerHarness harness;
  harness.lose_open = true;
  harness.Connect();
  EXPECT_EQ(1, harness.closed);
}

TEST(PioneerTest, ClosesTheSessionThatSomebodyLeftOpen) {
  PioneerHarness harness;
  harness.synced = 3;
  harness.open = true;
  harness.sip.x = 777;
  for (int i = 0; i < 300 && harness.closed == 0; ++i) {
    harness.Step();
  }
  ASSERT_EQ((Commands{kSync0, kClose}), harness.heard);  // SYNC0 is PULSE to this robot
  EXPECT_FALSE(harness.pioneer.known());
  harness.Connect();
  EXPECT_EQ(1, harness.closed);
}

// MobileSim then takes SYNC0 for PULSE, which it does not answer.
TEST(PioneerTest, OpensTheSessionThatCloseHasBegunOutOfSequence) {
  PioneerHarness harness;
  harness.lost_replies = 1;
  harness.Run(1200);
  EXPECT_EQ((Commands{kSync0, kClose, kOpen, kSonarOff, kDecelerate, kEnable, kStandStill}),
            harness.heard);
  EXPECT_TRUE(harness.pioneer.known());
}

TEST(PioneerTest, AnAnswerToCloseWithoutNamesIsNoSession) {
  PioneerHarness harness;
  harness.on = false;
  harness.Run(1100);
  ASSERT_EQ((Commands{kSync0, kClose}), harness.heard);
  harness.ToClient(NaivePacket({2}));
  harness.Run(300);
  EXPECT_EQ((Commands{kSync0, kClose, kSync0}), harness.heard);
}

TEST(PioneerTest, ANewConnectionBeginsWithSync0) {
  PioneerHarness harness;
  harness.Connect();
  harness.synced = 0;
  harness.open = false;
  harness.pioneer.Restart(harness.now16());
  harness.Run(300);
  EXPECT_EQ((Commands{kSync0, kSync1, kSync2, kOpen, kSonarOff, kDecelerate, kEnable, kStandStill}),
            harness.heard);
}

TEST(PioneerTest, LetsTheLastSipsOfAnOldSessionPass) {
  PioneerHarness harness;
  harness.synced = 3;
  harness.RunUntilHeard();  // SYNC0, which is PULSE to it
  harness.ToClient(Sip());
  ASSERT_TRUE(harness.RunUntilHeard());
  ASSERT_EQ(kClose, harness.heard.back());
  harness.heard.clear();
  harness.Run(100);
  harness.ToClient(Sip());
  harness.Run(80);
  EXPECT_TRUE(harness.heard.empty());
  harness.Connect();
}

TEST(PioneerTest, AnEchoOutOfTurnIsIgnored) {
  PioneerHarness harness;
  harness.on = false;
  const Bytes echo0 = NaivePacket({0});
  const Bytes echo1 = NaivePacket({1});
  const Bytes echo2 = NaivePacket({2});
  harness.ToClient(echo0);  // before SYNC0 has been sent
  ASSERT_TRUE(harness.RunUntilHeard());
  harness.ToClient(echo1);
  harness.ToClient(echo2);
  harness.Run(500);
  ASSERT_EQ((Commands{kSync0}), harness.heard);
  harness.ToClient(echo0);
  harness.ToClient(echo0);
  harness.Run(500);
  EXPECT_EQ((Commands{kSync0, kSync1}), harness.heard);
}

TEST(PioneerTest, AnEnableThatWasLostIsRepeatedOnceTheRobotIsToMove) {
  PioneerHarness harness;
  harness.sip.flags = 0;
  harness.deaf_to = 4;
  harness.Run(1000);
  ASSERT_TRUE(harness.pioneer.known());
  harness.deaf_to = -1;
  harness.heard.clear();
  harness.Run(1000);
  EXPECT_EQ(0, harness.CountOf(PioneerCommand::kEnable)) << "a robot that is to stand needs none";
  harness.pioneer.set_wheel_speeds(200, 200);
  harness.Run(250);
  EXPECT_EQ(1, harness.CountOf(PioneerCommand::kEnable));
  EXPECT_EQ(1, harness.sip.flags);
  EXPECT_EQ(0, harness.pioneer.status().alarms);
}

// Somebody has pressed STOP, or the motors' own button: to let go of it must not be dangerous.
TEST(PioneerTest, MotorsThatWereSwitchedOffStayOffUntilTheRobotIsToMoveAgain) {
  for (const uint16_t flags : {uint16_t{0}, uint16_t{0x20}, uint16_t{0x40}}) {
    SCOPED_TRACE(flags);
    PioneerHarness harness;
    harness.Connect();
    harness.pioneer.set_wheel_speeds(200, 200);
    harness.Run(200);
    harness.heard.clear();
    harness.sip.flags = flags;
    harness.Tell(0, 0, 0);
    const uint8_t stop = flags == 0 ? 0 : kStopButtonAlarm;
    EXPECT_EQ(kMotorsOffAlarm | stop, harness.pioneer.status().alarms);
    harness.pioneer.set_wheel_speeds(0, 0);  // what a robot does then
    harness.Run(2000);
    EXPECT_EQ(stop, harness.pioneer.status().alarms) << "the button lasts";
    harness.sip.flags = 0;
    harness.Run(2000);
    EXPECT_EQ(0, harness.pioneer.status().alarms);
    EXPECT_EQ(0, harness.CountOf(PioneerCommand::kEnable));
    harness.pioneer.set_wheel_speeds(200, 200);
    harness.Run(250);
    EXPECT_EQ(1, harness.CountOf(PioneerCommand::kEnable));
  }
}

TEST(PioneerTest, StallAndBumpersAreAlarmsForAsLongAsTheyAreReported) {
  PioneerHarness harness;
  harness.Connect();
  const struct {
    uint16_t word;
    int alarms;
  } cases[] = {{0x0001, kStallAlarm},
               {0x0100, kStallAlarm},
               {0x0101, kStallAlarm},
               {0x0002, kBumperAlarm},
               {0x8000, kBumperAlarm},
               {0x0080, kBumperAlarm},
               {0x0200, kBumperAlarm},
               {0x0301, kStallAlarm | kBumperAlarm},
               {0x0000, 0}};
  for (const auto& it : cases) {
    harness.sip.stall = it.word;
    harness.Tell(0, 0, 0);
    EXPECT_EQ(it.alarms, harness.pioneer.status().alarms) << it.word;
    EXPECT_EQ(it.word, harness.pioneer.status().bumpers);
  }
}

TEST(PioneerTest, ASipThatEndsBeforeTheFlagsSaysNothingAboutThem) {
  PioneerHarness harness;
  harness.Connect();
  harness.sip.stall = 0xFFFF;
  harness.sip.size = 17;
  harness.Tell(0, 0, 0);
  EXPECT_EQ(0, harness.pioneer.status().alarms);
  EXPECT_EQ(125, harness.pioneer.status().battery_100mv) << "of the one before";
}

TEST(PioneerTest, AnEmergencyStopGoesOutBeforeAnythingElseAndZeroSpeedFollows) {
  PioneerHarness harness;
  harness.Connect();
  harness.pioneer.set_wheel_speeds(200, 200);
  harness.Run(50);
  harness.heard.clear();
  harness.pioneer.set_wheel_speeds(300, 300);
  harness.pioneer.emergency_stop();
  harness.Run(50);
  EXPECT_EQ((Commands{kEmergency, kStandStill}), harness.heard);
}

TEST(PioneerTest, AnEmergencyStopWithoutASessionIsNotSent) {
  PioneerHarness harness;
  harness.on = false;
  harness.Run(2500);
  harness.pioneer.emergency_stop();
  harness.Run(2500);
  EXPECT_EQ(0, harness.CountOf(PioneerCommand::kEmergencyStop));
}

// A reset of our processor, while the Pioneer rolls on in its session.
TEST(PioneerTest, AWarmResetStopsThePioneerAndGoesOnInItsSessionWithoutAGapInTheOdometry) {
  PioneerHarness harness(5000, k100NmPerMm);
  harness.on = false;
  harness.Run(1100);
  harness.on = true;
  harness.Connect();
  ASSERT_EQ(1, harness.pioneer.rate());
  harness.Tell(1000, 0, 0);
  harness.Tell(1500, 0, 0);
  const Odometry before = harness.pioneer.odometry();
  const PioneerTrack track = harness.pioneer.track();
  harness.heard.clear();
  harness.pioneer = Pioneer(harness.now16(), k100NmPerMm);
  harness.pioneer.Continue(track);
  EXPECT_FALSE(harness.pioneer.known());
  harness.sip.x = 1620;  // it has rolled on
  harness.sip.y = 30;
  harness.Run(110);
  EXPECT_TRUE(harness.pioneer.known());
  EXPECT_EQ(0, harness.closed);
  EXPECT_EQ(1, harness.pioneer.rate());
  EXPECT_EQ(before.x_mm + 120, harness.pioneer.odometry().x_mm);
  EXPECT_EQ(before.y_mm + 30, harness.pioneer.odometry().y_mm);
  EXPECT_EQ(0, harness.pioneer.status().alarms);
  ASSERT_FALSE(harness.heard.empty());
  EXPECT_EQ(kEmergency, harness.heard[0]);
  EXPECT_LE(harness.heard[0].at_ms, harness.now_ms - 90) << "without waiting for a SIP";
  EXPECT_EQ(0, harness.CountOf(PioneerCommand::kSync0));
}

TEST(PioneerTest, AWarmResetWhoseSessionIsGoneLosesThePoseAndConnectsAnew) {
  PioneerHarness harness;
  harness.Connect();
  const PioneerTrack track = harness.pioneer.track();
  harness.synced = 0;  // the Pioneer was reset too
  harness.open = false;
  harness.pioneer = Pioneer(harness.now16());
  harness.pioneer.Continue(track);
  harness.Run(kPioneerSilenceMs + 10);
  EXPECT_EQ(kPoseLostAlarm, harness.pioneer.status().alarms);
  harness.Run(1000);
  EXPECT_TRUE(harness.pioneer.known());
}

TEST(PioneerTest, WhatTheFrontSonarsSeeIsTheShortestOfTheLastReports) {
  PioneerHarness harness;
  harness.pioneer = Pioneer(harness.now16(), kPioneerCount100Nm, true);
  harness.Connect();
  EXPECT_EQ(kNoRange, harness.pioneer.status().front_mm);
  const auto tell = [&](std::vector<std::pair<int, int>> readings) {
    harness.sip.sonars = std::move(readings);
    harness.Tell(0, 0, 0);
    return harness.pioneer.status().front_mm;
  };
  EXPECT_EQ(kNoRange, tell({{0, 200}, {1, 210}, {6, 220}, {7, 230}, {8, 100}, {15, 90}}))
      << "to the sides and behind";
  EXPECT_EQ(900, tell({{2, 900}, {5, 1200}}));
  EXPECT_EQ(300, tell({{3, 300}, {4, 2000}}));
  EXPECT_EQ(300, tell({{4, 2000}}));
  int farther = 0;  // reports until it is believed that the way is free: all sonars have had a turn
  while (tell({{2, 3000}, {3, 3000}}) != 3000) {
    ASSERT_LT(++farther, 8);
  }
  EXPECT_GE(farther, 3);
}

TEST(PioneerTest, SonarsThatAreOnAreSwitchedOffAgain) {
  PioneerHarness harness;
  harness.Connect();
  harness.sip.flags = 0x0003;
  harness.Run(250);
  EXPECT_EQ((Commands{kSonarOff}), harness.heard);
}

TEST(PioneerTest, ARobotThatCannotObeyIsStillToldItsSpeeds) {
  PioneerHarness harness;
  harness.Connect();
  for (int i = 0; i < 50; ++i) {
    harness.sip.flags = kSonarsOn;  // motors off, sonars on, whatever it is told
    if (i % 10 == 0) {
      harness.pioneer.set_wheel_speeds(200, 200);
    }
    harness.Run(100);
  }
  EXPECT_EQ(5, harness.CountOf(PioneerCommand::kVel2));
}

TEST(PioneerTest, SpeedsAreSentAtOnceAndThenKeptAlive) {
  PioneerHarness harness;
  harness.Connect();
  harness.pioneer.set_wheel_speeds(200, 200);
  harness.Run(1);
  ASSERT_EQ((Commands{kStraight}), harness.heard);
  harness.Run(5000);
  ASSERT_EQ(11u, harness.heard.size());
  for (size_t i = 1; i < harness.heard.size(); ++i) {
    EXPECT_EQ(kStraight, harness.heard[i]);
    EXPECT_EQ(kKeepAliveMs, harness.heard[i].at_ms - harness.heard[i - 1].at_ms);
  }
}

TEST(PioneerTest, OfSpeedsThatComeTooFastTheLastIsSent) {
  PioneerHarness harness;
  harness.Connect();
  for (int16_t i = 0; i < 100; ++i) {
    harness.pioneer.set_wheel_speeds(static_cast<int16_t>(i * 20), 0);
    harness.Step();
  }
  harness.Run(kCommandGapMs);
  EXPECT_EQ(99 * 256, harness.heard.back().argument);
  for (size_t i = 1; i < harness.heard.size(); ++i) {
    EXPECT_EQ(kCommandGapMs, harness.heard[i].at_ms - harness.heard[i - 1].at_ms);
  }
}

TEST(PioneerTest, SpeedsAreClampedTo127Units) {
  PioneerHarness harness;
  harness.Connect();
  harness.pioneer.set_wheel_speeds(INT16_MAX, INT16_MAX);
  harness.Run(20);
  EXPECT_EQ(127 * 256 + 127, harness.heard.back().argument);
  harness.pioneer.set_wheel_speeds(INT16_MIN, INT16_MIN);
  harness.Run(20);
  EXPECT_EQ(-127 * 256 + (256 - 127), harness.heard.back().argument);
}

TEST(PioneerTest, SilenceLeadsToANewSessionThatStandsStill) {
  PioneerHarness harness;
  harness.Connect();
  harness.pioneer.set_wheel_speeds(200, 200);
  harness.Run(100);
  harness.on = false;
  const uint32_t last_sip_ms = harness.now_ms;
  while (harness.pioneer.known()) {
    harness.Step();
    harness.pioneer.set_wheel_speeds(200, 200);
    ASSERT_LE(harness.now_ms - last_sip_ms, kPioneerSilenceMs);
  }
  EXPECT_EQ(kPioneerSilenceMs, harness.now_ms - last_sip_ms);
  harness.heard.clear();
  harness.synced = 0;  // power lost
  harness.open = false;
  harness.Run(500);
  harness.pioneer.set_wheel_speeds(200, 200);  // into the void
  harness.on = true;
  for (int i = 0; i < 5000 && !harness.pioneer.known(); ++i) {
    harness.Step();
  }
  harness.Run(1000);
  // One at first, then to keep alive.
  EXPECT_GE(harness.CountOf(PioneerCommand::kVel2), 2);
  for (const Heard& it : harness.heard) {
    EXPECT_TRUE(it.command != 32 || it.argument == 0) << it;
  }
  harness.pioneer.set_wheel_speeds(200, 200);
  harness.Run(20);
  EXPECT_EQ(kStraight, harness.heard.back());
}

TEST(PioneerTest, ARobotThatHearsUsAndIsNotHeardIsClosed) {
  PioneerHarness harness;
  harness.Connect();
  harness.pioneer.set_wheel_speeds(200, 200);
  harness.mute = true;
  harness.Run(1200);
  EXPECT_EQ(1, harness.closed);
  harness.mute = false;
  harness.Connect();
}

TEST(PioneerTest, AShortOutageDoesNotEndTheSession) {
  PioneerHarness harness;
  harness.Connect();
  harness.deaf = true;
  harness.mute = true;
  harness.Run(800);
  harness.deaf = false;
  harness.mute = false;
  harness.Run(2000);
  EXPECT_EQ(0, harness.closed);
  EXPECT_TRUE(harness.pioneer.known());
}

TEST(PioneerTest, OnlySipsShowThatTheRobotIsThere) {
  PioneerHarness harness;
  harness.Connect();
  harness.mute = true;
  for (int i = 0; i < 15; ++i) {
    harness.Run(100);
    for (const int type : {0x20, 0x90, 0xF0, 0x2F, 0x35, 0, 1, 2}) {
      Sip other;
      other.type = static_cast<uint8_t>(type);
      harness.ToClient(other);
    }
    Sip without_pose;
    without_pose.size = 6;
    harness.ToClient(without_pose);
  }
  EXPECT_FALSE(harness.pioneer.known());
}

TEST(PioneerTest, FirmwareWithoutFlagsIsEnabledOnce) {
  PioneerHarness harness;
  harness.sip.size = 17;
  harness.sip.flags = 0;
  harness.sip.stall = kLeftStall;
  harness.Run(2000);
  EXPECT_TRUE(harness.pioneer.known());
  EXPECT_EQ(1, harness.CountOf(PioneerCommand::kEnable));
  EXPECT_EQ(0, harness.pioneer.status().bumpers);
}

TEST(PioneerTest, TellsStalls) {
  PioneerHarness harness;
  harness.Connect();
  EXPECT_EQ(0, harness.pioneer.status().bumpers);
  for (const uint16_t stall : {kLeftStall, kRightStall, uint16_t{0x3E01}}) {
    harness.sip.stall = stall;
    harness.Run(100);
    EXPECT_EQ(stall, harness.pioneer.status().bumpers);
  }
}

TEST(PioneerTest, ACommandWaitsForRoomAndTheNextForTheCommand) {
  PioneerHarness harness;
  harness.Connect();
  harness.jammed = true;
  harness.pioneer.set_wheel_speeds(200, 200);
  harness.Run(30);
  harness.pioneer.set_wheel_speeds(0, 0);
  harness.Run(30);
  ASSERT_EQ(9, harness.pioneer.tx_size());
  ASSERT_TRUE(harness.heard.empty());
  harness.jammed = false;
  harness.Run(20);
  EXPECT_EQ((Commands{kStraight, kStandStill}), harness.heard);
  EXPECT_EQ(kCommandGapMs, harness.heard[1].at_ms - harness.heard[0].at_ms);
}

TEST(PioneerTest, AJammedUartDoesNotHideSilence) {
  PioneerHarness harness;
  harness.Connect();
  harness.jammed = true;
  harness.mute = true;
  harness.Run(1100);
  EXPECT_FALSE(harness.pioneer.known());
  harness.jammed = false;
  harness.mute = false;
  harness.Connect();
}

// Three turns of the 16-bit clock, from just before its wrap.
TEST(PioneerTest, TheClockMayWrap) {
  PioneerHarness harness(65'500);
  harness.Connect();
  uint32_t last_ms = harness.now_ms;
  while (harness.now_ms < 270'000) {
    if (harness.now_ms % 777 == 0) {
      harness.pioneer.set_wheel_speeds(200, 200);
    }
    if (harness.RunUntilHeard(kKeepAliveMs + 1)) {
      EXPECT_GE(harness.now_ms - last_ms, kCommandGapMs);
      last_ms = harness.now_ms;
    }
    ASSERT_LE(harness.now_ms - last_ms, kKeepAliveMs);
  }
  EXPECT_EQ(0, harness.closed);
}

// Whatever the cable does, commands keep their distance, every one is a packet (the harness
// checks), and when the cable is whole again there is a session within four seconds.
TEST(PioneerTest, ComesBackAfterAnyDisturbance) {
  std::mt19937 random(11);
  const auto one_in = [&random](unsigned n) { return random() % n == 0; };
  PioneerHarness harness;
  for (int round = 0; round < 60; ++round) {
    for (int i = 0; i < 4000; ++i) {
      if (one_in(500)) {
        harness.on = !harness.on;
      }
      if (one_in(300)) {
        harness.mute = !harness.mute;
        harness.lost_replies = static_cast<int>(random() % 3);
      }
      if (one_in(300)) {
        harness.deaf = !harness.deaf;
      }
      if (one_in(1000)) {
        harness.open = false;
        harness.synced = static_cast<int>(random() % 4);
      }
      if (one_in(20)) {
        harness.ToClient(Bytes{static_cast<uint8_t>(random())});
      }
      if (one_in(200)) {
        harness.ToClient(NaivePacket({static_cast<uint8_t>(random() % 3)}));
      }
      if (one_in(50)) {
        harness.pioneer.set_wheel_speeds(static_cast<int16_t>(random()),
                                         static_cast<int16_t>(random()));
      }
      harness.Step();
    }
    harness.on = true;
    harness.mute = false;
    harness.deaf = false;
    harness.lost_replies = 0;
    harness.lose_open = false;
    harness.Run(4000);
    ASSERT_TRUE(harness.pioneer.known()) << round;
    ASSERT_TRUE(harness.open) << round;
    for (size_t i = 1; i < harness.heard.size(); ++i) {
      ASSERT_GE(harness.heard[i].at_ms - harness.heard[i - 1].at_ms, kCommandGapMs);
    }
    harness.heard.clear();
  }
}

}  // namespace
}  // namespace client
}  // namespace pheromone
