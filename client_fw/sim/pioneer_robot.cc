#include "client_fw/sim/pioneer_robot.h"

#include <algorithm>
#include <cassert>
#include <cstdlib>
#include <numbers>
#include <utility>

namespace pheromone::sim {
namespace {

constexpr int64_t kNsPerMs = 1'000'000;
constexpr int64_t kTickNs = kNsPerMs;
static_assert(PioneerDrive::kTickS * 1e9 == kTickNs);

constexpr double kDegree = std::numbers::pi / 180;
constexpr int kNothingInReachMm = 5000;
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
  kSetRv = 10,
  kVel = 11,
  kConfig = 18,
  kRvel = 21,
  kSetRa = 23,
  kSonar = 28,
  kStop = 29,
  kVel2 = 32,
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
    if (open()) {
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
  drive_.Tick(silent_ ? Motion{} : target_, limits_);
}

// A client that missed an echo repeats its SYNC, or begins again at SYNC0.
void PioneerRobot::Synchronise(const Packet& packet) {
  if (session_ == Session::kSynchronised && packet.id == kSync1Open) {
    Open();
    return;
  }
  if (packet.id > next_sync_) {
    ++counters_.ignored;
    return;
  }
  next_sync_ = std::min<uint8_t>(packet.id + 1, kSync2Close);
  if (packet.id == kSync2Close) {
    session_ = Session::kSynchronised;
    Send(MakeNamesPacket(config_.model, config_.name));
  } else {
    session_ = Session::kSynchronising;
    Send(MakePacket(packet.id, {}));
  }
}

void PioneerRobot::Open() {
  session_ = Session::kOpen;
  sonar_enabled_ = config_.sonar_when_opened;
  next_sip_ns_ = now_ns_ + config_.sip_period_ms * kNsPerMs;
  ++counters_.sessions;
}

void PioneerRobot::Close() {
  session_ = Session::kSynchronising;
  next_sync_ = kSync0Pulse;
  motors_enabled_ = false;
  by_wheels_ = false;
  silent_ = false;
  target_ = {};
  limits_ = ModelLimits();
}

void PioneerRobot::HangUp() {
  Close();
  reader_.Clear();
  output_.clear();
}

void PioneerRobot::Obey(const Packet& packet) {
  const std::optional<int> argument = PacketArgument(packet);
  switch (packet.id) {
    case kSync0Pulse:
    case kSync1Open:
    case kHostBaud:
      break;
    case kSync2Close:
      Close();
      break;
    case kSetO:
      drive_.ResetOdometry();
      break;
    case kStop:
      target_ = {};
      break;
    case kEStop:
      target_ = {};
      drive_.Halt();
      break;
    case kConfig:
      if (config_.answers_config) {
        Send(MakeConfigPacket(config_.model, {config_.name, config_.sip_period_ms,
                                              config_.watchdog_ms, config_.sonars, limits_}));
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
      motors_enabled_ = argument != 0;
      if (!motors_enabled_) {
        target_ = {};
      }
      return true;
    case kSonar:
      sonar_enabled_ = argument != 0;
      return true;
    default:
      break;
  }
  if (!motors_enabled_) {
    return false;
  }
  switch (command) {
    case kVel:
      target_ = {OfMm(argument), by_wheels_ ? 0 : target_.turn_rad_s};
      by_wheels_ = false;
      return true;
    case kRvel:
      target_ = {by_wheels_ ? 0 : target_.speed_m_s, argument * kDegree};
      by_wheels_ = false;
      return true;
    case kVel2: {
      // Raw or negated, the low 16 bits of the argument are the two bytes.
      const auto word = static_cast<uint16_t>(argument);
      const int right = static_cast<int8_t>(word & 0xFF) * config_.model.vel2_unit_mm_s;
      const int left = static_cast<int8_t>(word >> 8) * config_.model.vel2_unit_mm_s;
      target_ = {OfMm(right + left) / 2, (right - left) / 2.0 * config_.model.diff_conv_per_mm};
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

void PioneerRobot::SendSip() {
  SipContent sip;
  sip.moving = drive_.motion() != Motion{};
  sip.x_mm = drive_.odometry().x_m * 1000;
  sip.y_mm = drive_.odometry().y_m * 1000;
  sip.heading_rad = drive_.odometry().heading_rad;
  sip.left_mm_s = drive_.left_m_s() * 1000;
  sip.right_mm_s = drive_.right_m_s() * 1000;
  sip.turn_rad_s = drive_.motion().turn_rad_s;
  sip.battery_v = config_.battery_v;
  sip.left_stalled = drive_.left_stalled();
  sip.right_stalled = drive_.right_stalled();
  sip.motors_enabled = motors_enabled_;
  sip.sonar_enabled = sonar_enabled_;
  for (int number = 0; sonar_enabled_ && number < config_.sonars; ++number) {
    sip.ranges_mm.push_back(config_.range_mm ? config_.range_mm(drive_.true_pose(), number)
                                             : kNothingInReachMm);
  }
  const size_t before = output_.size();
  Send(MakeSip(config_.model, config_.sip_form, config_.position_bits, sip));
  ++(output_.size() > before ? counters_.sips : counters_.lost_sips);
}

}  // namespace pheromone::sim
