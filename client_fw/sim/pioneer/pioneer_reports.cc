#include "client_fw/sim/pioneer/pioneer_reports.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <string_view>

#include "client_fw/sim/pioneer/pioneer_packets.h"

namespace pheromone::sim {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;
constexpr double kDegree = kTurn / 360;
constexpr uint8_t kSync2Reply = 2;
constexpr uint8_t kConfigPacket = 0x20;
constexpr uint8_t kEncoderPacket = 0x90;
constexpr uint8_t kIoPacket = 0xF0;
constexpr uint8_t kStopped = 0x32;
constexpr uint8_t kMoving = 0x33;
constexpr uint16_t kMotorsFlag = 1;
constexpr uint16_t kSonarFlags = 0b11110;   // one for each of four arrays
constexpr uint16_t kStopFlags = 0b1100000;  // the button is pressed, its stall is engaged
constexpr uint16_t kLeftStall = 1;
constexpr uint16_t kRightStall = 1 << 8;
constexpr size_t kMaxName = 20;

class Writer {
 public:
  void Byte(int value) { data_.push_back(static_cast<uint8_t>(value)); }
  void Word(int64_t value) {  // its low 16 bits, two's complement
    Byte(static_cast<int>(value & 0xFF));
    Byte(static_cast<int>(value >> 8 & 0xFF));
  }
  void Signed(double value) { Word(std::llround(std::clamp(value, -32768.0, 32767.0))); }
  void Unsigned(double value) { Word(std::llround(std::clamp(value, 0.0, 65535.0))); }
  void Text(std::string_view text) {
    const std::string_view cut = text.substr(0, std::min(kMaxName, text.find('\0')));
    data_.insert(data_.end(), cut.begin(), cut.end());
    Byte(0);
  }
  std::vector<uint8_t> Packet(uint8_t id) const { return MakePacket(id, data_); }

 private:
  std::vector<uint8_t> data_;
};

// In units of `unit`, the low `bits` of it.
int64_t Wrapped(double value, double unit, int bits) {
  return std::llround(value / unit) & ((int64_t{1} << bits) - 1);
}

// 4096 a turn, from -2048 to 2047.
int64_t SignedHeading(double heading_rad) {
  constexpr int kSteps = 4096;
  const int64_t steps = std::llround(heading_rad / (kTurn / kSteps)) & (kSteps - 1);
  return steps < kSteps / 2 ? steps : steps - kSteps;
}

// The inputs' bits of a SIP: a ring begins at bit 1, above a wheel's stall.
int BumperBits(uint8_t pressed) {
  return pressed << 1;
}

}  // namespace

std::vector<uint8_t> MakeSip(const PioneerModel& model, SipForm form, int position_bits,
                             const SipContent& content) {
  assert(position_bits == 15 || position_bits == 16);
  assert(content.sonar.size() <= kMaxSonarReadings);
  const double battery_dv = content.battery_v * 10;
  Writer sip;
  sip.Word(Wrapped(content.x_mm, model.distance_mm, position_bits));
  sip.Word(Wrapped(content.y_mm, model.distance_mm, position_bits));
  sip.Word(SignedHeading(content.heading_rad));
  sip.Signed(content.left_mm_s / model.speed_mm_s);
  sip.Signed(content.right_mm_s / model.speed_mm_s);
  sip.Byte(static_cast<int>(std::lround(std::clamp(battery_dv, 0.0, 255.0))));
  sip.Word((content.left_stalled ? kLeftStall : 0) | BumperBits(content.bumpers.rear) |
           (content.right_stalled ? kRightStall : 0) | BumperBits(content.bumpers.front) << 8);
  sip.Word(SignedHeading(content.heading_setpoint_rad));
  sip.Word((content.motors_enabled ? kMotorsFlag : 0) | (content.sonar_enabled ? kSonarFlags : 0) |
           (content.stop_pressed ? kStopFlags : 0));
  sip.Byte(0);  // compass: none
  sip.Byte(static_cast<int>(content.sonar.size()));
  for (const SonarReading& reading : content.sonar) {
    sip.Byte(reading.number);
    sip.Unsigned(reading.range_mm / model.range_mm);
  }
  if (form == SipForm::kFull) {
    for (int none = 0; none < 5; ++none) {
      sip.Byte(0);  // gripper, analog port, analog, digital in, digital out
    }
    sip.Unsigned(battery_dv);
    sip.Byte(0);  // not charging
    sip.Signed(content.turn_rad_s / kDegree * 10);
    sip.Word(0);     // faults
    sip.Word(0);     // lateral speed
    sip.Byte(-128);  // no thermometer
    sip.Byte(0);     // nor a gauge of charge
  }
  return sip.Packet(content.moving ? kMoving : kStopped);
}

std::vector<uint8_t> MakeEncoderPacket(const PioneerModel& model, double left_mm, double right_mm) {
  Writer encoders;
  for (const double rolled_mm : {left_mm, right_mm}) {
    const int64_t ticks = std::llround(rolled_mm * model.encoder_ticks_per_mm);
    encoders.Word(ticks);
    encoders.Word(ticks >> 16);
  }
  return encoders.Packet(kEncoderPacket);
}

std::vector<uint8_t> MakeIoPacket(const PressedBumpers& bumpers, double battery_v) {
  constexpr int kAllHigh = 0xFF;
  Writer io;
  io.Byte(4);
  io.Byte(0);
  io.Byte(kAllHigh & ~BumperBits(bumpers.front));
  io.Byte(kAllHigh & ~BumperBits(bumpers.rear));
  io.Byte(kAllHigh);
  io.Byte(1);
  io.Byte(0);
  io.Byte(9);
  for (int port = 0; port < 8; ++port) {
    io.Word(0);
  }
  io.Word(std::llround(std::clamp(battery_v / 20, 0.0, 1.0) * 1023));
  return io.Packet(kIoPacket);
}

std::vector<uint8_t> MakeConfigPacket(const PioneerModel& model, const ConfigContent& content) {
  const MotionLimits& limits = content.limits;
  Writer config;
  config.Text("Pioneer");
  config.Text(model.subclass);
  config.Text("simulated");  // the serial number
  config.Byte(0);            // two motors
  config.Word(model.top_turn_deg_s);
  config.Word(model.top_speed_mm_s);
  config.Word(model.top_turn_acceleration_deg_s2);
  config.Word(model.top_acceleration_mm_s2);
  config.Word(500);  // full power
  config.Text(content.name);
  config.Byte(std::min(content.sip_period_ms, 255));
  config.Byte(0);                                // the host's port: 9600 baud
  config.Byte(0);                                // the auxiliary port
  config.Word(0);                                // no gripper
  config.Word(1);                                // the front array of sonars
  config.Byte(model.sonars.size() > 8 ? 1 : 0);  // the rear array
  config.Word(0);                                // no alarm at low battery
  config.Word(0);                                // encoder ticks a turn of the robot: not told
  config.Word(content.watchdog_ms);
  config.Byte(0);  // standard SIPs
  for (int none = 0; none < 4; ++none) {
    config.Word(0);  // stall power and time, joystick speed and turn rate
  }
  config.Unsigned(limits.turn_rad_s / kDegree);
  config.Unsigned(limits.speed_m_s * 1000);
  config.Unsigned(limits.turn_acceleration_rad_s2 / kDegree);
  config.Unsigned(limits.turn_deceleration_rad_s2 / kDegree);
  for (int none = 0; none < 3; ++none) {
    config.Word(0);  // gains of the rotation's controller
  }
  config.Unsigned(limits.acceleration_m_s2 * 1000);
  config.Unsigned(limits.deceleration_m_s2 * 1000);
  for (int none = 0; none < 3; ++none) {
    config.Word(0);  // gains of the translation's controller
  }
  config.Byte(content.bumpers);  // in front
  config.Byte(content.bumpers);  // behind
  config.Byte(0);                // no charger
  config.Byte(40);               // ms of a sonar's cycle
  config.Byte(0);                // the rate of the host's port stays
  config.Byte(0);                // no gyro
  config.Word(0);                // no correction of drift
  config.Byte(0);                // the second auxiliary port
  config.Byte(0);                // the third
  config.Word(model.encoder_ticks_per_mm);
  return config.Packet(kConfigPacket);
}

std::vector<uint8_t> MakeNamesPacket(const PioneerModel& model, const std::string& name) {
  Writer names;
  names.Text(name);
  names.Text("Pioneer");
  names.Text(model.subclass);
  return names.Packet(kSync2Reply);
}

}  // namespace pheromone::sim
