#include "server/core/field/work.h"

#include <algorithm>
#include <cassert>
#include <memory>
#include <utility>

#include "server/core/field/field.h"

namespace pheromone::field {

Result<Raster> RasterFor(const FieldEdit& edit, const MapGeometry& map) {
  const bool takes_all =
      edit.shape == FieldEdit::Shape::kAll && edit.action == FieldEdit::Action::kErase;
  return takes_all ? Result<Raster>(Raster{}) : RasterOf(edit, map);
}

uint64_t LayPlan::size() const {
  uint64_t size = erase.size();
  for (const Laid& laid : lay) {
    size += laid.nodes->size();
  }
  return size;
}

void Field::BeginEdit(uint64_t id, const FieldEdit& edit, std::shared_ptr<const Raster> raster,
                      uint64_t now_ms, int64_t utc_ms) {
  assert(accepts_work());
  Work work;
  work.id = id;
  work.utc_ms = utc_ms;
  work.edit = edit;
  work.raster = std::move(raster);
  if (work.raster == nullptr) {
    work.raster = std::make_shared<const Raster>(RasterFor(edit, config().map).value());
  }
  cost_ += static_cast<uint64_t>(work.raster->steps);
  works_.push_back(std::move(work));
  if (works_.size() == 1) {
    MakePortion(now_ms);
  }
}

// One portion of the first pending change.
void Field::MakePortion(uint64_t now_ms) {
  Work& work = works_.front();
  if (work.reverses()) {
    const bool redo = work.kind == Work::Kind::kRedo;
    if (work.phase == Work::Phase::kReserve && !ReserveForReverse(&work, now_ms)) {
      return;
    }
    if (ApplyReverse(&work, now_ms)) {
      history_.Moved(redo);
      Finish(Ok());
    }
    return;
  }
  if (work.kind == Work::Kind::kLay) {
    if (ApplyPlan(&work, now_ms)) {
      Finish(Ok());
    }
    return;
  }
  const PheromoneLaw* law = FindLaw(work.edit.type);
  if (law == nullptr || law->is_blend()) {
    Finish(Error{"its pheromone has left the configuration"});
    return;
  }
  if (work.phase == Work::Phase::kReserve && !ReserveForEdit(&work, now_ms)) {
    return;
  }
  if (ApplyEdit(&work, now_ms)) {
    Finish(Ok());
  }
}

void Field::Finish(Status outcome) {
  const Work& work = works_.front();
  budget_.Give(work.reserved_bytes);
  const bool has_entry = outcome.ok() && work.is_recorded && !work.reverses();
  finished_.push_back({work.id, std::move(outcome), work.changed,
                       has_entry ? history_.IdOf(work.id, work.edit.continues) : 0});
  works_.pop_front();
}

uint64_t Field::BytesMissing(const PheromoneLaw& law, TileIndex tile, bool leaf_counted,
                             bool top_counted) const {
  const auto its = [&](const auto& layer) {
    return layer.BytesMissing(tile.column, tile.row, leaf_counted, top_counted);
  };
  return law.diffuses() ? its(*layers_.diffusing[law.type]) : its(*layers_.cells[law.type]);
}

// True once the memory for the complete edit is reserved. False: not yet, or the edit has failed
// for lack of memory.
bool Field::ReserveForEdit(Work* work, uint64_t now_ms) {
  if (work->edit.action == FieldEdit::Action::kErase) {
    work->phase = Work::Phase::kApply;
    return true;
  }
  const PheromoneLaw& law = *FindLaw(work->edit.type);
  const std::vector<TileIndex>& tiles = work->raster->tiles;
  const auto leaf_of = [](TileIndex tile) {
    return std::pair(tile.column / kLeafSide, tile.row / kLeafSide);
  };
  const uint64_t end = std::min<uint64_t>(tiles.size(), work->counted + kTilesCountedAtOnce);
  cost_ += end - work->counted;
  for (; work->counted < end; ++work->counted) {
    const TileIndex tile = tiles[work->counted];
    const bool leaf_counted =
        work->counted > 0 && leaf_of(tiles[work->counted - 1]) == leaf_of(tile);
    work->missing_bytes += BytesMissing(law, tile, leaf_counted, work->missing_bytes != 0);
  }
  if (work->counted < tiles.size()) {
    return false;
  }
  if (!ReserveCounted(work, now_ms)) {
    return false;
  }
  work->phase = Work::Phase::kApply;
  return true;
}

// Reserves what was counted. False: there is no memory, and all is counted again, or the edit has
// failed.
bool Field::ReserveCounted(Work* work, uint64_t now_ms) {
  if (budget_.Take(work->missing_bytes)) {
    work->reserved_bytes += std::exchange(work->missing_bytes, 0);
    return true;
  }
  if (!work->swept) {
    work->swept = true;
    // Some of the counted tiles may have been removed: count again.
    work->counted = 0;
    work->missing_bytes = 0;
    budget_.Give(std::exchange(work->reserved_bytes, 0));
    if (SweepPortion(now_ms, kTilesAtOnce)) {
      return false;
    }
  }
  Finish(Error{"there is no memory left for all of the edit; nothing was changed"});
  return false;
}

// True when everything is done. No node can fail: its memory was reserved, and no tile is removed
// meanwhile.
bool Field::ApplyEdit(Work* work, uint64_t now_ms) {
  const FieldEdit& edit = work->edit;
  if (work->erases_all()) {
    return EraseRecorded(work, now_ms);
  }
  const PheromoneLaw& law = *FindLaw(edit.type);
  const std::vector<NodeRun>& runs = work->raster->runs;
  const uint64_t done_before = work->done;
  budget_.reservation = &work->reserved_bytes;
  for (int left = kNodesOfPortion; left > 0 && work->run < runs.size(); --left) {
    const NodeRun& run = runs[work->run];
    const NodeIndex node{run.first + work->in_run, run.row};
    if (node.column == run.last) {
      ++work->run;
      work->in_run = 0;
    } else {
      ++work->in_run;
    }
    ++work->done;
    if (edit.action == FieldEdit::Action::kErase) {
      SetForEdit(work, law, node, 0, now_ms);
    } else if (!IsBlocked(node)) {
      uint64_t level = edit.level;
      level += edit.action == FieldEdit::Action::kAdd ? LevelOf(edit.type, node, now_ms) : 0;
      level = std::min<uint64_t>(level, law.max_level());
      SetForEdit(work, law, node, static_cast<uint32_t>(level), now_ms);
    }
  }
  budget_.reservation = nullptr;
  cost_ += work->done - done_before;
  return work->run == runs.size();
}

bool Field::ApplyPlan(Work* work, uint64_t now_ms) {
  const LayPlan& plan = *work->plan;
  const uint64_t done_before = work->done;
  budget_.reservation = &work->reserved_bytes;
  int left = kNodesOfPortion;
  for (; left > 0 && work->done < plan.erase.size(); --left, ++work->done) {
    const auto& [type, node] = plan.erase[work->done];
    if (const PheromoneLaw* law = FindLaw(type); law != nullptr && !law->is_blend()) {
      SetForEdit(work, *law, node, 0, now_ms);
    }
  }
  uint64_t begin = plan.erase.size();  // of a list, in steps
  for (const LayPlan::Laid& laid : plan.lay) {
    const std::vector<InitialNode>& nodes = *laid.nodes;
    const PheromoneLaw* law = FindLaw(laid.type);
    for (; left > 0 && work->done < begin + nodes.size(); --left, ++work->done) {
      const InitialNode& it = nodes[work->done - begin];
      const uint32_t wanted = std::min(it.level, law->max_level());
      if (!IsBlocked(it.node) && LevelOf(laid.type, it.node, now_ms) < wanted) {
        SetForEdit(work, *law, it.node, wanted, now_ms);
      }
    }
    begin += nodes.size();
  }
  budget_.reservation = nullptr;
  cost_ += work->done - done_before;
  return work->done == begin;
}

// Converts nodes that were stored under an earlier law, one row of tiles after the other. When none
// are left, that law is dropped.
void Field::RebasePortion() {
  const Setup& setup = current();
  for (int left = kTilesRebasedAtOnce; left > 0 && rebase_type_ < kTypes; --left) {
    const LawChange* change = setup.ChangeOf(rebase_type_);
    CellMap& layer = *layers_.cells[rebase_type_];
    const int32_t leaf = rebase_row_ / kLeafSide;
    if (change == nullptr || layer.tile_count() == 0 || leaf >= layer.leaf_count()) {
      rebase_row_ = 0;
      ++rebase_type_;
      continue;
    }
    if (layer.tiles_in_leaf(leaf) == 0) {
      rebase_row_ = (leaf + 1) * kLeafSide;
      continue;
    }
    const PheromoneLaw& law = *setup.law[rebase_type_];
    const int tiles = layer.ForEachInLeafRow(leaf, rebase_row_ % kLeafSide,
                                             [&](NodeIndex node, NodeState stored) {
                                               if (stored.time_ms < change->at_ms) {
                                                 Store(law, node, Rebased(change, law, stored), 0);
                                               }
                                             });
    left -= tiles;
    cost_ += static_cast<uint64_t>(tiles) * kCostOfRebasedTile;
    ++rebase_row_;
  }
  if (rebase_type_ == kTypes) {
    auto next = std::make_unique<Setup>(setup.shared);
    Publish(std::move(next));
    is_rebasing_ = false;
    rebase_type_ = 1;
  }
}

}  // namespace pheromone::field
