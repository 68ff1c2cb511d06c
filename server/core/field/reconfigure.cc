// Changes of a field's configuration, and its initial contents.

#include <algorithm>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <utility>

#include "server/base/format.h"
#include "server/core/field/extent.h"
#include "server/core/field/field.h"

namespace pheromone::field {
namespace {

template <typename Laid>
bool Contains(const std::vector<Laid>& all, const Laid& one) {
  return std::find(all.begin(), all.end(), one) != all.end();
}

// Calls visit(type, node, level) for the nodes of the selected predefined paths and initial
// rasters.
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
  for (const InitialRaster& print : config.initial_rasters) {
    if (print.nodes && pick_print(print)) {
      for (const InitialNode& it : *print.nodes) {
        visit(print.type, it.node, it.level);
      }
    }
  }
}

// The paths and initial rasters of `config` that are, or are not, also in the other one; in order.
std::vector<LaidNode> NodesThat(const FieldConfig& config, const FieldConfig& other,
                                bool are_in_other) {
  std::vector<LaidNode> nodes;
  ForEachLaid(
      config, [&](const Path& it) { return Contains(other.paths, it) == are_in_other; },
      [&](const InitialRaster& it) { return Contains(other.initial_rasters, it) == are_in_other; },
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
                     const std::function<bool(const InitialRaster&)>& wanted_print) {
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

LayPlan PlanLaying(const FieldConfig& before, const FieldConfig& next) {
  LayPlan plan;
  plan.erase = NodesThat(before, next, false);
  if (!plan.erase.empty()) {
    const std::vector<LaidNode> kept = NodesThat(before, next, true);
    std::erase_if(plan.erase,
                  [&](const LaidNode& it) { return Contains(kept, it.first, it.second); });
  }
  const auto has_nodes = [&](uint8_t type) {
    const PheromoneLaw* law = next.FindLaw(type);
    return law != nullptr && !law->is_blend();
  };
  for (const Path& path : next.paths) {
    if (has_nodes(path.type) && !Contains(before.paths, path)) {
      std::vector<InitialNode> nodes;
      for (const NodeIndex node : NodesAlong(next.map, path)) {
        nodes.push_back({node, uint32_t{path.count} << kLevelBits});
      }
      plan.lay.push_back({path.type, Shared(std::move(nodes))});
    }
  }
  for (const InitialRaster& print : next.initial_rasters) {
    if (print.nodes && has_nodes(print.type) && !Contains(before.initial_rasters, print)) {
      plan.lay.push_back({print.type, print.nodes});
    }
  }
  if (!plan.lay.empty()) {
    plan.bytes = BytesOfLaid(
        next, [&](const Path& it) { return !Contains(before.paths, it); },
        [&](const InitialRaster& it) { return !Contains(before.initial_rasters, it); });
  }
  return plan;
}

// A deposit sets a minimum: nodes that hold more keep it.
void Field::LayAll(const FieldConfig& config, const FieldConfig* except, uint64_t now_ms) {
  ForEachLaid(
      config, [&](const Path& it) { return except == nullptr || !Contains(except->paths, it); },
      [&](const InitialRaster& it) {
        return except == nullptr || !Contains(except->initial_rasters, it);
      },
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

// Removed paths and initial rasters are erased, except nodes shared with a remaining one.
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

namespace {

Status CheckMap(const FieldConfig& present, const FieldConfig& next) {
  const auto words = [](const MapGeometry& map) {
    return DescribeExtent(map) + ", cells of " +
           FormatNumber(static_cast<double>(map.cell_um) / 1e6) + " m";
  };
  return next.map == present.map ? Ok()
                                 : Error{"the state is of " + words(present.map) +
                                         "; the configuration has " + words(next.map)};
}

// `visit_levels(type, visit)`: the nodes of a type that have content.
template <typename VisitLevels>
Status CheckGoing(const FieldConfig& present, const FieldConfig& next, VisitLevels&& visit_levels) {
  std::optional<std::vector<LaidNode>> laid;  // computed only if something is removed
  for (const PheromoneLaw& law : present.pheromones) {
    const PheromoneLaw* successor = next.FindLaw(law.type);
    if (law.is_blend() || (successor != nullptr && !successor->is_blend())) {
      continue;
    }
    if (!laid) {
      laid = NodesThat(present, present, true);
    }
    bool left_over = false;
    visit_levels(law.type,
                 [&](NodeIndex node, uint32_t) { left_over |= !Contains(*laid, law.type, node); });
    if (left_over) {
      return Error{"pheromone type " + std::to_string(law.type) + " (\"" + law.name +
                   "\") left the configuration, but some of it is on the map"};
    }
  }
  return Ok();
}

}  // namespace

Status Field::CheckReconfigure(const FieldConfig& next, uint64_t now_ms) const {
  const FieldConfig& present = current().config;
  Status status = CheckMap(present, next);
  if (status.ok()) {
    status = CheckGoing(present, next,
                        [&](uint8_t type, auto&& visit) { VisitLevels(type, now_ms, visit); });
  }
  return status.ok() ? CheckReconfigure(next, PlanLaying(present, next)) : status;
}

Status Field::CheckLeaving(const FieldReader& reader, const FieldConfig& present,
                           const FieldConfig& next, uint64_t now_ms) {
  return CheckGoing(present, next,
                    [&](uint8_t type, auto&& visit) { reader.VisitLevels(type, now_ms, visit); });
}

Status Field::CheckReconfigure(const FieldConfig& next, const LayPlan& plan) const {
  PHEROMONE_TRY_STATUS(CheckMap(current().config, next));
  if (busy()) {
    return Error{"the map is still being changed by an earlier request"};
  }
  if (plan.bytes != 0 && budget_.used_bytes + plan.bytes > next.memory_bytes) {
    return Error{"there is no memory for the new paths beside what is on the map"};
  }
  return Ok();
}

// Stored values may have another meaning under the new configuration.
void Field::MarkAll() {
  for (uint8_t type = 1; type < kTypes; ++type) {
    layers_.cells[type]->MarkAll();
  }
}

void Field::Reconfigure(const FieldConfig& next, uint64_t now_ms) {
  const FieldConfig before = current().config;
  history_.ForgetAll();
  EraseLaid(before, next, now_ms);
  // All present values are kept under the new laws: neither a memory limit below the present use,
  // nor the directory of a type that begins to diffuse, may lose any.
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
  Publish(std::make_unique<Setup>(std::make_shared<const FieldConfig>(next)));
  MarkAll();
  sweep_ = {.earliest_ms = 0, .cycle_ms = UINT64_MAX, .next_ms = now_ms};
  LayAll(current().config, &before, now_ms);  // fits, as checked by CheckReconfigure
  budget_.limit_bytes = current().config.memory_bytes;
  history_.SetLimit(EditHistory::LimitOf(budget_.limit_bytes));
}

void Field::BeginReconfigure(uint64_t id, std::shared_ptr<const FieldConfig> next,
                             std::shared_ptr<const LayPlan> plan, uint64_t now_ms, int64_t utc_ms) {
  auto setup = std::make_unique<Setup>(std::move(next));
  const FieldConfig& config = setup->config;
  budget_.limit_bytes = UINT64_MAX;  // a lower limit must not remove present contents
  for (const PheromoneLaw& law : current().config.pheromones) {
    const PheromoneLaw* successor = config.FindLaw(law.type);
    if (law.is_blend()) {
      continue;
    }
    if (successor != nullptr && SameSubstance(law, *successor)) {
      continue;
    }
    history_.Forget(law.type);
    if (successor == nullptr || successor->is_blend()) {
      EraseAll(law.type);
    } else if (law.diffuses() || successor->diffuses()) {
      cost_ += (layers_.cells[law.type]->tile_count() + layers_.diffusing[law.type]->tile_count()) *
               kCostOfRebasedTile;
      Rebase(law, *successor, now_ms);  // costs about as much as one step
    } else if (layers_.cells[law.type]->node_count() != 0) {
      setup->change[law.type] = LawChange{law, now_ms + 1};
      is_rebasing_ = true;
    }
  }
  rebase_type_ = 1;
  rebase_row_ = 0;
  budget_.limit_bytes = config.memory_bytes;
  history_.SetLimit(EditHistory::LimitOf(config.memory_bytes));
  Publish(std::move(setup));
  MarkAll();
  sweep_ = {.earliest_ms = 0, .cycle_ms = UINT64_MAX, .next_ms = now_ms + 1};
  if (!plan->empty()) {
    Work work;
    work.id = id;
    work.utc_ms = utc_ms;
    work.kind = Work::Kind::kLay;
    work.phase = Work::Phase::kApply;
    work.reserved_bytes = plan->bytes;  // available, as checked by CheckReconfigure
    budget_.used_bytes += plan->bytes;
    work.plan = std::move(plan);
    works_.push_back(std::move(work));
    MakePortion(now_ms + 1);
  } else {
    finished_.push_back({.id = id});
  }
}

// Converts the present values under `from` to levels under `to`, rounded to the nearest level, or
// to whole quanta if the law counts these.
void Field::Rebase(const PheromoneLaw& from, const PheromoneLaw& to, uint64_t now_ms) {
  std::vector<std::pair<NodeIndex, uint32_t>> nodes;
  VisitLevels(from.type, now_ms,
              [&](NodeIndex node, uint32_t level) { nodes.emplace_back(node, level); });
  layers_.cells[from.type]->ForEach(
      [&](NodeIndex node, NodeState) { Store(from, node, {}, now_ms); });
  layers_.diffusing[from.type]->Clear();
  for (const auto& [node, level] : nodes) {
    SetLevel(to, node, LevelUnder(from, to, level), now_ms);
  }
}

Status Field::Edit(const FieldEdit& edit, uint64_t now_ms) {
  const PheromoneLaw* law = FindLaw(edit.type);
  if (law == nullptr || law->is_blend()) {
    return Error{
        "type " + std::to_string(edit.type) +
        (law == nullptr ? " is not configured" : " is a blend, which has no content of its own")};
  }
  history_.Forget(edit.type);
  if (edit.action == FieldEdit::Action::kErase && edit.shape == FieldEdit::Shape::kAll) {
    EraseAll(edit.type);
    return Ok();
  }
  PHEROMONE_TRY(const std::vector<NodeIndex> nodes, NodesOf(edit, current().config.map));
  // Raw states, so that a failed edit can be undone exactly.
  CellMap& cells = *layers_.cells[law->type];
  DiffusionLayer& diffusing = *layers_.diffusing[law->type];
  std::vector<std::pair<NodeIndex, NodeState>> before;
  for (const NodeIndex node : nodes) {
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
      cells.MarkAll();
      return Error{"there is no memory left for all of the edit; nothing was changed"};
    }
    before.emplace_back(node, state);
  }
  return Ok();
}

}  // namespace pheromone::field
