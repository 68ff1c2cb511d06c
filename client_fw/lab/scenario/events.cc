#include "client_fw/lab/scenario/events.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>

#include "client_fw/lab/chance.h"
#include "server/core/field/route.h"

namespace pheromone::lab {

ScenarioEvents::ScenarioEvents(const LabScenario& scenario, World* world)
    : scenario_(scenario), world_(world), gates_(scenario.gates) {
  SetLeastWays();
}

Status ScenarioEvents::MakeDue() {
  const auto now_ms = static_cast<int64_t>(world_->time().now_ms());
  bool moved = false;
  for (; next_ < scenario_.events.size() && scenario_.events[next_].at_ms <= now_ms; ++next_) {
    const LabEvent& event = scenario_.events[next_];
    PHEROMONE_TRY_STATUS(Make(event));
    moved |= event.kind == LabEvent::Kind::kGate || event.kind == LabEvent::Kind::kMoveSite;
  }
  if (moved) {
    SetLeastWays();
  }
  return Ok();
}

Status ScenarioEvents::Make(const LabEvent& event) {
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
void ScenarioEvents::FailSome(const LabEvent& event) {
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

void ScenarioEvents::SetLeastWays() {
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
double ScenarioEvents::LeastWayM(const PheromoneSite& from, const PheromoneSite& to) const {
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

}  // namespace pheromone::lab
