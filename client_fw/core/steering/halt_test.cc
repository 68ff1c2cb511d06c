// Motion never begins by itself: what halts a robot, and what releases it.
#include <gtest/gtest.h>

#include "client_fw/core/testing/conversation_harness.h"

namespace pheromone {
namespace client {
namespace {

using protocol::CommandCode;
using protocol::EventCode;
using protocol::Reason;

Parameters Halted() {
  Parameters parameters = TestParameters();
  parameters.start_released = false;
  return parameters;
}

// Gives a command and returns the result in its ACK. In the quiet part of a period.
class Commander {
 public:
  explicit Commander(Harness* harness) : harness_(harness) {}

  Reason Do(CommandCode code, int id = 0, int32_t value = 0) {
    harness_->Serve(250);  // to the end of an exchange
    if (harness_->leaving) {
      harness_->Serve(100);
    }
    protocol::Command command;
    command.id = kTestId;
    command.seq = ++seq_;
    command.code = code;
    command.arguments[0] = static_cast<uint8_t>(id);
    if (code == CommandCode::kSpeed) {
      protocol::PutI16(command.arguments, static_cast<int16_t>(value));
    } else {
      protocol::PutI32(command.arguments + 1, value);
    }
    return Send(command);
  }
  Reason Repeat() {
    protocol::Command command;
    command.id = kTestId;
    command.seq = seq_;
    command.code = CommandCode::kResume;
    return Send(command);
  }

 private:
  Reason Send(const protocol::Command& command) {
    harness_->FeedEncoded(command);
    protocol::CommandAck ack;
    for (int i = 0; i < 3; ++i) {
      EXPECT_TRUE(harness_->RunUntilSent(100));
      if (Decode(harness_->sent, &ack)) {
        break;
      }
    }
    return static_cast<Reason>(ack.result);
  }

  Harness* harness_;
  uint8_t seq_ = 0;
};

bool Reported(const Harness& harness, EventCode code) {
  for (const protocol::EventReport& event : harness.events) {
    if (event.code == code) {
      return true;
    }
  }
  return false;
}

DriveStatus With(uint8_t alarms, uint16_t bumpers = 0) {
  DriveStatus status = kNothingToTell;
  status.alarms = alarms;
  status.bumpers = bumpers;
  return status;
}

TEST(HaltTest, ARobotThatWasSwitchedOnAsksAndStandsUntilItIsReleased) {
  Harness harness(Halted());
  harness.GreetAndServe(3000);
  EXPECT_EQ(kStill, harness.conversation.state().wheels);
  EXPECT_EQ(kHalted, harness.conversation.state().flags);
  EXPECT_GE(harness.counters().answers, 10u);
  Commander commander(&harness);
  EXPECT_EQ(Reason::kNone, commander.Do(CommandCode::kResume));
  EXPECT_EQ(kStraight, harness.conversation.state().wheels);
}

TEST(HaltTest, AWarmResetHaltsARobotThatDroveUnlessItsSettingsSayOtherwise) {
  for (const bool start_released : {false, true}) {
    Parameters parameters = Halted();
    parameters.start_released = start_released;
    Harness before(parameters);
    before.GreetAndServe(1000);
    Commander commander(&before);
    ASSERT_EQ(Reason::kNone, commander.Do(CommandCode::kResume));
    ASSERT_TRUE(Trusted(before.memory));
    Harness after(parameters, 9000, before.memory);
    after.GreetAndServe(2000);
    EXPECT_EQ(start_released ? kStraight : kStill, after.conversation.state().wheels);
  }
}

TEST(HaltTest, HaltOutlivesAWarmResetWhateverTheSettingsSay) {
  Harness before;
  before.GreetAndServe(1000);
  Commander commander(&before);
  ASSERT_EQ(Reason::kNone, commander.Do(CommandCode::kHalt));
  ASSERT_TRUE(Trusted(before.memory));
  Harness after(TestParameters(), 9000, before.memory);
  after.GreetAndServe(2000);
  EXPECT_EQ(kHalted, after.conversation.state().flags);
}

TEST(HaltTest, ACommandThatWasExecutedBeforeAWarmResetIsNotExecutedAgainAfterIt) {
  Harness before;
  before.GreetAndServe(1000);
  Commander commander(&before);
  ASSERT_EQ(Reason::kNone, commander.Do(CommandCode::kResume));
  Harness after(TestParameters(), 9000, before.memory);
  after.GreetAndServe(1000);
  protocol::Command halt;  // of everybody: not in the command memory
  halt.id = protocol::kBroadcastId;
  halt.code = CommandCode::kHalt;
  after.FeedEncoded(halt);
  protocol::Command resume;
  resume.id = kTestId;
  resume.seq = 1;
  resume.code = CommandCode::kResume;
  after.FeedEncoded(resume);
  EXPECT_EQ(1u, after.counters().repeated_commands);
  EXPECT_EQ(kHalted, after.conversation.state().flags);
}

TEST(HaltTest, ValuesThatAreNotStoredOutliveAWarmResetAndNoPowerLoss) {
  Harness before;
  before.GreetAndServe(1000);
  Commander commander(&before);
  ASSERT_EQ(Reason::kNone, commander.Do(CommandCode::kSpeed, 0, 350));
  ASSERT_EQ(Reason::kNone, commander.Do(CommandCode::kFollowType, 1));
  Harness warm(TestParameters(), 9000, before.memory);
  EXPECT_EQ(350, warm.conversation.state().parameters.speed_mm_s);
  EXPECT_EQ(1, warm.conversation.state().parameters.type);
  Parameters next = TestParameters();
  next.boot_counter = 0x1235;
  Harness cold(next, 9000, before.memory);
  EXPECT_EQ(200, cold.conversation.state().parameters.speed_mm_s);
  EXPECT_EQ(2, cold.conversation.state().parameters.type);
}

// And a repetition of the COMMAND, whose ACK was lost, is not acknowledged for nothing.
TEST(HaltTest, TheLoadOutlivesAWarmResetAndNoPowerLoss) {
  Harness before;
  before.GreetAndServe(1000);
  Commander commander(&before);
  ASSERT_EQ(Reason::kNone, commander.Do(CommandCode::kPickLoad));
  Harness warm(TestParameters(), 9000, before.memory);
  EXPECT_TRUE(warm.conversation.state().load);
  warm.GreetAndServe(1000);
  protocol::Command again;
  again.id = kTestId;
  again.seq = 1;
  again.code = CommandCode::kPickLoad;
  warm.FeedEncoded(again);
  EXPECT_EQ(1u, warm.counters().repeated_commands);
  EXPECT_TRUE(warm.conversation.state().load);
  Parameters next = TestParameters();
  next.boot_counter = 0x1235;
  Harness cold(next, 9000, before.memory);
  EXPECT_FALSE(cold.conversation.state().load);
  ASSERT_EQ(Reason::kNone, commander.Do(CommandCode::kDropLoad));
  EXPECT_FALSE(Harness(TestParameters(), 9000, before.memory).conversation.state().load);
}

TEST(HaltTest, AnAlarmHaltsAtOnceIsReportedAndOutlivesItsEndAndAReset) {
  const struct {
    uint8_t alarm;
    uint16_t bumpers;
    EventCode event;
    int argument;
  } cases[] = {{kStallAlarm, 0x0101, EventCode::kObstacle, 0x0101},
               {kBumperAlarm, 0x8004, EventCode::kObstacle, 0x8004 - 0x10000},
               {kStopButtonAlarm, 0, EventCode::kStoppedByHand, 0},
               {kMotorsOffAlarm, 0, EventCode::kStoppedByHand, 0}};
  for (const auto& it : cases) {
    SCOPED_TRACE(int{it.alarm});
    Harness harness;
    harness.GreetAndServe(1000);
    ASSERT_EQ(kStraight, harness.conversation.state().wheels);
    harness.conversation.behaviour()->OnDrive(With(it.alarm, it.bumpers));
    EXPECT_EQ(kStill, harness.conversation.state().wheels);
    EXPECT_TRUE(harness.conversation.behaviour()->Take(kStopAtOnce));
    EXPECT_FALSE(harness.conversation.behaviour()->Take(kStopAtOnce));
    harness.conversation.behaviour()->OnDrive(With(0));
    EXPECT_FALSE(harness.conversation.behaviour()->Take(kStopAtOnce));
    harness.Serve(2000);
    EXPECT_EQ(kHalted, harness.conversation.state().flags) << "to let go does not release it";
    ASSERT_EQ(1u, harness.events.size());
    EXPECT_EQ(it.event, harness.events[0].code);
    EXPECT_EQ(it.argument, harness.events[0].argument);
    ASSERT_TRUE(Trusted(harness.memory));
    Harness after(TestParameters(), 9000, harness.memory);
    after.GreetAndServe(2000);
    EXPECT_EQ(kHalted, after.conversation.state().flags);
  }
}

TEST(HaltTest, NothingReleasesARobotWhileTheAlarmLasts) {
  Harness harness;
  harness.GreetAndServe(1000);
  Commander commander(&harness);
  harness.conversation.behaviour()->OnDrive(With(kBumperAlarm));
  EXPECT_EQ(Reason::kBlockedByObstacle, commander.Do(CommandCode::kResume));
  harness.conversation.behaviour()->OnDrive(With(kStopButtonAlarm));
  EXPECT_EQ(Reason::kNotPermitted, commander.Do(CommandCode::kResume));
  EXPECT_EQ(kStill, harness.conversation.state().wheels);
  harness.conversation.behaviour()->OnDrive(With(0));
  EXPECT_EQ(Reason::kNone, commander.Do(CommandCode::kResume));
  EXPECT_EQ(kStraight, harness.conversation.state().wheels);
}

TEST(HaltTest, BumpersThatTheRobotDoesNotHaveAreIgnored) {
  Parameters parameters = TestParameters();
  parameters.bumpers = false;
  Harness harness(parameters);
  harness.GreetAndServe(1000);
  harness.conversation.behaviour()->OnDrive(With(kBumperAlarm, 0xFFFF));
  EXPECT_EQ(kStraight, harness.conversation.state().wheels);
  harness.conversation.behaviour()->OnDrive(With(kBumperAlarm | kStallAlarm, 0xFFFF));
  EXPECT_EQ(kStill, harness.conversation.state().wheels);
}

TEST(HaltTest, ARobotThatHasLostItsPoseSaysSoAndAsksForNothingUntilItHasOneAndIsReleased) {
  Parameters parameters = TestParameters();
  parameters.pose_lost = true;
  Harness harness(parameters);
  harness.pose = {100, 20, 0x1000};  // odometry
  harness.GreetAndServe(3000);
  EXPECT_TRUE(Reported(harness, EventCode::kPoseLost));
  EXPECT_EQ(0u, harness.counters().requests) << "it does not know from where";
  EXPECT_EQ(kStill, harness.conversation.state().wheels);

  Commander commander(&harness);
  EXPECT_EQ(Reason::kNone, commander.Do(CommandCode::kSetParameter, kPoseX, 5000));
  EXPECT_EQ(Reason::kNone, commander.Do(CommandCode::kSetParameter, kPoseY, -1500));
  EXPECT_EQ(0u, harness.counters().requests);
  EXPECT_EQ(Reason::kNone, commander.Do(CommandCode::kSetParameter, kPoseHeading, 0x5000));
  harness.Serve(1000);
  EXPECT_EQ(kStill, harness.conversation.state().wheels) << "a pose alone does not release it";
  ASSERT_TRUE(harness.RunUntilSent());
  EXPECT_EQ(5000, harness.SentSense().pose.x);
  EXPECT_EQ(-1500, harness.SentSense().pose.y);
  EXPECT_EQ(0x5000, harness.SentSense().pose.heading);
  harness.Answer(0, 0);
  EXPECT_EQ(Reason::kNone, commander.Do(CommandCode::kResume));
  EXPECT_EQ(kStraight, harness.conversation.state().wheels);

  // A quarter turn further left than its odometry believes: 10 mm along its x are along y.
  harness.pose.x_mm += 10;
  ASSERT_TRUE(harness.RunUntilSent());
  EXPECT_EQ(5000, harness.SentSense().pose.x);
  EXPECT_EQ(-1490, harness.SentSense().pose.y);
  harness.Answer(0, 0);

  ASSERT_TRUE(Trusted(harness.memory));
  Harness warm(TestParameters(), 9000, harness.memory);
  warm.pose = harness.pose;
  warm.Greet();
  ASSERT_TRUE(warm.RunUntilSent());
  EXPECT_EQ(-1490, warm.SentSense().pose.y) << "and a warm reset keeps the place";
}

TEST(HaltTest, ADriveThatLostTrackHaltsAndLosesThePose) {
  Harness harness;
  harness.GreetAndServe(1000);
  harness.conversation.behaviour()->OnDrive(With(kPoseLostAlarm));
  EXPECT_EQ(kHalted | kPoseLost, harness.conversation.state().flags);
  harness.conversation.behaviour()->OnDrive(With(0));
  harness.Serve(2000);
  EXPECT_TRUE(Reported(harness, EventCode::kPoseLost));
}

TEST(HaltTest, APoseThatCannotBeIsRefusedOrOffTheMap) {
  Harness harness;
  harness.GreetAndServe(1000);
  Commander commander(&harness);
  EXPECT_EQ(Reason::kBadValue, commander.Do(CommandCode::kSetParameter, kPoseHeading, 65536));
  EXPECT_EQ(Reason::kBadValue, commander.Do(CommandCode::kSetParameter, kPoseHeading, -1));
  EXPECT_EQ(Reason::kBadValue, commander.Do(CommandCode::kSetParameter, 67, 0));
  EXPECT_EQ(Reason::kNone, commander.Do(CommandCode::kSetParameter, kPoseX, INT32_MIN));
  EXPECT_EQ(Reason::kNone, commander.Do(CommandCode::kSetParameter, kPoseHeading, 0));
  harness.Serve(1000);
  EXPECT_TRUE(Reported(harness, EventCode::kOffTheMap));
  EXPECT_EQ(kStill, harness.conversation.state().wheels);
}

// --- What is stored.

TEST(StoredSettingsTest, ValuesThatHoldForNowAreNotStoredWithAnother) {
  Harness harness;
  harness.GreetAndServe(1000);
  Commander commander(&harness);
  ASSERT_EQ(Reason::kNone, commander.Do(CommandCode::kSpeed, 0, 350));
  ASSERT_EQ(Reason::kNone, commander.Do(CommandCode::kFollowType, 1));
  EXPECT_FALSE(harness.conversation.behaviour()->Take(kSaveSettings));
  ASSERT_EQ(Reason::kNone, commander.Do(CommandCode::kSetParameter, kGainSetting, 12));
  ASSERT_TRUE(harness.conversation.behaviour()->Take(kSaveSettings));
  EXPECT_EQ(12, harness.conversation.state().stored.gain_8ths);
  EXPECT_EQ(200, harness.conversation.state().stored.speed_mm_s);
  EXPECT_EQ(2, harness.conversation.state().stored.type);
  EXPECT_EQ(350, harness.conversation.state().parameters.speed_mm_s) << "it goes on to hold";
}

TEST(StoredSettingsTest, AStoredValueReplacesTheOneThatHeldForNow) {
  Harness harness;
  harness.GreetAndServe(1000);
  Commander commander(&harness);
  ASSERT_EQ(Reason::kNone, commander.Do(CommandCode::kSpeed, 0, 350));
  ASSERT_EQ(Reason::kNone, commander.Do(CommandCode::kSetParameter, kSpeedSetting, 250));
  EXPECT_EQ(250, harness.conversation.state().parameters.speed_mm_s);
  Parameters stored = TestParameters();
  stored.speed_mm_s = 250;
  Harness warm(stored, 9000, harness.memory);
  EXPECT_EQ(250, warm.conversation.state().parameters.speed_mm_s);
}

TEST(StoredSettingsTest, AnUnchangedValueIsAcceptedAndNotStored) {
  Harness harness;
  harness.GreetAndServe(1000);
  Commander commander(&harness);
  for (int i = 0; i < 20; ++i) {
    ASSERT_EQ(Reason::kNone, commander.Do(CommandCode::kSetParameter, kPeriodSetting, 200));
    EXPECT_FALSE(harness.conversation.behaviour()->Take(kSaveSettings));
  }
}

TEST(StoredSettingsTest, AValueThatDoesNotFitIsRefusedAndNothingChanges) {
  Harness harness;
  harness.GreetAndServe(1000);
  Commander commander(&harness);
  EXPECT_EQ(Reason::kBadValue, commander.Do(CommandCode::kSetParameter, kPeriodSetting, 500));
  EXPECT_EQ(Reason::kUnknownPheromone, commander.Do(CommandCode::kSetParameter, kTypeSetting, 3));
  EXPECT_FALSE(harness.conversation.behaviour()->Take(kSaveSettings));
  EXPECT_EQ(2, harness.conversation.state().stored.type);
  EXPECT_EQ(2, harness.conversation.state().parameters.type);
}

// An EEPROM wears out after 100 000 writes of a byte.
TEST(StoredSettingsTest, AfterEightChangesOneAMinuteIsStoredAndMoreAreRefusedAsBusy) {
  Harness harness;
  harness.GreetAndServe(1000);
  Commander commander(&harness);
  int stored = 0;
  int busy = 0;
  const uint32_t begin_ms = harness.now_ms;
  for (int i = 0; harness.now_ms - begin_ms < 10 * 60000; ++i) {
    const Reason result = commander.Do(CommandCode::kSetParameter, kPeriodSetting, 201 + i % 2);
    busy += result == Reason::kBusy ? 1 : 0;
    stored += harness.conversation.behaviour()->Take(kSaveSettings) ? 1 : 0;
    harness.Serve(1000);
    if (i == 7) {
      EXPECT_EQ(8, stored);
    }
  }
  EXPECT_GT(busy, 100);
  EXPECT_GE(stored, 8 + 4) << "half of the free moments find the value unchanged";
  EXPECT_LE(stored, 8 + 10);
}

// --- Battery and diagnostics.

TEST(BatteryTest, AVoltageThatStaysLowIsReportedOnceAndAgainAfterItHasRecovered) {
  Harness harness;
  harness.GreetAndServe(1000);
  const auto run = [&](uint8_t battery_100mv, int seconds) {
    DriveStatus status = kNothingToTell;
    status.battery_100mv = battery_100mv;
    for (int i = 0; i < 10 * seconds; ++i) {
      harness.conversation.behaviour()->OnDrive(status);
      harness.Serve(100);
    }
    return harness.events.size();
  };
  EXPECT_EQ(0u, run(115, 10)) << "11.5 V are enough";
  EXPECT_EQ(0u, run(0, 10)) << "it is not known";
  EXPECT_EQ(0u, run(100, 4)) << "while it accelerates";
  EXPECT_EQ(0u, run(120, 1));
  EXPECT_EQ(1u, run(114, 60));
  EXPECT_EQ(EventCode::kBatteryLow, harness.events[0].code);
  EXPECT_EQ(114, harness.events[0].argument);
  EXPECT_EQ(1u, run(119, 1)) << "it has not really recovered";
  EXPECT_EQ(1u, run(114, 10));
  EXPECT_EQ(1u, run(120, 1));
  EXPECT_EQ(2u, run(110, 10));
  EXPECT_EQ(kStraight, harness.conversation.state().wheels) << "it drives on";
}

TEST(BatteryTest, ALimitOfZeroSwitchesTheReportOff) {
  Parameters parameters = TestParameters();
  parameters.low_battery_100mv = 0;
  Harness harness(parameters);
  harness.GreetAndServe(1000);
  DriveStatus status = kNothingToTell;
  status.battery_100mv = 1;
  harness.conversation.behaviour()->OnDrive(status);
  harness.Serve(20000);
  harness.conversation.behaviour()->OnDrive(status);
  harness.Serve(1000);
  EXPECT_TRUE(harness.events.empty());
}

TEST(DiagnosticsTest, CountersAreReportedAsAParameterAndUnknownNumbersRefused) {
  Harness harness;
  harness.GreetAndServe(1000);
  Commander commander(&harness);
  const auto ask = [&](uint8_t id) {
    harness.events.clear();
    EXPECT_EQ(Reason::kNone, commander.Do(CommandCode::kGetParameter, id));
    harness.Serve(500);
    EXPECT_EQ(1u, harness.events.size());
    EXPECT_EQ(EventCode::kParameterValue, harness.events.back().code);
    return harness.events.back().argument;
  };
  DriveStatus status = kNothingToTell;
  status.bumpers = 0x0301;
  status.battery_100mv = 123;
  status.front_mm = 456;
  harness.conversation.behaviour()->OnDrive(status);
  EXPECT_EQ(0, ask(kStopFlags));
  EXPECT_EQ(0x0301, ask(kBumperWord));
  EXPECT_EQ(123, ask(kBattery));
  EXPECT_EQ(456, ask(kFrontRange));
  EXPECT_GT(ask(kRequestCount), 5);
  status.front_mm = kNoRange;
  harness.conversation.behaviour()->OnDrive(status);
  EXPECT_EQ(32767, ask(kFrontRange)) << "as much as an EVENT can say";
  for (const int id : {18, 63, 64, 66, 127, int{kEndOfDiagnostics}, 255}) {
    EXPECT_EQ(Reason::kBadValue, commander.Do(CommandCode::kGetParameter, id)) << id;
  }
}

}  // namespace
}  // namespace client
}  // namespace pheromone
