#include "server/core/field/work.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <string>
#include <utility>

#include "server/base/hash.h"
#include "server/core/field/field.h"

namespace pheromone::field {
namespace {

uint64_t HashEdit(const FieldEdit& edit) {
  uint64_t hash = Hash64(
      {edit.type, static_cast<uint64_t>(edit.shape), static_cast<uint64_t>(edit.action), edit.level,
       static_cast<uint64_t>(edit.radius_um), edit.continues, edit.points.size()});
  for (const PointUm point : edit.points) {
    hash = HashStep(HashStep(hash, static_cast<uint64_t>(point.x)), static_cast<uint64_t>(point.y));
  }
  return hash;
}

FieldEdit RestoreEdit(ByteReader* reader) {
  FieldEdit edit;
  DecodeFields(reader, &edit);
  if (edit.type >= kTypes || !CheckShape(edit).ok()) {
    reader->Fail("an edit under way that no edit can be");
  }
  return edit;
}

void SaveNode(NodeIndex node, ByteWriter* writer) {
  writer->I32(node.column);
  writer->I32(node.row);
}

NodeIndex RestoreNode(const MapGeometry& map, ByteReader* reader) {
  const int32_t column = reader->I32();
  const NodeIndex node{column, reader->I32()};
  if (node.column < 0 || node.row < 0 || node.column >= map.columns() || node.row >= map.rows()) {
    reader->Fail("a node to be laid or erased is not on the map");
    return {};
  }
  return node;
}

void SavePlan(const LayPlan& plan, ByteWriter* writer) {
  writer->Count(plan.erase.size());
  for (const auto& [type, node] : plan.erase) {
    writer->U8(type);
    SaveNode(node, writer);
  }
  writer->Count(plan.lay.size());
  for (const LayPlan::Laid& laid : plan.lay) {
    writer->U8(laid.type);
    writer->Count(laid.nodes->size());
    for (const InitialNode& it : *laid.nodes) {
      SaveNode(it.node, writer);
      writer->U32(it.level);
    }
  }
  writer->U64(plan.bytes);
}

LayPlan RestorePlan(const FieldConfig& config, ByteReader* reader) {
  LayPlan plan;
  for (uint32_t left = reader->Count(); left > 0 && reader->ok(); --left) {
    const uint8_t type = reader->U8UpTo(kTypes - 1, "a pheromone type");
    plan.erase.emplace_back(type, RestoreNode(config.map, reader));
  }
  for (uint32_t left = reader->Count(); left > 0 && reader->ok(); --left) {
    const uint8_t type = reader->U8UpTo(kTypes - 1, "a pheromone type");
    const PheromoneLaw* law = config.FindLaw(type);
    if (law == nullptr || law->is_blend()) {
      reader->Fail("a deposit to a type that is not configured or is a blend");
    }
    std::vector<InitialNode> nodes;
    for (uint32_t more = reader->Count(); more > 0 && reader->ok(); --more) {
      const NodeIndex node = RestoreNode(config.map, reader);
      nodes.push_back({node, reader->U32()});
    }
    plan.lay.push_back({type, Shared(std::move(nodes))});
  }
  plan.bytes = reader->U64();
  return plan;
}

// Skips what was done before a restart.
void FindPlace(Work* work) {
  uint64_t left = work->done;
  for (const NodeRun& run : work->raster->runs) {
    const uint64_t nodes = static_cast<uint64_t>(run.last - run.first) + 1;
    if (left < nodes) {
      break;
    }
    left -= nodes;
    ++work->run;
  }
  work->in_run = static_cast<int32_t>(left);
}

}  // namespace

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

void SaveWork(const Work& work, ByteWriter* writer) {
  writer->U64(work.id);
  writer->U8(static_cast<uint8_t>(work.kind));
  writer->U8(static_cast<uint8_t>(work.phase));
  writer->U64(work.counted);
  writer->U64(work.missing_bytes);
  writer->Flag(work.swept);
  writer->U64(work.done);
  writer->U64(work.reserved_bytes);
  writer->I64(work.utc_ms);
  writer->Flag(work.is_recorded);
  writer->U64(work.changed);
  if (work.kind == Work::Kind::kEdit) {
    EncodeFields(work.edit, writer);
  } else if (work.kind == Work::Kind::kLay) {
    SavePlan(*work.plan, writer);
  }
}

Work RestoreWork(const FieldConfig& config, const EditHistory& history, ByteReader* reader) {
  Work work;
  work.id = reader->U64();
  work.kind = static_cast<Work::Kind>(
      reader->U8UpTo(static_cast<uint8_t>(Work::Kind::kRedo), "the kind of a change under way"));
  work.phase = static_cast<Work::Phase>(
      reader->U8UpTo(static_cast<uint8_t>(Work::Phase::kApply), "the phase of a change"));
  work.counted = reader->U64();
  work.missing_bytes = reader->U64();
  work.swept = reader->Flag();
  work.done = reader->U64();
  work.reserved_bytes = reader->U64();
  work.utc_ms = reader->I64();
  work.is_recorded = reader->Flag();
  work.changed = reader->U64();
  if (work.reverses()) {
    if (history.Next(work.kind == Work::Kind::kRedo) == nullptr) {
      reader->Fail("an undoing under way of an edit that is not there");
    }
    return work;
  }
  if (work.kind == Work::Kind::kLay) {
    work.plan = std::make_shared<const LayPlan>(RestorePlan(config, reader));
    if (work.done > work.plan->size() || work.phase != Work::Phase::kApply) {
      reader->Fail("a change under way has done more than there is to do");
    }
    return work;
  }
  work.edit = RestoreEdit(reader);
  Result<Raster> raster =
      reader->ok() ? RasterFor(work.edit, config.map) : Result<Raster>(Raster{});
  if (!raster.ok()) {
    reader->Fail(raster.error());
    raster = Raster{};
  }
  if ((!work.erases_all() && work.done > static_cast<uint64_t>(raster.value().node_count)) ||
      work.counted > raster.value().tiles.size()) {
    reader->Fail("an edit under way has done more than there is to do");
    work.done = 0;
  }
  work.raster = std::make_shared<const Raster>(std::move(raster).value());
  FindPlace(&work);
  return work;
}

uint64_t HashWork(const Work& work) {
  return Hash64({'J', work.id, static_cast<uint64_t>(work.kind), static_cast<uint64_t>(work.phase),
                 work.counted, work.missing_bytes, work.swept ? 1u : 0u, work.done,
                 work.reserved_bytes, static_cast<uint64_t>(work.utc_ms),
                 work.is_recorded ? 1u : 0u, work.changed,
                 work.kind == Work::Kind::kEdit  ? HashEdit(work.edit)
                 : work.kind == Work::Kind::kLay ? work.plan->size()
                                                 : 0});
}

// --- The field's part.

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
  works_.push_back(std::move(work));
  if (works_.size() == 1) {
    MakePortion(now_ms);
  }
}

Status Field::CheckReverse(bool redo) const {
  if (!works_.empty()) {
    return Error{"the map is still being changed by an earlier request; try again in a moment"};
  }
  if (history_.Next(redo) != nullptr) {
    return Ok();
  }
  const std::string nothing = redo ? "nothing to redo" : "nothing to undo";
  if (redo || history_.forgotten() == 0) {
    return Error{nothing};
  }
  constexpr uint64_t kMiB = uint64_t{1} << 20;
  return Error{nothing + ": " + std::to_string(history_.forgotten()) +
               (history_.forgotten() == 1 ? " earlier edit is" : " earlier edits are") +
               " forgotten; the last " + std::to_string(EditHistory::kMaxEdits) +
               " are kept, as far as they fit into " +
               std::to_string(history_.limit_bytes() / kMiB) +
               " MiB and until the law of their pheromone changes"};
}

void Field::BeginReverse(uint64_t id, bool redo, uint64_t now_ms) {
  assert(CheckReverse(redo).ok());
  Work work;
  work.id = id;
  work.kind = redo ? Work::Kind::kRedo : Work::Kind::kUndo;
  works_.push_back(std::move(work));
  MakePortion(now_ms);
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

// Calls `visit_row(leaf, row)` for rows of tiles from number `*position` on, as far as what is left
// of the portion goes: it returns how many nodes it visited. True if there are no more.
template <typename HasTiles, typename VisitRow>
bool Field::VisitRows(uint64_t* position, int64_t* left, HasTiles&& has_tiles,
                      VisitRow&& visit_row) const {
  constexpr int kRow = kWorkOfNode / 4;
  const uint64_t end = RowsOfTiles();
  while (*position < end) {
    if (*left <= 0) {
      return false;
    }
    const auto leaf = static_cast<int32_t>(*position / kLeafSide);
    if (!has_tiles(leaf)) {
      *position = (*position / kLeafSide + 1) * kLeafSide;
      *left -= 1;
      continue;
    }
    *left -= kRow + kWorkOfNode * visit_row(leaf, static_cast<int32_t>(*position % kLeafSide));
    ++*position;
  }
  return true;
}

// Calls `visit(sheet, law, leaf, node, other)` for one portion of an edit's nodes: from row of
// tiles number `*position` on, counted through all sheets. `end_sheet()` after each of these: if it
// returns false, nothing more is done. True if there are no more.
template <typename Visit, typename EndSheet>
bool Field::VisitSheets(EditHistory::Entry* entry, uint64_t* position, Visit&& visit,
                        EndSheet&& end_sheet) const {
  const uint64_t rows = RowsOfTiles();
  int64_t left = kNodesOfPortion * kWorkOfNode;
  while (*position < rows * entry->sheets.size()) {
    EditHistory::Sheet& sheet = entry->sheets[*position / rows];
    const PheromoneLaw& law = *FindLaw(sheet.type);
    const uint64_t first = *position % rows;
    uint64_t row = first;
    const bool all = VisitRows(
        &row, &left, [&](int32_t leaf) { return sheet.cells->tiles_in_leaf(leaf) != 0; },
        [&](int32_t leaf, int32_t leaf_row) {
          return EditHistory::VisitRow(sheet, leaf, leaf_row, [&](NodeIndex node, NodeState other) {
            visit(&sheet, law, leaf, node, other);
          });
        });
    *position += row - first;
    if (!all || !end_sheet()) {
      return false;
    }
  }
  return true;
}

// The tiles of nodes that get something back. True once the memory for all of them is reserved.
bool Field::ReserveForReverse(Work* work, uint64_t now_ms) {
  int32_t counted_leaf = -1;
  TileIndex counted{-1, -1};
  const auto count = [&](const EditHistory::Sheet*, const PheromoneLaw& law, int32_t leaf,
                         NodeIndex node, NodeState other) {
    const TileIndex tile{node.column / kTileSide, node.row / kTileSide};
    if (tile == counted || LevelOfState(law, other, now_ms) == 0) {
      return;
    }
    counted = tile;
    const bool leaf_counted = std::exchange(counted_leaf, leaf) == leaf;
    work->missing_bytes += BytesMissing(law, tile, leaf_counted, work->missing_bytes != 0);
  };
  // Reserved by type, so that it shows whether a type's table is counted.
  const auto end_sheet = [&] {
    counted_leaf = -1;
    counted = {-1, -1};
    return ReserveCounted(work, now_ms);
  };
  if (!VisitSheets(history_.Next(work->kind == Work::Kind::kRedo), &work->counted, count,
                   end_sheet)) {
    return false;
  }
  work->phase = Work::Phase::kApply;
  return true;
}

// Exchanges the states of the edit's nodes on both sides of it.
bool Field::ApplyReverse(Work* work, uint64_t now_ms) {
  budget_.reservation = &work->reserved_bytes;
  const bool all = VisitSheets(
      history_.Next(work->kind == Work::Kind::kRedo), &work->done,
      [&](EditHistory::Sheet* sheet, const PheromoneLaw& law, int32_t /*leaf*/, NodeIndex node,
          NodeState other) {
        const NodeState present = StateOf(law, node, now_ms);
        EditHistory::Exchange(sheet, node, present);
        Replace(work, law, node, present, other, now_ms);
      },
      [] { return true; });
  budget_.reservation = nullptr;
  return all;
}

// The state of a node under the present law, empty if it has evaporated; of a diffusing type, its
// content.
NodeState Field::StateOf(const PheromoneLaw& law, NodeIndex node, uint64_t now_ms) const {
  if (law.diffuses()) {
    return {layers_.diffusing[law.type]->Read(node), 0};
  }
  const NodeState state = Present(law.type, layers_.cells[law.type]->Read(node));
  return LevelAt(law, state, now_ms) != 0 ? state : NodeState{};
}

uint32_t Field::LevelOfState(const PheromoneLaw& law, NodeState state, uint64_t now_ms) {
  return law.diffuses() ? LevelOfDiffusing(state.level) : LevelAt(law, state, now_ms);
}

// Replaces a node's state; its memory was reserved.
void Field::Replace(Work* work, const PheromoneLaw& law, NodeIndex node, NodeState before,
                    NodeState state, uint64_t now_ms) {
  const uint32_t level = LevelOfState(law, state, now_ms);
  work->changed += level != LevelOfState(law, before, now_ms) ? 1u : 0u;
  const bool is_gone = level == 0 && !law.diffuses();
  const bool stored = SetState(law, node, is_gone ? NodeState{} : state, now_ms);
  assert(stored);
  (void)stored;
}

// Sets a node's level for an edit, and records what it held.
void Field::SetForEdit(Work* work, const PheromoneLaw& law, NodeIndex node, uint32_t level,
                       uint64_t now_ms) {
  const NodeState before = StateOf(law, node, now_ms);
  const NodeState next = StateAt(law, level, now_ms);
  const bool same = law.tau_ms == 0 ? before.level == next.level : before == next;
  if (work->is_recorded && !same) {
    const bool lays = work->kind == Work::Kind::kLay;
    const EditInfo info = lays ? EditInfo{work->id, work->utc_ms, true}
                               : EditInfo{work->id, work->utc_ms,     false,
                                          law.type, work->edit.shape, work->edit.action};
    work->is_recorded = history_.Record(info, work->edit.continues, law, node, before);
  }
  Replace(work, law, node, before, next, now_ms);
}

// Erases what there is. What is too much to be recorded is erased at once, unless it diffuses: then
// it shows only on the way.
bool Field::EraseRecorded(Work* work, uint64_t now_ms) {
  const uint8_t type = work->edit.type;
  const PheromoneLaw& law = *FindLaw(type);
  CellMap& cells = *layers_.cells[type];
  if (work->done == 0 && !law.diffuses() &&
      cells.tile_count() * CellMap::kTileBytes > history_.limit_bytes()) {
    history_.Refuse(work->id, work->edit.continues);
    work->is_recorded = false;
    work->changed = cells.node_count();
    EraseAll(type);
    return true;
  }
  int64_t left = kNodesOfPortion * kWorkOfNode;
  const auto erase = [&](NodeIndex node) { SetForEdit(work, law, node, 0, now_ms); };
  if (!law.diffuses()) {
    return VisitRows(
        &work->done, &left, [&](int32_t leaf) { return cells.tiles_in_leaf(leaf) != 0; },
        [&](int32_t leaf, int32_t row) {
          int nodes = 0;
          cells.ForEachInLeafRow(leaf, row, [&](NodeIndex node, NodeState) {
            ++nodes;
            erase(node);
          });
          return nodes;
        });
  }
  const DiffusionLayer& layer = *layers_.diffusing[type];
  const int32_t leaf_columns = cells.leaf_columns();
  return VisitRows(
      &work->done, &left, [&](int32_t) { return !layer.empty(); },
      [&](int32_t leaf, int32_t row) {
        int nodes = 0;
        for (int32_t i = 0; i < kLeafSide; ++i) {
          const NodeIndex tile{leaf % leaf_columns * kLeafSide + i,
                               leaf / leaf_columns * kLeafSide + row};
          for (uint64_t rest = layer.Find(tile.column, tile.row).occupied; rest != 0;
               rest &= rest - 1) {
            const int slot = std::countr_zero(rest);
            erase({tile.column * kTileSide + slot % kTileSide,
                   tile.row * kTileSide + slot / kTileSide});
            ++nodes;
          }
        }
        return nodes;
      });
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
  return work->run == runs.size();
}

bool Field::ApplyPlan(Work* work, uint64_t now_ms) {
  const LayPlan& plan = *work->plan;
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
    left -= layer.ForEachInLeafRow(leaf, rebase_row_ % kLeafSide,
                                   [&](NodeIndex node, NodeState stored) {
                                     if (stored.time_ms < change->at_ms) {
                                       Store(law, node, Rebased(change, law, stored), 0);
                                     }
                                   });
    ++rebase_row_;
  }
  if (rebase_type_ == kTypes) {
    auto next = std::make_unique<Setup>(setup.shared);
    Publish(std::move(next));
    is_rebasing_ = false;
    rebase_type_ = 1;
  }
}

uint64_t Field::HashOfWork() const {
  uint64_t hash = 0;
  for (const Work& work : works_) {
    hash += HashWork(work);
  }
  if (is_rebasing_) {
    hash += Hash64({'P', rebase_type_, static_cast<uint64_t>(rebase_row_)});
    for (uint8_t type = 1; type < kTypes; ++type) {
      if (const LawChange* change = current().ChangeOf(type); change != nullptr) {
        const PheromoneLaw& from = change->from;
        hash += Hash64({'L', type, change->at_ms, static_cast<uint64_t>(from.evaporation),
                        static_cast<uint64_t>(from.tau_ms),
                        static_cast<uint64_t>(from.quantum_micro), from.max_count});
      }
    }
  }
  return hash;
}

}  // namespace pheromone::field
