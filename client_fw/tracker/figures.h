// What a run tells: rate, missed tags, reprojection errors, and for a simulated swarm how far its
// robots were from where they are.
//
//   Figures figures(settings);
//   figures.Add(view, 0.04);
//   fmt::print("{}\n", figures.Line(2.0));   // of the last two seconds
//   figures.Clear();
//
// One thread.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "client_fw/tracker/settings.h"
#include "client_fw/tracker/simulated_swarm.h"
#include "client_fw/tracker/tracking.h"

namespace pheromone::tracker {

class Figures {
 public:
  explicit Figures(const Settings& settings) : settings_(settings) {}

  /// A picture, and how many seconds of a processor it took to find tags and poses in it.
  void Add(const View& view, double seconds);
  /// A robot that was seen, and where it was.
  void AddError(const SeenRobot& seen, const TruePose& truth);

  /// Of what was added since Clear, in `seconds`.
  std::string Line(double seconds) const;
  void Clear() { *this = Figures(settings_); }

  int pictures() const { return pictures_; }

 private:
  Settings settings_;
  int pictures_ = 0;
  double seconds_ = 0;
  size_t robots_ = 0;
  size_t rejected_ = 0;
  size_t floor_ = 0;
  std::vector<double> camera_px_;
  std::vector<double> robot_px_;
  std::vector<double> error_mm_;
  std::vector<double> error_deg_;
  std::map<int, int> missed_;  // by tag
  std::string last_trouble_;
};

}  // namespace pheromone::tracker
