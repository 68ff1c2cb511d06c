// Changes of the map that are too large to be made at once: edits of many nodes, their undoing, and
// the paths and initial rasters of a new configuration. They are made in bounded portions, between
// which robots are served, and all or nothing: the memory that a change needs is reserved before
// its first node is changed, and there is no sweep, diffusion step or conversion while one is in
// progress, so that no portion can fail.
//
//   field.BeginEdit(sequence, edit, raster, now_ms);     // the first portion is made at once
//   while (field.busy()) field.Advance(now_ms);          // each makes another one
//   field.TakeFinished(&finished);                       // by sequence, with their results
//
// What depends only on the map's geometry (the raster of an edit, the plan of a change of the
// configuration) can be computed in advance, by any thread; it is not part of the state.
#pragma once

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "server/base/bytes.h"
#include "server/base/result.h"
#include "server/core/field/config.h"
#include "server/core/field/edit.h"
#include "server/core/field/edit_history.h"
#include "server/core/field/raster.h"

namespace pheromone::field {

/// A node of a type; ordered.
using LaidNode = std::pair<uint8_t, NodeIndex>;

/// The nodes that a change of the configuration erases and deposits: those of removed paths and
/// initial rasters, except nodes shared with a remaining one, and those of new ones. A deposit sets
/// the minimum content of a node; nodes on obstacles are omitted.
struct LayPlan {
  struct Laid {
    uint8_t type = 0;
    Shared<std::vector<InitialNode>> nodes;
  };
  std::vector<LaidNode> erase;
  std::vector<Laid> lay;
  uint64_t bytes = 0;  ///< upper bound of the memory for the deposits

  bool empty() const { return erase.empty() && lay.empty(); }
  uint64_t size() const;  ///< steps: nodes to erase and to deposit
};

/// The time is proportional to the size of both configurations.
LayPlan PlanLaying(const FieldConfig& before, const FieldConfig& next);

/// The raster of an edit: RasterOf, or nothing if everything is erased, which visits the existing
/// nodes instead.
Result<Raster> RasterFor(const FieldEdit& edit, const MapGeometry& map);

/// A change in progress. Everything is part of the state except `raster`, which is derived from it.
struct Work {
  enum class Kind : uint8_t { kEdit, kLay, kUndo, kRedo };
  enum class Phase : uint8_t {
    kReserve,  ///< memory is being counted; nothing has changed
    kApply,
  };

  uint64_t id = 0;  ///< the log's sequence number of the event that began it
  Kind kind = Kind::kEdit;
  Phase phase = Phase::kReserve;
  FieldEdit edit;
  std::shared_ptr<const LayPlan> plan;
  int64_t utc_ms = 0;           ///< of the event
  bool is_recorded = true;      ///< to be undone: it is not too large
  uint64_t changed = 0;         ///< nodes whose level became another one
  uint64_t counted = 0;         ///< kReserve: tiles visited; kUndo, kRedo: rows of tiles
  uint64_t missing_bytes = 0;   ///< of the missing ones among them; not yet reserved
  bool swept = false;           ///< memory was short and evaporated nodes were removed
  uint64_t done = 0;            ///< kApply: nodes, steps of the plan, or rows of tiles
  uint64_t reserved_bytes = 0;  ///< not yet used

  std::shared_ptr<const Raster> raster;
  size_t run = 0;      // of the raster, where `done` is,
  int32_t in_run = 0;  // and the nodes of it that are done

  bool reverses() const { return kind == Kind::kUndo || kind == Kind::kRedo; }
  bool erases_all() const {
    return kind == Kind::kEdit && edit.shape == FieldEdit::Shape::kAll &&
           edit.action == FieldEdit::Action::kErase;
  }
};

struct FinishedWork {
  uint64_t id = 0;
  Status outcome = Ok();  ///< if not ok, nothing was changed
  uint64_t changed = 0;   ///< nodes whose level became another one
  /// The ID of the edit in the history; 0: it cannot be undone, since it is too large or changed
  /// nothing.
  uint64_t edit = 0;
};

/// Encodes and decodes a change; the raster is recomputed. Invalid data is a failure of the reader.
/// `config` is that of the field; `history` was restored before.
void SaveWork(const Work& work, ByteWriter* writer);
Work RestoreWork(const FieldConfig& config, const EditHistory& history, ByteReader* reader);
uint64_t HashWork(const Work& work);

}  // namespace pheromone::field
