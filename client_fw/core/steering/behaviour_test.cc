// Behaviour by itself: what stops a robot, what sets it going, and what it reports.
#include "client_fw/core/steering/behaviour.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <utility>
#include <vector>

#include "protocol/byte_order.h"

namespace pheromone {
namespace client {
namespace {

using protocol::CommandCode;
using protocol::EventCode;
using protocol::Reason;

constexpr uint16_t kTypes = 0x0006;  // 1 and 2

Parameters Released() {
  Parameters parameters;
  parameters.type = 2;
  parameters.fail_safe_ms = 500;
  parameters.start_released = true;
  parameters.law = Law::kDifferential;
  parameters.speed_mm_s = 200;
  parameters.lost_after_ms = 0;
  return parameters;
}

using Told = std::vector<std::pair<EventCode, int>>;

class BehaviourTest : public ::testing::Test {
 protected:
  explicit BehaviourTest(const Parameters& parameters = Released())
      : behaviour_(parameters, &memory_) {
    behaviour_.OnServer(protocol::kProtocolVersion, kTypes);
  }

  Reason Do(CommandCode code, std::vector<uint8_t> arguments = {}) {
    arguments.resize(8);
    return behaviour_.Execute(static_cast<uint8_t>(code), arguments.data());
  }
  Reason Set(uint8_t id, int32_t value) {
    std::vector<uint8_t> arguments(8);
    arguments[0] = id;
    protocol::PutI32(arguments.data() + 1, value);
    return Do(CommandCode::kSetParameter, arguments);
  }
  Reason Ask(uint8_t id) { return Do(CommandCode::kGetParameter, {id}); }

  void Run(int ms) {
    for (int i = 0; i < ms; ++i) {
      behaviour_.Advance(1);
      behaviour_.Check();
    }
  }

  // The events that are to be reported, with their arguments.
  Told Events() {
    Told events;
    while (behaviour_.state().events != 0) {
      EventCode event{};
      const int16_t argument = behaviour_.TakeEvent(&event);
      events.emplace_back(event, argument);
    }
    return events;
  }

  bool Drives() const {
    const WheelSpeeds wheels = behaviour_.state().wheels;
    return wheels.left_mm_s != 0 || wheels.right_mm_s != 0;
  }
  uint8_t flags() const { return behaviour_.state().flags; }

  RequestMemory memory_ = RequestMemory();
  Behaviour behaviour_;
};

TEST_F(BehaviourTest, StandsUntilTheFirstIntensitiesAndThenDrives) {
  EXPECT_EQ(flags(), kNoAnswerYet);
  EXPECT_FALSE(Drives());
  behaviour_.OnIntensities(4096, 4096, 0);
  EXPECT_EQ(flags(), 0);
  EXPECT_EQ(behaviour_.state().wheels.left_mm_s, 200);
  EXPECT_EQ(behaviour_.state().wheels.right_mm_s, 200);
}

TEST_F(BehaviourTest, StopsAtOnceWhenAnswersAreMissingAndGoesOnWithTheNext) {
  behaviour_.OnIntensities(4096, 4096, 0);
  Run(499);
  EXPECT_TRUE(Drives());
  EXPECT_FALSE(behaviour_.Take(kStopAtOnce));
  Run(1);
  EXPECT_FALSE(Drives());
  EXPECT_EQ(flags(), kFailSafe);
  EXPECT_TRUE(behaviour_.Take(kStopAtOnce));
  EXPECT_FALSE(behaviour_.Take(kStopAtOnce)) << "once";
  EXPECT_EQ(behaviour_.state().fail_safe_stops, 1u);
  EXPECT_EQ(Events(), Told()) << "the channel may merely be full";
  behaviour_.OnSilence();
  EXPECT_EQ(Events(), (Told{{EventCode::kFailSafeStop, 0}}));
  behaviour_.OnIntensities(4096, 4096, 0);
  EXPECT_TRUE(Drives());
}

TEST_F(BehaviourTest, AHaltStaysUntilAResumeAlsoOverAReset) {
  behaviour_.OnIntensities(4096, 4096, 0);
  EXPECT_EQ(Do(CommandCode::kHalt), Reason::kNone);
  EXPECT_FALSE(Drives());
  behaviour_.OnIntensities(4096, 4096, 0);
  EXPECT_EQ(flags(), kHalted);
  Behaviour next(Released(), &memory_);
  EXPECT_EQ(next.state().flags, kNoAnswerYet | kHalted);
  EXPECT_EQ(Do(CommandCode::kResume), Reason::kNone);
  EXPECT_TRUE(Drives());
}

TEST_F(BehaviourTest, AnAlarmHaltsAndCannotBeResumedWhileItLasts) {
  behaviour_.OnIntensities(4096, 4096, 0);
  behaviour_.OnDrive({kBumperAlarm, 120, 0x0203, kNoRange});
  EXPECT_FALSE(Drives());
  EXPECT_TRUE(behaviour_.Take(kStopAtOnce));
  EXPECT_EQ(Events(), (Told{{EventCode::kObstacle, 0x0203}}));
  EXPECT_EQ(Do(CommandCode::kResume), Reason::kBlockedByObstacle);
  behaviour_.OnDrive({kStopButtonAlarm, 120, 0, kNoRange});
  EXPECT_EQ(Events(), (Told{{EventCode::kStoppedByHand, 0}}));
  EXPECT_EQ(Do(CommandCode::kResume), Reason::kNotPermitted);
  behaviour_.OnDrive({0, 120, 0, kNoRange});
  EXPECT_FALSE(Drives()) << "it waits for a resume";
  EXPECT_EQ(Do(CommandCode::kResume), Reason::kNone);
  EXPECT_TRUE(Drives());
}

TEST_F(BehaviourTest, BumpersThatTheSettingsExcludeDoNothing) {
  Parameters parameters = Released();
  parameters.bumpers = false;
  RequestMemory memory = RequestMemory();
  Behaviour behaviour(parameters, &memory);
  behaviour.OnDrive({kBumperAlarm, 120, 0x0203, kNoRange});
  EXPECT_EQ(behaviour.state().drive.alarms, 0);
  EXPECT_EQ(behaviour.state().events, 0);
}

TEST_F(BehaviourTest, ALowBatteryIsReportedOnceIfItStaysLow) {
  const uint8_t low = behaviour_.state().parameters.low_battery_100mv;
  const DriveStatus dip{0, static_cast<uint8_t>(low - 1), 0, kNoRange};
  const DriveStatus full{0, static_cast<uint8_t>(low + 10), 0, kNoRange};
  behaviour_.OnDrive(full);
  behaviour_.OnDrive(dip);
  Run(4999);
  behaviour_.OnDrive(dip);
  EXPECT_EQ(Events(), Told()) << "a dip";
  Run(1);
  behaviour_.OnDrive(dip);
  EXPECT_EQ(Events(), (Told{{EventCode::kBatteryLow, low - 1}}));
  Run(10'000);
  behaviour_.OnDrive(dip);
  EXPECT_EQ(Events(), Told());
}

TEST_F(BehaviourTest, SpeedAndTypeHoldUntilItIsSwitchedOff) {
  EXPECT_EQ(Do(CommandCode::kSpeed, {120, 0}), Reason::kNone);
  EXPECT_EQ(Do(CommandCode::kFollowType, {1}), Reason::kNone);
  EXPECT_EQ(Do(CommandCode::kFollowType, {3}), Reason::kUnknownPheromone);
  EXPECT_EQ(behaviour_.state().parameters.speed_mm_s, 120);
  EXPECT_EQ(behaviour_.state().parameters.type, 1);
  EXPECT_EQ(behaviour_.state().stored.type, 2) << "not stored";
  EXPECT_FALSE(behaviour_.Take(kSaveSettings));
  const Behaviour next(Released(), &memory_);
  EXPECT_EQ(next.state().parameters.speed_mm_s, 120);
  EXPECT_EQ(next.state().parameters.type, 1);
}

TEST_F(BehaviourTest, SettingsAreStoredEightTimesAtOnceAndThenOnceAMinute) {
  for (int i = 0; i < kMaxSavesAtOnce; ++i) {
    EXPECT_EQ(Set(kSpeedSetting, 100 + i), Reason::kNone) << i;
    EXPECT_TRUE(behaviour_.Take(kSaveSettings)) << i;
  }
  EXPECT_EQ(Set(kSpeedSetting, 150), Reason::kBusy);
  EXPECT_FALSE(behaviour_.Take(kSaveSettings));
  EXPECT_EQ(Set(kSpeedSetting, 107), Reason::kNone) << "it has this value: nothing to store";
  EXPECT_FALSE(behaviour_.Take(kSaveSettings));
  behaviour_.Advance(kSavingMs - 1);
  behaviour_.Check();
  EXPECT_EQ(Set(kSpeedSetting, 150), Reason::kBusy);
  behaviour_.Advance(1);
  behaviour_.Check();
  EXPECT_EQ(Set(kSpeedSetting, 150), Reason::kNone);
  EXPECT_EQ(Set(kSpeedSetting, 151), Reason::kBusy);
}

TEST_F(BehaviourTest, AValueOutOfRangeChangesNothing) {
  EXPECT_EQ(Set(kSpeedSetting, 100'000), Reason::kBadValue);
  EXPECT_EQ(Set(0xEE, 1), Reason::kBadValue);
  EXPECT_EQ(Do(CommandCode::kSpeed, {0xFF, 0xFF}), Reason::kBadValue) << "negative";
  EXPECT_EQ(behaviour_.state().parameters.speed_mm_s, 200);
  EXPECT_EQ(behaviour_.Execute(0xEE, nullptr), Reason::kNotPermitted);
}

TEST_F(BehaviourTest, ValuesThatAreAskedForAreReported) {
  EXPECT_EQ(Ask(kSpeedSetting), Reason::kNone);
  EXPECT_EQ(Events(), (Told{{EventCode::kParameterValue, 200}}));
  EXPECT_EQ(Ask(kStopFlags), Reason::kNone);
  EXPECT_EQ(Events(), (Told{{EventCode::kParameterValue, kNoAnswerYet}}));
  EXPECT_EQ(Ask(kResetCause), Reason::kNone);
  EXPECT_EQ(Events(), Told()) << "others know it";
  EXPECT_EQ(behaviour_.state().value_wanted, kResetCause);
  behaviour_.Tell(40'000);
  EXPECT_EQ(behaviour_.state().value_wanted, 0);
  EXPECT_EQ(Events(), (Told{{EventCode::kParameterValue, INT16_MAX}})) << "cut off";
  EXPECT_EQ(Ask(0xEE), Reason::kBadValue);
}

TEST_F(BehaviourTest, ARobotWithoutAPoseStandsUntilItIsGivenOneAndReleased) {
  Parameters parameters = Released();
  parameters.pose_lost = true;
  RequestMemory memory = RequestMemory();
  Behaviour behaviour(parameters, &memory);
  behaviour.OnServer(protocol::kProtocolVersion, kTypes);
  behaviour.OnIntensities(4096, 4096, 0);
  EXPECT_EQ(behaviour.state().flags, kPoseLost | kHalted);
  const Odometry odometry{};
  EXPECT_FALSE(behaviour.Locate(odometry));
  const auto set = [&behaviour](uint8_t id, int32_t value) {
    uint8_t arguments[8] = {id};
    protocol::PutI32(arguments + 1, value);
    return behaviour.Execute(static_cast<uint8_t>(CommandCode::kSetParameter), arguments);
  };
  EXPECT_EQ(set(kPoseX, 1000), Reason::kNone);
  EXPECT_EQ(set(kPoseY, -2000), Reason::kNone);
  EXPECT_FALSE(behaviour.Locate(odometry)) << "the heading is last";
  EXPECT_EQ(set(kPoseHeading, 0x1'0000), Reason::kBadValue);
  EXPECT_EQ(set(kPoseHeading, 0), Reason::kNone);
  EXPECT_TRUE(behaviour.Locate(odometry));
  EXPECT_EQ(behaviour.state().flags, kHalted);
  const uint8_t none[8] = {};
  EXPECT_EQ(behaviour.Execute(static_cast<uint8_t>(CommandCode::kResume), none), Reason::kNone);
  EXPECT_EQ(behaviour.state().flags, 0);
}

TEST_F(BehaviourTest, AServerOfAnotherVersionOrWithoutThePheromoneStopsIt) {
  behaviour_.OnIntensities(4096, 4096, 0);
  EXPECT_FALSE(behaviour_.OnServer(protocol::kProtocolVersion + 1, kTypes));
  EXPECT_EQ(flags(), kWrongVersion);
  EXPECT_FALSE(behaviour_.OnServer(protocol::kProtocolVersion, 0x0002));
  EXPECT_EQ(flags(), kTypeMissing);
  EXPECT_TRUE(behaviour_.OnServer(protocol::kProtocolVersion, kTypes));
  EXPECT_TRUE(Drives());
}

TEST_F(BehaviourTest, OffTheMapItStandsUntilAnAnswerAndReportsItOnce) {
  behaviour_.OnIntensities(4096, 4096, 0);
  behaviour_.OnOffTheMap();
  behaviour_.OnOffTheMap();
  EXPECT_EQ(flags(), kOffTheMap);
  EXPECT_EQ(Events(), (Told{{EventCode::kOffTheMap, 0}}));
  behaviour_.OnIntensities(4096, 4096, 0);
  EXPECT_TRUE(Drives());
}

TEST_F(BehaviourTest, ATrailIsLostAfterItsTimeAndStopsThoseThatStop) {
  Parameters parameters = Released();
  parameters.lost_after_ms = 300;
  parameters.lost_trail = LostTrail::kStop;
  RequestMemory memory = RequestMemory();
  Behaviour behaviour(parameters, &memory);
  behaviour.OnServer(protocol::kProtocolVersion, kTypes);
  behaviour.OnIntensities(4096, 4096, 0);
  behaviour.Advance(299);
  behaviour.OnIntensities(0, 0, 0);
  EXPECT_EQ(behaviour.state().flags, 0);
  behaviour.Advance(1);
  behaviour.OnIntensities(0, 0, 0);
  EXPECT_EQ(behaviour.state().flags, kTrailLost);
  EventCode event{};
  behaviour.TakeEvent(&event);
  EXPECT_EQ(event, EventCode::kTrailLost);
  behaviour.OnIntensities(4096, 0, 0);
  EXPECT_EQ(behaviour.state().flags, 0);
}

TEST_F(BehaviourTest, LoadsArePickedAndDroppedAsCommanded) {
  EXPECT_EQ(Do(CommandCode::kPickLoad), Reason::kNone);
  EXPECT_TRUE(behaviour_.state().load);
  EXPECT_EQ(Do(CommandCode::kDropLoad), Reason::kNone);
  EXPECT_FALSE(behaviour_.state().load);
  EXPECT_EQ(Events(), (Told{{EventCode::kLoadPicked, 0}, {EventCode::kLoadDropped, 0}}));
}

TEST_F(BehaviourTest, ANetExceptionHaltsAndNamesItsTag) {
  behaviour_.OnIntensities(4096, 4096, 0);
  behaviour_.RaiseNetException(513);
  EXPECT_EQ(flags(), kHalted);
  EXPECT_EQ(Events(), (Told{{EventCode::kNetException, 513}}));
}

}  // namespace
}  // namespace client
}  // namespace pheromone
