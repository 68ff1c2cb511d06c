// A world of up to 100 000 robots: arrays, a step in phases, the server's own field. What a robot
// senses is what the server would answer, its behaviours steer by the laws of the firmware, and its
// wheels roll as those of the simulated robots do (client_fw/sim). What is left out is the radio:
// each robot is answered in each step, at once, or, with a RadioModel, when measured rounds would
// have answered it.
//
//   WorldConfig config;                    // map, pheromones, groups, sites, seed
//   Result<std::unique_ptr<World>> world = World::Create(std::move(config));
//   while (world.value()->time().now_ms() < 600'000) {
//     PHEROMONE_TRY_STATUS(world.value()->Step());
//   }
//
// A step, at the time t = step * step_ms:
//   1 sense     all robots, the map as it was left by the last step
//   2 behave    from what was sensed to wheel speeds, deposits and loads
//   3 loads     are picked up and dropped, in the order of the robots
//   4 deposit   where each robot sensed, in the order of the robots; then Field::Advance(t)
//     roll, collide, commit   (phases.h) while one thread deposits
// and t becomes t + step_ms. A robot that sends TRACE has the same order: it does not sense what it
// is about to deposit.
//
// Chance is a hash of seed, robot, step and use, and nothing depends on the order in which threads
// do their slices: a run has the same Hash() for any number of threads.
//
// One thread owns a world and calls its functions; the world has threads of its own. Errors name
// robot and field, and end the world: nothing but its arrays may be looked at afterwards.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client_fw/lab/coverage.h"
#include "client_fw/lab/disc_grid.h"
#include "client_fw/lab/group.h"
#include "client_fw/lab/path_errors.h"
#include "client_fw/lab/phases.h"
#include "client_fw/lab/robots.h"
#include "client_fw/lab/sites.h"
#include "client_fw/lab/walls.h"
#include "client_fw/lab/worker_pool.h"
#include "server/base/result.h"
#include "server/core/field/field.h"

namespace pheromone::lab {

struct WorldConfig {
  field::FieldConfig field;
  uint16_t pose_unit_10um = 100;
  int64_t step_ms = 200;  ///< between two answers to a robot; 1 to 60 000
  uint64_t seed = 1;
  int threads = 1;  ///< of no influence on what happens
  std::vector<RobotGroup> groups;
  std::vector<SiteConfig> sites;
  std::optional<RadioModel> radio;       ///< none: each robot is answered in each step, at once
  int64_t coverage_cell_um = 1'000'000;  ///< at least a cell of the map
  /// From then on answers, stops and distances from paths are counted.
  int64_t measure_from_ms = 0;
};

/// What happened since the start.
struct WorldTally {
  Moves moves;
  Heard heard;
  PathErrors path_errors;
  uint64_t deposited_quanta = 0;
  uint64_t refused_deposits = 0;  ///< off the map, or where an obstacle is
};

class World {
 public:
  /// Errors: a start off the map, in an obstacle or overlapping another one, a pheromone that does
  /// not exist, a number out of its range.
  static Result<std::unique_ptr<World>> Create(WorldConfig config);

  /// Sense, then Act.
  Status Step();
  /// Phases 1 and 2. The actions of groups with a behaviour are then decided; those of the others
  /// are what they were, and whoever owns the world may write them now.
  Status Sense();
  /// The rest of the step. Wrong actions of groups without a behaviour are found first: then
  /// nothing has happened, and others may be tried.
  Status Act();

  const StepTime& time() const { return time_; }
  const Robots& robots() const { return robots_; }
  /// What a behaviour begins with: stand, deposit nothing, keep the load, sense everything.
  void ResetActions(const Slice& slice);
  /// For the actions of groups without a behaviour.
  Robots& mutable_robots() { return robots_; }
  std::span<const RobotGroup> groups() const { return config_.groups; }
  /// That the robots sense and lay trails on.
  const field::Field& field() const;
  Sites& sites() { return sites_; }
  const Sites& sites() const { return sites_; }
  const Coverage& coverage() const { return coverage_; }
  const WorldTally& tally() const { return tally_; }
  int64_t measure_from_ms() const { return config_.measure_from_ms; }

  /// Replaces the obstacles from now on. Errors: their mask is not of the map's size.
  Status ReplaceObstacles(field::Shared<field::ObstacleMask> obstacles);
  /// From now on the robot brakes, and then stands.
  void Fail(size_t robot) { robots_.failed[robot] = 1; }

  /// Of the robots, the field, the sites, the number of steps, and what behaviours have besides.
  uint64_t Hash() const;

  /// One phase for all robots in this thread, for benchmarks: a step is all of them in this order.
  enum class Phase { kSense, kBehave, kLoads, kDeposit, kAdvance, kRoll, kGrid, kCollide, kCommit };
  static constexpr Phase kPhases[] = {Phase::kSense,   Phase::kBehave,  Phase::kLoads,
                                      Phase::kDeposit, Phase::kAdvance, Phase::kRoll,
                                      Phase::kGrid,    Phase::kCollide, Phase::kCommit};
  Status Run(Phase phase);

 private:
  explicit World(WorldConfig config);

  Status Place();
  void SenseSlice(const Slice& slice);
  Status Behave(const Slice& slice);
  PheromoneView ViewOf(const Slice& slice) const;
  PheromoneActions Actions();
  Status CheckActions(const Slice& slice) const;
  Status Deposit();
  Status EndBehaviours();
  Error MapFull() const;
  void BuildGrid() { grid_.Build(robots_.x_m, robots_.y_m); }
  void RollSlice(size_t slice) { ways_m_[slice] = Roll(time_, slices_[slice], &robots_); }
  Surroundings Around() const;
  void Discharge(double range_m, size_t robot);
  void CommitSlice(const Slice& slice);
  bool Measures() const { return static_cast<int64_t>(time_.now_ms()) >= config_.measure_from_ms; }
  void EndStep() { ++time_.step; }

  WorldConfig config_;
  StepTime time_;
  Robots robots_;
  std::vector<Slice> slices_;
  std::unique_ptr<field::Field> field_;
  Walls walls_;
  DiscGrid grid_;
  std::unique_ptr<Radio> radio_;  // if there is one
  double most_radius_m_;
  std::vector<double> ways_m_;  // a slice: the longest way in this step
  Sites sites_;
  Coverage coverage_;
  PathWatch paths_;
  std::vector<Behaviour*> behaviours_;  // of the groups, each once
  WorkerPool pool_;
  WorldTally tally_;
  std::mutex mutex_;  // of what slices add to
};

}  // namespace pheromone::lab
