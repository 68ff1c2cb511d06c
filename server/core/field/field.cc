#include "server/core/field/field.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "server/base/hash.h"
#include "server/core/field/frozen_field.h"
#include "server/core/field/kernel_table.h"

namespace pheromone::field {
namespace {

SenseError Check(const Setup& setup, uint8_t type, const PoseUm& pose) {
  if (type >= kTypes || setup.law[type] == nullptr) {
    return SenseError::kUnknownPheromone;
  }
  return setup.config.map.Contains(pose.position) ? SenseError::kNone : SenseError::kOffTheMap;
}

std::optional<Intensities> SensePair(const Setup& setup, const Layers& layers, const Kernel& kernel,
                                     uint8_t type, const PoseUm& pose, uint64_t now_ms,
                                     SenseError* error) {
  const SenseError reason = Check(setup, type, pose);
  if (reason != SenseError::kNone) {
    if (error != nullptr) {
      *error = reason;
    }
    return std::nullopt;
  }
  const Antennas antennas = AntennasOf(pose, setup.config.antennas);
  const PointUm places[2] = {antennas.left, antennas.right};
  int64_t p[2] = {0, 0};
  SenseAt(setup, layers, kernel, type, pose, DirectionOf(pose.heading), places, now_ms, p);
  return Intensities{p[0], p[1]};
}

}  // namespace

Antennas AntennasOf(const PoseUm& pose, const AntennaGeometry& geometry) {
  constexpr int64_t kOneQ14 = int64_t{1} << 14;
  constexpr uint16_t kQuarterTurn = 16384;
  const PointUm p = pose.position;
  const auto aside = [&](uint16_t direction) {
    const DirectionQ14 h = DirectionOf(direction);
    return PointUm{RoundDiv(geometry.distance_um * h.cos, 2 * kOneQ14),
                   RoundDiv(geometry.distance_um * h.sin, 2 * kOneQ14)};
  };
  const PointUm left = aside(static_cast<uint16_t>(pose.heading + geometry.angle));
  if (geometry.angle == kQuarterTurn && geometry.forward_um == 0) {
    return {{p.x + left.x, p.y + left.y}, {p.x - left.x, p.y - left.y}};
  }
  const PointUm right = aside(static_cast<uint16_t>(pose.heading - geometry.angle));
  const DirectionQ14 h = DirectionOf(pose.heading);
  const PointUm ahead{p.x + RoundDiv(geometry.forward_um * h.cos, kOneQ14),
                      p.y + RoundDiv(geometry.forward_um * h.sin, kOneQ14)};
  return {{ahead.x + left.x, ahead.y + left.y}, {ahead.x + right.x, ahead.y + right.y}};
}

uint32_t SpreadQ16(const PheromoneLaw& law, int64_t distance_squared_um2) {
  const KernelLaw kernel = ForKernel(law);
  const auto d2 = static_cast<double>(distance_squared_um2);
  if (kernel.gaussian) {
    const double mu = Exp2Minus(d2 * kernel.exponent) * 65536.0 + 0.5;
    return d2 <= kernel.reach_um2 ? static_cast<uint32_t>(mu) : 0;
  }
  // IEEE double, each operation rounded once, no contraction: the same bits everywhere.
  const double mu = (kernel.reach_um - std::sqrt(d2)) * kernel.slope + 0.5;
  return static_cast<uint32_t>(std::clamp(mu, 0.0, 65536.0));
}

Field::Field(std::shared_ptr<const FieldConfig> config, const Kernel& kernel, uint64_t now_ms)
    : Field(std::move(config), kernel, Empty{}) {
  LayAll(current().config, nullptr, now_ms);
}

Field::Field(std::shared_ptr<const FieldConfig> shared, const Kernel& kernel, Empty /*empty*/)
    : kernel_(kernel), history_(shared->map.columns(), shared->map.rows(), &reclaimer_, &pool_) {
  const FieldConfig& config = *shared;
  budget_.limit_bytes = config.memory_bytes;
  history_.SetLimit(EditHistory::LimitOf(config.memory_bytes));
  for (size_t type = 1; type < kTypes; ++type) {
    layers_.cells[type] = std::make_unique<CellMap>(config.map.columns(), config.map.rows(),
                                                    &budget_, &reclaimer_, &pool_);
    layers_.diffusing[type] = std::make_unique<DiffusionLayer>(
        config.map.columns(), config.map.rows(), &budget_, &reclaimer_, &pool_);
  }
  setup_.store(new Setup(std::move(shared)));
}

Field::~Field() {
  if (frozen_ != nullptr) {
    frozen_->LetGo();
  }
  delete setup_.load();
}

void Field::Publish(std::unique_ptr<Setup> setup) {
  const Setup* before = setup_.exchange(setup.release());
  reclaimer_.Retire([before] { delete before; });
}

std::optional<Intensities> Field::Sense(uint8_t type, const PoseUm& pose, uint64_t now_ms,
                                        SenseError* error) const {
  return SensePair(current(), layers_, kernel_, type, pose, now_ms, error);
}

SenseError Field::SenseAll(uint8_t type, const PoseUm& pose, std::span<const PointUm> antennas,
                           uint64_t now_ms, std::span<int64_t> intensities) const {
  const SenseError reason = Check(current(), type, pose);
  if (reason == SenseError::kNone) {
    SenseAt(current(), layers_, kernel_, type, pose, DirectionOf(pose.heading), antennas, now_ms,
            intensities);
  }
  return reason;
}

bool Field::IsBlocked(NodeIndex node) const {
  const FieldConfig& config = current().config;
  return config.obstacles && config.obstacles->Blocked(node);
}

DepositResult Field::Deposit(uint8_t type, PointUm point, uint16_t quanta, uint64_t now_ms) {
  const PheromoneLaw* law = FindLaw(type);
  if (law == nullptr) {
    return DepositResult::kUnknownPheromone;
  }
  if (law->is_blend()) {
    return DepositResult::kNotPermitted;
  }
  const MapGeometry& map = current().config.map;
  if (!map.Contains(point)) {
    return DepositResult::kOffTheMap;
  }
  const NodeIndex node = map.NearestNode(point);
  if (IsBlocked(node)) {
    return DepositResult::kBlocked;
  }
  if (law->diffuses()) {
    DiffusionLayer& layer = *layers_.diffusing[type];
    BeginDiffusion(type, now_ms);
    const uint64_t amount = uint64_t{quanta} << 16;
    const uint32_t most = uint32_t{law->max_count} << 16;
    const bool done = layer.Add(node, amount, most) ||
                      (SweepPortion(now_ms, kTilesForADeposit) && layer.Add(node, amount, most));
    layers_.cells[type]->MarkAll();
    if (!done) {
      return DepositResult::kMapFull;
    }
    history_.Change(type, node, [&](NodeState other) {
      const uint64_t room = most - std::min(most, other.level);
      return NodeState{other.level + static_cast<uint32_t>(std::min(amount, room)), 0};
    });
    return DepositResult::kDone;
  }
  const NodeState present = Present(type, layers_.cells[type]->Read(node));
  const NodeState next = AfterDeposit(*law, present, quanta, now_ms);
  if (!Store(*law, node, next, now_ms)) {
    return DepositResult::kMapFull;
  }
  history_.Change(type, node,
                  [&](NodeState other) { return AfterDeposit(*law, other, quanta, now_ms); });
  return DepositResult::kDone;
}

uint32_t Field::LevelOf(uint8_t type, NodeIndex node, uint64_t now_ms) const {
  const PheromoneLaw* law = FindLaw(type);
  if (law == nullptr || law->is_blend()) {
    return 0;
  }
  return law->diffuses() ? LevelOfDiffusing(layers_.diffusing[type]->Read(node))
                         : LevelAt(*law, Present(type, layers_.cells[type]->Read(node)), now_ms);
}

uint64_t Field::NodeHash(const PheromoneLaw& law, NodeIndex node, NodeState state) {
  const auto key = uint64_t{'N'} << 56 | uint64_t{law.type} << 48 |
                   static_cast<uint64_t>(node.row) << 24 | static_cast<uint64_t>(node.column);
  const NodeState canonical{state.level, law.tau_ms == 0 ? 0 : state.time_ms};
  return HashStep(HashStep(0, key), PackNode(canonical));
}

uint64_t Field::hash() const {
  uint64_t sum = Hash64({'W', sweep_.type, static_cast<uint64_t>(sweep_.leaf), sweep_.earliest_ms,
                         sweep_.cycle_ms, sweep_.next_ms}) +
                 HashOfWork() + history_.Hash();
  for (const uint64_t hash : hashes_) {
    sum += hash;
  }
  for (const PheromoneLaw& law : config().pheromones) {
    if (law.diffuses()) {
      sum += Hash64({'D', law.type, layers_.diffusing[law.type]->Hash(), stepped_ms_[law.type]});
    }
  }
  return sum;
}

// Every change of a node goes through here, so that the hash cannot miss one. When memory is
// exhausted, evaporated nodes are removed first.
bool Field::Store(const PheromoneLaw& law, NodeIndex node, NodeState state, uint64_t now_ms) {
  CellMap& layer = *layers_.cells[law.type];
  const LawChange* change = current().ChangeOf(law.type);
  state.time_ms = std::min(state.time_ms, kTimeMask);
  const NodeState before = layer.Read(node);
  ++changes_[law.type];
  if (!layer.Write(node, state) &&
      !(SweepPortion(now_ms, kTilesForADeposit) && layer.Write(node, state))) {
    return false;
  }
  if (before.level != 0) {
    hashes_[law.type] -= NodeHash(LawOf(change, law, before), node, before);
  }
  if (state.level != 0) {
    hashes_[law.type] += NodeHash(LawOf(change, law, state), node, state);
    const uint64_t until_ms = LivesUntil(law, Rebased(change, law, state));
    sweep_.earliest_ms = std::min(sweep_.earliest_ms, until_ms);
    sweep_.cycle_ms = std::min(sweep_.cycle_ms, until_ms);
  }
  return true;
}

// The cost does not depend on the amount of pheromone. The sweep needs no notification.
void Field::EraseAll(uint8_t type) {
  ++changes_[type];
  layers_.diffusing[type]->Clear();
  layers_.cells[type]->Clear();  // which marks all nodes of the type as changed
  hashes_[type] = 0;
}

// Steps are counted from the first deposit on an empty layer.
void Field::BeginDiffusion(uint8_t type, uint64_t now_ms) {
  if (layers_.diffusing[type]->empty()) {
    stepped_ms_[type] = now_ms;
  }
}

// Replaces what a node holds, in either kind of layer.
bool Field::SetState(const PheromoneLaw& law, NodeIndex node, NodeState state, uint64_t now_ms) {
  if (!law.diffuses()) {
    return Store(law, node, state, now_ms);
  }
  DiffusionLayer& layer = *layers_.diffusing[law.type];
  BeginDiffusion(law.type, now_ms);
  const bool done = layer.Set(node, state.level) ||
                    (SweepPortion(now_ms, kTilesForADeposit) && layer.Set(node, state.level));
  layers_.cells[law.type]->MarkAll();
  return done;
}

// Sweeps the next leaves of the map, with about that many tiles in total, and removes evaporated
// nodes. Each round determines when the next one can release memory, so that a map full of nodes
// that have not evaporated is not swept again for every refused deposit. True if memory was
// released.
bool Field::SweepPortion(uint64_t now_ms, int tiles) {
  // A change in progress relies on the existing tiles, from the first one that it has counted.
  const bool counted_on = !works_.empty() && (works_.front().phase == Work::Phase::kApply ||
                                              works_.front().counted != 0);
  if (now_ms < sweep_.earliest_ms || counted_on) {
    return false;
  }
  // The remaining work, in sixteenths of a tile.
  constexpr int kTile = 16;
  constexpr int kLeaf = 8 * kTile;
  constexpr int kNoLeaf = 1;
  const uint64_t used_before = budget_.used_bytes;
  const std::pair begin{sweep_.type, sweep_.leaf};
  int work = tiles * kTile;
  size_t types = kTypes;  // a type emptied meanwhile does not return to its start
  do {
    if (sweep_.type == 1 && sweep_.leaf == 0) {
      sweep_.cycle_ms = UINT64_MAX;  // a new round sees everything
    }
    const PheromoneLaw* law = FindLaw(sweep_.type);
    const CellMap& layer = *layers_.cells[sweep_.type];
    const bool wanted = law != nullptr && law->tau_ms != 0 && layer.tile_count() != 0;
    if (wanted) {
      const int in_leaf = static_cast<int>(layer.tiles_in_leaf(sweep_.leaf));
      cost_ += static_cast<uint64_t>(in_leaf) * kCostOfSweptTile;
      work -= in_leaf != 0 ? kLeaf + in_leaf * kTile : kNoLeaf;
      SweepLeaf(*law, sweep_.leaf, now_ms);
    }
    if (!wanted || ++sweep_.leaf >= layer.leaf_count()) {
      sweep_.leaf = 0;
      --types;
      if (++sweep_.type == kTypes) {
        sweep_.type = 1;
        sweep_.earliest_ms = sweep_.cycle_ms;
      }
    }
  } while (work > 0 && types > 0 && begin != std::pair{sweep_.type, sweep_.leaf});
  return budget_.used_bytes < used_before;
}

void Field::SweepLeaf(const PheromoneLaw& law, int32_t leaf, uint64_t now_ms) {
  CellMap& layer = *layers_.cells[law.type];
  layer.ForEachInLeaf(leaf, [&](NodeIndex node, NodeState state) {
    const NodeState present = Present(law.type, state);
    const uint64_t until_ms = LivesUntil(law, present);
    if (now_ms >= until_ms && LevelAt(law, present, now_ms) == 0) {
      hashes_[law.type] -= NodeHash(StoredLaw(law.type, state), node, state);
      layer.Forget(node);
    } else {
      sweep_.cycle_ms = std::min(sweep_.cycle_ms, until_ms);
    }
  });
}

void Field::StepDiffusion(uint64_t now_ms) {
  const FieldConfig& config = current().config;
  const ObstacleMask* obstacles = config.obstacles ? &*config.obstacles : nullptr;
  for (const PheromoneLaw& law : config.pheromones) {
    DiffusionLayer& layer = *layers_.diffusing[law.type];
    uint64_t& stepped_ms = stepped_ms_[law.type];
    if (!law.diffuses() || layer.empty() || now_ms < stepped_ms + law.diffusion.step_ms) {
      continue;
    }
    const uint64_t steps = (now_ms - stepped_ms) / law.diffusion.step_ms;
    const uint64_t made = std::min(steps, kStepsAtOnce);
    for (uint64_t i = 0; i < made; ++i) {
      layer.Step(law.diffusion, obstacles);
      cost_ += layer.tile_count() * kCostOfStep;
    }
    layer.Decay(law.diffusion, steps - made);
    stepped_ms += steps * law.diffusion.step_ms;
    layers_.cells[law.type]->MarkAll();
  }
}

void Field::Advance(uint64_t now_ms) {
  if (!works_.empty()) {
    MakePortion(now_ms);
  } else {
    if (is_rebasing_) {
      RebasePortion();
    }
    StepDiffusion(now_ms);
    if (!is_rebasing_ && now_ms >= sweep_.earliest_ms && now_ms >= sweep_.next_ms) {
      SweepPortion(now_ms, kTilesAtOnce);
      sweep_.next_ms = now_ms + kSweepIntervalMs;
    }
  }
  reclaimer_.Collect();
}

bool Field::ReleaseMemory() {
  reclaimer_.Collect();
  pool_.ReleaseSome(kTilesReleasedAtOnce);
  return has_garbage();
}

std::optional<uint64_t> Field::NextDeadline() const {
  if (busy()) {
    return 0;
  }
  uint64_t deadline = UINT64_MAX;
  if (sweep_.earliest_ms != UINT64_MAX) {
    deadline = std::max(sweep_.earliest_ms, sweep_.next_ms);
  }
  for (const PheromoneLaw& law : config().pheromones) {
    if (law.diffuses() && !layers_.diffusing[law.type]->empty()) {
      deadline = std::min(deadline, stepped_ms_[law.type] + law.diffusion.step_ms);
    }
  }
  return deadline == UINT64_MAX ? std::nullopt : std::optional(deadline);
}

size_t Field::node_count() const {
  size_t count = 0;
  for (size_t type = 1; type < kTypes; ++type) {
    count += layers_.cells[type]->node_count();
  }
  return count;
}

size_t Field::tile_count() const {
  size_t count = 0;
  for (size_t type = 1; type < kTypes; ++type) {
    count += layers_.cells[type]->tile_count();
  }
  return count;
}

FieldReader::FieldReader(const Field& field) : field_(field), slot_(field.reclaimer_.Register()) {}

FieldReader::~FieldReader() {
  if (ok()) {
    field_.reclaimer_.Unregister(slot_);
  }
}

void FieldReader::SenseEach(uint8_t type, std::span<const PoseUm> poses, uint64_t now_ms,
                            std::span<std::optional<Intensities>> answers) const {
  field_.reclaimer_.Enter(slot_);
  const Setup& setup = *field_.setup_.load();
  for (size_t i = 0; i < poses.size(); ++i) {
    answers[i] = SensePair(setup, field_.layers_, field_.kernel_, type, poses[i], now_ms, nullptr);
  }
  field_.reclaimer_.Leave(slot_);
}

std::optional<Intensities> FieldReader::Sense(uint8_t type, const PoseUm& pose, uint64_t now_ms,
                                              SenseError* error) const {
  field_.reclaimer_.Enter(slot_);
  const auto p =
      SensePair(*field_.setup_.load(), field_.layers_, field_.kernel_, type, pose, now_ms, error);
  field_.reclaimer_.Leave(slot_);
  return p;
}

}  // namespace pheromone::field
