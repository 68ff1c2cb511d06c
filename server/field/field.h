// The pheromone map: deposits in, intensities at a robot's two antennas out.
//
//   Field field(config);
//   field.Deposit(type, point, quanta, now_ms);
//   Intensities p = field.Sense(type, pose, now_ms).value();   // P_L, P_R of eq. (4)
//
// Evaporation is worked out when a node is read: no frame sweeps the map, a deposit touches one
// node, and a query touches the nodes in reach of the antennas, whatever the size of the map. Only
// a map whose memory is used up is searched, for what has evaporated, and only when something can
// have. All arithmetic is defined to the bit in protocol/README.md ("Arithmetic"); equations are
// those of Susnea et al. 2009.
//
// Pure: no clock, no log, no files. Times are the field's own milliseconds, which never decrease.
// Sense is const and changes nothing. Not thread-safe: one owner (the engine, behind its lock).
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "server/base/result.h"
#include "server/field/cell_map.h"
#include "server/field/geometry.h"
#include "server/field/heading.h"
#include "server/field/law.h"
#include "server/field/path.h"

namespace pheromone::field {

constexpr size_t kTypes = 16;  ///< types are 1-15; entry 0 of tables stays empty

struct FieldConfig {
  MapGeometry map;
  int64_t antenna_distance_um = 0;  ///< b of eq. (5)
  std::vector<PheromoneLaw> pheromones;
  std::vector<Path> paths;    ///< predefined trails
  uint64_t memory_bytes = 0;  ///< what the nodes may occupy; beyond it, the map is full
  bool operator==(const FieldConfig&) const = default;
};

/// P_L and P_R of eq. (4), in 1/4096 of a pheromone unit, not yet limited to what a message holds.
struct Intensities {
  int64_t left = 0;
  int64_t right = 0;
  bool operator==(const Intensities&) const = default;
};

struct Antennas {
  PointUm left;
  PointUm right;
};

/// Eq. (5) for headings counted counter-clockwise: left = p + (b / 2)(-sin, cos), right = p - that.
Antennas AntennasOf(const PoseUm& pose, DirectionQ14 heading, int64_t distance_um);

/// mu(d) of eq. (1) in 1/65 536, d^2 given in square micrometres; 0 beyond reach.
uint32_t SpreadQ16(const PheromoneLaw& law, int64_t distance_squared_um2);

/// How many tiles the memory of a configuration allows.
size_t TileLimit(const FieldConfig& config);

/// How many tiles the nodes of a configuration's paths occupy, over all pheromones; those of paths
/// for which `wanted` is false are left out.
size_t TilesOfPaths(const FieldConfig& config, const std::function<bool(const Path&)>& wanted);

enum class DepositResult { kDone, kOffTheMap, kUnknownPheromone, kMapFull };
enum class SenseError { kNone, kOffTheMap, kUnknownPheromone };

class Field {
 public:
  /// The configuration must be sound (server/config checks it): sides, sigma and quanta positive,
  /// types 1-15 and each at most once, memory for the paths. Lays the paths at time 0.
  explicit Field(FieldConfig config);
  Field(const Field&) = delete;
  Field& operator=(const Field&) = delete;

  const FieldConfig& config() const { return config_; }
  const PheromoneLaw* FindLaw(uint8_t type) const;

  /// The intensities at the antennas of a robot at `pose`. Empty, with the reason in `error` if
  /// given, when the robot's centre is not on the map or the type does not exist. The antennas
  /// may leave the map.
  std::optional<Intensities> Sense(uint8_t type, const PoseUm& pose, uint64_t now_ms,
                                   SenseError* error = nullptr) const;

  /// Adds `quanta` at the node nearest to `point`. All or nothing.
  DepositResult Deposit(uint8_t type, PointUm point, uint16_t quanta, uint64_t now_ms);

  /// Why `next` cannot replace the configuration, if it cannot: another geometry, a pheromone that
  /// goes while some of it is left on the map, or new paths for which there is no memory.
  Status CheckReconfigure(const FieldConfig& next, uint64_t now_ms) const;

  /// Goes on under `next`, which CheckReconfigure accepts. A law whose evaporation or quantum
  /// changed goes on from the present values; paths that left the configuration are erased along
  /// their own nodes, new ones are laid.
  void Reconfigure(const FieldConfig& next, uint64_t now_ms);

  /// Calls `visit(type, NodeIndex, NodeState)` for each remembered node, in no particular order.
  template <typename Visit>
  void ForEach(Visit&& visit) const {
    for (const PheromoneLaw& law : config_.pheromones) {
      layers_[law.type].ForEach(
          [&](NodeIndex node, NodeState state) { visit(law.type, node, state); });
    }
  }

  /// The nodes' contribution to the state hash, kept up to date by every change: the sum over the
  /// remembered nodes of NodeHash.
  uint64_t hash() const { return hash_; }

  /// Hash64 of (kind 'N', type, column, row, count, time); time 0 where nothing evaporates.
  static uint64_t NodeHash(const PheromoneLaw& law, NodeIndex node, NodeState state);

  size_t node_count() const;
  size_t tile_count() const { return budget_.used; }
  size_t tile_limit() const { return budget_.limit; }

 private:
  bool Store(const PheromoneLaw& law, NodeIndex node, NodeState state, uint64_t now_ms);
  void SweepAll(uint64_t now_ms);
  void LayPath(const Path& path, uint64_t now_ms);
  void Rebase(const PheromoneLaw& from, const PheromoneLaw& to, uint64_t now_ms);

  FieldConfig config_;
  TileBudget budget_;
  std::array<CellMap, kTypes> layers_;
  uint64_t hash_ = 0;
  uint64_t next_sweep_ms_ = 0;  // nothing that a sweep could give back dies before
};

}  // namespace pheromone::field
