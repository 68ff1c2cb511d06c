// A scripted client that uses every command, against a naive model: Euler steps of 0.1 ms, and
// brakes that are pulled when the way left is what stopping takes. Each packet is compared: when it
// comes, where the robot is, how fast it moves, and what else it says.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <numbers>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "client_fw/sim/pioneer/pioneer_robot.h"
#include "client_fw/sim/testing/pioneer_client.h"

namespace pheromone::sim {
namespace {

using testing::Bytes;
using testing::Command;
using testing::Framed;
using testing::Sip;
using testing::operator+;  // NOLINT(misc-unused-using-decls): it is used

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kStepS = 1e-4;
constexpr int kBatteryInfo = 62;

// One axis; mm or degrees.
struct NaiveAxis {
  double speed = 0;
  double wanted = 0;
  std::optional<double> rest;
  double top = 0;
  double faster = 0;
  double slower = 0;

  void Step(bool silent) {
    double goal = std::clamp(wanted, -top, top);
    if (rest) {
      const double towards = *rest < 0 ? -1 : 1;
      const bool brake = speed * towards > 0 && speed * speed / 2 / slower >= std::abs(*rest);
      goal = brake ? 0 : towards * top;
    }
    if (silent || speed * goal < 0) {
      goal = 0;
    }
    const double most = (std::abs(goal) > std::abs(speed) ? faster : slower) * kStepS;
    speed += std::clamp(goal - speed, -most, most);
    if (rest) {
      *rest -= speed * kStepS;
      if (std::abs(*rest) < 0.001 && std::abs(speed) < 1) {  // there
        Hold(0);
        speed = 0;
      }
    }
  }
  void Hold(double value) {
    wanted = value;
    rest.reset();
  }
};

struct NaiveRobot {
  const PioneerModel* model;
  NaiveAxis ahead;
  NaiveAxis turn;
  double x_mm = 0;
  double y_mm = 0;
  double heading_deg = 0;
  double left_mm = 0;  // rolled
  double right_mm = 0;
  bool motors = false;
  bool sonar = true;
  bool wheels = false;
  int encoder = 0;
  int io = 0;
  int64_t heard_ms = 0;
  int64_t commanded_ms = 0;

  explicit NaiveRobot(const PioneerModel* robot) : model(robot) {
    ahead.top = model->max_speed_mm_s;
    ahead.faster = ahead.slower = model->acceleration_mm_s2;
    turn.top = model->max_turn_deg_s;
    turn.faster = turn.slower = model->turn_acceleration_deg_s2;
  }

  void StepMs(int64_t now_ms) {
    const bool silent = now_ms - heard_ms >= 2000;
    for (int i = 0; i < 10; ++i) {
      ahead.Step(silent);
      turn.Step(silent);
      heading_deg += turn.speed * kStepS;
      x_mm += ahead.speed * kStepS * std::cos(heading_deg * kDegree);
      y_mm += ahead.speed * kStepS * std::sin(heading_deg * kDegree);
      left_mm += Left() * kStepS;
      right_mm += Right() * kStepS;
    }
  }
  double Left() const { return ahead.speed - turn.speed * kDegree / model->diff_conv_per_mm; }
  double Right() const { return ahead.speed + turn.speed * kDegree / model->diff_conv_per_mm; }

  void Stop() {
    ahead.Hold(0);
    turn.Hold(0);
    wheels = false;
  }

  void Obey(int id, int argument, int64_t now_ms) {
    heard_ms = now_ms;
    if (id != testing::kPulse) {
      commanded_ms = now_ms;
    }
    const bool one_axis = id == testing::kVel || id == testing::kMove || id == testing::kRvel ||
                          id == testing::kRotate || id == testing::kHead || id == testing::kDHead;
    if (!motors && (one_axis || id == testing::kVel2)) {
      return;
    }
    if (one_axis && wheels) {
      Stop();
    }
    switch (id) {
      case testing::kEnable:
        motors = argument != 0;
        if (!motors) {
          Stop();
        }
        break;
      case testing::kSetA:
        (argument > 0 ? ahead.faster : ahead.slower) = std::abs(argument);
        break;
      case testing::kSetRa:
        (argument > 0 ? turn.faster : turn.slower) = std::abs(argument);
        break;
      case testing::kSetV:
        ahead.top = argument;
        break;
      case testing::kSetRv:
        turn.top = argument;
        break;
      case testing::kSetO:
        x_mm = y_mm = heading_deg = 0;
        break;
      case testing::kVel:
        ahead.Hold(argument);
        break;
      case testing::kMove:
        ahead.rest = argument;
        break;
      case testing::kRvel:
      case testing::kRotate:
        turn.Hold(argument);
        break;
      case testing::kHead:
        turn.rest = std::remainder(argument - heading_deg, 360);
        break;
      case testing::kDHead:
        turn.rest = argument;
        break;
      case testing::kVel2: {
        const int right = static_cast<int8_t>(argument & 0xFF) * 20;
        const int left = static_cast<int8_t>(argument >> 8 & 0xFF) * 20;
        ahead.Hold((right + left) / 2.0);
        turn.Hold((right - left) / 2.0 * model->diff_conv_per_mm / kDegree);
        wheels = true;
        break;
      }
      case testing::kStop:
        Stop();
        break;
      case testing::kEStop:
        Stop();
        ahead.speed = turn.speed = 0;
        break;
      case testing::kSonar:
        sonar = argument != 0;
        break;
      case testing::kEncoder:
        encoder = argument;
        break;
      case testing::kIoRequest:
        io = argument;
        break;
      default:
        break;
    }
  }
};

// The robot and the model side by side, a millisecond at a time.
class Script {
 public:
  explicit Script(const char* subclass)
      : model_(FindPioneerModel(subclass)), robot_(ConfigOf(model_), {}), naive_(model_) {
    const Bytes names = Framed(Bytes{2} + Text("Simulated") + Text("Pioneer") + Text(subclass));
    EXPECT_EQ(Now(Command(0)), Command(0));
    EXPECT_EQ(Now(Command(1)), Command(1));
    EXPECT_EQ(Now(Command(2)), names);
    EXPECT_EQ(Now(Command(1)), Bytes{});  // OPEN
  }

  void Say(int id) { Answer(id, Now(Command(id)), 0); }
  void Say(int id, int argument) { Answer(id, Now(Command(id, argument)), argument); }
  /// VEL2 with its bytes as they are, as Player sends it.
  void SayRaw(int right, int left) {
    const Bytes bytes = {32, 0x3B, static_cast<uint8_t>(right / 20),
                         static_cast<uint8_t>(left / 20)};
    Answer(testing::kVel2, Now(Framed(bytes)), bytes[2] | bytes[3] << 8);
  }

  /// Lets time pass, in silence, and compares each packet.
  void Wait(int64_t ms) {
    for (const int64_t end_ms = now_ms_ + ms; now_ms_ < end_ms && !::testing::Test::HasFailure();) {
      ++now_ms_;
      naive_.StepMs(now_ms_);
      still_ms_ = naive_.ahead.speed == 0 && naive_.turn.speed == 0 ? still_ms_ + 1 : 0;
      robot_.AdvanceTo(now_ms_ * 1'000'000);
      const std::vector<Bytes> packets = testing::Packets(robot_.TakeOutput());
      const bool due = now_ms_ % 100 == 0;
      ASSERT_EQ(packets.size(), due ? 1u + (naive_.encoder > 0) + (naive_.io > 0) : 0u) << now_ms_;
      if (due) {
        Compare(packets);
      }
      EXPECT_FALSE(::testing::Test::HasFailure()) << "at " << now_ms_ << " ms";
    }
  }
  /// The same, with a PULSE every half a second.
  void Drive(int64_t ms) {
    for (; ms > 0; ms -= 500) {
      Wait(std::min<int64_t>(ms, 500));
      Say(testing::kPulse);
    }
  }

  int sips() const { return sips_; }
  const NaiveRobot& naive() const { return naive_; }
  PioneerRobot& robot() { return robot_; }

 private:
  static PioneerConfig ConfigOf(const PioneerModel* model) {
    PioneerConfig config;
    config.model = *model;
    config.position_bits = 16;
    return config;
  }
  static Bytes Text(const std::string& text) {
    Bytes bytes(text.begin(), text.end());
    bytes.push_back(0);
    return bytes;
  }

  Bytes Now(const Bytes& bytes) {
    robot_.OnBytes(bytes, now_ms_ * 1'000'000);
    return robot_.TakeOutput();
  }

  void Answer(int id, const Bytes& answer, int argument) {
    naive_.Obey(id, argument, now_ms_);
    if (id == testing::kConfig) {
      ASSERT_EQ(testing::Packets(answer).size(), 1u);
      EXPECT_EQ(answer[3], 0x20);
    } else {
      EXPECT_EQ(answer, Bytes{}) << id;
    }
  }

  void Compare(const std::vector<Bytes>& packets) {
    const Sip sip(packets[0]);
    ++sips_;
    const double speed = std::max(std::abs(naive_.ahead.speed), std::abs(naive_.turn.speed));
    const bool pursues = naive_.ahead.rest || naive_.turn.rest;
    if (still_ms_ > 50 || speed > 5) {  // the model stands a little earlier
      EXPECT_EQ(sip.moving(), speed > 0 && (pursues || now_ms_ - naive_.commanded_ms < 2000));
    }
    // A millimetre for what differs by a tick, and half a unit for the rounding.
    EXPECT_NEAR(Folded(sip.x(), naive_.x_mm), naive_.x_mm, 1 + model_->distance_mm);
    EXPECT_NEAR(Folded(sip.y(), naive_.y_mm), naive_.y_mm, 1 + model_->distance_mm);
    ExpectHeading(sip.heading(), naive_.heading_deg);
    EXPECT_GE(sip.heading(), -2048);
    EXPECT_LT(sip.heading(), 2048);
    ExpectHeading(sip.setpoint(), naive_.heading_deg + naive_.turn.rest.value_or(0));
    EXPECT_NEAR(sip.left() * model_->speed_mm_s, naive_.Left(), 4);
    EXPECT_NEAR(sip.right() * model_->speed_mm_s, naive_.Right(), 4);
    EXPECT_EQ(sip.byte(14), 128);
    EXPECT_EQ(sip.stall(), 0);
    EXPECT_EQ(sip.flags(), (naive_.motors ? 1 : 0) | (naive_.sonar ? 0b11110 : 0));
    const auto sonars = static_cast<int>(std::min<size_t>(16, model_->sonars.size()));
    ASSERT_EQ(sip.sonars(), naive_.sonar ? sonars : 0);
    for (int i = 0; i < sip.sonars(); ++i) {
      EXPECT_EQ(sip.word(24 + 3 * static_cast<size_t>(i)), 5000);
    }
    const size_t rest = 23 + 3 * static_cast<size_t>(sip.sonars());
    ASSERT_EQ(sip.bytes.size(), rest + 18);
    EXPECT_EQ(sip.word(rest + 5), 128);
    EXPECT_NEAR(sip.signed_word(rest + 8) / 10.0, naive_.turn.speed, 0.5);
    size_t at = 1;
    if (naive_.encoder > 0) {
      const Sip encoders(packets.at(at++));
      ASSERT_EQ(encoders.bytes.size(), 14u);
      EXPECT_EQ(encoders.byte(3), 0x90);
      EXPECT_NEAR(Ticks(encoders, 4), naive_.left_mm * model_->encoder_ticks_per_mm, 250);
      EXPECT_NEAR(Ticks(encoders, 8), naive_.right_mm * model_->encoder_ticks_per_mm, 250);
      naive_.encoder -= naive_.encoder == 1 ? 1 : 0;
    }
    if (naive_.io > 0) {
      const Bytes io =
          Framed(testing::Hex("f0 04 00 ff ff ff 01 00 09 00 00 00 00 00 00 00 00 00 "
                              "00 00 00 00 00 00 00 8f 02"));  // 12.8 V of 20
      EXPECT_EQ(packets.at(at), io);
      naive_.io -= naive_.io == 1 ? 1 : 0;
    }
  }

  // The reported position nearest to the expected one, of those that 16 bits do not tell apart.
  double Folded(int units, double expected_mm) const {
    const double turn_mm = 65536 * model_->distance_mm;
    const double reported_mm = units * model_->distance_mm;
    return expected_mm + std::remainder(reported_mm - expected_mm, turn_mm);
  }
  static void ExpectHeading(int units, double expected_deg) {
    const double reported_deg = units * 360.0 / 4096;
    EXPECT_NEAR(std::remainder(reported_deg - expected_deg, 360), 0, 0.15);
  }
  static double Ticks(const Sip& packet, size_t at) {
    return static_cast<int32_t>(static_cast<uint32_t>(packet.word(at)) |
                                static_cast<uint32_t>(packet.word(at + 2)) << 16);
  }

  const PioneerModel* model_;
  PioneerRobot robot_;
  NaiveRobot naive_;
  int64_t now_ms_ = 0;
  int64_t still_ms_ = 0;
  int sips_ = 0;
};

class PioneerScriptTest : public ::testing::TestWithParam<const char*> {};

// Slow enough for the wheels of all models.
TEST_P(PioneerScriptTest, EveryCommandDoesWhatTheNaiveModelDoes) {
  using namespace testing;  // NOLINT(google-build-using-namespace): the commands' names
  Script script(GetParam());
  script.Wait(150);
  script.Say(kVel, 200);  // the motors are still off
  script.Wait(250);
  script.Say(kConfig);
  script.Say(kHostBaud, 2);
  script.Say(kBatteryInfo, 1);
  script.Say(kSonar, 0);
  script.Say(kEnable, 1);
  script.Wait(300);

  script.Say(kSetV, 400);
  script.Say(kSetA, 250);
  script.Say(kSetA, -350);
  script.Say(kSetRv, 40);
  script.Say(kSetRa, 60);
  script.Say(kSetRa, -90);
  script.Say(kVel, 300);
  script.Drive(2333);
  script.Say(kVel, 900);  // over the limit
  script.Say(kRvel, 20);
  script.Drive(3000);
  script.Say(kRotate, -300);
  script.Say(kVel, -150);
  script.Drive(4000);
  script.Say(kStop);
  script.Drive(2000);

  script.Say(kSetO);
  script.Say(kMove, 800);
  script.Drive(4500);
  EXPECT_NEAR(script.naive().x_mm, 800, 0.1);  // the model itself arrives
  script.Say(kHead, 135);
  script.Drive(5500);
  EXPECT_NEAR(script.naive().heading_deg, 135, 0.1);
  script.Say(kHead, 225);  // through 180 degrees
  script.Drive(4000);
  script.Say(kDHead, -200);
  script.Say(kMove, -300);
  script.Say(kEncoder, 2);
  script.Drive(9000);
  script.Say(kMove, 5000);
  script.Say(kDHead, 30);
  script.Drive(1500);
  script.Say(kEStop);
  script.Say(kIoRequest, 1);
  script.Drive(1000);

  script.Say(kVel2, 10 << 8 | 12);
  script.Drive(2500);
  script.SayRaw(100, -100);
  script.Say(kEncoder, 0);
  script.Drive(2500);
  script.Say(kVel2, -(9 << 8 | 10));  // as ARIA sends -200 and -200
  script.Say(kIoRequest, 2);
  script.Drive(2500);
  script.Say(kHead, 0);  // ends VEL2
  script.Say(kEncoder, 1);
  script.Drive(5000);
  script.Say(kIoRequest, 0);
  script.Say(kSonar, 1);

  script.Say(kVel, 250);
  script.Wait(4000);  // the watchdog stops it
  EXPECT_EQ(script.naive().ahead.speed, 0);
  script.Say(kPulse);
  script.Drive(1500);
  script.Say(kEnable, 0);
  script.Drive(1500);
  EXPECT_GT(script.sips(), 500);

  script.Say(kClose);
  EXPECT_FALSE(script.robot().open());
  script.robot().AdvanceTo(int64_t{3600} * 1'000'000'000);
  EXPECT_EQ(script.robot().TakeOutput(), Bytes{});
}

// Any order of any motion commands, at any time.
TEST_P(PioneerScriptTest, RandomCommandsDoWhatTheNaiveModelDoes) {
  using namespace testing;  // NOLINT(google-build-using-namespace): the commands' names
  std::mt19937 random(11);
  const auto between = [&](int least, int most) {
    return least + static_cast<int>(random() % static_cast<unsigned>(most - least + 1));
  };
  for (int round = 0; round < 10; ++round) {
    SCOPED_TRACE(round);
    Script script(GetParam());
    script.Say(kEnable, 1);
    script.Say(kSonar, 0);
    script.Say(kSetV, between(100, 500));
    script.Say(kSetRv, between(10, 40));
    for (int i = 0; i < 12; ++i) {
      switch (between(0, 9)) {
        case 0:
          script.Say(kVel, between(-600, 600));
          break;
        case 1:
          script.Say(random() % 2 == 0 ? kRvel : kRotate, between(-60, 60));
          break;
        case 2:
          script.Say(kVel2, between(-12, 12) * 256 + between(0, 12));
          break;
        case 3:
        case 4:
          script.Say(kMove, between(-1500, 1500));
          break;
        case 5:
          script.Say(kHead, between(-400, 400));
          break;
        case 6:
          script.Say(kDHead, between(-200, 200));
          break;
        case 7:
          script.Say(random() % 4 == 0 ? kEStop : kStop);
          break;
        case 8:
          script.Say(kSetO);
          break;
        default:
          script.Say(kSetA, between(1, 2) * between(100, 400) - 600);
          script.Say(kSetRa, between(40, 200));
      }
      script.Wait(between(0, 2500));
      if (HasFailure()) {
        return;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Models, PioneerScriptTest,
                         ::testing::Values("p3dx", "p3dx-sh", "peoplebot-sh", "p3at", "p3at-sh",
                                           "amigo", "amigo-sh"));

}  // namespace
}  // namespace pheromone::sim
