// What an edit records in the history (edit_history.h) of the nodes that it changes, and undo and
// redo, which put it back.

#include <bit>
#include <cassert>
#include <string>
#include <utility>

#include "server/core/field/field.h"

namespace pheromone::field {

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

// Calls `visit_row(leaf, row)` for rows of tiles from number `*position` on, as far as what is left
// of the portion goes: `visit_row` returns how many nodes it visited. True if there are no more.
template <typename HasTiles, typename VisitRow>
bool Field::VisitRows(uint64_t* position, int64_t* left, HasTiles&& has_tiles,
                      VisitRow&& visit_row) {
  constexpr int kRow = kWorkOfNode / 4;
  const uint64_t end = RowsOfTiles();
  const int64_t before = *left;
  while (*left > 0 && *position < end) {
    const auto leaf = static_cast<int32_t>(*position / kLeafSide);
    if (!has_tiles(leaf)) {
      *position = (*position / kLeafSide + 1) * kLeafSide;
      *left -= 1;
      continue;
    }
    *left -= kRow + kWorkOfNode * visit_row(leaf, static_cast<int32_t>(*position % kLeafSide));
    ++*position;
  }
  cost_ += static_cast<uint64_t>(before - *left) / kWorkOfNode;
  return *position >= end;
}

// Calls `visit(sheet, law, leaf, node, other)` for one portion of an edit's nodes: from row of
// tiles number `*position` on, counted through all sheets. `end_sheet()` after each of these: if it
// returns false, nothing more is done. True if there are no more.
template <typename Visit, typename EndSheet>
bool Field::VisitSheets(EditHistory::Entry* entry, uint64_t* position, Visit&& visit,
                        EndSheet&& end_sheet) {
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
    ++cost_;
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

}  // namespace pheromone::field
