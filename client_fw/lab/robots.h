// The robots of a world as plain arrays, an element a robot. They are never moved or resized while
// the world lives, so that others may look at them without a copy.
//
// Between two steps, `x_m`, `y_m` and `heading_rad` are true poses, and the actions are those of
// the last step. Units are in the names; enumerations are in behaviour_abi.h.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "client_fw/lab/behaviour_abi.h"

namespace pheromone::lab {

struct Robots {
  /// `believes`: there are robots whose odometry has errors, or that are given fixes. `slots`: the
  /// most that a robot senses.
  Robots(size_t robots, size_t slots, bool believes)
      : count(robots),
        x_m(robots),
        y_m(robots),
        heading_rad(robots),
        left_m_s(robots),
        right_m_s(robots),
        radius_m(robots),
        way_m(robots),
        charged_m(robots),
        believed_x_m(believes ? robots : 0),
        believed_y_m(believes ? robots : 0),
        believed_heading_rad(believes ? robots : 0),
        sensed_x(robots),
        sensed_y(robots),
        sensed_heading(robots),
        on_map(robots),
        asked(robots, 1),
        answered(robots, 1),
        silent(robots),
        site(robots),
        contact(robots),
        load(robots),
        failed(robots),
        want_left_m_s(robots),
        want_right_m_s(robots),
        want_quanta(robots),
        want_type(robots),
        want_load(robots),
        want_sense(robots),
        memory(robots * kPheromoneMemory),
        next_x_m(robots),
        next_y_m(robots),
        next_heading_rad(robots),
        roll_left_m(robots),
        roll_right_m(robots),
        roll_way_m(robots),
        blocked(robots) {
    for (size_t slot = 0; slot < slots; ++slot) {
      p_left[slot].resize(robots);
      p_right[slot].resize(robots);
    }
  }

  size_t count;

  // What is so.
  std::vector<double> x_m;
  std::vector<double> y_m;
  std::vector<double> heading_rad;  ///< not reduced to a turn
  std::vector<double> left_m_s;     ///< of the wheels
  std::vector<double> right_m_s;
  std::vector<float> radius_m;
  std::vector<double> way_m;      ///< since the start, forwards or backwards
  std::vector<double> charged_m;  ///< that of the last nest

  // What they believe; empty if that is what is so.
  std::vector<double> believed_x_m;
  std::vector<double> believed_y_m;
  std::vector<double> believed_heading_rad;

  // What they sensed last, and the pose that they reported for it: in pose units, 65 536 a turn.
  std::vector<int32_t> sensed_x;
  std::vector<int32_t> sensed_y;
  std::vector<uint16_t> sensed_heading;
  std::vector<uint8_t> on_map;
  std::vector<uint8_t> asked;     ///< 1: in this step; then its deposit is made
  std::vector<uint8_t> answered;  ///< 1: in this step; otherwise what it sensed is old
  std::vector<uint8_t> silent;    ///< 1: not answered for the fail-safe time, so it stands
  std::array<std::vector<int16_t>, kPheromoneSlots> p_left;
  std::array<std::vector<int16_t>, kPheromoneSlots> p_right;
  std::vector<uint8_t> site;
  std::vector<uint8_t> contact;
  std::vector<uint8_t> load;
  std::vector<uint8_t> failed;  ///< 1: it stands, whatever its behaviour says

  // Their actions.
  std::vector<double> want_left_m_s;
  std::vector<double> want_right_m_s;
  std::vector<uint16_t> want_quanta;
  std::vector<uint8_t> want_type;
  std::vector<int8_t> want_load;
  std::vector<uint8_t> want_sense;
  std::vector<double> memory;

  // Within a step: where they would go, what their wheels rolled, and what is in the way.
  std::vector<double> next_x_m;
  std::vector<double> next_y_m;
  std::vector<double> next_heading_rad;
  std::vector<double> roll_left_m;
  std::vector<double> roll_right_m;
  std::vector<double> roll_way_m;  ///< its own way by that, without its sign
  std::vector<uint8_t> blocked;

  const double* BelievedX() const {
    return believed_x_m.empty() ? x_m.data() : believed_x_m.data();
  }
  const double* BelievedY() const {
    return believed_y_m.empty() ? y_m.data() : believed_y_m.data();
  }
  const double* BelievedHeading() const {
    return believed_heading_rad.empty() ? heading_rad.data() : believed_heading_rad.data();
  }
};

}  // namespace pheromone::lab
