#include "client_fw/lab/scenario/run.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>

#include "client_fw/lab/scenario/events.h"

namespace pheromone::lab {

LabResult ResultOf(const World& world) {
  const uint64_t steps = world.time().step;
  return LabResult{
      false,
      world.robots().count,
      static_cast<int64_t>(world.time().step_ms),
      steps,
      world.Hash(),
      std::max<int64_t>(static_cast<int64_t>(world.time().now_ms()) - world.measure_from_ms(), 0),
      world.tally(),
      world.sites().trips(),
      world.coverage().At(steps)};
}

Result<LabResult> RunLab(const LabScenario& scenario, int threads,
                         const std::function<Status(const World&)>& look,
                         std::shared_ptr<Server> server) {
  PHEROMONE_TRY(const std::unique_ptr<World> world,
                MakeWorld(scenario, threads, std::move(server)));
  ScenarioEvents events(scenario, world.get());
  if (look) {
    PHEROMONE_TRY_STATUS(look(*world));
  }
  while (static_cast<int64_t>(world->time().now_ms()) < scenario.duration_ms) {
    PHEROMONE_TRY_STATUS(events.MakeDue());
    PHEROMONE_TRY_STATUS(world->Step());
    if (look) {
      PHEROMONE_TRY_STATUS(look(*world));
    }
  }
  return ResultOf(*world);
}

std::vector<Measure> MeasuresOf(const LabResult& result) {
  const double step_s = static_cast<double>(result.step_ms) / 1000;
  const double robot_steps = static_cast<double>(result.robots) * static_cast<double>(result.steps);
  const double robot_hours = robot_steps * step_s / 3600;
  const auto share = [](auto of, auto all) {
    return all == 0 ? 0.0 : static_cast<double>(of) / static_cast<double>(all);
  };
  const auto in_world = [&](auto value) {
    return result.on_air ? std::nullopt : std::optional(static_cast<double>(value));
  };
  const WorldTally& tally = result.tally;
  const Moves& moves = tally.moves;
  const Trips& trips = result.trips;
  return {
      {"robots", static_cast<double>(result.robots)},
      {"time_s", static_cast<double>(result.steps * static_cast<uint64_t>(result.step_ms)) / 1000},
      {"deliveries", in_world(trips.delivered)},
      {"deliveries_per_robot_hour", in_world(share(trips.delivered, robot_hours))},
      {"delivered_quality", in_world(trips.quality)},
      {"lost_loads", in_world(trips.lost)},
      {"trip_s", in_world(share(trips.duration_ms, trips.delivered) / 1000)},
      {"path_efficiency", in_world(share(trips.least_way_m, trips.way_m))},
      {"robot_contacts_per_robot_hour", in_world(share(moves.robot_contacts, robot_hours))},
      {"wall_contacts_per_robot_hour", in_world(share(moves.wall_contacts, robot_hours))},
      {"standing_share", in_world(share(moves.standing, robot_steps))},
      {"covered_share", in_world(result.coverage.covered)},
      {"idle_mean_s", in_world(result.coverage.mean_idle_steps * step_s)},
      {"idle_most_s", in_world(static_cast<double>(result.coverage.most_idle_steps) * step_s)},
      {"deposited_quanta", in_world(tally.deposited_quanta)},
      {"refused_deposits", in_world(tally.refused_deposits)},
      {"answers_per_s", 1000 * share(tally.heard.answers, result.measured_ms)},
      {"fail_safe_stops", static_cast<double>(tally.heard.fail_safe_stops)},
      {"path_error_mm", tally.path_errors.samples == 0
                            ? std::nullopt
                            : std::optional(1000 * tally.path_errors.mean_m())},
  };
}

}  // namespace pheromone::lab
