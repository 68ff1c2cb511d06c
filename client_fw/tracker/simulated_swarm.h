// The robots and floor of a configuration, as its camera would see them: to try everything without
// a camera.
//
//   SimulatedSwarm swarm(settings);
//   const Picture picture = swarm.PictureAt(1.5);
//
// The camera hangs above the middle of the floor tags, a little askew, high enough to see all. The
// robots drive one behind the other, counter-clockwise, on an ellipse about this middle whose axes
// are 0.7 times the sides of the floor tags' rectangle: robot n of N, counted from 0, is at the
// angle 2 pi n / N + 0.1 t. One thread; the same times in the same order give the same pictures.
#pragma once

#include <optional>
#include <vector>

#include "client_fw/tracker/rendering.h"
#include "client_fw/tracker/settings.h"

namespace pheromone::tracker {

struct TruePose {
  Point place = {0, 0};
  double heading_rad = 0;
};

class SimulatedSwarm {
 public:
  explicit SimulatedSwarm(const Settings& settings, const Blemishes& blemishes = {});

  Picture PictureAt(double seconds);

  /// Where robot `index` of the configuration is.
  TruePose PoseAt(double seconds, size_t index) const;

 private:
  Settings settings_;
  Point middle_ = {0, 0};
  Point axes_ = {0, 0};  // half of them
  std::optional<Renderer> renderer_;
};

}  // namespace pheromone::tracker
