// The Arduino library's own code on a clock that the test moves: when a modem is keyed, whose
// datagrams count, how wheels are driven, and where odometry says they went.
#include <Arduino.h>
#include <IPAddress.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <deque>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "client_fw/boards/arduino/odometry.h"
#include "client_fw/boards/arduino/serial_link.h"
#include "client_fw/boards/arduino/steppers.h"
#include "client_fw/boards/arduino/two_wheels.h"
#include "client_fw/boards/arduino/udp_link.h"

namespace pheromone::arduino {
namespace {

unsigned long now_ms = 0;
std::array<int, 32> pins{};

// --- Odometry

TEST(WheelOdometry, IsWhereARobotIsThatIntegratesInFloatingPoint) {
  constexpr double kTickM = 152716e-9;
  constexpr double kTrackM = 0.141;
  WheelOdometry odometry(152716, 141000);
  std::mt19937 random(1);
  double x = 0;
  double y = 0;
  double heading = 0;
  double travelled = 0;
  for (int i = 0; i < 20'000; ++i) {
    const auto left = static_cast<int16_t>(random() % 30);
    const auto right = static_cast<int16_t>(static_cast<int>(random() % 40) - 5);
    odometry.Add(left, right);
    const double way = (left + right) * kTickM / 2;
    const double turn = (right - left) * kTickM / kTrackM;
    x += way * std::cos(heading + turn / 2);
    y += way * std::sin(heading + turn / 2);
    heading += turn;
    travelled += way;
    const client::Odometry pose = odometry.pose();
    ASSERT_NEAR(x * 1000, pose.x_mm, 2 + travelled * 0.2) << i;
    ASSERT_NEAR(y * 1000, pose.y_mm, 2 + travelled * 0.2) << i;
    const double error =
        std::remainder(heading - pose.heading * 2 * std::numbers::pi / 65536, 2 * std::numbers::pi);
    ASSERT_NEAR(error, 0, 0.002) << i;
  }
}

TEST(WheelOdometry, GoesOnFromAPose) {
  WheelOdometry odometry(1'000'000, 100'000);  // a millimetre
  odometry.Set({1000, -2000, 0x8000});
  odometry.Add(50, 50);
  EXPECT_EQ(odometry.pose().x_mm, 950);
  EXPECT_EQ(odometry.pose().y_mm, -2000);
  EXPECT_EQ(odometry.pose().heading, 0x8000);
}

// A loop may pause, or an encoder be coarse.
TEST(WheelOdometry, AWayOfAnyLengthCountsInFull) {
  for (const int16_t ticks : std::array<int16_t, 6>{131, 132, 263, 2'000, 32'767, -32'767}) {
    WheelOdometry odometry(1'000'000, 100'000);  // a millimetre
    odometry.Add(ticks, ticks);
    EXPECT_EQ(odometry.pose().x_mm, ticks);
    EXPECT_EQ(odometry.pose().y_mm, 0);
    EXPECT_EQ(odometry.pose().heading, 0);
  }
  WheelOdometry coarse(10'000'000, 100'000);
  coarse.Add(20'000, 20'000);
  EXPECT_EQ(coarse.pose().x_mm, 200'000);
}

TEST(WheelOdometry, AWayOfAQuarterOfACircleIsNoStraightLine) {
  WheelOdometry odometry(1'000'000, 100'000);
  odometry.Add(1'492, 1'649);  // pi / 2 times 950 and 1050 mm
  EXPECT_NEAR(odometry.pose().x_mm, 1'000, 3);
  EXPECT_NEAR(odometry.pose().y_mm, 1'000, 3);
  EXPECT_NEAR(odometry.pose().heading, 0x4000, 20);
}

// --- A modem. A ring of 63 bytes before a UART with a data and a shift register.

// NOLINTNEXTLINE(cppcoreguidelines-virtual-class-destructor): as Arduino's streams
class FakeUart final : public Stream {
 public:
  static constexpr double kByteMs = 10'000.0 / 9600;

  int read() override { return -1; }
  size_t write(uint8_t /*byte*/) override {
    Advance();
    const double now = static_cast<double>(now_ms);
    ends_.push_back(std::max(ends_.empty() ? 0 : ends_.back(), now) + kByteMs);
    if (first_ms < 0) {
      first_ms = now;
    }
    end_ms = ends_.back();
    return 1;
  }
  int availableForWrite() override {
    Advance();
    const auto waiting = static_cast<int>(ends_.size()) - 2;  // two are in the UART
    return 63 - std::max(waiting, 0);
  }

  double first_ms = -1;
  double end_ms = 0;

 private:
  void Advance() {
    while (!ends_.empty() && ends_.front() <= static_cast<double>(now_ms)) {
      ends_.pop_front();
    }
  }

  std::deque<double> ends_;
};

TEST(PheromoneSerial, KeysAModemForItsLeadAndTailAndIsBusyToTheEnd) {
  for (const uint16_t lead_ms : std::array<uint16_t, 3>{0, 1, 25}) {
    for (const uint16_t tail_ms : std::array<uint16_t, 3>{0, 7, 50}) {
      for (const int size : {1, 2, 3, 34}) {
        FakeUart uart;
        PheromoneSerial link(uart, 9600, 4);
        client::Parameters parameters;
        now_ms = 1'000;
        link.begin(&parameters);
        EXPECT_EQ(parameters.baud, 9600u);
        link.set_keying(lead_ms, tail_ms);
        EXPECT_TRUE(link.idle());
        double keyed_ms = -1;
        double unkeyed_ms = -1;
        for (int put = 0; unkeyed_ms < 0; ++now_ms) {
          ASSERT_LT(now_ms, 1'500u);
          const bool idle = put == size && link.idle();
          EXPECT_EQ(idle, !link.busy() && put != 0);
          if (idle) {
            EXPECT_EQ(pins[4], LOW);
            unkeyed_ms = static_cast<double>(now_ms);
          }
          while (put < size && link.put(0x55)) {
            ++put;
          }
          if (keyed_ms < 0 && pins[4] == HIGH) {
            keyed_ms = static_cast<double>(now_ms);
          }
        }
        EXPECT_EQ(uart.first_ms - keyed_ms, lead_ms);
        EXPECT_GE(unkeyed_ms, uart.end_ms + tail_ms);
        EXPECT_LE(unkeyed_ms, uart.end_ms + tail_ms + 5) << size;
      }
    }
  }
}

TEST(PheromoneSerial, LeavesPinsAloneWithoutAKey) {
  FakeUart uart;
  PheromoneSerial link(uart, 9600);
  client::Parameters parameters;
  link.begin(&parameters);
  link.set_keying(100, 100);
  pins.fill(7);
  EXPECT_TRUE(link.put(1)) << "no lead either";
  for (const int pin : pins) {
    EXPECT_EQ(pin, 7);
  }
}

// --- A network

// Reads as an ESP32's: there is no next datagram before this one was read to its end.
class FakeUdp {
 public:
  struct Datagram {
    IPAddress from;
    uint16_t port;
    std::vector<uint8_t> bytes;
  };

  void begin(uint16_t /*port*/) {}
  int beginPacket(IPAddress /*to*/, uint16_t /*port*/) { return 1; }
  size_t write(uint8_t /*byte*/) { return 1; }
  int endPacket() { return 1; }
  int parsePacket() {
    if (waiting.empty() || available() != 0) {
      return 0;
    }
    now_ = waiting.front();
    waiting.pop_front();
    read_ = 0;
    return available();
  }
  int available() { return static_cast<int>(now_.bytes.size() - read_); }
  int read() { return available() != 0 ? now_.bytes[read_++] : -1; }
  IPAddress remoteIP() { return now_.from; }
  uint16_t remotePort() { return now_.port; }

  std::deque<Datagram> waiting;

 private:
  Datagram now_{{0, 0, 0, 0}, 0, {}};
  size_t read_ = 0;
};

TEST(PheromoneUdp, HearsTheServerOnly) {
  const IPAddress server(192, 168, 4, 1);
  const IPAddress other(192, 168, 4, 2);
  FakeUdp udp;
  PheromoneUdp<FakeUdp> link(udp, server, 4950);
  EXPECT_EQ(link.get(), -1);
  udp.waiting = {{other, 4950, {1, 2}}, {server, 4950, {3, 4}}, {server, 4951, {5}},
                 {other, 4951, {6, 7}}, {server, 4950, {8}},    {other, 4950, {9}}};
  std::vector<int> heard;
  for (int turn = 0; turn < 10; ++turn) {  // of the loop
    for (int byte = link.get(); byte >= 0; byte = link.get()) {
      heard.push_back(byte);
    }
  }
  EXPECT_EQ(heard, (std::vector<int>{3, 4, 8}));
}

// --- Motors: 0.6 m/s at full power and a lag of 80 ms, with encoders of `tick_m`.

struct Motor {
  double Advance() {
    speed += (power / 255.0 * 0.6 * (stuck ? 0 : 1) - speed) / 80;
    way += speed / 1000;
    return way;
  }
  int16_t power = 0;
  double speed = 0;
  double way = 0;
  bool stuck = false;
};

std::array<Motor, 2> motors;
double tick_m = 0;

void SetPower(int16_t left, int16_t right) {
  motors[0].power = left;
  motors[1].power = right;
}

void ReadTicks(int16_t* left, int16_t* right) {
  // They wrap, as the counters of a sketch do.
  const auto ticks = [](const Motor& it) {
    return static_cast<int16_t>(static_cast<int64_t>(std::floor(it.way / tick_m)));
  };
  *left = ticks(motors[0]);
  *right = ticks(motors[1]);
}

void Drive(TwoWheels* wheels, int ms) {
  for (int i = 0; i < ms; ++i) {
    ++now_ms;
    motors[0].Advance();
    motors[1].Advance();
    wheels->step(static_cast<uint16_t>(now_ms));
  }
}

TwoWheels Wheels(uint32_t tick_nm) {
  motors = {};
  tick_m = tick_nm * 1e-9;
  TwoWheels wheels(SetPower, ReadTicks, {tick_nm, 141'000, 500});
  wheels.begin();
  return wheels;
}

TEST(TwoWheels, KeepsTheSpeedsWithFineAndCoarseEncoders) {
  for (const uint32_t tick_nm : {152'716u, 10'000'000u}) {
    TwoWheels wheels = Wheels(tick_nm);
    for (const auto& [left, right] :
         {std::pair{200, 200}, {50, 120}, {-150, 150}, {400, 300}, {-30, -30}}) {
      wheels.set_wheel_speeds(static_cast<int16_t>(left), static_cast<int16_t>(right));
      Drive(&wheels, 2'000);
      const std::array before = {motors[0].way, motors[1].way};
      Drive(&wheels, 5'000);
      EXPECT_NEAR((motors[0].way - before[0]) * 200, left, 12) << tick_nm;
      EXPECT_NEAR((motors[1].way - before[1]) * 200, right, 12) << tick_nm;
      EXPECT_EQ(wheels.status().alarms, 0) << tick_nm << ' ' << left;
    }
  }
}

TEST(TwoWheels, ClampsToFullSpeedAndStopsAtOnce) {
  TwoWheels wheels = Wheels(152'716);
  wheels.set_wheel_speeds(2'000, -2'000);
  Drive(&wheels, 3'000);
  EXPECT_NEAR(motors[0].speed, 0.5, 0.02);
  EXPECT_NEAR(motors[1].speed, -0.5, 0.02);
  wheels.emergency_stop();
  EXPECT_EQ(motors[0].power, 0);
  EXPECT_EQ(motors[1].power, 0);
  Drive(&wheels, 1'000);
  EXPECT_EQ(motors[0].power, 0) << "nothing is made up for";
}

TEST(TwoWheels, RaisesAnAlarmWhenAWheelIsStuckWhichEndsWhenItIsLetGo) {
  TwoWheels wheels = Wheels(152'716);
  motors[1].stuck = true;
  wheels.set_wheel_speeds(200, 200);
  Drive(&wheels, 950);
  EXPECT_EQ(wheels.status().alarms, 0);
  Drive(&wheels, 200);
  EXPECT_EQ(wheels.status().alarms, client::kStallAlarm);
  wheels.emergency_stop();
  Drive(&wheels, 20);
  EXPECT_EQ(wheels.status().alarms, 0);
}

TEST(TwoWheels, FollowsEncodersThatWrap) {
  TwoWheels wheels = Wheels(152'716);
  motors[0].way = motors[1].way = 32'700 * tick_m;
  wheels.begin();
  wheels.set_wheel_speeds(200, 200);
  const double before = motors[0].way;
  Drive(&wheels, 5'000);
  client::Odometry pose{};
  ASSERT_TRUE(wheels.odometry(&pose));
  EXPECT_NEAR(pose.x_mm, (motors[0].way - before) * 1000, 5);
}

// --- Steppers: what leaves the pins. Pins 2 and 3 are the left motor's, 4 and 5 the right one's.

class SteppersTest : public testing::Test {
 protected:
  static constexpr double kStepMm = 0.127627;

  explicit SteppersTest(int16_t acceleration_mm_s2 = 600)
      : wheels_({127'627, 150'000, 400, acceleration_mm_s2, {2, 3}, {4, 5}, 2}) {
    pins.fill(LOW);
    now_ms = 0;
    wheels_.begin();
  }

  void Run(int ms) {
    for (int tick = 0; tick < ms * 10; ++tick) {
      const std::array before = {pins[2], pins[4]};
      wheels_.tick();
      steps_[0] += before[0] == LOW && pins[2] == HIGH ? (pins[3] == LOW ? 1 : -1) : 0;
      steps_[1] += before[1] == LOW && pins[4] == HIGH ? (pins[5] == HIGH ? 1 : -1) : 0;
      if (tick % 10 == 9) {
        ++now_ms;
        wheels_.step(static_cast<uint16_t>(now_ms));
      }
    }
  }

  Steppers wheels_;
  std::array<int, 2> steps_{};
};

TEST_F(SteppersTest, StepAsTheyAreToldAndRampAndCount) {
  wheels_.set_wheel_speeds(300, -150);
  Run(250);
  const std::array ramp = steps_;
  EXPECT_NEAR(ramp[0], 0.5 * 600 * 0.25 * 0.25 / kStepMm, 15) << "600 mm/s^2";
  EXPECT_NEAR(ramp[1], -ramp[0], 3);
  Run(750);
  const std::array before = steps_;
  Run(2'000);
  EXPECT_NEAR((steps_[0] - before[0]) * kStepMm / 2, 300, 2);
  EXPECT_NEAR((steps_[1] - before[1]) * kStepMm / 2, -150, 2);
  client::Odometry pose{};
  wheels_.set_wheel_speeds(0, 0);
  Run(1'000);
  ASSERT_TRUE(wheels_.odometry(&pose));
  const double turn = (steps_[1] - steps_[0]) * kStepMm / 150;
  EXPECT_NEAR(
      std::remainder(turn - pose.heading * 2 * std::numbers::pi / 65536, 2 * std::numbers::pi), 0,
      0.01);
  const std::array stopped = steps_;
  Run(100);
  EXPECT_EQ(steps_, stopped);
}

class SlowSteppersTest : public SteppersTest {
 protected:
  SlowSteppersTest() : SteppersTest(55) {}
};

// Less than a millimetre a second at a step of the control.
TEST_F(SlowSteppersTest, RampUpAndDown) {
  wheels_.set_wheel_speeds(110, 110);
  Run(2'000);
  EXPECT_NEAR(steps_[0] * kStepMm, 0.5 * 55 * 2 * 2, 3);
  wheels_.set_wheel_speeds(0, 0);
  Run(2'100);
  EXPECT_NEAR(steps_[0] * kStepMm, 55 * 2 * 2, 6);
  const std::array stopped = steps_;
  Run(200);
  EXPECT_EQ(steps_, stopped);
}

}  // namespace
}  // namespace pheromone::arduino

unsigned long millis() {
  return pheromone::arduino::now_ms;
}
void pinMode(uint8_t /*pin*/, uint8_t /*mode*/) {}
void digitalWrite(uint8_t pin, uint8_t value) {
  pheromone::arduino::pins.at(pin) = value;
}
