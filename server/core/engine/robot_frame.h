// Converts a robot's own coordinates to map coordinates. A robot may, for example, report its pose
// relative to where it was switched on; its frame is that pose on the map:
//
//   map position = R(heading) * reported position + (x, y),   map heading = reported + heading
//
//   config.frames = {MakeFrame("radio-a", 7, {2'000'000, 500'000}, 90.0)};
//   const field::PoseUm on_the_map = ToMap(config.frames[0], reported);
//
// A frame is part of the configuration and carries its rotation in integers: floating point ends
// where the configuration is read, and a replay gives the same bits on every machine.
//
// Pure; any thread.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "server/base/result.h"
#include "server/core/field/geometry.h"

namespace pheromone::engine {

/// The frame of one robot. Robots without one use the map's coordinates.
struct RobotFrame {
  std::string link;           ///< with the ID, the robot's key
  uint8_t id = 0;             ///< 1-254
  int64_t x_um = 0;           ///< the frame's origin on the map, within kMaxOffsetUm
  int64_t y_um = 0;           ///< likewise
  uint16_t heading = 0;       ///< of the frame's x axis on the map; a binary angle
  int32_t cos_q30 = 1 << 30;  ///< the same angle, before it was rounded to a binary one,
  int32_t sin_q30 = 0;        ///< in 2^-30, rounded to nearest
  bool operator==(const RobotFrame&) const = default;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("link", it.link);
    visit("id", it.id);
    visit("x_um", it.x_um);
    visit("y_um", it.y_um);
    visit("heading", it.heading);
    visit("cos_q30", it.cos_q30);
    visit("sin_q30", it.sin_q30);
  }
};

/// 10^9 m: larger than any map, and sums cannot overflow 64 bits.
constexpr int64_t kMaxOffsetUm = 1'000'000'000'000'000;

/// `heading_deg` is counter-clockwise from the map's +x and finite.
RobotFrame MakeFrame(std::string link, uint8_t id, field::PointUm origin, double heading_deg);

/// Checks the frames of a configuration. Errors: two frames of one robot, an invalid robot ID, an
/// origin out of range, an invalid rotation or one that differs from the heading. An unknown link
/// is not an error, since it may be configured again.
Status CheckFrames(const std::vector<RobotFrame>& frames);

/// x = round((cos_q30 * X - sin_q30 * Y) / 2^30) + x_um and y = round((sin_q30 * X + cos_q30 * Y) /
/// 2^30) + y_um, to nearest, halves away from zero, exact in between; headings are added modulo a
/// turn. Every position that a message can hold is within range.
field::PoseUm ToMap(const RobotFrame& frame, const field::PoseUm& reported);

/// A difference of two positions on the map, as the robot sees it: turned back by the heading, and
/// rounded as above.
field::PointUm DifferenceFromMap(const RobotFrame& frame, const field::PointUm& difference);

}  // namespace pheromone::engine
