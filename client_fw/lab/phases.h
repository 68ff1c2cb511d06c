// The phases of a step that are done for slices of robots, in any order and by any threads: a phase
// writes its own robots only, and reads of others what no robot writes in that phase.
//
//   Sense    where it believes to be, and what is sensed there
//   Roll     the wheels, and where the robot would go on its arc
//   Collide  whether something is in the way
//   Commit   it goes there, or turns where it stands
//
// world.h puts them together.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "client_fw/core/steering/settings.h"
#include "client_fw/lab/disc_grid.h"
#include "client_fw/lab/group.h"
#include "client_fw/lab/link/rounds_link.h"
#include "client_fw/lab/robots.h"
#include "client_fw/lab/walls.h"
#include "server/core/field/field.h"

namespace pheromone::lab {

/// Robots of one group.
struct Slice {
  const RobotGroup* group = nullptr;
  size_t group_first = 0;  ///< the group's first robot
  size_t first = 0;
  size_t count = 0;

  size_t end() const { return first + count; }
};

/// When a step is.
struct StepTime {
  uint64_t seed = 1;
  uint64_t step = 0;
  uint64_t step_ms = 200;

  uint64_t now_ms() const { return step * step_ms; }
  double step_s() const { return static_cast<double>(step_ms) / 1000; }
};

/// The intensities of an answer, until the robot has it.
struct Answer {
  uint16_t heading = 0;
  uint8_t on_map = 0;
  std::array<int16_t, kPheromoneSlots> left{};
  std::array<int16_t, kPheromoneSlots> right{};
};

/// Robots that are answered by a modelled radio.
struct Radio {
  struct State {
    LinkExchange next;
    bool asked = false;    ///< `answer` is on its way
    bool heard = false;    ///< there was an answer
    bool stopped = false;  ///< counted as a fail-safe stop, since
    int64_t heard_ms = 0;  ///< the last one
    Answer answer;
  };

  Radio(size_t count, const RadioModel& model, uint64_t seed);

  RoundsLink link;
  std::vector<State> robots;
};

/// What Sense has seen, to be added up.
struct Heard {
  uint64_t answers = 0;          ///< with intensities
  uint64_t fail_safe_stops = 0;  ///< begun: gaps between answers longer than kFailSafeMs

  Heard& operator+=(const Heard& other) {
    answers += other.answers;
    fail_safe_stops += other.fail_safe_stops;
    return *this;
  }
};
/// As the firmware has it if nobody changes the setting.
constexpr int64_t kFailSafeMs = client::Settings{}.fail_safe_ms;

/// Without a radio all robots are answered in each step. With one, those whose exchanges are due:
/// a robot senses in the first step after it has asked, and has the answer in the first step after
/// that has come. One that has had none for kFailSafeMs is silent. The reported pose is the
/// believed one to the nearest millimetre, in pose units, as the firmware sends it, and the
/// intensities are those of the server's answer.
Heard Sense(const field::Field& field, uint16_t pose_unit_10um,
            std::span<const PheromoneSite> sites, const StepTime& time, const Slice& slice,
            Radio* radio, Robots* robots);

/// Requires actions within their ranges. Returns the longest way that one of them would go: no less
/// than the straight line.
double Roll(const StepTime& time, const Slice& slice, Robots* robots);

struct Surroundings {
  const DiscGrid& grid;  ///< of the present positions
  const Walls& walls;
  double most_radius_m = 0;  ///< of all robots; 0: no two collide
  double most_way_m = 0;     ///< of all robots in this step
};

/// A robot may go where its disc overlaps no other one, neither where that one is nor where it goes
/// if that has the right of way, which is drawn in each step. So no two robots ever overlap after a
/// step, whatever their order. One that touches a wall already, such as one that has closed on it,
/// is not held by walls.
void Collide(const StepTime& time, const Surroundings& around, const Slice& slice, Robots* robots);

/// What Commit has seen, to be added up.
struct Moves {
  uint64_t robot_contacts = 0;  ///< begun
  uint64_t wall_contacts = 0;
  uint64_t standing = 0;  ///< robots that moved by less than a millimetre
};

/// A blocked robot keeps its place and turns as its wheels say.
Moves Commit(const StepTime& time, const Slice& slice, Robots* robots);

}  // namespace pheromone::lab
