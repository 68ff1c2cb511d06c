#include "server/field/field.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>
#include <utility>

#include "server/base/hash.h"

namespace pheromone::field {
namespace {

__extension__ using Int128 = __int128;

template <size_t... kIndex>
std::array<CellMap, kTypes> MakeLayers(TileBudget* budget, std::index_sequence<kIndex...>) {
  return {((void)kIndex, CellMap(budget))...};
}

// P = 4096 * Q * sum / 65 536 for Q in millionths, rounded to nearest.
int64_t ToIntensity(const PheromoneLaw& law, int64_t sum) {
  constexpr int64_t kDivisor = 16 * int64_t{1'000'000};
  const Int128 scaled = static_cast<Int128>(law.quantum_micro) * sum;
  return static_cast<int64_t>((scaled + kDivisor / 2) / kDivisor);
}

int64_t SquaredDistance(PointUm a, PointUm b) {
  return (a.x - b.x) * (a.x - b.x) + (a.y - b.y) * (a.y - b.y);
}

bool SameSubstance(const PheromoneLaw& a, const PheromoneLaw& b) {
  return a.tau_ms == b.tau_ms && a.quantum_micro == b.quantum_micro && a.max_count == b.max_count;
}

const PheromoneLaw* FindIn(const FieldConfig& config, uint8_t type) {
  for (const PheromoneLaw& law : config.pheromones) {
    if (law.type == type) {
      return &law;
    }
  }
  return nullptr;
}

bool Contains(const std::vector<Path>& paths, const Path& path) {
  return std::find(paths.begin(), paths.end(), path) != paths.end();
}

// The nodes of the paths of `type` that `wanted(path)` picks.
template <typename Wanted>
std::set<NodeIndex> NodesOfPaths(const FieldConfig& config, uint8_t type, Wanted&& wanted) {
  std::set<NodeIndex> nodes;
  for (const Path& path : config.paths) {
    if (path.type == type && wanted(path)) {
      const std::vector<NodeIndex> line = NodesAlong(config.map, path);
      nodes.insert(line.begin(), line.end());
    }
  }
  return nodes;
}

}  // namespace

size_t TileLimit(const FieldConfig& config) {
  return static_cast<size_t>(config.memory_bytes / CellMap::kTileBytes);
}

size_t TilesOfPaths(const FieldConfig& config, const std::function<bool(const Path&)>& wanted) {
  std::set<std::tuple<uint8_t, int32_t, int32_t>> tiles;
  for (const Path& path : config.paths) {
    if (wanted(path)) {
      for (const NodeIndex node : NodesAlong(config.map, path)) {
        tiles.emplace(path.type, node.column / CellMap::kTileSide, node.row / CellMap::kTileSide);
      }
    }
  }
  return tiles.size();
}

Antennas AntennasOf(const PoseUm& pose, DirectionQ14 heading, int64_t distance_um) {
  constexpr int64_t kTwoQ14 = int64_t{2} << 14;
  const PointUm offset{RoundDiv(-distance_um * heading.sin, kTwoQ14),
                       RoundDiv(distance_um * heading.cos, kTwoQ14)};
  const PointUm p = pose.position;
  return {{p.x + offset.x, p.y + offset.y}, {p.x - offset.x, p.y - offset.y}};
}

uint32_t SpreadQ16(const PheromoneLaw& law, int64_t distance_squared_um2) {
  const int64_t reach = law.reach_um();
  if (distance_squared_um2 > reach * reach) {
    return 0;
  }
  if (distance_squared_um2 <= law.core_um * law.core_um) {
    return 65536;
  }
  // IEEE double, each operation rounded once, no contraction: the same bits everywhere.
  const double distance = std::sqrt(static_cast<double>(distance_squared_um2));
  const double slope = 65536.0 / static_cast<double>(law.sigma_um);
  const double mu = std::floor((static_cast<double>(reach) - distance) * slope + 0.5);
  return static_cast<uint32_t>(std::clamp(mu, 0.0, 65536.0));
}

Field::Field(FieldConfig config)
    : config_(std::move(config)),
      layers_(MakeLayers(&budget_, std::make_index_sequence<kTypes>())) {
  budget_.limit = TileLimit(config_);
  for (const Path& path : config_.paths) {
    LayPath(path, 0);
  }
}

const PheromoneLaw* Field::FindLaw(uint8_t type) const {
  return FindIn(config_, type);
}

std::optional<Intensities> Field::Sense(uint8_t type, const PoseUm& pose, uint64_t now_ms,
                                        SenseError* error) const {
  const auto refuse = [error](SenseError reason) {
    if (error != nullptr) {
      *error = reason;
    }
    return std::nullopt;
  };
  const PheromoneLaw* law = FindLaw(type);
  if (law == nullptr) {
    return refuse(SenseError::kUnknownPheromone);
  }
  if (!config_.map.Contains(pose.position)) {
    return refuse(SenseError::kOffTheMap);
  }
  const DirectionQ14 heading = DirectionOf(pose.heading);
  const Antennas antennas = AntennasOf(pose, heading, config_.antenna_distance_um);

  // Only nodes in reach of an antenna can count: the rectangle around both.
  const int64_t reach = law->reach_um();
  const MapGeometry& map = config_.map;
  const auto nodes_in_reach = [&](int64_t a, int64_t b, int64_t origin, int32_t count) {
    const int64_t low = -FloorDiv(-(std::min(a, b) - reach - origin), map.cell_um);
    const int64_t high = FloorDiv(std::max(a, b) + reach - origin, map.cell_um);
    return std::pair{static_cast<int32_t>(std::max<int64_t>(low, 0)),
                     static_cast<int32_t>(std::min<int64_t>(high, count - 1))};
  };
  const auto [left, right] =
      nodes_in_reach(antennas.left.x, antennas.right.x, map.origin.x, map.columns());
  const auto [bottom, top] =
      nodes_in_reach(antennas.left.y, antennas.right.y, map.origin.y, map.rows());
  if (left > right || bottom > top) {
    return Intensities{};
  }

  int64_t sum_left = 0;
  int64_t sum_right = 0;
  layers_[type].ForEachIn({left, bottom}, {right, top}, [&](NodeIndex node, NodeState state) {
    const PointUm at = map.PositionOf(node);
    if (law->directional &&
        (at.x - pose.position.x) * heading.cos + (at.y - pose.position.y) * heading.sin < 0) {
      return;  // behind the axle line: invisible (fig. 7)
    }
    const int64_t count = CountAt(*law, state, now_ms);
    if (count != 0) {
      sum_left += count * SpreadQ16(*law, SquaredDistance(at, antennas.left));
      sum_right += count * SpreadQ16(*law, SquaredDistance(at, antennas.right));
    }
  });
  return Intensities{ToIntensity(*law, sum_left), ToIntensity(*law, sum_right)};
}

DepositResult Field::Deposit(uint8_t type, PointUm point, uint16_t quanta, uint64_t now_ms) {
  const PheromoneLaw* law = FindLaw(type);
  if (law == nullptr) {
    return DepositResult::kUnknownPheromone;
  }
  if (!config_.map.Contains(point)) {
    return DepositResult::kOffTheMap;
  }
  const NodeIndex node = config_.map.NearestNode(point);
  const NodeState next = AfterDeposit(*law, layers_[type].Read(node), quanta, now_ms);
  return Store(*law, node, next, now_ms) ? DepositResult::kDone : DepositResult::kMapFull;
}

uint64_t Field::NodeHash(const PheromoneLaw& law, NodeIndex node, NodeState state) {
  return Hash64({'N', law.type, static_cast<uint64_t>(node.column), static_cast<uint64_t>(node.row),
                 state.count, law.tau_ms == 0 ? 0 : state.time_ms});
}

// Every change of a node goes through here, so that the hash cannot miss one. When memory is
// exhausted, what has evaporated is given back first.
bool Field::Store(const PheromoneLaw& law, NodeIndex node, NodeState state, uint64_t now_ms) {
  CellMap& layer = layers_[law.type];
  const NodeState before = layer.Read(node);
  if (!layer.Write(node, state)) {
    SweepAll(now_ms);
    if (!layer.Write(node, state)) {
      return false;
    }
  }
  if (before.count != 0) {
    hash_ -= NodeHash(law, node, before);
  }
  if (state.count != 0) {
    hash_ += NodeHash(law, node, state);
    const auto tau_ms = static_cast<uint64_t>(law.tau_ms);
    if (tau_ms != 0) {
      next_sweep_ms_ = std::min(next_sweep_ms_, state.time_ms + state.count * tau_ms);
    }
  }
  return true;
}

// A map full of what has not evaporated must not be searched again for every deposit that it
// refuses: each sweep finds out when the next one can give back anything, and Store keeps that up
// to date.
void Field::SweepAll(uint64_t now_ms) {
  if (now_ms < next_sweep_ms_) {
    return;
  }
  next_sweep_ms_ = UINT64_MAX;
  for (const PheromoneLaw& law : config_.pheromones) {
    if (law.tau_ms == 0) {
      continue;
    }
    std::vector<std::pair<NodeIndex, NodeState>> dead;
    layers_[law.type].ForEach([&](NodeIndex node, NodeState state) {
      const uint64_t dies_ms = state.time_ms + state.count * static_cast<uint64_t>(law.tau_ms);
      if (dies_ms <= now_ms) {
        dead.emplace_back(node, state);
      } else {
        next_sweep_ms_ = std::min(next_sweep_ms_, dies_ms);
      }
    });
    for (const auto& [node, state] : dead) {
      hash_ -= NodeHash(law, node, state);
      layers_[law.type].Write(node, {});
    }
  }
}

void Field::LayPath(const Path& path, uint64_t now_ms) {
  const PheromoneLaw* law = FindLaw(path.type);
  if (law == nullptr) {
    return;
  }
  const uint16_t count = std::min(path.count, law->max_count);
  for (const NodeIndex node : NodesAlong(config_.map, path)) {
    if (CountAt(*law, layers_[law->type].Read(node), now_ms) < count) {
      Store(*law, node, {count, now_ms}, now_ms);
    }
  }
}

Status Field::CheckReconfigure(const FieldConfig& next, uint64_t now_ms) const {
  if (!(next.map == config_.map)) {
    return Error{
        "the map's origin, extent or cell size differ from the running map's; they cannot "
        "be changed while pheromone lies on it"};
  }
  for (const PheromoneLaw& law : config_.pheromones) {
    if (FindIn(next, law.type) != nullptr) {
      continue;
    }
    const std::set<NodeIndex> laid =
        NodesOfPaths(config_, law.type, [](const Path&) { return true; });
    bool left_over = false;
    layers_[law.type].ForEach([&](NodeIndex node, NodeState state) {
      left_over |= CountAt(law, state, now_ms) != 0 && !laid.contains(node);
    });
    if (left_over) {
      return Error{"pheromone type " + std::to_string(law.type) + " (\"" + law.name +
                   "\") left the configuration, but some of it is on the map"};
    }
  }
  const size_t new_tiles =
      TilesOfPaths(next, [this](const Path& path) { return !Contains(config_.paths, path); });
  if (new_tiles != 0 && budget_.used + new_tiles > TileLimit(next)) {
    return Error{"there is no memory for the new paths beside what is on the map"};
  }
  return Ok();
}

void Field::Reconfigure(const FieldConfig& next, uint64_t now_ms) {
  // 1. Paths that left: erased, but for nodes that they share with a path that stays.
  for (const PheromoneLaw& law : config_.pheromones) {
    const std::set<NodeIndex> kept = NodesOfPaths(
        config_, law.type, [&](const Path& path) { return Contains(next.paths, path); });
    const std::set<NodeIndex> gone = NodesOfPaths(
        config_, law.type, [&](const Path& path) { return !Contains(next.paths, path); });
    for (const NodeIndex node : gone) {
      if (!kept.contains(node)) {
        Store(law, node, {}, now_ms);
      }
    }
  }
  // 2. Laws: present values go on under the new law.
  for (const PheromoneLaw& law : config_.pheromones) {
    const PheromoneLaw* successor = FindIn(next, law.type);
    PheromoneLaw nothing;
    nothing.type = law.type;
    nothing.max_count = 0;
    if (successor == nullptr || !SameSubstance(law, *successor)) {
      Rebase(law, successor != nullptr ? *successor : nothing, now_ms);
    }
  }
  next_sweep_ms_ = 0;
  const std::vector<Path> before = std::exchange(config_, next).paths;
  budget_.limit = TileLimit(config_);
  // 3. New paths.
  for (const Path& path : config_.paths) {
    if (!Contains(before, path)) {
      LayPath(path, now_ms);
    }
  }
}

// Expresses the present values under `from` as counts under `to`, at the nearest whole quantum.
void Field::Rebase(const PheromoneLaw& from, const PheromoneLaw& to, uint64_t now_ms) {
  CellMap& layer = layers_[from.type];
  std::vector<std::pair<NodeIndex, NodeState>> nodes;
  layer.ForEach([&](NodeIndex node, NodeState state) { nodes.emplace_back(node, state); });
  for (const auto& [node, state] : nodes) {
    const int64_t value_micro = CountAt(from, state, now_ms) * from.quantum_micro;
    const int64_t count = std::min<int64_t>(RoundDiv(value_micro, to.quantum_micro), to.max_count);
    const NodeState next{static_cast<uint16_t>(count), now_ms};
    layer.Write(node, next);
    hash_ -= NodeHash(from, node, state);
    hash_ += next.count != 0 ? NodeHash(to, node, next) : 0;
  }
}

size_t Field::node_count() const {
  size_t count = 0;
  for (const CellMap& layer : layers_) {
    count += layer.node_count();
  }
  return count;
}

}  // namespace pheromone::field
