// The client beside a robot (client_fw/attach) against the simulated Pioneer, which was written
// without it, and a naive server, in virtual time. What "stands" means is the simulated robot's
// true motion.
#include "client_fw/attach/attached_robot.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <deque>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "client_fw/sim/pioneer/pioneer_robot.h"
#include "client_fw/sim/serial_line.h"
#include "protocol/decoder.h"
#include "protocol/messages.h"

namespace pheromone::attach {
namespace {

constexpr int64_t kNsPerMs = 1'000'000;
constexpr double kAntennasM = 0.33;
constexpr double kAheadM = 0.2;  // as if only the nodes ahead were sensed
constexpr double kTrailReachM = 0.5;

// Along the x axis, full at y = 0: what an antenna senses beside it.
int16_t IntensityAt(double y_m) {
  return static_cast<int16_t>(std::lround(4096 * std::max(0.0, 1 - std::abs(y_m) / kTrailReachM)));
}

client::Parameters WithStart(int speed_mm_s, double y_m, double heading_rad) {
  client::Parameters parameters;
  parameters.boot_counter = 7;
  parameters.buffered_link = true;
  parameters.rounds = false;
  parameters.start_released = true;
  parameters.fail_safe_ms = 400;  // as pheromone-robot's default
  parameters.speed_mm_s = static_cast<int16_t>(speed_mm_s);
  parameters.start = {
      0, static_cast<int32_t>(std::lround(y_m * 1000)),
      static_cast<client::BinaryAngle>(std::lround(heading_rad / (2 * std::numbers::pi) * 65'536))};
  return parameters;
}

class World {
 public:
  explicit World(int speed_mm_s, double y_m = 0, double heading_rad = 0)
      : pioneer(Config(), {0, y_m, heading_rad}), robot(WithStart(speed_mm_s, y_m, heading_rad)) {}
  explicit World(const client::Parameters& parameters)  // at the origin
      : pioneer(Config(), {}), robot(parameters) {}

  static sim::PioneerConfig Config() {
    sim::PioneerConfig config;
    config.model = *sim::FindPioneerModel("p3dx-sh");
    return config;
  }

  // The robot's program is held up if `stepped` is false; the world goes on.
  void Run(int ms, bool stepped = true) {
    for (int i = 0; i < ms; ++i) {
      ++now_ms;
      StepPioneer();
      StepServer();
      if (!stepped) {
        continue;
      }
      robot.Step(static_cast<uint32_t>(now_ms));
      for (const uint8_t byte : robot.TakeCommands()) {
        commands_.Put(byte, now_ms * kNsPerMs);
      }
      if (const std::vector<uint8_t> frame = robot.TakeFrame(); !frame.empty()) {
        sent_.push_back({now_ms + kAirtimeMs, frame});
      }
    }
  }

  // The mean distance from the trail over the next `ms`.
  double MeanDistanceMm(int ms) {
    double sum = 0;
    for (int i = 0; i < ms; ++i) {
      Run(1);
      sum += std::abs(pioneer.drive().true_pose().y_m) * 1000;
    }
    return sum / ms;
  }

  void Command(protocol::CommandCode code) {
    protocol::Command command;
    command.id = 1;
    command.seq = 1;
    command.code = code;
    protocol::Message message;
    Encode(command, &message);
    Answer(message);
  }

  bool stands() const { return pioneer.drive().motion() == sim::Motion{}; }

  int64_t now_ms = 0;
  bool server_gone = false;
  bool cable_cut = false;
  std::vector<uint8_t> before_output;  // reaches the client before all that the robot sends
  sim::PioneerRobot pioneer;
  AttachedRobot robot;

 private:
  static constexpr int64_t kAirtimeMs = 15;
  static constexpr int64_t kAnswerMs = 20;
  struct Frame {
    int64_t at_ms;
    std::vector<uint8_t> bytes;
  };

  void StepPioneer() {
    const int64_t now_ns = now_ms * kNsPerMs;
    while (const auto command = commands_.Get(now_ns)) {
      if (!cable_cut) {
        pioneer.OnBytes({&command->byte, 1}, command->time_ns);
      }
    }
    pioneer.AdvanceTo(now_ns);
    const std::vector<uint8_t> output = pioneer.TakeOutput();
    if (!output.empty()) {
      robot.OnRobotBytes(before_output);
    }
    for (const uint8_t byte : output) {
      reports_.Put(byte, now_ns);
    }
    while (const auto report = reports_.Get(now_ns)) {
      if (!cable_cut) {
        robot.OnRobotBytes({&report->byte, 1});
      }
    }
  }

  void StepServer() {
    while (!sent_.empty() && sent_.front().at_ms <= now_ms) {
      robot.OnFrameSent();
      if (!server_gone) {
        Serve(sent_.front().bytes);
      }
      sent_.pop_front();
    }
    while (!answers_.empty() && answers_.front().at_ms <= now_ms) {
      robot.OnModemBytes(answers_.front().bytes);
      answers_.pop_front();
    }
  }

  void Serve(const std::vector<uint8_t>& frame) {
    protocol::FrameDecoder decoder(protocol::kNoGapTimeout);
    bool complete = false;
    for (const uint8_t byte : frame) {
      complete = decoder.Push(byte, 0);
    }
    ASSERT_TRUE(complete);
    const protocol::Message& request = decoder.message();
    protocol::Message answer;
    protocol::HelloRequest hello;
    protocol::SenseRequest sense;
    protocol::EventReport event;
    if (Decode(request, &hello)) {
      protocol::HelloAnswer greeting;
      greeting.id = hello.id;
      greeting.nonce = hello.nonce;
      greeting.protocol_version = protocol::kProtocolVersion;
      greeting.epoch = 1;
      greeting.pose_unit_10um = 100;
      greeting.type_mask = 0x0002;
      Encode(greeting, &answer);
    } else if (request.opcode == protocol::kPing) {
      answer = request;
      answer.opcode = protocol::kPingAnswer;
    } else if (Decode(request, &event)) {
      Encode(protocol::EventAck{event.id, event.seq}, &answer);
    } else if (Decode(request, &sense)) {
      const double heading = sense.pose.heading * 2 * std::numbers::pi / 65'536;
      const double y_m = sense.pose.y / 1000.0 + kAheadM * std::sin(heading);
      const double aside_m = kAntennasM / 2 * std::cos(heading);
      Encode(protocol::SenseAnswer{sense.id, sense.type, sense.wide, IntensityAt(y_m + aside_m),
                                   IntensityAt(y_m - aside_m)},
             &answer);
    } else {
      return;
    }
    Answer(answer);
  }

  void Answer(const protocol::Message& answer) {
    uint8_t bytes[protocol::kMaxFrame];
    const size_t size = EncodeFrame(answer, bytes, sizeof bytes);
    answers_.push_back({now_ms + kAnswerMs, {bytes, bytes + size}});
  }

  sim::SerialLine commands_{9600};
  sim::SerialLine reports_{9600};
  std::deque<Frame> sent_;
  std::deque<Frame> answers_;
};

TEST(AttachedRobot, FollowsATrail) {
  World world(300, 0.2, 20 * std::numbers::pi / 180);
  world.Run(8000);
  EXPECT_LT(world.MeanDistanceMm(20'000), 60);
  EXPECT_GT(world.pioneer.drive().true_pose().x_m, 5);
  EXPECT_EQ(0u, world.pioneer.counters().bad_checksums);
  EXPECT_EQ(0u, world.pioneer.counters().ignored);
  EXPECT_EQ(0u, world.robot.conversation().counters().timeouts);
}

// Whenever the server goes: the true speed is zero half a second later.
TEST(AttachedRobot, CutOffFromTheServerItStandsWithin500MsAndGoesOnWhenItIsBack) {
  int64_t longest_ms = 0;
  for (const int speed_mm_s : {100, 200, 300, 600}) {
    for (int phase_ms = 0; phase_ms < 400; phase_ms += 7) {
      World world(speed_mm_s);
      world.Run(6000 + phase_ms);
      ASSERT_GT(world.pioneer.drive().motion().speed_m_s, 0.09);
      world.server_gone = true;
      const int64_t cut_ms = world.now_ms;
      while (!world.stands() && world.now_ms < cut_ms + 10'000) {
        world.Run(1);
      }
      longest_ms = std::max(longest_ms, world.now_ms - cut_ms);
      world.Run(2000);
      ASSERT_TRUE(world.stands());
      world.server_gone = false;
      world.Run(4000);
      ASSERT_GT(world.pioneer.drive().motion().speed_m_s, 0.09) << phase_ms;
    }
  }
  std::printf("longest from the cut to zero speed: %lld ms\n", static_cast<long long>(longest_ms));
  EXPECT_LE(longest_ms, 500);
}

TEST(AttachedRobot, StartsHaltedUnlessItIsReleased) {
  client::Parameters parameters = WithStart(200, 0, 0);
  parameters.start_released = false;
  World world(parameters);
  world.Run(8000);
  EXPECT_EQ(client::kHalted, world.robot.conversation().state().flags);
  EXPECT_EQ(0, world.pioneer.drive().true_pose().x_m);
  world.Command(protocol::CommandCode::kResume);
  world.Run(2000);
  EXPECT_EQ(0, world.robot.conversation().state().flags);
  EXPECT_GT(world.pioneer.drive().true_pose().x_m, 0.1);
}

TEST(AttachedRobot, RobotThatWasCutOffIsDrivenAgainFromItsLastPose) {
  World world(200);
  world.Run(8000);
  world.cable_cut = true;
  world.pioneer.HangUp();  // as the simulated Pioneer does when its connection ends
  world.Run(1000);
  EXPECT_TRUE(world.stands());
  const double rolled_x_m = world.pioneer.drive().true_pose().x_m;
  world.Run(5000);
  EXPECT_FALSE(world.robot.pioneer().known());
  EXPECT_TRUE(world.stands());
  const int32_t known_x_mm = world.robot.pose().x_mm;
  EXPECT_NEAR(rolled_x_m * 1000, known_x_mm, 200);  // it rolled to a stop unseen

  world.cable_cut = false;
  world.Run(5000);
  EXPECT_TRUE(world.robot.pioneer().known());
  const double driven_mm = (world.pioneer.drive().true_pose().x_m - rolled_x_m) * 1000;
  EXPECT_GT(driven_mm, 200);
  EXPECT_NEAR(driven_mm, world.robot.pose().x_mm - known_x_mm, 30);  // 100 ms of a report
  EXPECT_EQ(2u, world.pioneer.counters().sessions);
}

// Packets of types that the client does not know, damaged ones, and rubbish, before every report.
TEST(AttachedRobot, PacketsThatItDoesNotKnowChangeNothing) {
  std::vector<uint8_t> foreign;
  constexpr uint8_t kTypes[] = {0x20, 0x90, 0xF0, 0x80, 0xA4, 0xB0, 0xFF};
  for (const uint8_t type : kTypes) {
    for (const int size : {1, 2, 30, 200}) {
      std::vector<uint8_t> data;
      for (int i = 0; i < size; ++i) {
        data.push_back(static_cast<uint8_t>(type + 7 * i));
      }
      const std::vector<uint8_t> packet = sim::MakePacket(type, data);
      foreign.insert(foreign.end(), packet.begin(), packet.end());
    }
  }
  std::vector<uint8_t> damaged = sim::MakePacket(0x32, std::vector<uint8_t>(40, 0x11));
  damaged.back() ^= 1;
  foreign.insert(foreign.end(), damaged.begin(), damaged.end());
  for (const char c : {'W', 'M', 'S', '2', '\r'}) {
    foreign.push_back(static_cast<uint8_t>(c));
  }
  World plain(300, 0.2);
  World mixed(300, 0.2);
  mixed.before_output = foreign;
  plain.Run(10'000);
  mixed.Run(10'000);
  EXPECT_GT(plain.pioneer.drive().true_pose().x_m, 1.5);
  EXPECT_EQ(plain.pioneer.drive().true_pose().x_m, mixed.pioneer.drive().true_pose().x_m);
  EXPECT_EQ(plain.pioneer.drive().true_pose().y_m, mixed.pioneer.drive().true_pose().y_m);
  EXPECT_EQ(plain.pioneer.counters().packets, mixed.pioneer.counters().packets);
}

// A line that picks up noise, then works again.
TEST(AttachedRobot, NoiseOnBothLinesIsSurvived) {
  std::mt19937 random(1);
  World world(200);
  world.Run(3000);
  for (int i = 0; i < 20'000; ++i) {
    std::vector<uint8_t> noise(random() % 8);
    for (uint8_t& byte : noise) {
      constexpr uint8_t kMarks[] = {0x10, 0x02, 0x03, 0xFA, 0xFB, 0x32};
      const auto drawn = static_cast<uint32_t>(random());
      byte = static_cast<uint8_t>((drawn & 1) != 0 ? kMarks[drawn / 2 % 6] : drawn >> 8);
    }
    world.robot.OnModemBytes(noise);
    world.robot.OnRobotBytes(noise);
    world.Run(1);
  }
  const double x_m = world.pioneer.drive().true_pose().x_m;
  world.Run(10'000);
  EXPECT_GT(world.pioneer.drive().true_pose().x_m, x_m + 1);
  EXPECT_NEAR(0, world.pioneer.drive().true_pose().y_m, 0.05);
}

// A program that was held up finds an answer that waited: it is as old as the pause.
TEST(AttachedRobot, AnswerThatWaitedForAPausedProgramDoesNotSteer) {
  World world(200);
  world.Run(6000);
  while (world.robot.conversation().awaited_opcode() == 0) {
    world.Run(1);
  }
  const uint32_t answers = world.robot.conversation().counters().answers;
  world.Run(1500, false);
  world.Run(1);
  EXPECT_EQ(answers, world.robot.conversation().counters().answers);
  EXPECT_EQ(1u, world.robot.conversation().counters().fail_safe_stops);
  EXPECT_EQ((client::WheelSpeeds{0, 0}), world.robot.wheels());
  world.Run(3000);
  EXPECT_GT(world.robot.conversation().counters().answers, answers);
  EXPECT_GT(world.pioneer.drive().motion().speed_m_s, 0.19);
}

// Several reports are read at once then, and the button is pressed in the first of them only.
TEST(AttachedRobot, AStopButtonThatWasPressedDuringAPauseHaltsTheRobot) {
  World world(200);
  world.Run(6000);
  ASSERT_TRUE(world.pioneer.motors_enabled());
  world.pioneer.set_stop_pressed(true);
  world.Run(120, false);
  world.pioneer.set_stop_pressed(false);
  world.Run(300, false);
  world.Run(3000);
  EXPECT_EQ(client::kHalted, world.robot.conversation().state().flags);
  EXPECT_FALSE(world.pioneer.motors_enabled());
}

// The one before was killed while the robot drove, and its watchdog has stopped it: any command but
// CLOSE would make it go on.
TEST(AttachedRobot, ARobotThatWasLeftInASessionStandsUntilItIsInANewOne) {
  World world(300);
  world.Run(6000);
  ASSERT_GT(world.pioneer.drive().motion().speed_m_s, 0.29);
  world.Run(4000, false);
  ASSERT_TRUE(world.stands());
  ASSERT_TRUE(world.pioneer.open());
  world.robot.OnRobotConnected(static_cast<uint32_t>(world.now_ms), true);
  for (int i = 0; i < 2000 && world.pioneer.counters().sessions < 2; ++i) {
    world.Run(1);
    ASSERT_TRUE(world.stands()) << i;
  }
  EXPECT_EQ(world.pioneer.counters().sessions, 2u);
}

TEST(AttachedRobot, LeavesARobotThatStandsAndASessionThatIsClosed) {
  World world(300);
  world.Run(6000);
  ASSERT_GT(world.pioneer.drive().motion().speed_m_s, 0.29);
  world.robot.Leave();
  while (world.pioneer.open() && world.now_ms < 20'000) {
    world.Run(1);
    if (!world.pioneer.open()) {
      EXPECT_TRUE(world.stands());
    }
  }
  EXPECT_TRUE(world.robot.left());
  EXPECT_TRUE(world.robot.stands());
  EXPECT_LT(world.now_ms, 6000 + kLongestStopMs);
  world.Run(5000);
  EXPECT_FALSE(world.pioneer.open());  // and it does not begin another one
}

TEST(AttachedRobot, LeavesARobotThatIsGoneAtOnceAndDoesNotClaimThatItStands) {
  World world(300);
  world.Run(6000);
  world.cable_cut = true;
  world.Run(3000);
  world.robot.Leave();
  world.Run(1);
  EXPECT_TRUE(world.robot.left());
  EXPECT_FALSE(world.robot.stands());
}

// It stood until its cable was cut, but whether it stands nobody has seen since it was told to.
TEST(AttachedRobot, DoesNotTakeSilenceForStanding) {
  World world(300);
  world.Run(6000);
  world.cable_cut = true;
  world.robot.Leave();
  world.Run(kLongestStopMs);
  EXPECT_TRUE(world.robot.left());
  EXPECT_FALSE(world.robot.stands());
}

// A hundred connections, each at another moment of the one before: a session within 2 s each time.
TEST(AttachedRobot, ANewConnectionHasItsSessionWithin2SWhateverTheOldOneWasDoing) {
  World world(300);
  for (int round = 0; round < 100; ++round) {
    SCOPED_TRACE(round);
    world.cable_cut = true;  // the old connection, and time until the next
    world.pioneer.HangUp();
    world.Run(17 * round);
    world.cable_cut = false;
    world.robot.OnRobotConnected(static_cast<uint32_t>(world.now_ms), false);
    const int64_t began_ms = world.now_ms;
    while (!world.robot.pioneer().known() && world.now_ms - began_ms < 5000) {
      world.Run(1);
    }
    EXPECT_LE(world.now_ms - began_ms, 2000);
    world.Run(13 * round);
  }
}

// A Pioneer on a serial line that is switched on at any moment, which nobody tells the client.
TEST(AttachedRobot, APioneerThatIsSwitchedOnHasItsSessionWithin2S) {
  World world(300);
  for (int round = 0; round < 100; ++round) {
    SCOPED_TRACE(round);
    world.cable_cut = true;
    world.pioneer.HangUp();
    world.Run(3000 + 17 * round);
    world.cable_cut = false;
    const int64_t began_ms = world.now_ms;
    while (!world.robot.pioneer().known() && world.now_ms - began_ms < 5000) {
      world.Run(1);
    }
    EXPECT_LE(world.now_ms - began_ms, 2000);
  }
}

// Reports stop while it waits for the robot to stand.
TEST(AttachedRobot, WaitsForARobotThatFallsSilentNoLongerThanItHasTo) {
  World world(300);
  world.Run(6000);
  world.robot.Leave();
  world.Run(100);
  world.cable_cut = true;
  world.Run(kLongestStopMs);
  EXPECT_TRUE(world.robot.left());
}

}  // namespace
}  // namespace pheromone::attach
