// The session: what is said, when, and what is not. How the robot moves: pioneer_motion_test.cc.
#include "client_fw/sim/pioneer_robot.h"

#include <gtest/gtest.h>

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

TEST(PioneerSessionTest, SyncsOutOfOrderAreNotAnswered) {
  Client client;
  EXPECT_TRUE(client.Send(kSync1).empty());
  EXPECT_TRUE(client.Send(kSync2).empty());
  EXPECT_TRUE(client.Send(Command(4, 1)).empty());
  client.Send(kSync0);
  EXPECT_TRUE(client.Send(kSync2).empty());
  EXPECT_EQ(client.Send(kSync1), kSync1);
}

TEST(PioneerSessionTest, ALostEchoIsRepeatedOrAskedForFromTheStart) {
  Client client(AsMobileSim());
  for (int attempt = 0; attempt < 2; ++attempt) {
    EXPECT_EQ(client.Send(kSync0), kSync0);
    EXPECT_EQ(client.Send(kSync0), kSync0);
    EXPECT_EQ(client.Send(kSync1), kSync1);
    EXPECT_EQ(client.Send(kSync1), kSync1);
    EXPECT_EQ(client.Send(kSync2), kNames);
    EXPECT_EQ(client.Send(kSync2), kNames);
  }
  client.Send(testing::kOpen);
  EXPECT_TRUE(client.robot().open());
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
  config.range_mm = [](const PlanePose& pose, int number) {
    return static_cast<int>(pose.x_m * 1000) + number;
  };
  Client client(config, {1, 0, 0});
  client.Connect();
  client.Wait(100);
  ASSERT_EQ(client.last().sonars(), 8);
  EXPECT_EQ(client.last().byte(23 + 3 * 7), 7);
  EXPECT_EQ(client.last().word(24 + 3 * 7), 1007);
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
