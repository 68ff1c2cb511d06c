// The loop that joins board, conversation and drive.
#include "client_fw/core/robot.h"

#include <gtest/gtest.h>

#include <vector>

#include "client_fw/boards/host/host_board.h"
#include "client_fw/core/testing/conversation_harness.h"

namespace pheromone {
namespace client {
namespace {

struct FakeDrive {
  bool odometry(Odometry* to) {
    *to = pose;
    return known;
  }
  void set_wheel_speeds(int16_t left, int16_t right) { told.push_back({left, right}); }
  void emergency_stop() { ++emergencies; }
  const DriveStatus& status() const { return reported; }

  Odometry pose = {0, 0, 0};
  bool known = true;
  std::vector<WheelSpeeds> told;
  int emergencies = 0;
  DriveStatus reported = kNothingToTell;
};

class RobotTest : public testing::Test {
 protected:
  explicit RobotTest(const Parameters& parameters = WithStart())
      : robot_(&board_, &drive_, parameters, &memory_) {}

  static Parameters WithStart() {
    Parameters parameters = TestParameters();
    parameters.start = Pose{1000, 2000, kQuarterTurn};
    return parameters;
  }

  // One millisecond of a link that takes `kAirtimeMs` for whatever is sent.
  void Step() {
    board_.set_millis(++now_ms_);
    robot_.Step();
    uint8_t bytes[kMaxClientFrame];
    const size_t size = board_.TakeTransmission(bytes, sizeof(bytes));
    if (size != 0) {
      protocol::FrameDecoder decoder(protocol::kNoGapTimeout);
      bool complete = false;
      for (size_t i = 0; i < size; ++i) {
        complete = decoder.Push(bytes[i], 0);
      }
      ASSERT_TRUE(complete);
      request_ = decoder.message();
      leaves_ms_ = now_ms_ + kAirtimeMs;
      leaving_ = true;
    } else if (leaving_ && now_ms_ == leaves_ms_) {
      leaving_ = false;
      board_.OnTransmitted();
      if (serving_) {
        Serve();
      }
    }
  }

  void Serve() {
    protocol::Message answer;
    if (request_.opcode == protocol::kCommandAck) {
      return;
    }
    if (request_.opcode == protocol::kHello) {
      protocol::HelloAnswer hello;
      hello.id = kTestId;
      hello.nonce = 0x1234;
      hello.protocol_version = protocol::kProtocolVersion;
      hello.pose_unit_10um = 100;
      hello.type_mask = 0x0004;
      hello.slot_ms = kTestSlotMs;
      hello.response_window_ms = kTestWindowMs;
      Encode(hello, &answer);
    } else if (request_.opcode == protocol::kEvent) {
      Encode(protocol::EventAck{kTestId, request_.data[0]}, &answer);
    } else {
      ASSERT_TRUE(Decode(request_, &sense_));
      Encode(protocol::SenseAnswer{kTestId, 2, false, left_, 0}, &answer);
    }
    const std::vector<uint8_t> frame = FrameOf(answer);
    board_.Receive(frame.data(), frame.size());
  }

  void Command(const protocol::Command& command) {
    protocol::Message message;
    Encode(command, &message);
    const std::vector<uint8_t> frame = FrameOf(message);
    board_.Receive(frame.data(), frame.size());
    Step();
  }

  void Run(int ms) {
    for (int i = 0; i < ms; ++i) {
      Step();
    }
  }

  static constexpr uint32_t kAirtimeMs = 15;
  HostBoard board_;
  FakeDrive drive_;
  RequestMemory memory_ = {};
  Robot<HostBoard, FakeDrive> robot_;
  uint32_t now_ms_ = 0;
  bool serving_ = true;
  bool leaving_ = false;
  uint32_t leaves_ms_ = 0;
  int16_t left_ = 0;
  protocol::Message request_;
  protocol::SenseRequest sense_;
};

TEST_F(RobotTest, FirstThingToldIsZero) {
  Step();
  ASSERT_EQ(1u, drive_.told.size());
  EXPECT_EQ((WheelSpeeds{0, 0}), drive_.told[0]);
}

TEST_F(RobotTest, AsksWithOdometryPlacedOnTheMap) {
  drive_.pose = {300, -50, 0x0100};
  Run(500);
  EXPECT_EQ(1000 + 50, sense_.pose.x);  // facing +y: forward is +y, left_ is -x
  EXPECT_EQ(2000 + 300, sense_.pose.y);
  EXPECT_EQ(0x4100, sense_.pose.heading);
}

TEST_F(RobotTest, UnchangedSpeedsAreRepeatedEvery250Ms) {
  Run(1000);
  EXPECT_EQ((WheelSpeeds{200, 200}), robot_.wheels());
  drive_.told.clear();
  Run(2000);
  EXPECT_EQ(8u, drive_.told.size());
  for (const WheelSpeeds& speeds : drive_.told) {
    EXPECT_EQ((WheelSpeeds{200, 200}), speeds);
  }
}

TEST_F(RobotTest, ChangedSpeedsAreToldWithTheAnswer) {
  Run(1000);
  left_ = 2048;
  drive_.told.clear();
  Run(240);
  ASSERT_FALSE(drive_.told.empty());
  EXPECT_EQ((WheelSpeeds{100, 200}), drive_.told.back());
}

TEST_F(RobotTest, FailSafeTellsTheDriveZeroAndGoesOnTellingIt) {
  Run(1000);
  serving_ = false;
  Run(450 + 500);
  drive_.told.clear();
  Run(1000);
  EXPECT_EQ(4u, drive_.told.size());
  for (const WheelSpeeds& speeds : drive_.told) {
    EXPECT_EQ((WheelSpeeds{0, 0}), speeds);
  }
  serving_ = true;
  Run(3000);
  EXPECT_EQ((WheelSpeeds{200, 200}), drive_.told.back());
}

TEST_F(RobotTest, LoadAndSettingsReachTheBoard) {
  Run(1000);
  EXPECT_FALSE(board_.load());
  protocol::Command command;
  command.id = kTestId;
  command.seq = 1;
  command.code = protocol::CommandCode::kPickLoad;
  Command(command);
  EXPECT_TRUE(board_.load());
  EXPECT_TRUE(board_.settings().empty());

  command.seq = 2;
  command.code = protocol::CommandCode::kSetParameter;
  command.arguments[0] = kSpeedSetting;
  command.arguments[1] = 250;
  Command(command);
  Settings saved;
  ASSERT_EQ(size_t{kSettingsSize}, board_.settings().size());
  ASSERT_TRUE(UnpackSettings(board_.settings().data(), &saved));
  EXPECT_EQ(250, saved.speed_mm_s);
}

TEST_F(RobotTest, AResumeFromBesideItOutlivesAWarmReset) {
  Run(1000);
  drive_.reported.alarms = kStopButtonAlarm;
  Step();
  EXPECT_EQ(protocol::Reason::kNotPermitted, robot_.Resume());
  drive_.reported.alarms = 0;
  Step();
  EXPECT_TRUE(memory_.halted);
  EXPECT_EQ(protocol::Reason::kNone, robot_.Resume());
  EXPECT_FALSE(memory_.halted);
  EXPECT_TRUE(Trusted(memory_));
}

TEST_F(RobotTest, FailSafeIsAnEmergencyStopAndOneOnly) {
  Run(1000);
  EXPECT_EQ(0, drive_.emergencies);
  serving_ = false;
  Run(5000);
  EXPECT_EQ(1, drive_.emergencies);
  EXPECT_EQ((WheelSpeeds{0, 0}), drive_.told.back());
}

TEST_F(RobotTest, ABumperIsAnEmergencyStopWithinAPassOfTheLoop) {
  Run(1000);
  drive_.reported.alarms = kBumperAlarm;
  Step();
  EXPECT_EQ(1, drive_.emergencies);
  EXPECT_EQ((WheelSpeeds{0, 0}), drive_.told.back());
  drive_.reported.alarms = 0;
  Run(5000);
  EXPECT_EQ((WheelSpeeds{0, 0}), drive_.told.back()) << "until somebody releases it";
  protocol::Command command;
  command.id = kTestId;
  command.seq = 1;
  command.code = protocol::CommandCode::kResume;
  Command(command);
  Run(500);
  EXPECT_EQ((WheelSpeeds{200, 200}), drive_.told.back());
  EXPECT_EQ(1, drive_.emergencies);
}

TEST_F(RobotTest, WhatIsAheadLimitsTheSpeedTowardsIt) {
  Run(1000);
  drive_.reported.front_mm = 350;
  Step();
  EXPECT_EQ((WheelSpeeds{100, 100}), drive_.told.back());
  drive_.reported.front_mm = 100;
  Step();
  EXPECT_EQ((WheelSpeeds{0, 0}), drive_.told.back());
  drive_.reported.front_mm = kNoRange;
  Step();
  EXPECT_EQ((WheelSpeeds{200, 200}), drive_.told.back());
  EXPECT_EQ(0, drive_.emergencies);
}

TEST_F(RobotTest, AnswersWithAValueOfTheBoard) {
  Run(1000);
  protocol::Command command;
  command.id = kTestId;
  command.seq = 1;
  command.code = protocol::CommandCode::kGetParameter;
  command.arguments[0] = kRadioOverruns;
  for (int i = 0; i < 4096 + 3; ++i) {
    board_.Receive(0);
  }
  Step();
  Run(500);
  Command(command);
  for (int i = 0; i < 1000 && request_.opcode != protocol::kEvent; ++i) {
    Step();
  }
  protocol::EventReport event;
  ASSERT_TRUE(Decode(request_, &event));
  EXPECT_EQ(protocol::EventCode::kParameterValue, event.code);
  EXPECT_EQ(3, event.argument);
}

TEST_F(RobotTest, TheLedIsSteadyWhileItDrivesAndFlashesOnceWhileItIsHalted) {
  Run(6000);
  const auto changes = [&](int ms) {
    int count = 0;
    for (int i = 0; i < ms; ++i) {
      const bool before = board_.led();
      Step();
      count += before != board_.led() ? 1 : 0;
    }
    return count;
  };
  EXPECT_TRUE(board_.led());
  EXPECT_EQ(0, changes(2000));
  protocol::Command command;
  command.id = kTestId;
  command.seq = 1;
  command.code = protocol::CommandCode::kHalt;
  Command(command);
  changes(2000);
  EXPECT_EQ(10, changes(5 * 6 * 256)) << "on and off again, five times in five periods";
}

TEST_F(RobotTest, UnknownOdometryIsNotSent) {
  drive_.known = false;
  Run(2000);
  EXPECT_EQ(0u, robot_.conversation().counters().requests);
  EXPECT_GE(robot_.conversation().counters().hello_answers, 1u);
}

}  // namespace
}  // namespace client
}  // namespace pheromone
