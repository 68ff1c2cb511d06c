#include "server/engine/config_check.h"

#include <algorithm>
#include <set>
#include <string>

#include "server/field/diffusion.h"

namespace pheromone::engine {
namespace {

// As the reader of configuration files has them; pheromoned.toml(5) gives them to people.
constexpr int64_t kMostUm = 1'000'000'000'000;
constexpr int64_t kMostCells = 30'000;
constexpr int64_t kMostBiasUm = 65'000'000;
constexpr int64_t kMostForwardUm = 32'000'000;
constexpr int64_t kMostReachUm = 50'000'000;
constexpr int64_t kMostReachCells = 1'000;
constexpr int64_t kMostWeightMilli = 1'000'000;
constexpr uint32_t kMostStepMs = 60'000;
constexpr uint16_t kMostDiffusingCount = field::DiffusionLayer::kMostContent >> 16;

bool IsWithin(int64_t value, int64_t least, int64_t most) {
  return value >= least && value <= most;
}

bool IsGood(const field::MapGeometry& map) {
  return IsWithin(map.origin.x, -kMostUm, kMostUm) && IsWithin(map.origin.y, -kMostUm, kMostUm) &&
         IsWithin(map.width_um, 1, kMostUm) && IsWithin(map.height_um, 1, kMostUm) &&
         IsWithin(map.cell_um, 1, std::min(map.width_um, map.height_um)) &&
         std::max(map.width_um, map.height_um) / map.cell_um <= kMostCells;
}

bool IsGood(const field::DiffusionLaw& law, const field::PheromoneLaw& of) {
  return law.exchange_q16 <= field::DiffusionLayer::kMostExchangeQ16 &&
         law.cutoff_q16 <= (1u << 16) && IsWithin(law.step_ms, 1, kMostStepMs) &&
         (!of.diffuses() || of.max_count <= kMostDiffusingCount);
}

bool IsGood(const field::PheromoneLaw& law) {
  return law.profile <= field::Profile::kGaussian &&
         law.evaporation <= field::Evaporation::kExponential &&
         IsWithin(law.core_um, 0, kMostReachUm) && IsWithin(law.sigma_um, 1, kMostReachUm) &&
         IsWithin(law.cutoff_um, 0, kMostReachUm) && law.reach_um() <= kMostReachUm &&
         IsWithin(law.tau_ms, 0, field::kMaxTauMs) &&
         IsWithin(law.quantum_micro, 1, field::kMaxQuantumMicro) && law.max_count >= 1 &&
         IsWithin(law.weight_milli, -kMostWeightMilli, kMostWeightMilli) &&
         IsGood(law.diffusion, law);
}

bool IsGoodBlend(const field::PheromoneLaw& blend, const field::FieldConfig& config) {
  std::set<uint8_t> types;
  return std::all_of(blend.blend.begin(), blend.blend.end(), [&](const field::BlendPart& part) {
    const field::PheromoneLaw* law = config.FindLaw(part.type);
    return law != nullptr && !law->is_blend() && types.insert(part.type).second &&
           IsWithin(part.weight_milli, -kMostWeightMilli, kMostWeightMilli);
  });
}

Status CheckPheromones(const field::FieldConfig& config) {
  std::set<uint8_t> types;
  for (const field::PheromoneLaw& law : config.pheromones) {
    const std::string who = "pheromone type " + std::to_string(law.type) + " ";
    if (!IsWithin(law.type, 1, field::kTypes - 1) || !types.insert(law.type).second) {
      return Error{who + "is there twice or is none: types are 1 to 15"};
    }
    // A blend's own numbers mean nothing, but they are computed with.
    if (!IsGood(law) || !IsGoodBlend(law, config)) {
      return Error{who + "has a law that no configuration file can have"};
    }
    const field::AntennaGeometry& antennas = config.antennas;
    const int64_t reach_um =
        law.reach_um() + antennas.distance_um / 2 + std::abs(antennas.forward_um);
    if (reach_um / config.map.cell_um > kMostReachCells) {
      return Error{who + "reaches further than " + std::to_string(kMostReachCells) + " cells"};
    }
  }
  return Ok();
}

Status CheckLaid(const field::FieldConfig& config) {
  const field::MapGeometry& map = config.map;
  for (const field::Path& path : config.paths) {
    const bool on_map = std::all_of(path.points.begin(), path.points.end(),
                                    [&map](field::PointUm point) { return map.Contains(point); });
    if (path.points.empty() || !on_map || path.type < 1 || path.type >= field::kTypes) {
      return Error{"a path that is empty, not on the map, or of no type"};
    }
  }
  for (const field::Print& print : config.prints) {
    const auto is_on_map = [&map](const field::PrintNode& it) {
      return IsWithin(it.node.column, 0, map.columns() - 1) &&
             IsWithin(it.node.row, 0, map.rows() - 1);
    };
    if (print.type < 1 || print.type >= field::kTypes ||
        (print.nodes && !std::all_of(print.nodes->begin(), print.nodes->end(), is_on_map))) {
      return Error{"a print that is not on the map, or of no type"};
    }
  }
  if (config.obstacles &&
      (config.obstacles->columns() != map.columns() || config.obstacles->rows() != map.rows())) {
    return Error{"obstacles for a map of another size"};
  }
  return Ok();
}

}  // namespace

Status CheckGeometry(const field::FieldConfig& config) {
  if (!IsGood(config.map)) {
    return Error{"a map that no configuration file can have"};
  }
  if (!IsWithin(config.antennas.distance_um, 0, kMostBiasUm) ||
      !IsWithin(config.antennas.forward_um, -kMostForwardUm, kMostForwardUm)) {
    return Error{"antennas that no configuration file can have"};
  }
  return Ok();
}

Status CheckValues(const EngineConfig& config) {
  Status geometry = CheckGeometry(config.field);
  if (!geometry.ok()) {
    return geometry;
  }
  const field::FieldConfig& field = config.field;
  if (config.robots_per_link == 0 || config.pose_unit_10um == 0) {
    return Error{"no robots on a link, or a pose unit of nothing"};
  }
  for (const Status& status :
       {CheckPheromones(field), CheckLaid(field), CheckFrames(config.frames)}) {
    if (!status.ok()) {
      return status;
    }
  }
  return Ok();
}

}  // namespace pheromone::engine
