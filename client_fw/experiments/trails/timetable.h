// The two-trail bench by timetable: robots do not drive, but arrive at the next tag after the time
// that the way takes; all else is real. The robots' core (client_fw/core/tasks/net_robot.h)
// exchanges the protocol's messages with the engine and its readers. Ten thousand times faster than
// real time, for statistics over hours and seeds.
//
//   Timetable timetable;
//   timetable.rules.robots = 7;
//   Result<TrailsRun> run = RunTimetable(bench, timetable, /*seed=*/1);
//
// Lanes, from one tag to the next, are FIFO: nobody overtakes, and a tag has room for one robot;
// the next one takes its place `headway_s` after it has left. With `parking`, robots in the nest do
// not stand in each other's way. The way on a lane takes up to a tenth more or less, at random;
// that is all that the seed determines, beside what robots draw themselves.
//
// Pure; any thread.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "client_fw/core/tasks/net_robot.h"
#include "client_fw/experiments/trails/bench.h"
#include "client_fw/experiments/trails/run.h"
#include "server/base/result.h"

namespace pheromone::swarm {

/// A robot that stands for good once it is in the nest after that time.
struct StopInNest {
  int robot = 0;
  int64_t time_ms = 0;
};

struct Timetable {
  TrailsRules rules;
  client::NetRobotParameters robot;
  std::array<double, kTrails> trail_s = {20, 40};  ///< from exit to entrance, each way
  double nest_s = 10;                              ///< from N4 to N1
  double area_s = 3;     ///< from N1 to P, from P to N5, and so on: each lane within an area
  double headway_s = 2;  ///< between two robots at one place
  double spread = 0.1;   ///< of each of these, either way
  bool parking = false;
  std::optional<StopInNest> stop = {};
  int64_t duration_ms = 7'200'000;
  int64_t pace_ms = 200;  ///< of a robot that waits for the reader
  int64_t sample_ms = 0;  ///< 0: no samples
};

/// The times of robots that drive the bench at that speed: the ways at 0.8 of it, since they slow
/// down to steer, as one alone does, and 1.5 s to brake and start.
Timetable TimetableOf(const TrailsBench& bench, double speed_m_s);

/// Errors: those of ConfigWith; a way along a line on which the next tag is missing.
Result<TrailsRun> RunTimetable(const TrailsBench& bench, const Timetable& timetable, uint64_t seed);

}  // namespace pheromone::swarm
