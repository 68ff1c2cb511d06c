// The pheromone map: deposits in, intensities at a robot's antennas out.
//
//   Field field(config);
//   field.Deposit(type, point, quanta, now_ms);
//   Intensities p = field.Sense(type, pose, now_ms).value();   // P_L, P_R of eq. (4)
//
// Evaporation is worked out when a node is read: no frame sweeps the map, a deposit touches one
// node, and a query touches the occupied nodes in reach of the antennas, whatever the size of the
// map. What has evaporated is given back in bounded portions: by Advance, and by a deposit that
// finds no memory. All arithmetic is defined to the bit in protocol/README.md ("Arithmetic");
// equations are those of Susnea et al. 2009. server/core/field/README.md explains the algorithm and
// has the measurements.
//
// Pure: no clock, no log, no files. Times are the field's own milliseconds, which never decrease
// and stay below 2^42.
//
// Threads: one writer (the engine, behind its lock), for which Field is; any number of others look
// through a FieldReader each. Sense is const and changes nothing.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <deque>
#include <iterator>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "server/base/bytes.h"
#include "server/base/result.h"
#include "server/core/field/config.h"
#include "server/core/field/edit.h"
#include "server/core/field/edit_history.h"
#include "server/core/field/heading.h"
#include "server/core/field/kernel.h"
#include "server/core/field/memory.h"
#include "server/core/field/sense.h"
#include "server/core/field/setup.h"
#include "server/core/field/work.h"

namespace pheromone::field {

/// The left and the right antenna, eq. (5) with a heading counted counter-clockwise.
struct Antennas {
  PointUm left;
  PointUm right;
};
Antennas AntennasOf(const PoseUm& pose, const AntennaGeometry& geometry);

/// mu of eq. (1), or of a Gaussian, for a source at `distance_squared_um2`, in 1/65 536.
uint32_t SpreadQ16(const PheromoneLaw& law, int64_t distance_squared_um2);

/// P_L and P_R of eq. (4), in 1/4096 of a pheromone unit, not yet limited to what a message holds.
struct Intensities {
  int64_t left = 0;
  int64_t right = 0;
  bool operator==(const Intensities&) const = default;
};

enum class SenseError : uint8_t { kNone, kOffTheMap, kUnknownPheromone };

enum class DepositResult : uint8_t {
  kDone,
  kOffTheMap,
  kUnknownPheromone,
  kMapFull,
  kBlocked,       ///< there is an obstacle
  kNotPermitted,  ///< a blend has no pheromone of its own
};

/// How far the search for what has evaporated is. Part of the state: it decides when memory comes
/// back.
struct SweepState {
  uint8_t type = 1;
  int32_t leaf = 0;
  uint64_t earliest_ms = UINT64_MAX;  ///< nothing dies before
  uint64_t cycle_ms = UINT64_MAX;     ///< the same, of what the present round has seen
  uint64_t next_ms = 0;               ///< the next portion is not due before
  bool operator==(const SweepState&) const = default;
};

class FieldReader;
class FrozenField;

class Field {  // NOLINT(clang-analyzer-optin.performance.Padding): by what belongs together
 public:
  /// About how many tiles one portion of a sweep looks at, and a deposit that finds no memory: it
  /// may be refused although something has evaporated elsewhere.
  static constexpr int kTilesAtOnce = 8192;
  static constexpr int kTilesForADeposit = 256;
  static constexpr uint64_t kSweepIntervalMs = 1000;
  static constexpr int kTilesReleasedAtOnce = 1024;
  /// Of a diffusing type's steps that are due at once, so many are made; of the others, only the
  /// evaporation.
  static constexpr uint64_t kStepsAtOnce = 16;
  /// One portion of a large change: so many nodes are set, tiles counted, or tiles looked at for
  /// nodes that were stored under an earlier law.
  static constexpr int kNodesOfPortion = 4096;
  static constexpr int kTilesCountedAtOnce = 32768;
  static constexpr int kTilesRebasedAtOnce = 128;
  static constexpr size_t kMaxWorks = 64;  ///< that may wait for their turn

  /// Lays the configuration's paths and prints at `now_ms`. `kernel` is for tests and benchmarks;
  /// it changes no bit of any answer.
  explicit Field(std::shared_ptr<const FieldConfig> config, const Kernel& kernel = BestKernel(),
                 uint64_t now_ms = 0);
  explicit Field(FieldConfig config, const Kernel& kernel = BestKernel(), uint64_t now_ms = 0)
      : Field(std::make_shared<const FieldConfig>(std::move(config)), kernel, now_ms) {}
  Field(const Field&) = delete;
  Field& operator=(const Field&) = delete;
  ~Field();

  /// All that answers and later changes depend on, but for the configuration: what lies on the map,
  /// how far the sweep and the steps are, which tables have memory.
  void Save(ByteWriter* writer) const;
  /// The same as it is now, to be copied in portions (frozen_field.h). At most one at a time; while
  /// there is one, or paths and rasters of a large configuration are being laid, null. Edits are in
  /// nobody's way: they might never end. What is changed before it was copied is kept: up to
  /// `most_kept_bytes`.
  std::unique_ptr<FrozenField> Freeze(uint64_t most_kept_bytes) const;
  /// A field that continues as the saved one would have, to the bit. Null, and a failure of the
  /// reader, if this cannot be the state of a field with that configuration.
  static std::unique_ptr<Field> Restore(std::shared_ptr<const FieldConfig> config,
                                        ByteReader* reader, const Kernel& kernel = BestKernel());
  /// A copy that continues as this one does: Save and Restore.
  std::unique_ptr<Field> Clone() const;

  const FieldConfig& config() const { return current().config; }
  /// Null if there is no such type.
  const PheromoneLaw* FindLaw(uint8_t type) const {
    return type < kTypes ? current().law[type] : nullptr;
  }

  /// P_L and P_R for a robot at `pose`; of a blend, the weighted sum. Nothing, and the reason in
  /// `error` if given, when the robot's centre is not on the map or the type does not exist. The
  /// antennas may leave the map.
  std::optional<Intensities> Sense(uint8_t type, const PoseUm& pose, uint64_t now_ms,
                                   SenseError* error = nullptr) const;

  /// P at any number of antennas, anywhere around the robot (within 65 m). `intensities` has as
  /// many places as `antennas`; unchanged if the result is not kNone.
  SenseError SenseAll(uint8_t type, const PoseUm& pose, std::span<const PointUm> antennas,
                      uint64_t now_ms, std::span<int64_t> intensities) const;

  /// Adds `quanta` at the node nearest to `point`. All or nothing.
  DepositResult Deposit(uint8_t type, PointUm point, uint16_t quanta, uint64_t now_ms);

  /// Fills, brushes or erases, at once, however long that takes. All or nothing; errors: edit.h.
  /// Not to be undone: the edits of that type are forgotten.
  Status Edit(const FieldEdit& edit, uint64_t now_ms);

  /// The same in portions (work.h): the first one now, if nothing else is under way; Advance makes
  /// the others. `edit` is one that RasterOf accepts; `raster` may be null. `id` is told when it is
  /// finished. It is recorded in the history, with `utc_ms`.
  void BeginEdit(uint64_t id, const FieldEdit& edit, std::shared_ptr<const Raster> raster,
                 uint64_t now_ms, int64_t utc_ms = 0);
  /// Whether there is an edit to be undone or redone, and no change under way.
  Status CheckReverse(bool redo) const;
  /// Undoes or redoes an edit, in portions as above: if CheckReverse accepts it.
  void BeginReverse(uint64_t id, bool redo, uint64_t now_ms);
  const EditHistory& history() const { return history_; }
  /// What is on the map is its beginning: as if it were no edit's.
  void ForgetEdits() { history_.Clear(); }
  /// Whether more changes may be begun.
  bool accepts_work() const { return works_.size() < kMaxWorks; }
  /// Whether a change is under way, or nodes of an earlier law are left.
  bool busy() const { return !works_.empty() || is_rebasing_; }
  /// Appends those that have ended since the last call. Not part of the state.
  void TakeFinished(std::vector<FinishedWork>* to) {
    std::move(finished_.begin(), finished_.end(), std::back_inserter(*to));
    finished_.clear();
  }

  /// What the field did since the last call, as the number of nodes that an edit sets in that time:
  /// exact, and the same in each replay. For the log, which weighs how long a replay takes. Not
  /// part of the state.
  uint64_t TakeCost() { return std::exchange(cost_, 0); }

  /// Why `next` cannot replace the configuration, if it cannot: another geometry, a pheromone that
  /// goes while some of it is left on the map, or new paths for which there is no memory.
  Status CheckReconfigure(const FieldConfig& next, uint64_t now_ms) const;

  /// The same in parts, for those who prepare a change beside the robots: CheckLeaving looks
  /// through every node of the pheromones that go; what it found holds as long as their changes()
  /// stay. The rest takes no time: geometry, memory for `plan`, and that nothing is under way.
  static Status CheckLeaving(const FieldReader& reader, const FieldConfig& present,
                             const FieldConfig& next, uint64_t now_ms);
  Status CheckReconfigure(const FieldConfig& next, const LayPlan& plan) const;
  /// How often a node of the type was changed; not part of the state.
  uint64_t changes(uint8_t type) const { return changes_[type]; }

  /// Goes on under `next`, which CheckReconfigure accepts. A law whose evaporation or quantum
  /// changed goes on from the present values; paths that left the configuration are erased along
  /// their own nodes, new ones are laid.
  void Reconfigure(const FieldConfig& next, uint64_t now_ms);

  /// The same in portions, from `now_ms` + 1 on: time must have advanced to that before anything
  /// else is done. At once, laws change and values are what they were; Advance rewrites nodes that
  /// were stored under an earlier law, and erases and lays. Not while busy().
  void BeginReconfigure(uint64_t id, std::shared_ptr<const FieldConfig> next,
                        std::shared_ptr<const LayPlan> plan, uint64_t now_ms, int64_t utc_ms = 0);

  /// Does what is due by `now_ms`, in a bounded portion: looks for what has evaporated, and steps
  /// the types that diffuse.
  void Advance(uint64_t now_ms);
  /// When Advance has something to do; nothing if never.
  std::optional<uint64_t> NextDeadline() const;

  /// Calls `visit(type, NodeIndex, NodeState)` for each remembered node of the types that do not
  /// diffuse, in no particular order. States are as they were stored: while the field is busy, some
  /// of them under an earlier law (StoredLaw).
  template <typename Visit>
  void ForEach(Visit&& visit) const {
    for (const PheromoneLaw& law : config().pheromones) {
      layers_.cells[law.type]->ForEach(
          [&](NodeIndex node, NodeState state) { visit(law.type, node, state); });
    }
  }

  /// Calls `visit(NodeIndex, level)` for each node of a type that has something at `now_ms`.
  template <typename Visit>
  void VisitLevels(uint8_t type, uint64_t now_ms, Visit&& visit) const {
    VisitLevelsIn(current(), layers_, type, now_ms, visit);
  }

  /// The present level of a node, of either kind of type.
  uint32_t LevelOf(uint8_t type, NodeIndex node, uint64_t now_ms) const;

  /// The contribution to the state hash: the sum over the remembered nodes of NodeHash, kept up to
  /// date by every change, and what diffuses and the sweep, worked out when asked.
  uint64_t hash() const;

  /// HashStep over (kind 'N', type, column, row) in one word and the node's packed state (kernel.h)
  /// in another; time 0 where nothing evaporates.
  static uint64_t NodeHash(const PheromoneLaw& law, NodeIndex node, NodeState state);
  /// The law under which a state of a type was stored.
  const PheromoneLaw& StoredLaw(uint8_t type, NodeState state) const {
    return LawOf(current().ChangeOf(type), *current().law[type], state);
  }
  /// What changes under way and laws that are being replaced add to the hash; 0: none.
  uint64_t HashOfWork() const;

  /// Gives back a bounded portion of the memory of what was erased all at once; 100 us. It is no
  /// part of the state, and no answer or hash depends on it. True if there is more, some of which a
  /// reader or a frozen copy may still hold.
  bool ReleaseMemory();
  bool has_garbage() const { return pool_.has_garbage() || reclaimer_.waiting() != 0; }

  const SweepState& sweep() const { return sweep_; }
  const Kernel& kernel() const { return kernel_; }
  size_t node_count() const;
  size_t tile_count() const;
  uint64_t used_bytes() const { return budget_.used_bytes; }
  uint64_t limit_bytes() const { return budget_.limit_bytes; }

 private:
  friend class FieldReader;
  friend class FrozenField;

  struct Empty {};  // with nothing laid
  Field(std::shared_ptr<const FieldConfig> shared, const Kernel& kernel, Empty empty);

  const Setup& current() const { return *setup_.load(std::memory_order_relaxed); }
  void Publish(std::unique_ptr<Setup> setup);
  void SaveRest(ByteWriter* writer) const;
  void RestoreWorks(ByteReader* reader);
  void HashNodes(ByteReader* reader);

  template <typename Visit>
  static void VisitLevelsIn(const Setup& setup, const Layers& layers, uint8_t type, uint64_t now_ms,
                            Visit&& visit) {
    const PheromoneLaw* law = type < kTypes ? setup.law[type] : nullptr;
    if (law == nullptr) {
      return;
    }
    layers.cells[type]->ForEach([&](NodeIndex node, NodeState state) {
      const NodeState present = setup.Present(type, state);
      if (const uint32_t level = LevelAt(*law, present, now_ms); level != 0) {
        visit(node, level);
      }
    });
    layers.diffusing[type]->ForEach([&](NodeIndex node, uint32_t content_q16) {
      if (const uint32_t level = LevelOfDiffusing(content_q16); level != 0) {
        visit(node, level);
      }
    });
  }

  static NodeArea WholeMap(const Setup& setup) { return {{0, 0}, {setup.columns, setup.rows}}; }

  // The nodes of one area, which lies in the map.
  template <typename Visit>
  static void VisitLevelsOf(const Setup& setup, const Layers& layers, uint8_t type,
                            const NodeArea& area, uint64_t now_ms, Visit&& visit) {
    const PheromoneLaw* law = type < kTypes ? setup.law[type] : nullptr;
    if (law == nullptr || area.empty()) {
      return;
    }
    layers.cells[type]->ForEachIn(area, [&](NodeIndex node, NodeState state) {
      if (const uint32_t level = LevelAt(*law, setup.Present(type, state), now_ms); level != 0) {
        visit(node, level);
      }
    });
    layers.diffusing[type]->ForEachIn(area, [&](NodeIndex node, uint32_t content_q16) {
      if (const uint32_t level = LevelOfDiffusing(content_q16); level != 0) {
        visit(node, level);
      }
    });
  }

  bool Store(const PheromoneLaw& law, NodeIndex node, NodeState state, uint64_t now_ms);
  // What a node of that level holds that is set now; of a diffusing type, its content.
  static NodeState StateAt(const PheromoneLaw& law, uint32_t level, uint64_t now_ms) {
    return law.diffuses() ? NodeState{level << (16 - kLevelBits), 0}
           : level != 0   ? NodeState{level, now_ms}
                          : NodeState{};
  }
  bool SetState(const PheromoneLaw& law, NodeIndex node, NodeState state, uint64_t now_ms);
  bool SetLevel(const PheromoneLaw& law, NodeIndex node, uint32_t level, uint64_t now_ms) {
    return SetState(law, node, StateAt(law, level, now_ms), now_ms);
  }
  bool IsBlocked(NodeIndex node) const;
  bool SweepPortion(uint64_t now_ms, int tiles);
  void BeginDiffusion(uint8_t type, uint64_t now_ms);
  void SweepLeaf(const PheromoneLaw& law, int32_t leaf, uint64_t now_ms);
  void EraseAll(uint8_t type);
  void MarkAll();
  void StepDiffusion(uint64_t now_ms);
  void LayAll(const FieldConfig& config, const FieldConfig* except, uint64_t now_ms);
  void EraseLaid(const FieldConfig& before, const FieldConfig& next, uint64_t now_ms);
  void Rebase(const PheromoneLaw& from, const PheromoneLaw& to, uint64_t now_ms);

  NodeState Present(uint8_t type, NodeState stored) const {
    return current().Present(type, stored);
  }

  // work.cc
  void MakePortion(uint64_t now_ms);
  bool ReserveForEdit(Work* work, uint64_t now_ms);
  bool ReserveCounted(Work* work, uint64_t now_ms);
  uint64_t BytesMissing(const PheromoneLaw& law, TileIndex tile, bool leaf_counted,
                        bool top_counted) const;
  bool ApplyEdit(Work* work, uint64_t now_ms);
  bool ApplyPlan(Work* work, uint64_t now_ms);
  void Finish(Status outcome);
  void RebasePortion();

  // In nodes that are set: a tile whose nodes are looked at, rewritten, or make a step.
  static constexpr uint64_t kCostOfSweptTile = 8;
  static constexpr uint64_t kCostOfRebasedTile = 64;
  static constexpr uint64_t kCostOfStep = 8;

  // reverse.cc
  static constexpr int64_t kWorkOfNode = 64;
  uint64_t RowsOfTiles() const {
    return static_cast<uint64_t>(layers_.cells[1]->leaf_count()) * kLeafSide;
  }
  template <typename HasTiles, typename VisitRow>
  bool VisitRows(uint64_t* position, int64_t* left, HasTiles&& has_tiles, VisitRow&& visit_row);
  template <typename Visit, typename EndSheet>
  bool VisitSheets(EditHistory::Entry* entry, uint64_t* position, Visit&& visit,
                   EndSheet&& end_sheet);
  bool ReserveForReverse(Work* work, uint64_t now_ms);
  bool ApplyReverse(Work* work, uint64_t now_ms);
  NodeState StateOf(const PheromoneLaw& law, NodeIndex node, uint64_t now_ms) const;
  static uint32_t LevelOfState(const PheromoneLaw& law, NodeState state, uint64_t now_ms);
  void Replace(Work* work, const PheromoneLaw& law, NodeIndex node, NodeState before,
               NodeState state, uint64_t now_ms);
  void SetForEdit(Work* work, const PheromoneLaw& law, NodeIndex node, uint32_t level,
                  uint64_t now_ms);
  bool EraseRecorded(Work* work, uint64_t now_ms);

  const Kernel& kernel_;
  MemoryBudget budget_;
  TilePool pool_;  // outlives the reclaimer, which gives tiles back to it
  mutable Reclaimer reclaimer_;
  std::atomic<const Setup*> setup_{nullptr};
  Layers layers_;
  EditHistory history_;
  std::array<uint64_t, kTypes> hashes_{};  // of each type's nodes
  SweepState sweep_;
  std::array<uint64_t, kTypes> stepped_ms_{};  // of diffusing types: the time of the last step
  std::deque<Work> works_;                     // the first one is under way
  std::vector<FinishedWork> finished_;
  std::array<uint64_t, kTypes> changes_{};
  uint64_t cost_ = 0;         // since TakeCost
  bool is_rebasing_ = false;  // nodes of earlier laws may be left, from here on:
  uint8_t rebase_type_ = 1;
  int32_t rebase_row_ = 0;                 // kLeafSide rows of tiles for each leaf
  mutable FrozenField* frozen_ = nullptr;  // what is being copied
};

/// A place beside the writer: looks at the field while it is being changed, without holding it up
/// and without waiting. What it sees may mix neighbouring moments. One thread at a time; the field
/// outlives it. At most Reclaimer::kReaders exist. No call from inside another one's visitor.
class FieldReader {
 public:
  explicit FieldReader(const Field& field);
  FieldReader(const FieldReader&) = delete;
  FieldReader& operator=(const FieldReader&) = delete;
  ~FieldReader();

  /// False when there was no place left; then nothing else may be called.
  bool ok() const { return slot_ >= 0; }

  /// As Field::Sense.
  std::optional<Intensities> Sense(uint8_t type, const PoseUm& pose, uint64_t now_ms,
                                   SenseError* error = nullptr) const;

  /// The same for many poses in one visit, which is cheaper than one by one; `answers` has as many
  /// places as `poses`. Holds back the reuse of memory, not the writer, until it ends.
  void SenseEach(uint8_t type, std::span<const PoseUm> poses, uint64_t now_ms,
                 std::span<std::optional<Intensities>> answers) const;

  /// As Field::VisitLevels. Holds back the reuse of memory, not the writer, until it ends.
  template <typename Visit>
  void VisitLevels(uint8_t type, uint64_t now_ms, Visit&& visit) const {
    field_.reclaimer_.Enter(slot_);
    Field::VisitLevelsIn(*field_.setup_.load(), field_.layers_, type, now_ms, visit);
    field_.reclaimer_.Leave(slot_);
  }

  /// The same for the nodes in `area`, in time proportional to its size.
  template <typename Visit>
  void VisitLevels(uint8_t type, const NodeArea& area, uint64_t now_ms, Visit&& visit) const {
    field_.reclaimer_.Enter(slot_);
    const Setup& setup = *field_.setup_.load();
    Field::VisitLevelsOf(setup, field_.layers_, type, area.Within(Field::WholeMap(setup)), now_ms,
                         visit);
    field_.reclaimer_.Leave(slot_);
  }

  /// Calls `visit(NodeArea)` for each part of `area` in which nodes of a type may have changed
  /// since an earlier call, whose result's `number` is `since`; 0 for the first call. A part is a
  /// tile of 8 x 8 nodes, or larger; read its levels afterwards.
  ///
  /// Evaporation does not count as a change, since it follows from the law. After erase-all and a
  /// new configuration everything has changed, and after each step of a pheromone that diffuses.
  /// Removed tiles may be reported more than once. A blend has no nodes of its own: ask for its
  /// parts. Change numbers start anew with each Field, and so with each start of the server.
  template <typename Visit>
  CellMap::Changes VisitChanged(uint8_t type, const NodeArea& area, uint64_t since,
                                Visit&& visit) const {
    if (type == 0 || type >= kTypes) {
      return {};
    }
    field_.reclaimer_.Enter(slot_);
    const NodeArea inside = area.Within(Field::WholeMap(*field_.setup_.load()));
    const CellMap::Changes changes = field_.layers_.cells[type]->VisitChanged(inside, since, visit);
    field_.reclaimer_.Leave(slot_);
    return changes;
  }

 private:
  const Field& field_;
  int slot_;
};

}  // namespace pheromone::field
