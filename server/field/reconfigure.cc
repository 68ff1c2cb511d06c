// How a field goes on under another configuration, and what lies on it from the beginning.

#include <algorithm>
#include <set>
#include <string>
#include <tuple>

#include "server/field/field.h"

namespace pheromone::field {
namespace {

bool SameSubstance(const PheromoneLaw& a, const PheromoneLaw& b) {
  return a.evaporation == b.evaporation && a.tau_ms == b.tau_ms &&
         a.quantum_micro == b.quantum_micro && a.max_count == b.max_count &&
         a.diffuses() == b.diffuses() && a.is_blend() == b.is_blend();
}

template <typename Laid>
bool Contains(const std::vector<Laid>& all, const Laid& one) {
  return std::find(all.begin(), all.end(), one) != all.end();
}

// Calls visit(type, node, level) for the nodes of the predefined paths and prints that are picked.
template <typename PickPath, typename PickPrint, typename Visit>
void ForEachLaid(const FieldConfig& config, PickPath&& pick_path, PickPrint&& pick_print,
                 Visit&& visit) {
  for (const Path& path : config.paths) {
    if (pick_path(path)) {
      const uint32_t level = uint32_t{path.count} << kLevelBits;
      for (const NodeIndex node : NodesAlong(config.map, path)) {
        visit(path.type, node, level);
      }
    }
  }
  for (const Print& print : config.prints) {
    if (print.nodes && pick_print(print)) {
      for (const PrintNode& it : *print.nodes) {
        visit(print.type, it.node, it.level);
      }
    }
  }
}

using LaidNode = std::pair<uint8_t, NodeIndex>;

// Of the paths and prints of `config` that are, or are not, in the other one too; in order.
std::vector<LaidNode> NodesThat(const FieldConfig& config, const FieldConfig& other,
                                bool are_in_other) {
  std::vector<LaidNode> nodes;
  ForEachLaid(
      config, [&](const Path& it) { return Contains(other.paths, it) == are_in_other; },
      [&](const Print& it) { return Contains(other.prints, it) == are_in_other; },
      [&](uint8_t type, NodeIndex node, uint32_t) { nodes.emplace_back(type, node); });
  std::sort(nodes.begin(), nodes.end());
  return nodes;
}

bool Contains(const std::vector<LaidNode>& sorted, uint8_t type, NodeIndex node) {
  return std::binary_search(sorted.begin(), sorted.end(), LaidNode{type, node});
}

}  // namespace

const PheromoneLaw* FieldConfig::FindLaw(uint8_t type) const {
  const auto found = std::find_if(pheromones.begin(), pheromones.end(),
                                  [type](const PheromoneLaw& law) { return law.type == type; });
  return found != pheromones.end() ? &*found : nullptr;
}

uint64_t BytesOfLaid(const FieldConfig& config, const std::function<bool(const Path&)>& wanted,
                     const std::function<bool(const Print&)>& wanted_print) {
  std::set<std::tuple<uint8_t, int32_t, int32_t>> tiles;
  std::set<std::tuple<uint8_t, int32_t, int32_t>> leaves;
  std::set<uint8_t> types;
  uint64_t leaf_bytes = 0;
  ForEachLaid(config, wanted, wanted_print, [&](uint8_t type, NodeIndex node, uint32_t) {
    const NodeIndex tile{node.column / kTileSide, node.row / kTileSide};
    types.insert(type);
    tiles.emplace(type, tile.column, tile.row);
    if (leaves.emplace(type, tile.column / kLeafSide, tile.row / kLeafSide).second) {
      const PheromoneLaw* law = config.FindLaw(type);
      const bool diffuses = law != nullptr && law->diffuses();
      leaf_bytes += diffuses ? DiffusionLayer::kLeafBytes : CellMap::kLeafBytes;
    }
  });
  return tiles.size() * CellMap::kTileBytes + leaf_bytes +
         types.size() * CellMap::TopBytes(config.map.columns(), config.map.rows());
}

// What is laid is the least that a node holds: more stays.
void Field::LayAll(const FieldConfig& config, const FieldConfig* except, uint64_t now_ms) {
  ForEachLaid(
      config, [&](const Path& it) { return except == nullptr || !Contains(except->paths, it); },
      [&](const Print& it) { return except == nullptr || !Contains(except->prints, it); },
      [&](uint8_t type, NodeIndex node, uint32_t level) {
        const PheromoneLaw* law = FindLaw(type);
        if (law == nullptr || law->is_blend() || IsBlocked(node)) {
          return;
        }
        const uint32_t wanted = std::min(level, law->max_level());
        if (LevelOf(type, node, now_ms) < wanted) {
          SetLevel(*law, node, wanted, now_ms);
        }
      });
}

// Paths and prints that left are erased, but for nodes that they share with one that stays.
void Field::EraseLaid(const FieldConfig& before, const FieldConfig& next, uint64_t now_ms) {
  const std::vector<LaidNode> gone = NodesThat(before, next, false);
  const std::vector<LaidNode> kept =
      gone.empty() ? std::vector<LaidNode>{} : NodesThat(before, next, true);
  for (const auto& [type, node] : gone) {
    const PheromoneLaw* law = FindLaw(type);
    if (law != nullptr && !Contains(kept, type, node)) {
      SetLevel(*law, node, 0, now_ms);
    }
  }
}

Status Field::CheckReconfigure(const FieldConfig& next, uint64_t now_ms) const {
  const FieldConfig& present = current().config;
  if (!(next.map == present.map)) {
    return Error{
        "the map's origin, extent or cell size differ from the running map's; they cannot "
        "be changed while pheromone lies on it"};
  }
  const std::vector<LaidNode> laid = NodesThat(present, present, true);
  for (const PheromoneLaw& law : present.pheromones) {
    const PheromoneLaw* successor = next.FindLaw(law.type);
    if (successor != nullptr && !successor->is_blend()) {
      continue;
    }
    bool left_over = false;
    VisitLevels(law.type, now_ms,
                [&](NodeIndex node, uint32_t) { left_over |= !Contains(laid, law.type, node); });
    if (left_over) {
      return Error{"pheromone type " + std::to_string(law.type) + " (\"" + law.name +
                   "\") left the configuration, but some of it is on the map"};
    }
  }
  const uint64_t new_bytes = BytesOfLaid(
      next, [&](const Path& it) { return !Contains(present.paths, it); },
      [&](const Print& it) { return !Contains(present.prints, it); });
  if (new_bytes != 0 && budget_.used_bytes + new_bytes > next.memory_bytes) {
    return Error{"there is no memory for the new paths beside what is on the map"};
  }
  return Ok();
}

void Field::Reconfigure(const FieldConfig& next, uint64_t now_ms) {
  const FieldConfig before = current().config;
  EraseLaid(before, next, now_ms);
  // Present values go on under the new laws, all of them: a limit that is lower than what is there,
  // or the directory of a type that begins to diffuse, must not cost any.
  budget_.limit_bytes = UINT64_MAX;
  for (const PheromoneLaw& law : before.pheromones) {
    const PheromoneLaw* successor = next.FindLaw(law.type);
    PheromoneLaw nothing;
    nothing.type = law.type;
    nothing.max_count = 0;
    if (successor == nullptr || successor->is_blend()) {
      Rebase(law, nothing, now_ms);
    } else if (!law.is_blend() && !SameSubstance(law, *successor)) {
      Rebase(law, *successor, now_ms);
    }
  }
  Publish(next);
  sweep_ = {.earliest_ms = 0, .cycle_ms = UINT64_MAX, .next_ms = now_ms};
  LayAll(current().config, &before, now_ms);  // which fits, as CheckReconfigure found
  budget_.limit_bytes = current().config.memory_bytes;
}

// Expresses the present values under `from` as levels under `to`, at the nearest level; whole
// quanta where that is what the law counts.
void Field::Rebase(const PheromoneLaw& from, const PheromoneLaw& to, uint64_t now_ms) {
  std::vector<std::pair<NodeIndex, uint32_t>> nodes;
  VisitLevels(from.type, now_ms,
              [&](NodeIndex node, uint32_t level) { nodes.emplace_back(node, level); });
  layers_.cells[from.type]->ForEach(
      [&](NodeIndex node, NodeState) { Store(from, node, {}, now_ms); });
  layers_.diffusing[from.type]->Clear();
  const bool whole = to.evaporation == Evaporation::kCounter && !to.diffuses();
  for (const auto& [node, level] : nodes) {
    const int64_t value = int64_t{level} * from.quantum_micro;
    const int64_t unit = whole ? int64_t{kLevelsPerQuantum} : 1;
    const int64_t next = RoundDiv(value, to.quantum_micro * unit) * unit;
    SetLevel(to, node, static_cast<uint32_t>(std::min<int64_t>(next, to.max_level())), now_ms);
  }
}

Status Field::Edit(const FieldEdit& edit, uint64_t now_ms) {
  const PheromoneLaw* law = FindLaw(edit.type);
  if (law == nullptr || law->is_blend()) {
    return Error{"type " + std::to_string(edit.type) +
                 (law == nullptr ? " is not configured" : " is a blend, which holds nothing")};
  }
  if (edit.action == FieldEdit::Action::kErase && edit.shape == FieldEdit::Shape::kAll) {
    layers_.cells[edit.type]->ForEach(
        [&](NodeIndex node, NodeState) { Store(*law, node, {}, now_ms); });
    layers_.diffusing[edit.type]->Clear();
    return Ok();
  }
  const Result<std::vector<NodeIndex>> nodes = NodesOf(edit, current().config.map);
  if (!nodes.ok()) {
    return Error{nodes.error()};
  }
  // Raw states, so that an edit that does not fit leaves no trace.
  CellMap& cells = *layers_.cells[law->type];
  DiffusionLayer& diffusing = *layers_.diffusing[law->type];
  std::vector<std::pair<NodeIndex, NodeState>> before;
  for (const NodeIndex node : nodes.value()) {
    if (edit.action != FieldEdit::Action::kErase && IsBlocked(node)) {
      continue;
    }
    const NodeState state = law->diffuses() ? NodeState{diffusing.Read(node), 0} : cells.Read(node);
    uint64_t level = edit.action == FieldEdit::Action::kErase ? 0 : edit.level;
    level += edit.action == FieldEdit::Action::kAdd ? LevelOf(edit.type, node, now_ms) : 0;
    level = std::min<uint64_t>(level, law->max_level());
    if (!SetLevel(*law, node, static_cast<uint32_t>(level), now_ms)) {
      for (const auto& [undone, was] : before) {
        law->diffuses() ? diffusing.Set(undone, was.level) : Store(*law, undone, was, now_ms);
      }
      return Error{"there is no memory left for all of the edit; nothing was changed"};
    }
    before.emplace_back(node, state);
  }
  return Ok();
}

}  // namespace pheromone::field
