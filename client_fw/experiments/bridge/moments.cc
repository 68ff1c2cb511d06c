#include "client_fw/experiments/bridge/moments.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <numbers>
#include <utility>

namespace pheromone::swarm {
namespace {

void AddMoment(const BridgeMoment& moment, std::string* csv) {
  BridgeSimulation simulation(moment.experiment, moment.seed);
  simulation.RunTo(moment.time_ms);
  const auto add = [&](const char* what, size_t number, double x_m, double y_m,
                       const std::string& value = {}) {
    fmt::format_to(std::back_inserter(*csv), "{},{:g},{},{},{},{:.3f},{:.3f},{}\n", moment.seed,
                   static_cast<double>(moment.time_ms) / 1000, NameOf(moment.outcome), what, number,
                   x_m, y_m, value);
  };
  const BridgeArena& arena = simulation.arena();
  for (const auto corridor : {BridgeArena::kNestStem, BridgeArena::kShortBranch,
                              BridgeArena::kLongBranch, BridgeArena::kFoodStem}) {
    for (const Lane::Point& point : arena.lane(corridor, true).points()) {
      add("corridor", static_cast<size_t>(corridor), point.x_m, point.y_m);
    }
  }
  const Lane::Point nest = arena.lane(BridgeArena::kNestStem, true).points().front();
  const Lane::Point food = arena.lane(BridgeArena::kFoodStem, false).points().front();
  add("nest", 0, nest.x_m, nest.y_m);
  add("food", 0, food.x_m, food.y_m);
  const field::FieldConfig field = EngineConfigOf(moment.experiment).field;
  const field::PheromoneLaw& law = field.pheromones.front();
  std::vector<std::pair<field::NodeIndex, double>> nodes;
  simulation.service().Inspect([&](const engine::Engine& engine) {
    engine.field().VisitLevels(law.type, static_cast<uint64_t>(moment.time_ms),
                               [&](field::NodeIndex node, uint32_t level) {
                                 nodes.emplace_back(node,
                                                    static_cast<double>(level) / law.max_level());
                               });
  });
  std::sort(nodes.begin(), nodes.end());
  for (const auto& [node, share] : nodes) {
    const field::PointUm at = field.map.PositionOf(node);
    add("node", 0, static_cast<double>(at.x) / 1e6, static_cast<double>(at.y) / 1e6,
        fmt::format("{:.3f}", share));
  }
  for (size_t i = 0; i < simulation.robots().size(); ++i) {
    if (simulation.released(i)) {
      const sim::PlanePose& pose = simulation.robots()[i].pose();
      add("robot", i + 1, pose.x_m, pose.y_m,
          fmt::format("{:.1f}", pose.heading_rad * 180 / std::numbers::pi));
    }
  }
}

}  // namespace

std::string MomentsToCsv(const std::vector<BridgeMoment>& moments) {
  std::string csv = "seed,time_s,outcome,what,number,x_m,y_m,value\n";
  for (const BridgeMoment& moment : moments) {
    AddMoment(moment, &csv);
  }
  return csv;
}

}  // namespace pheromone::swarm
