// Changes of the map that are too large to be made at once: edits of many nodes, and the paths and
// prints that a new configuration lays. They are made in bounded portions, between which robots
// have their turn, and all or nothing: the memory that a change needs is reserved before its first
// node is touched, and nothing is swept, spread or converted while one is under way, so that no
// portion can fail.
//
//   field.BeginEdit(sequence, edit, raster, now_ms);     // the first portion is made at once
//   while (field.busy()) field.Advance(now_ms);          // each makes another one
//   field.TakeFinished(&finished);                       // by sequence, with what became of them
//
// What is worked out from the map's geometry alone (the raster of an edit, the plan of a change of
// the configuration) can be made beforehand, by any thread; it is no part of the state.
#pragma once

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "server/base/bytes.h"
#include "server/base/result.h"
#include "server/field/config.h"
#include "server/field/edit.h"
#include "server/field/raster.h"

namespace pheromone::field {

/// A node of a type; ordered.
using LaidNode = std::pair<uint8_t, NodeIndex>;

/// What a change of the configuration erases and lays: the paths and prints that left it, but for
/// nodes that they share with one that stays, and those that came. What is laid is the least that a
/// node holds; what lies on an obstacle is left out.
struct LayPlan {
  struct Laid {
    uint8_t type = 0;
    Shared<std::vector<InitialNode>> nodes;
  };
  std::vector<LaidNode> erase;
  std::vector<Laid> lay;
  uint64_t bytes = 0;  ///< of memory, that laying takes at the most

  bool empty() const { return erase.empty() && lay.empty(); }
  uint64_t size() const;  ///< steps: nodes erased, and laid
};

/// In time that grows with both configurations.
LayPlan PlanLaying(const FieldConfig& before, const FieldConfig& next);

/// The raster that an edit is made by: RasterOf, or nothing where all is erased, which looks at
/// what is there instead.
Result<Raster> RasterFor(const FieldEdit& edit, const MapGeometry& map);

/// A change under way. All of it is part of the state but for `raster`, which follows from it.
struct Work {
  enum class Kind : uint8_t { kEdit, kLay };
  enum class Phase : uint8_t {
    kReserve,  ///< memory is being counted; nothing has changed
    kApply,
  };

  uint64_t id = 0;  ///< the log's sequence number of the event that began it
  Kind kind = Kind::kEdit;
  Phase phase = Phase::kReserve;
  FieldEdit edit;
  std::shared_ptr<const LayPlan> plan;
  uint64_t counted = 0;         ///< kReserve: tiles looked at
  uint64_t missing_bytes = 0;   ///< and what those take that are not there
  bool swept = false;           ///< memory was short: what has evaporated was given back
  uint64_t done = 0;            ///< kApply: nodes, or steps of the plan
  uint64_t reserved_bytes = 0;  ///< and not used yet

  std::shared_ptr<const Raster> raster;
  size_t run = 0;      // of the raster, where `done` is,
  int32_t in_run = 0;  // and the nodes of it that are done
};

struct FinishedWork {
  uint64_t id = 0;
  Status outcome = Ok();  ///< if not ok, nothing was changed
};

/// As bytes and back; the raster is made anew. What cannot be is a failure of the reader: `config`
/// is that of the field.
void SaveWork(const Work& work, ByteWriter* writer);
Work RestoreWork(const FieldConfig& config, uint8_t version, ByteReader* reader);
uint64_t HashWork(const Work& work);

}  // namespace pheromone::field
