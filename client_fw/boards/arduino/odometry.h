// From the ways of two wheels to a pose, in whole numbers.
//
//   WheelOdometry odometry(152716, 141000);        // nm a tick, um between the wheels
//   odometry.Add(left_ticks, right_ticks);         // since the last call
//   odometry.pose();
//
// The heading follows from the sum of all ticks, so that it does not drift by rounding:
// (right - left) * tick / track. The position is summed in micrometres, to 2 km from the start.
#pragma once

#include <stdint.h>

#include "client_fw/core/base/angle.h"

namespace pheromone {
namespace arduino {

class WheelOdometry {
 public:
  constexpr WheelOdometry(uint32_t tick_nm, uint32_t track_um)
      : tick_nm_(tick_nm),
        heading_per_tick_(HeadingPerTick(tick_nm, track_um)),
        max_ticks_(static_cast<int16_t>(kMaxArcNm / tick_nm < INT16_MAX ? kMaxArcNm / tick_nm
                                                                        : INT16_MAX)) {}

  /// A long way counts as several arcs, on which no wheel rolls more than 131 mm.
  void Add(int16_t left, int16_t right);
  client::Odometry pose() const { return client::Odometry{x_um_ / 1000, y_um_ / 1000, heading()}; }
  /// Goes on from a pose.
  void Set(const client::Odometry& pose);

 private:
  // Two of them in nm fit 32 bits, and one in um times a cosine.
  static constexpr uint32_t kMaxArcNm = 131000000;

  // 2^16 binary angles a turn, in 1/2^16 of one: tick / track / (2 pi) * 2^32.
  static constexpr uint32_t HeadingPerTick(uint32_t tick_nm, uint32_t track_um) {
    return static_cast<uint32_t>((uint64_t{683565276} * tick_nm / 1000 + track_um / 2) / track_um);
  }
  client::BinaryAngle heading() const { return static_cast<client::BinaryAngle>(turned_ >> 16); }

  uint32_t tick_nm_;
  uint32_t heading_per_tick_;
  int16_t max_ticks_;    // of a wheel in an arc
  uint32_t turned_ = 0;  // wraps, as a heading does
  int32_t x_um_ = 0;
  int32_t y_um_ = 0;
  int16_t rest_nm_ = 0;
};

}  // namespace arduino
}  // namespace pheromone
