// The firmware's link to a Pioneer and the simulated Pioneer, which know nothing of each other, at
// the two ends of a serial line of 9600 baud.

#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <string>

#include "client_fw/core/pioneer/pioneer_drive.h"
#include "client_fw/sim/pioneer/pioneer_robot.h"

namespace pheromone {
namespace {

constexpr double kTurn = 2 * 3.14159265358979323846;

// One direction of the line: a byte a while, and nothing while the plug is out.
class Wire {
 public:
  static constexpr int64_t kByteNs = 10'000'000'000 / 9600;

  void Put(uint8_t byte, int64_t now_ns) {
    free_ns_ = std::max(free_ns_, now_ns) + kByteNs;
    if (!cut) {
      bytes_.push_back({byte, free_ns_});
    }
  }

  bool Arrived(int64_t now_ns) const {
    return !bytes_.empty() && bytes_.front().arrives_ns <= now_ns;
  }

  uint8_t Take() {
    const uint8_t byte = bytes_.front().byte;
    bytes_.pop_front();
    return byte;
  }

  bool cut = false;

 private:
  struct Timed {
    uint8_t byte;
    int64_t arrives_ns;
  };
  std::deque<Timed> bytes_;
  int64_t free_ns_ = 0;
};

struct Board {
  int robot_get() { return from_robot.Arrived(now_ns) ? from_robot.Take() : -1; }
  bool robot_put(uint8_t byte) {
    to_robot.Put(byte, now_ns);
    return true;
  }
  static void set_robot_rate(uint8_t /*number*/) {}
  uint32_t millis() const { return static_cast<uint32_t>(now_ns / 1'000'000); }

  int64_t now_ns = 1'000'000'000;
  Wire to_robot;
  Wire from_robot;
};

class PioneerClientTest : public ::testing::TestWithParam<const char*> {
 protected:
  static sim::PioneerConfig ConfigOf(const std::string& subclass) {
    sim::PioneerConfig config;
    config.model = *sim::FindPioneerModel(subclass);
    return config;
  }

  void Run(int ms) {
    for (int i = 0; i < ms; ++i) {
      board_.now_ns += 1'000'000;
      while (board_.to_robot.Arrived(board_.now_ns)) {
        const uint8_t byte = board_.to_robot.Take();
        robot_.OnBytes({&byte, 1}, board_.now_ns);
      }
      robot_.AdvanceTo(board_.now_ns);
      for (const uint8_t byte : robot_.TakeOutput()) {
        board_.from_robot.Put(byte, board_.now_ns);
      }
      drive_.Step();
    }
  }

  bool Known() const {
    client::Odometry odometry;
    return drive_.odometry(&odometry);
  }

  void Cut(bool cut) {
    board_.to_robot.cut = cut;
    board_.from_robot.cut = cut;
  }

  // Of a robot that stands: the way the firmware believes in, against the robot's own sums.
  void ExpectSamePose() const {
    client::Odometry odometry;
    ASSERT_TRUE(drive_.odometry(&odometry));
    const sim::PlanePose& pose = robot_.drive().odometry();
    EXPECT_NEAR(pose.x_m * 1000, odometry.x_mm, 2);
    EXPECT_NEAR(pose.y_m * 1000, odometry.y_mm, 2);
    const double turned = pose.heading_rad / kTurn - odometry.heading / 65'536.0;
    EXPECT_NEAR(std::round(turned), turned, 1.0 / 4096);
  }

  Board board_;
  sim::PioneerRobot robot_{ConfigOf(GetParam()), {0, 0, 0}};
  client::PioneerDrive<Board> drive_{
      &board_, static_cast<int16_t>(std::lround(ConfigOf(GetParam()).model.distance_mm * 10'000))};
};

TEST_P(PioneerClientTest, DrivesAndKeepsThePoseThroughASecondSession) {
  Run(1000);
  ASSERT_TRUE(Known());
  EXPECT_TRUE(robot_.motors_enabled());
  drive_.set_wheel_speeds(400, 400);
  Run(45'000);  // 18 m: a p3dx's X wraps
  EXPECT_NEAR(0.4, robot_.drive().motion().speed_m_s, 0.005);
  drive_.set_wheel_speeds(400, 440);
  Run(20'000);
  drive_.set_wheel_speeds(0, 0);
  Run(5000);
  ExpectSamePose();

  Cut(true);
  Run(5000);
  EXPECT_FALSE(Known());
  drive_.set_wheel_speeds(400, 400);  // to nobody
  Cut(false);
  Run(5000);
  ASSERT_TRUE(Known());
  EXPECT_EQ(2u, robot_.counters().sessions);
  EXPECT_EQ(0, robot_.drive().motion().speed_m_s);
  ExpectSamePose();
  drive_.set_wheel_speeds(-300, 300);
  Run(7000);
  drive_.set_wheel_speeds(300, 300);
  Run(7000);
  drive_.set_wheel_speeds(0, 0);
  Run(5000);
  ExpectSamePose();
  EXPECT_EQ(2u, robot_.counters().sessions);
  EXPECT_EQ(0u, robot_.counters().bad_checksums);
}

INSTANTIATE_TEST_SUITE_P(Models, PioneerClientTest,
                         ::testing::Values("p3dx", "p3dx-sh", "peoplebot-sh", "p3at", "p3at-sh",
                                           "amigo", "amigo-sh"));

}  // namespace
}  // namespace pheromone
