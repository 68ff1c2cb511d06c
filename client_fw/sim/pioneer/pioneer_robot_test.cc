// The session: what is said, when, and what is not. How the robot moves: pioneer_motion_test.cc.
#include "client_fw/sim/pioneer/pioneer_robot.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "client_fw/sim/testing/pioneer_client.h"

namespace pheromone::sim {
namespace {

using testing::Bytes;
using testing::Client;
using testing::Command;
using testing::Framed;
using testing::Hex;
using testing::Packets;
using testing::operator+;  // NOLINT(misc-unused-using-decls): it is used

const Bytes kSync0 = Hex("fa fb 03 00 00 00");
const Bytes kSync1 = Hex("fa fb 03 01 00 01");
const Bytes kSync2 = Hex("fa fb 03 02 00 02");
const Bytes kNames =
    Hex("fa fb 1d 02 4d 6f 62 69 6c 65 53 69 6d 00 50 69 6f 6e 65 65 72 00 70 33 64 78 2d 73 68 "
        "00 06 da");

PioneerConfig AsMobileSim() {
  PioneerConfig config;
  config.model = *FindPioneerModel("p3dx-sh");
  config.name = "MobileSim";
  return config;
}

TEST(PioneerSessionTest, SyncsAreEchoedAndTheLastTellsTheNames) {
  Client client(AsMobileSim());
  EXPECT_EQ(client.Send(kSync0), kSync0);
  EXPECT_EQ(client.Send(kSync1), kSync1);
  EXPECT_EQ(client.Send(kSync2), kNames);
  client.Wait(1000);
  EXPECT_TRUE(client.sips().empty());  // not before OPEN
  EXPECT_TRUE(client.Send(testing::kOpen).empty());
  client.Wait(1000);
  EXPECT_EQ(client.sips().size(), 10u);
}

TEST(PioneerSessionTest, OpenMayHaveAnArgument) {
  for (const Bytes& open : {Command(1), Command(1, 1)}) {
    Client client;
    client.Send(kSync0 + kSync1 + kSync2 + open);
    EXPECT_TRUE(client.robot().open());
  }
}

TEST(PioneerSessionTest, AModemsGreetingAndSeveralCommandsInOneReadAreTaken) {
  Client client(AsMobileSim());
  const Bytes greeting = {'W', 'M', 'S', '2', '\r'};
  EXPECT_EQ(client.Send(greeting + kSync0 + kSync1 + kSync2), kSync0 + kSync1 + kNames);
  client.Send(Command(1, 1) + Command(62, 1) + Command(4, 1) + Command(28, 0) + Command(11, 200));
  client.Wait(100);
  EXPECT_TRUE(client.last().motors());
  EXPECT_EQ(client.last().sonars(), 0);
  EXPECT_TRUE(client.last().moving());
  EXPECT_EQ(client.robot().counters().packets, 8u);
  EXPECT_EQ(client.robot().counters().ignored, 1u);  // 62
}

TEST(PioneerSessionTest, BytesOneByOneAreTheSameSession) {
  Client client(AsMobileSim());
  Bytes answers;
  for (const uint8_t byte : kSync0 + kSync1 + kSync2 + Command(1) + Command(4, 1)) {
    answers = answers + client.Send(Bytes{byte});
    client.Wait(1);
  }
  EXPECT_EQ(answers, kSync0 + kSync1 + kNames);
  EXPECT_TRUE(client.robot().motors_enabled());
}

// MobileSim warns of a SYNC out of sequence, and goes on from there.
TEST(PioneerSessionTest, ACloseBeforeSync0BeginsASessionInWhichSync0IsNotAnswered) {
  Client client(AsMobileSim());
  EXPECT_TRUE(client.Send(Command(4, 1)).empty());
  EXPECT_EQ(client.Send(kSync1), kSync1);
  EXPECT_EQ(client.Send(testing::kClose), kNames);
  EXPECT_TRUE(client.Send(kSync0).empty());
  client.Wait(60'000);
  EXPECT_TRUE(client.Send(kSync0).empty());
  EXPECT_TRUE(client.Send(testing::kClose).empty());
  EXPECT_EQ(client.robot().counters().closes, 1u);
  EXPECT_EQ(client.Send(kSync0), kSync0);
}

TEST(PioneerSessionTest, ALostEchoIsRepeatedOrAskedForFromTheStart) {
  Client client(AsMobileSim());
  for (int attempt = 0; attempt < 2; ++attempt) {
    EXPECT_EQ(client.Send(kSync0), kSync0);
    EXPECT_EQ(client.Send(kSync0), kSync0);
    EXPECT_EQ(client.Send(kSync1), kSync1);
    EXPECT_EQ(client.Send(kSync1), kSync1);
    EXPECT_EQ(client.Send(kSync2), kNames);
    EXPECT_TRUE(client.Send(kSync2).empty());  // it is CLOSE by now
  }
}

TEST(PioneerSessionTest, BadChecksumsAreDroppedWithoutAWord) {
  Client client;
  client.Connect();
  Bytes bad = Command(testing::kEnable, 1);
  bad.back() ^= 0x40;
  EXPECT_TRUE(client.Send(bad).empty());
  EXPECT_FALSE(client.robot().motors_enabled());
  EXPECT_EQ(client.robot().counters().bad_checksums, 1u);
  client.Send(Command(testing::kEnable, 1));
  EXPECT_TRUE(client.robot().motors_enabled());
}

TEST(PioneerSessionTest, UnknownCommandsAndMissingArgumentsAreIgnored) {
  Client client;
  client.Connect();
  const uint64_t before = client.robot().counters().ignored;
  EXPECT_TRUE(client.Send(Command(200, 5)).empty());
  EXPECT_TRUE(client.Send(Command(testing::kEnable)).empty());
  EXPECT_TRUE(client.Send(Framed({4, 0x3B, 1})).empty());
  EXPECT_TRUE(client.Send(Framed({4, 0x2B, 1, 0})).empty());
  EXPECT_FALSE(client.robot().motors_enabled());
  EXPECT_EQ(client.robot().counters().ignored - before, 4u);
}

// Well-formed packets with any content, in and out of sessions.
TEST(PioneerSessionTest, AnyPacketsAreSurvivedAndTheLimitsHold) {
  std::mt19937 random(5);
  Client client;
  for (int i = 0; i < 20'000; ++i) {
    if (random() % 200 == 0) {
      client.robot().HangUp();  // of whatever there is
      client.ConnectAndEnable();
    }
    Bytes packet = {static_cast<uint8_t>(random() % (random() % 2 == 0 ? 64 : 256))};
    for (size_t left = random() % 6; left > 0; --left) {
      const uint8_t types[] = {0x3B, 0x1B, 0x2B, static_cast<uint8_t>(random())};
      packet.push_back(types[random() % 4]);
    }
    client.Send(Framed(packet));
    client.Wait(static_cast<int64_t>(random() % 30));
    ASSERT_LE(std::abs(client.robot().drive().left_m_s()), 1.2 + 1e-6);
    ASSERT_LE(std::abs(client.robot().drive().right_m_s()), 1.2 + 1e-6);
  }
  EXPECT_GT(client.robot().counters().sessions, 30u);
  EXPECT_GT(std::abs(client.robot().drive().left_rolled_m()), 1);
}

TEST(PioneerSessionTest, ConfigIsAnsweredOrNot) {
  PioneerConfig config;
  Client talkative(config);
  talkative.Connect();
  const std::vector<Bytes> packets = Packets(talkative.Send(testing::kConfig, 1));
  ASSERT_EQ(packets.size(), 1u);
  EXPECT_EQ(packets[0][3], 0x20);
  EXPECT_EQ(talkative.Send(testing::kConfig), packets[0]);  // without an argument as well

  config.answers_config = false;
  Client silent(config);
  silent.Connect();
  EXPECT_TRUE(silent.Send(testing::kConfig, 1).empty());
  EXPECT_TRUE(silent.Send(testing::kHostBaud, 2).empty());
  EXPECT_EQ(silent.robot().counters().ignored, 0u);
}

TEST(PioneerSessionTest, CloseEndsTheStreamAndAnotherSessionCanBegin) {
  Client client;
  client.ConnectAndEnable();
  client.Wait(300);
  client.Send(testing::kClose);
  EXPECT_FALSE(client.robot().open());
  EXPECT_EQ(client.robot().NextSipTime(), PioneerRobot::kNever);
  client.Wait(1000);
  EXPECT_EQ(client.sips().size(), 3u);
  EXPECT_EQ(client.Send(kSync0), kSync0);
  client.Connect();
  client.Wait(300);
  EXPECT_EQ(client.sips().size(), 6u);
  EXPECT_FALSE(client.last().motors());  // off at each connection
  EXPECT_GT(client.last().sonars(), 0);
  EXPECT_EQ(client.robot().counters().sessions, 2u);
}

TEST(PioneerSessionTest, AnOldSessionGoesOnUntilItIsClosed) {
  Client client;
  client.ConnectAndEnable();
  client.Wait(60'000);
  EXPECT_EQ(client.sips().size(), 600u);     // nobody said CLOSE
  EXPECT_TRUE(client.Send(kSync0).empty());  // PULSE, in a session
  EXPECT_TRUE(client.Send(kSync2).empty());  // CLOSE
  EXPECT_EQ(client.Send(kSync0), kSync0);
}

TEST(PioneerSessionTest, HangUpIsCloseAndForgetsHalfAPacket) {
  Client client;
  client.ConnectAndEnable();
  client.Send(Hex("fa fb 06 0b 3b"));
  client.robot().HangUp();
  EXPECT_FALSE(client.robot().open());
  EXPECT_FALSE(client.robot().motors_enabled());
  EXPECT_EQ(client.Send(kSync0), kSync0);
}

// As ARIA connects: SYNCs, each answered by one packet within a second; CLOSE only if that is a SIP
// of type 0x32; 50 attempts. Returns how many it took, or 51.
int ConnectAsAria(PioneerRobot* robot, int64_t* now_ms) {
  uint8_t state = 0;
  for (int attempt = 1; attempt <= 50; ++attempt) {
    robot->OnBytes(Command(state), *now_ms * 1'000'000);
    Bytes answer = robot->TakeOutput();
    for (int waited_ms = 0; answer.empty() && waited_ms < 1000; ++waited_ms) {
      robot->AdvanceTo(++*now_ms * 1'000'000);
      answer = robot->TakeOutput();
    }
    const int id = answer.empty() ? -1 : answer[3];
    if (id == state && ++state == 3) {
      return attempt;
    }
    if (id == 0x32) {
      robot->OnBytes(Command(testing::kClose, 1), *now_ms * 1'000'000);
    }
    if (id != state - 1) {
      state = 0;
    }
  }
  return 51;
}

// A line whose end the robot cannot see: the old client is gone, the robot drives, and the new
// client's SYNC0s are PULSEs that keep it driving.
TEST(PioneerSessionTest, AClientThatBeginsWhileAnOldSessionDrivesIsTold0x32) {
  for (const int64_t pause_ms : {100, 1000, 1950, 2050, 2500, 10'000}) {
    Client old;
    old.ConnectAndEnable();
    old.Send(testing::kVel, 300);
    old.Wait(pause_ms);
    int64_t now_ms = pause_ms;
    EXPECT_LE(ConnectAsAria(&old.robot(), &now_ms), 30) << pause_ms;
    EXPECT_LE(now_ms - pause_ms, 2500);  // the watchdog's time, and the slowest of two SIPs
    EXPECT_FALSE(old.robot().open());
    EXPECT_FALSE(old.robot().motors_enabled());
  }
}

TEST(PioneerSipStreamTest, MovingIsWhatCommandsOfTheLastTwoSecondsHaveCaused) {
  Client client;
  client.ConnectAndEnable();
  client.Send(testing::kVel, 300);
  client.Wait(100);
  EXPECT_TRUE(client.last().moving());
  client.Drive(3000);  // PULSEs alone
  EXPECT_FALSE(client.last().moving());
  EXPECT_GT(client.last().left(), 200);
  client.Send(testing::kVel, 300);
  client.Wait(100);
  EXPECT_TRUE(client.last().moving());
  client.Send(testing::kSetV, 300);
  client.Send(testing::kMove, 3000);  // ends by itself, so PULSEs are enough
  client.Drive(6000);
  EXPECT_TRUE(client.last().moving());
  client.Drive(6000);
  EXPECT_FALSE(client.last().moving());
  EXPECT_EQ(client.last().left(), 0);
}

TEST(PioneerExtrasTest, EncoderAndIoPacketsFollowTheSipOnceOrUntilTheyAreStopped) {
  Client client;
  client.Connect();
  client.Send(testing::kSonar, 0);
  const auto ids_after = [&](int id, int argument) {
    client.Send(id, argument);
    std::vector<int> ids;
    for (const Bytes& packet : Packets(client.WaitForOthers(300))) {
      ids.push_back(packet[3]);
    }
    return ids;
  };
  EXPECT_EQ(ids_after(testing::kEncoder, 1), (std::vector{0x90}));
  EXPECT_EQ(ids_after(testing::kIoRequest, 1), (std::vector{0xF0}));
  EXPECT_EQ(ids_after(testing::kEncoder, 2), (std::vector{0x90, 0x90, 0x90}));
  EXPECT_EQ(ids_after(testing::kIoRequest, 3), (std::vector{0x90, 0xF0, 0x90, 0xF0, 0x90, 0xF0}));
  EXPECT_EQ(ids_after(testing::kEncoder, 0), (std::vector{0xF0, 0xF0, 0xF0}));
  EXPECT_EQ(ids_after(testing::kIoRequest, -2), (std::vector<int>{}));
  client.Send(testing::kEncoder, 2);
  client.Send(testing::kClose);
  client.Connect();
  EXPECT_TRUE(client.WaitForOthers(300).empty());  // not in the next session
}

TEST(PioneerStopButtonTest, StopsAtOnceAndKeepsTheMotorsOff) {
  Client client;
  client.ConnectAndEnable();
  client.Send(testing::kVel, 300);
  client.Wait(1500);
  client.robot().set_stop_pressed(true);
  client.Wait(100);
  EXPECT_EQ(client.speed_mm_s(), 0);
  EXPECT_EQ(client.last().flags() & 0b1100001, 0b1100000);
  EXPECT_EQ(client.last().stall(), 0x0101);
  client.Send(testing::kEnable, 1);
  client.Send(testing::kVel, 300);
  client.Wait(500);
  EXPECT_FALSE(client.last().motors());
  EXPECT_EQ(client.speed_mm_s(), 0);
  client.robot().set_stop_pressed(false);
  client.Wait(500);
  EXPECT_EQ(client.last().flags() & 0b1100001, 0);
  EXPECT_EQ(client.last().stall(), 0);
  EXPECT_EQ(client.speed_mm_s(), 0);  // nothing begins by itself
  client.Send(testing::kEnable, 1);
  client.Wait(500);
  EXPECT_EQ(client.speed_mm_s(), 0);
  client.Send(testing::kVel, 300);
  client.Wait(500);
  EXPECT_NEAR(client.speed_mm_s(), 150, 1e-6);
}

TEST(PioneerBatteryTest, IsReportedAsItIsSet) {
  PioneerConfig config;
  config.battery_v = 11.9;
  Client client(config);
  client.Connect();
  client.Send(testing::kSonar, 0);
  client.Wait(100);
  EXPECT_EQ(client.last().byte(14), 119);
  client.robot().set_battery_v(10.4);
  client.Wait(100);
  EXPECT_EQ(client.last().byte(14), 104);
  EXPECT_EQ(client.last().word(23 + 5), 104);
}

// A PeopleBot's 32 sonars, 16 a SIP.
TEST(PioneerSipStreamTest, SonarsTakeTurnsIfTheyAreMoreThanASipHasReadings) {
  PioneerConfig config;
  config.model = *FindPioneerModel("peoplebot-sh");
  Client client(config);
  client.Connect();
  client.Wait(300);
  ASSERT_EQ(client.sips().size(), 3u);
  for (size_t sip = 0; sip < 3; ++sip) {
    ASSERT_EQ(client.sips()[sip].sonars(), 16);
    for (size_t i = 0; i < 16; ++i) {
      EXPECT_EQ(client.sips()[sip].byte(23 + 3 * i), static_cast<int>((16 * sip + i) % 32));
    }
  }
}

TEST(PioneerSipStreamTest, ASipComesEvery100Ms) {
  Client client;
  client.Wait(37);
  client.Connect();
  for (int ms = 1; ms <= 1000; ++ms) {
    EXPECT_EQ(client.robot().NextSipTime(), (37 + (ms + 99) / 100 * 100) * 1'000'000) << ms;
    client.Wait(1);
    EXPECT_EQ(client.sips().size(), static_cast<size_t>(ms / 100)) << ms;
  }
}

TEST(PioneerSipStreamTest, SonarReadingsComeUntilSonarIsSwitchedOff) {
  PioneerConfig config;
  config.sonars = 8;
  config.range = [](const PlanePose& from, double /*reach_m*/) { return from.x_m; };
  Client client(config, {1, 0, 0});
  client.Connect();
  client.Wait(100);
  ASSERT_EQ(client.last().sonars(), 8);
  EXPECT_EQ(client.last().byte(23 + 3 * 7), 7);
  EXPECT_EQ(client.last().word(24 + 3 * 7), 1069);  // 69 mm before the centre
  EXPECT_EQ(client.last().flags(), 0b11110);
  client.Send(testing::kSonar, 0);
  client.Wait(100);
  EXPECT_EQ(client.last().sonars(), 0);
  EXPECT_EQ(client.last().bytes.size(), 41u);
  EXPECT_EQ(client.last().flags(), 0);
  client.Send(testing::kSonar, 1);
  client.Wait(100);
  EXPECT_EQ(client.last().sonars(), 8);
}

TEST(PioneerSipStreamTest, TheShortFormEndsAfterTheSonarReadings) {
  PioneerConfig config;
  config.sip_form = SipForm::kShort;
  Client client(config);
  client.Connect();
  client.Wait(100);
  EXPECT_EQ(client.last().bytes.size(), 25u + 3 * 16);
}

TEST(PioneerSipStreamTest, WhatNobodyTakesIsBoundedAndCutBetweenPackets) {
  PioneerRobot robot({}, {});
  robot.OnBytes(kSync0 + kSync1 + kSync2 + Command(1), 0);
  robot.AdvanceTo(int64_t{3600} * 1'000'000'000);
  const std::vector<Bytes> packets = Packets(robot.TakeOutput());
  EXPECT_GT(packets.size(), 30u);
  EXPECT_LT(packets.size(), 60u);
  EXPECT_EQ(robot.counters().sips + robot.counters().lost_sips, 36'000u);
  EXPECT_EQ(robot.counters().sips + 3, packets.size());
}

TEST(PioneerSipStreamTest, ATimeInThePastIsThePresent) {
  PioneerRobot robot({}, {});
  robot.OnBytes(kSync0 + kSync1 + kSync2 + Command(1), 5'000'000'000);
  robot.AdvanceTo(1);
  robot.OnBytes(Command(0), 1);
  EXPECT_EQ(robot.now_ns(), 5'000'000'000);
  EXPECT_EQ(robot.NextSipTime(), 5'100'000'000);
}

}  // namespace
}  // namespace pheromone::sim
