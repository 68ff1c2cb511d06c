#include "client_fw/tracker/figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>

namespace pheromone::tracker {
namespace {

double MedianOf(std::vector<double> values) {
  if (values.empty()) {
    return 0;
  }
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

void Figures::Add(const View& view, double seconds) {
  ++pictures_;
  seconds_ += seconds;
  robots_ += view.seen.size();
  rejected_ += view.rejected.size();
  floor_ += view.floor_seen.size();
  if (view.camera) {
    camera_px_.push_back(view.camera->rms_px);
  } else {
    last_trouble_ = view.why_no_camera;
  }
  for (const SeenRobot& it : view.seen) {
    robot_px_.push_back(it.tag.rms_px);
  }
  for (const RobotTag& it : view.missed) {
    ++missed_[it.tag];
  }
  for (const RejectedTag& it : view.rejected) {
    last_trouble_ = fmt::format("tag {} was rejected: {}", it.robot.tag, it.why);
  }
  if (view.moved) {
    last_trouble_ = "the camera or a floor tag was moved";
  }
}

void Figures::AddError(const SeenRobot& seen, const TruePose& truth) {
  error_mm_.push_back(1000 * (seen.place - truth.place).norm());
  error_deg_.push_back(
      std::abs(std::remainder(seen.heading_rad - truth.heading_rad, 2 * std::numbers::pi)) * 180 /
      std::numbers::pi);
}

std::string Figures::Line(double seconds) const {
  if (pictures_ == 0) {
    return "no picture";
  }
  const double pictures = pictures_;
  std::string line = fmt::format(
      "{:.1f} pictures/s, {:.0f} ms each; a picture has {:.1f} of {} floor tags, {:.1f} of {} "
      "robots; camera {:.2f} px, robots {:.2f} px",
      pictures / seconds, 1000 * seconds_ / pictures, static_cast<double>(floor_) / pictures,
      settings_.floor.size(), static_cast<double>(robots_) / pictures, settings_.robots.size(),
      MedianOf(camera_px_), MedianOf(robot_px_));
  const auto most =
      std::max_element(missed_.begin(), missed_.end(),
                       [](const auto& a, const auto& b) { return a.second < b.second; });
  if (most != missed_.end()) {
    fmt::format_to(std::back_inserter(line), "; missed most: tag {}, {:.0f} %", most->first,
                   100 * most->second / pictures);
  }
  if (!error_mm_.empty()) {
    fmt::format_to(std::back_inserter(line), "; errors: median {:.1f} mm, {:.2f} degrees",
                   MedianOf(error_mm_), MedianOf(error_deg_));
  }
  return last_trouble_.empty() ? line : line + "; " + last_trouble_;
}

}  // namespace pheromone::tracker
