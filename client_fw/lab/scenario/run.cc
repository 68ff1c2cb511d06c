#include "client_fw/lab/scenario/run.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "client_fw/lab/chance.h"
#include "server/core/field/route.h"

namespace pheromone::lab {
namespace {

class LabRun {
 public:
  LabRun(const LabScenario& scenario, World* world)
      : scenario_(scenario), world_(world), gates_(scenario.gates) {
    SetLeastWays();
  }

  // Those that are due.
  Status MakeEvents() {
    const auto now_ms = static_cast<int64_t>(world_->time().now_ms());
    bool moved = false;
    for (; next_ < scenario_.events.size() && scenario_.events[next_].at_ms <= now_ms; ++next_) {
      PHEROMONE_TRY_STATUS(Make(scenario_.events[next_]));
      moved = true;
    }
    if (moved) {
      SetLeastWays();
    }
    return Ok();
  }

 private:
  Status Make(const LabEvent& event) {
    switch (event.kind) {
      case LabEvent::Kind::kGate:
        gates_[event.which].open = event.open;
        return world_->ReplaceObstacles(ObstaclesOf(scenario_, gates_));
      case LabEvent::Kind::kMoveSite:
        world_->sites().Move(event.which, static_cast<double>(event.to.x) / 1e6,
                             static_cast<double>(event.to.y) / 1e6);
        break;
      case LabEvent::Kind::kSetAmount:
        world_->sites().SetAmount(event.which, event.amount);
        break;
      case LabEvent::Kind::kFail:
        FailSome(event);
        break;
    }
    return Ok();
  }

  // Each robot of the group with this probability.
  void FailSome(const LabEvent& event) {
    size_t robot = 0;
    for (size_t group = 0; group < event.which; ++group) {
      robot += world_->groups()[group].starts.size();
    }
    const size_t end = robot + world_->groups()[event.which].starts.size();
    const StepTime& time = world_->time();
    for (; robot < end; ++robot) {
      if (PheromoneUniform(time.seed, robot, time.step, kFailure) < event.amount) {
        world_->Fail(robot);
      }
    }
  }

  void SetLeastWays() {
    const std::span<const PheromoneSite> sites = world_->sites().all();
    for (size_t food = 0; food < sites.size(); ++food) {
      for (size_t nest = 0; nest < sites.size(); ++nest) {
        if (sites[food].is_food != 0 && sites[nest].is_food == 0) {
          world_->sites().SetLeastWay(food, nest, LeastWayM(sites[food], sites[nest]));
        }
      }
    }
  }

  // From rim to rim, around the walls; the straight line if there is no other way.
  double LeastWayM(const PheromoneSite& from, const PheromoneSite& to) const {
    const field::FieldConfig& field = world_->field().config();
    const auto point = [](const PheromoneSite& site) {
      return field::PointUm{std::llround(site.x_m * 1e6), std::llround(site.y_m * 1e6)};
    };
    double way_m = std::hypot(from.x_m - to.x_m, from.y_m - to.y_m);
    double radius_m = 0;
    for (const RobotGroup& group : world_->groups()) {
      radius_m = std::max(radius_m, group.radius_m);
    }
    const auto route = field::FindRoute(field.map, field.obstacles, point(from), point(to),
                                        std::llround(radius_m * 1e6));
    if (route.ok()) {
      way_m = 0;
      for (size_t i = 1; i < route.value().size(); ++i) {
        const field::PointUm& a = route.value()[i - 1];
        const field::PointUm& b = route.value()[i];
        way_m += std::hypot(static_cast<double>(a.x - b.x), static_cast<double>(a.y - b.y)) / 1e6;
      }
    }
    return std::max(0.0, way_m - from.radius_m - to.radius_m);
  }

  const LabScenario& scenario_;
  World* world_;
  std::vector<Gate> gates_;
  size_t next_ = 0;
};

}  // namespace

Result<LabResult> RunLab(const LabScenario& scenario, int threads,
                         const std::function<void(int64_t ms)>& progress) {
  PHEROMONE_TRY(const std::unique_ptr<World> world, MakeWorld(scenario, threads));
  LabRun run(scenario, world.get());
  while (static_cast<int64_t>(world->time().now_ms()) < scenario.duration_ms) {
    PHEROMONE_TRY_STATUS(run.MakeEvents());
    PHEROMONE_TRY_STATUS(world->Step());
    if (progress) {
      progress(static_cast<int64_t>(world->time().now_ms()));
    }
  }
  const uint64_t steps = world->time().step;
  return LabResult{
      world->robots().count,  scenario.world.step_ms,     steps, world->Hash(), world->tally(),
      world->sites().trips(), world->coverage().At(steps)};
}

std::vector<std::pair<std::string, double>> MeasuresOf(const LabResult& result) {
  const double step_s = static_cast<double>(result.step_ms) / 1000;
  const double robot_steps = static_cast<double>(result.robots) * static_cast<double>(result.steps);
  const double robot_hours = robot_steps * step_s / 3600;
  const auto share = [](auto of, auto all) {
    return all == 0 ? 0.0 : static_cast<double>(of) / static_cast<double>(all);
  };
  const Moves& moves = result.tally.moves;
  const Trips& trips = result.trips;
  return {{"robots", static_cast<double>(result.robots)},
          {"time_s", static_cast<double>(result.steps) * step_s},
          {"deliveries", static_cast<double>(trips.delivered)},
          {"deliveries_per_robot_hour", share(trips.delivered, robot_hours)},
          {"delivered_quality", trips.quality},
          {"lost_loads", static_cast<double>(trips.lost)},
          {"trip_s", share(trips.duration_ms, trips.delivered) / 1000},
          {"path_efficiency", share(trips.least_way_m, trips.way_m)},
          {"robot_contacts_per_robot_hour", share(moves.robot_contacts, robot_hours)},
          {"wall_contacts_per_robot_hour", share(moves.wall_contacts, robot_hours)},
          {"standing_share", share(moves.standing, robot_steps)},
          {"covered_share", result.coverage.covered},
          {"idle_mean_s", result.coverage.mean_idle_steps * step_s},
          {"idle_most_s", static_cast<double>(result.coverage.most_idle_steps) * step_s},
          {"deposited_quanta", static_cast<double>(result.tally.deposited_quanta)},
          {"refused_deposits", static_cast<double>(result.tally.refused_deposits)}};
}

}  // namespace pheromone::lab
