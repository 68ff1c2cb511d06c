#include "client_fw/sim/pioneer/pioneer_robot.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <utility>

namespace pheromone::sim {
namespace {

constexpr int64_t kNsPerMs = 1'000'000;
constexpr int64_t kTickNs = kNsPerMs;
static_assert(PioneerDrive::kTickS * 1e9 == kTickNs);

constexpr double kTurn = 2 * std::numbers::pi;
constexpr double kDegree = kTurn / 360;
// A line does not store bytes: unread output is lost.
constexpr size_t kMaxOutput = 4096;

enum Command : uint8_t {
  kSync0Pulse = 0,  // SYNCs until a session is open, then the others
  kSync1Open = 1,
  kSync2Close = 2,
  kEnable = 4,
  kSetA = 5,
  kSetV = 6,
  kSetO = 7,
  kMove = 8,
  kRotate = 9,
  kSetRv = 10,
  kVel = 11,
  kHead = 12,
  kDHead = 13,
  kConfig = 18,
  kEncoder = 19,
  kRvel = 21,
  kSetRa = 23,
  kSonar = 28,
  kStop = 29,
  kVel2 = 32,
  kIoRequest = 40,
  kHostBaud = 50,
  kEStop = 55,
};

double OfMm(int mm) {
  return mm / 1000.0;
}

PioneerBody BodyOf(const PioneerConfig& config) {
  const double believed_m = config.model.odometry_wheelbase_mm() / 1000;
  return {config.wheelbase_m > 0 ? config.wheelbase_m : believed_m, believed_m,
          OfMm(config.model.wheel_limit_mm_s)};
}

}  // namespace

PioneerRobot::PioneerRobot(const PioneerConfig& config, const PlanePose& start)
    : config_(config),
      drive_(BodyOf(config), config.errors, start, config.blocked),
      next_tick_ns_(kTickNs),
      limits_(ModelLimits()) {
  assert(config.sip_period_ms > 0);
}

MotionLimits PioneerRobot::ModelLimits() const {
  const PioneerModel& model = config_.model;
  const double acceleration = OfMm(model.acceleration_mm_s2);
  const double turn_acceleration = model.turn_acceleration_deg_s2 * kDegree;
  return {OfMm(model.max_speed_mm_s),
          model.max_turn_deg_s * kDegree,
          acceleration,
          acceleration,
          turn_acceleration,
          turn_acceleration};
}

PioneerCounters PioneerRobot::counters() const {
  PioneerCounters counters = counters_;
  counters.bad_checksums = reader_.bad_checksums();
  return counters;
}

std::vector<uint8_t> PioneerRobot::TakeOutput() {
  return std::exchange(output_, {});
}

void PioneerRobot::Send(const std::vector<uint8_t>& packet) {
  if (output_.size() + packet.size() <= kMaxOutput) {
    output_.insert(output_.end(), packet.begin(), packet.end());
  }
}

void PioneerRobot::OnBytes(std::span<const uint8_t> bytes, int64_t time_ns) {
  AdvanceTo(time_ns);
  reader_.Push(bytes);
  while (const std::optional<Packet> packet = reader_.Next()) {
    ++counters_.packets;
    last_packet_ns_ = now_ns_;
    silent_ = false;
    if (session_ != Session::kSynchronising && packet->id == kSync2Close) {
      Close();
      ++counters_.closes;
    } else if (open()) {
      Obey(*packet);
    } else {
      Synchronise(*packet);
    }
  }
}

void PioneerRobot::AdvanceTo(int64_t time_ns) {
  while (std::min(next_tick_ns_, NextSipTime()) <= time_ns) {
    if (next_tick_ns_ <= NextSipTime()) {
      now_ns_ = next_tick_ns_;
      next_tick_ns_ += kTickNs;
      TickMotion();
    } else {
      now_ns_ = next_sip_ns_;
      next_sip_ns_ += config_.sip_period_ms * kNsPerMs;
      SendSip();
    }
  }
  now_ns_ = std::max(now_ns_, time_ns);
}

bool PioneerRobot::Silent() const {
  return open() && config_.watchdog_ms > 0 &&
         now_ns_ - last_packet_ns_ >= config_.watchdog_ms * kNsPerMs;
}

void PioneerRobot::TickMotion() {
  if (Silent() && !silent_) {
    silent_ = true;
    ++counters_.watchdog_stops;
  }
  const Motion before = drive_.motion();
  const Motion target = {
      translation_.SpeedAfter(before.speed_m_s, limits_.deceleration_m_s2, PioneerDrive::kTickS),
      rotation_.SpeedAfter(before.turn_rad_s, limits_.turn_deceleration_rad_s2,
                           PioneerDrive::kTickS)};
  const double rolled_m = drive_.left_rolled_m() + drive_.right_rolled_m();
  const double heading_rad = drive_.odometry().heading_rad;
  drive_.Tick(silent_ ? Motion{} : target, limits_);
  translation_.OnCovered((drive_.left_rolled_m() + drive_.right_rolled_m() - rolled_m) / 2,
                         drive_.motion().speed_m_s);
  rotation_.OnCovered(drive_.odometry().heading_rad - heading_rad, drive_.motion().turn_rad_s);
}

// A client that missed an echo repeats its SYNC, or begins again at SYNC0. After SYNC2 the same
// numbers are commands: PULSE, OPEN, and CLOSE, which has been dealt with.
void PioneerRobot::Synchronise(const Packet& packet) {
  if (session_ == Session::kSynchronised) {
    if (packet.id == kSync1Open) {
      Open();
    } else if (packet.id != kSync0Pulse) {
      ++counters_.ignored;
    }
  } else if (packet.id == kSync2Close) {
    session_ = Session::kSynchronised;
    Send(MakeNamesPacket(config_.model, config_.name));
  } else if (packet.id < kSync2Close) {
    Send(MakePacket(packet.id, {}));
  } else {
    ++counters_.ignored;
  }
}

void PioneerRobot::Open() {
  session_ = Session::kOpen;
  last_command_ns_ = now_ns_;
  next_sonar_ = 0;
  sonar_enabled_ = true;  // until SONAR 0
  next_sip_ns_ = now_ns_ + config_.sip_period_ms * kNsPerMs;
  ++counters_.sessions;
}

void PioneerRobot::Close() {
  session_ = Session::kSynchronising;
  motors_enabled_ = false;
  silent_ = false;
  encoder_packets_ = 0;
  io_packets_ = 0;
  limits_ = ModelLimits();
  StandStill();
}

// Slows down and stands, whatever was commanded.
void PioneerRobot::StandStill() {
  translation_.Hold(0);
  rotation_.Hold(0);
  by_wheels_ = false;
}

void PioneerRobot::HangUp() {
  Close();
  reader_.Clear();
  output_.clear();
}

void PioneerRobot::set_stop_pressed(bool pressed) {
  stop_pressed_ = pressed;
  if (pressed) {
    motors_enabled_ = false;
    StandStill();
    drive_.Halt();
  }
}

void PioneerRobot::Obey(const Packet& packet) {
  if (packet.id != kSync0Pulse) {
    last_command_ns_ = now_ns_;
  }
  const std::optional<int> argument = PacketArgument(packet);
  switch (packet.id) {
    case kSync0Pulse:
    case kSync1Open:
    case kHostBaud:
      break;
    case kSetO:
      drive_.ResetOdometry();
      break;
    case kStop:
      StandStill();
      break;
    case kEStop:
      StandStill();
      drive_.Halt();
      break;
    case kConfig:
      if (config_.answers_config) {
        Send(MakeConfigPacket(config_.model, {config_.name, config_.sip_period_ms,
                                              config_.watchdog_ms, config_.bumpers, limits_}));
      }
      break;
    default:
      if (!argument ||
          (!ObeyArgument(packet.id, *argument) && !ObeySetting(packet.id, *argument))) {
        ++counters_.ignored;
      }
  }
}

// False if it is not one of these commands, or has no effect at present.
bool PioneerRobot::ObeyArgument(uint8_t command, int argument) {
  switch (command) {
    case kEnable:
      motors_enabled_ = argument != 0 && !stop_pressed_;
      if (!motors_enabled_) {
        StandStill();
      }
      return argument == 0 || motors_enabled_;
    case kSonar:
      sonar_enabled_ = argument != 0;
      return true;
    case kEncoder:
      encoder_packets_ = std::max(argument, 0);
      return true;
    case kIoRequest:
      io_packets_ = std::max(argument, 0);
      return true;
    default:
      return motors_enabled_ && ObeyMotion(command, argument);
  }
}

// A command for one axis leaves the other one as it is, but not what VEL2 gave it.
void PioneerRobot::LeaveWheels() {
  if (by_wheels_) {
    StandStill();
  }
}

bool PioneerRobot::ObeyMotion(uint8_t command, int argument) {
  switch (command) {
    case kVel:
      LeaveWheels();
      translation_.Hold(OfMm(argument));
      return true;
    case kMove:
      LeaveWheels();
      translation_.Cover(OfMm(argument));
      return true;
    case kRvel:
    case kRotate:
      LeaveWheels();
      rotation_.Hold(argument * kDegree);
      return true;
    case kHead:
      LeaveWheels();
      rotation_.Cover(std::remainder(argument * kDegree - drive_.odometry().heading_rad, kTurn));
      return true;
    case kDHead:
      LeaveWheels();
      rotation_.Cover(argument * kDegree);
      return true;
    case kVel2: {
      // Raw or negated, the low 16 bits of the argument are the two bytes.
      const auto word = static_cast<uint16_t>(argument);
      const int right = static_cast<int8_t>(word & 0xFF) * config_.model.vel2_unit_mm_s;
      const int left = static_cast<int8_t>(word >> 8) * config_.model.vel2_unit_mm_s;
      translation_.Hold(OfMm(right + left) / 2);
      rotation_.Hold((right - left) / 2.0 * config_.model.diff_conv_per_mm);
      by_wheels_ = true;
      return true;
    }
    default:
      return false;
  }
}

bool PioneerRobot::ObeySetting(uint8_t command, int argument) {
  const PioneerModel& model = config_.model;
  const int size = std::abs(argument);
  switch (command) {
    case kSetV:
      limits_.speed_m_s = OfMm(std::min(size, model.top_speed_mm_s));
      return true;
    case kSetRv:
      limits_.turn_rad_s = std::min(size, model.top_turn_deg_s) * kDegree;
      return true;
    case kSetA:
      if (size != 0) {
        (argument > 0 ? limits_.acceleration_m_s2 : limits_.deceleration_m_s2) =
            OfMm(std::min(size, model.top_acceleration_mm_s2));
      }
      return size != 0;
    case kSetRa:
      if (size != 0) {
        (argument > 0 ? limits_.turn_acceleration_rad_s2 : limits_.turn_deceleration_rad_s2) =
            std::min(size, model.top_turn_acceleration_deg_s2) * kDegree;
      }
      return size != 0;
    default:
      return false;
  }
}

bool PioneerRobot::ReportsMoving() const {
  const bool commanded = translation_.covers() || rotation_.covers() ||
                         now_ns_ - last_command_ns_ < config_.watchdog_ms * kNsPerMs;
  return drive_.motion() != Motion{} && config_.watchdog_ms > 0 && commanded;
}

PressedBumpers PioneerRobot::bumpers() const {
  return FindPressedBumpers(config_.model, config_.bumpers, drive_.true_pose(), config_.range);
}

std::vector<SonarReading> PioneerRobot::ReadSonar() {
  const std::span<const SonarMount> sonars = config_.model.sonars;
  std::vector<SonarReading> readings;
  const size_t count = std::min(sonars.size(), static_cast<size_t>(config_.sonars));
  for (size_t i = 0; i < count; ++i) {
    readings.push_back({static_cast<int>(next_sonar_),
                        SonarRangeMm(sonars[next_sonar_], drive_.true_pose(), config_.range)});
    next_sonar_ = (next_sonar_ + 1) % sonars.size();
  }
  return readings;
}

void PioneerRobot::SendSip() {
  SipContent sip;
  sip.moving = ReportsMoving();
  sip.x_mm = drive_.odometry().x_m * 1000;
  sip.y_mm = drive_.odometry().y_m * 1000;
  sip.heading_rad = drive_.odometry().heading_rad;
  sip.heading_setpoint_rad = sip.heading_rad + rotation_.rest();
  sip.left_mm_s = drive_.left_m_s() * 1000;
  sip.right_mm_s = drive_.right_m_s() * 1000;
  sip.turn_rad_s = drive_.motion().turn_rad_s;
  sip.battery_v = config_.battery_v;
  sip.left_stalled = drive_.left_stalled() || stop_pressed_;
  sip.right_stalled = drive_.right_stalled() || stop_pressed_;
  sip.bumpers = bumpers();
  sip.motors_enabled = motors_enabled_;
  sip.sonar_enabled = sonar_enabled_;
  sip.stop_pressed = stop_pressed_;
  if (sonar_enabled_) {
    sip.sonar = ReadSonar();
  }
  const size_t before = output_.size();
  Send(MakeSip(config_.model, config_.sip_form, config_.position_bits, sip));
  ++(output_.size() > before ? counters_.sips : counters_.lost_sips);
  SendExtras();
}

// What a client has asked for beside the SIPs, once or until it says otherwise.
void PioneerRobot::SendExtras() {
  if (encoder_packets_ > 0) {
    Send(MakeEncoderPacket(config_.model, drive_.left_rolled_m() * 1000,
                           drive_.right_rolled_m() * 1000));
  }
  if (io_packets_ > 0) {
    Send(MakeIoPacket(bumpers(), config_.battery_v));
  }
  encoder_packets_ -= encoder_packets_ == 1 ? 1 : 0;
  io_packets_ -= io_packets_ == 1 ? 1 : 0;
}

}  // namespace pheromone::sim
