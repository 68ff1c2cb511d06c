#include "client_fw/ros2/ros_robot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace pheromone::ros2 {
namespace {

// Longer than this between two Steps is a pause: what the server sent meanwhile is old.
constexpr int64_t kPauseMs = 100;
constexpr double kTurnRad = 2 * std::numbers::pi;
// Further than this, odometry does not get from one message to the next.
constexpr double kJumpM = 0.5;
constexpr double kFastestMPerS = 2.0;
constexpr double kJumpRad = 0.5;
constexpr double kFastestRadPerS = 4.0;

client::Parameters WithStart(client::Parameters parameters, PoseSource source) {
  if (source == PoseSource::kMap) {
    parameters.start = client::Pose{0, 0, 0};
  }
  return parameters;
}

bool IsFinite(const PlanePose& pose) {
  return std::isfinite(pose.x_m) && std::isfinite(pose.y_m) && std::isfinite(pose.heading_rad);
}

std::optional<client::Pose> Reportable(const PlanePose& pose) {
  return IsReportable(pose) ? std::optional(ToClientPose(pose)) : std::nullopt;
}

}  // namespace

PlanePose Compose(const PlanePose& frame, const PlanePose& pose) {
  const double c = std::cos(frame.heading_rad);
  const double s = std::sin(frame.heading_rad);
  return {frame.x_m + c * pose.x_m - s * pose.y_m, frame.y_m + s * pose.x_m + c * pose.y_m,
          frame.heading_rad + pose.heading_rad};
}

PlanePose Inverse(const PlanePose& pose) {
  const double c = std::cos(pose.heading_rad);
  const double s = std::sin(pose.heading_rad);
  return {-c * pose.x_m - s * pose.y_m, s * pose.x_m - c * pose.y_m, -pose.heading_rad};
}

RosRobot::RosRobot(const client::Parameters& parameters, double track_m, PoseSource source)
    : track_m_(track_m),
      source_(source),
      robot_(&board_, &drive_, WithStart(parameters, source), &memory_) {}

void RosRobot::OnOdometry(const PlanePose& pose, int64_t now_ms) {
  if (!IsFinite(pose)) {
    return;
  }
  if (odometry_ms_ && source_ == PoseSource::kStart) {
    // Without odometry it was told to stand: how long that lasted permits no more.
    const double seconds =
        static_cast<double>(std::min(now_ms - *odometry_ms_, kOdometryMs)) / 1000;
    const double way_m = std::hypot(pose.x_m - odometry_.x_m, pose.y_m - odometry_.y_m);
    const double turn_rad =
        std::abs(std::remainder(pose.heading_rad - odometry_.heading_rad, kTurnRad));
    jumped_ |=
        way_m > kJumpM + kFastestMPerS * seconds || turn_rad > kJumpRad + kFastestRadPerS * seconds;
  }
  if (!first_odometry_) {
    first_odometry_ = pose;
  }
  odometry_ = pose;
  odometry_ms_ = now_ms;
}

void RosRobot::OnServerBytes(std::span<const uint8_t> bytes) {
  from_server_.insert(from_server_.end(), bytes.begin(), bytes.end());
}

void RosRobot::Enable(bool enabled) {
  disabled_ = !enabled;
  resume_ = enabled;
}

std::optional<client::Pose> RosRobot::Place() const {
  if (!fresh_) {
    return std::nullopt;
  }
  if (source_ == PoseSource::kStart) {
    return Reportable(Compose(Inverse(*first_odometry_), odometry_));
  }
  return map_to_odometry_ ? Reportable(Compose(*map_to_odometry_, odometry_)) : std::nullopt;
}

void RosRobot::Step(int64_t now_ms) {
  if (now_ms - now_ms_ > kPauseMs) {
    from_server_.clear();
  }
  now_ms_ = now_ms;
  const bool was_fresh = fresh_;
  fresh_ = odometry_ms_ && now_ms - *odometry_ms_ <= kOdometryMs;
  const std::optional<client::Pose> place = Place();
  drive_.known = place.has_value();
  drive_.place = place.value_or(client::Pose{0, 0, 0});
  drive_.state.alarms = static_cast<uint8_t>((disabled_ || halt_ ? client::kStopButtonAlarm : 0) |
                                             (jumped_ ? client::kPoseLostAlarm : 0));
  board_.set_millis(static_cast<client::Moment>(now_ms));
  board_.Receive(from_server_.data(), from_server_.size());
  from_server_.clear();
  robot_.Step();
  // A halt wins over what would resume in the same turn, whichever came first.
  if (resume_ && !halt_ && !jumped_) {
    robot_.Resume();
  }
  halt_ = jumped_ = resume_ = false;
  drive_.told |= was_fresh && !fresh_;
  if (released()) {
    silent_ms_ = now_ms + kStandMs;
  }
}

std::optional<Speed> RosRobot::ClaimSpeed() {
  const bool told = drive_.told && now_ms_ < silent_ms_;
  drive_.told = false;
  if (!told) {
    return std::nullopt;
  }
  if (!drive_.known || !released()) {
    return Speed{};
  }
  const double left = drive_.wheels.left_mm_s / 1000.0;
  const double right = drive_.wheels.right_mm_s / 1000.0;
  return Speed{(left + right) / 2, (right - left) / track_m_};
}

bool RosRobot::ClaimSensed() {
  const unsigned before = answers_;
  answers_ = conversation().counters().answers;
  return answers_ != before;
}

std::vector<uint8_t> RosRobot::ClaimFrame() {
  std::array<uint8_t, client::kMaxClientFrame> frame{};
  const size_t size = board_.TakeTransmission(frame.data(), frame.size());
  return {frame.begin(), frame.begin() + static_cast<ptrdiff_t>(size)};
}

client::Pose RosRobot::pose() const {
  return client::StartPose(conversation().state().start).Place(drive_.place);
}

}  // namespace pheromone::ros2
