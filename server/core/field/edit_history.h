// The latest edits of the map, to be undone and redone.
//
// Undo is exact: it leaves every node as it would be if the edit had never been made and everything
// else had happened as it did, with the same level and the same time of the last deposit, to the
// bit, so that it also evaporates alike from then on; redo leaves it as if the edit had never been
// undone. For this, each edit keeps, for every node that it changed, the node's state on the other
// side of the edit: without it while it is made, with it while it is undone. A deposit on such a
// node is also made on that state, by the same law (eq. (2), Susnea et al. 2009) with the same
// limit. Evaporation needs nothing, since a state is a level and a time, and what is left of it is
// computed when it is read. Undo and redo exchange the two states. Edits are undone from the last
// one backwards. Whether there was memory for a deposit is not decided again. Of a pheromone that
// diffuses, a node gets back its content from before the edit, plus what was deposited on it since:
// what has flowed or evaporated since is not made up for.
//
//   history.Record(info, law, node, state);   // before an edit changes the node
//   history.Change(type, node, [](NodeState other) { ... });   // after a deposit on it
//
// The memory is bounded: kMaxEdits edits, and a quarter of the map's memory limit beside it (16 MiB
// hold about two million nodes). Beyond that, the oldest ones are forgotten; an edit that is too
// large by itself is made, but cannot be undone, and with it all before it are forgotten. So are
// the edits of a pheromone whose law changes.
//
// All of it is part of the field's state. States of a diffusing type are its contents, with time 0.
// To be used by the field's writer only.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <utility>
#include <vector>

#include "server/base/bytes.h"
#include "server/base/fields.h"
#include "server/core/field/cell_map.h"
#include "server/core/field/config.h"
#include "server/core/field/edit.h"
#include "server/core/field/law.h"
#include "server/core/field/memory.h"

namespace pheromone::field {

/// What an edit was.
struct EditInfo {
  uint64_t id = 0;     ///< the log's sequence number of the event that began it
  int64_t utc_ms = 0;  ///< when; for display only
  bool is_configuration =
      false;  ///< paths and initial rasters of a configuration; the rest means nothing
  uint8_t type = 0;
  FieldEdit::Shape shape = FieldEdit::Shape::kRectangle;
  FieldEdit::Action action = FieldEdit::Action::kSet;
  bool operator==(const EditInfo&) const = default;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("id", it.id);
    visit("utc_ms", it.utc_ms);
    visit("is_configuration", it.is_configuration);
    visit("type", it.type);
    visit("shape", it.shape, UpTo(FieldEdit::Shape::kAll));
    visit("action", it.action, UpTo(FieldEdit::Action::kErase));
  }
};

class EditHistory {
 public:
  static constexpr size_t kMaxEdits = 32;
  /// The memory for a map with this limit.
  static constexpr uint64_t LimitOf(uint64_t map_bytes) { return map_bytes / 4; }

  /// The other states of the nodes of one type. Each is stored as a state whose level is not 0.
  struct Sheet {
    uint8_t type = 0;
    bool diffuses = false;
    std::unique_ptr<CellMap> cells;
    uint64_t hash = 0;  // the sum over the stored states
  };
  struct Entry {
    EditInfo info;
    std::vector<Sheet> sheets;
  };

  /// As for a CellMap.
  EditHistory(int32_t columns, int32_t rows, Reclaimer* reclaimer, TilePool* pool);
  EditHistory(const EditHistory&) = delete;
  EditHistory& operator=(const EditHistory&) = delete;
  ~EditHistory() = default;

  /// The edit that undo or redo would take; null: there is none.
  const Entry* Next(bool redo) const;
  Entry* Next(bool redo) { return const_cast<Entry*>(std::as_const(*this).Next(redo)); }
  /// How many edits can no longer be undone.
  uint64_t forgotten() const { return forgotten_; }
  uint64_t used_bytes() const { return budget_.used_bytes; }
  uint64_t limit_bytes() const { return budget_.limit_bytes; }
  /// Forgets what does not fit: what was done first, then what would be redone last.
  void SetLimit(uint64_t bytes);

  /// Records a node's state before it is changed by an edit, unless a part of the edit has recorded
  /// it before. The first node of an edit discards what was undone. If the last edit has the ID
  /// `continues`, this one is a part of it. False: the edit is too large, and everything is
  /// forgotten; do not record the rest of it.
  bool Record(const EditInfo& info, uint64_t continues, const PheromoneLaw& law, NodeIndex node,
              NodeState before);
  /// The same for an edit that is known to be too large, instead of recording any of it.
  void Refuse(uint64_t id, uint64_t continues) {
    forgotten_ += IdOf(id, continues) == 0 ? 1u : 0u;
    ForgetAll();
  }
  /// The ID under which an edit is recorded; 0 if it is not.
  uint64_t IdOf(uint64_t id, uint64_t continues) const;

  /// Replaces each other state of a node by `change(state)`.
  template <typename Replacement>
  void Change(uint8_t type, NodeIndex node, Replacement&& change) {
    for (Entry& entry : entries_) {
      for (Sheet& sheet : entry.sheets) {
        if (sheet.type != type) {
          continue;
        }
        if (const NodeState stored = sheet.cells->Read(node); stored.level != 0) {
          Put(&sheet, node, stored, change(Unpacked(sheet.diffuses, stored)));
        }
      }
    }
  }

  /// Calls `visit(NodeIndex, NodeState)` for the nodes in one row of tiles of a sheet; returns how
  /// many there were. The visitor may call Exchange.
  template <typename Visit>
  static int VisitRow(const Sheet& sheet, int32_t leaf, int32_t row, Visit&& visit) {
    int nodes = 0;
    sheet.cells->ForEachInLeafRow(leaf, row, [&](NodeIndex node, NodeState stored) {
      ++nodes;
      visit(node, Unpacked(sheet.diffuses, stored));
    });
    return nodes;
  }
  /// Replaces the other state of a node that the sheet has by the node's present state.
  static void Exchange(Sheet* sheet, NodeIndex node, NodeState present) {
    Put(sheet, node, sheet->cells->Read(node), present);
  }
  /// The next edit to be undone, or redone, is so now: all of its states were exchanged.
  void Moved(bool redo) { redo ? ++done_ : --done_; }

  /// Forgets the edits of a type, or all.
  void Forget(uint8_t type);
  void ForgetAll();
  /// As if there had been none.
  void Clear() {
    ForgetAll();
    forgotten_ = 0;
  }

  /// Canonical bytes; the cells are in portions of their own (frozen_field.h).
  void Save(ByteWriter* writer) const;
  /// Calls `text(writer)` and `cells(CellMap)` for what Save writes, in this order.
  template <typename Text, typename Cells>
  void SaveParts(Text&& text, Cells&& cells) const {
    text([&](ByteWriter* writer) {
      writer->U64(forgotten_);
      writer->Count(entries_.size());
      writer->Count(done_);
    });
    for (const Entry& entry : entries_) {
      text([&](ByteWriter* writer) {
        EncodeFields(entry.info, writer);
        writer->Count(entry.sheets.size());
      });
      for (const Sheet& sheet : entry.sheets) {
        text([&](ByteWriter* writer) { writer->U8(sheet.type); });
        cells(*sheet.cells);
      }
    }
  }
  /// Into an empty one. Invalid data is a failure of the reader.
  void Restore(const FieldConfig& config, ByteReader* reader);
  /// 0 while there is nothing.
  uint64_t Hash() const;

 private:
  // A stored state has a level of at least 1: one more than the node's, or than the upper bits of a
  // content, whose lower ones are the time.
  static constexpr int kContentBits = 10;
  static NodeState Packed(bool diffuses, NodeState state) {
    return diffuses ? NodeState{(state.level >> kContentBits) + 1,
                                state.level & ((1u << kContentBits) - 1)}
                    : NodeState{state.level + 1, state.level != 0 ? state.time_ms : 0};
  }
  static NodeState Unpacked(bool diffuses, NodeState stored) {
    return diffuses ? NodeState{(stored.level - 1) << kContentBits |
                                    static_cast<uint32_t>(stored.time_ms),
                                0}
                    : NodeState{stored.level - 1, stored.time_ms};
  }
  static uint64_t HashOf(NodeIndex node, NodeState stored);
  static bool Put(Sheet* sheet, NodeIndex node, NodeState before, NodeState state);

  Entry* Open(const EditInfo& info, uint64_t continues);
  Sheet* SheetOf(Entry* entry, const PheromoneLaw& law);
  std::unique_ptr<CellMap> MakeCells();
  void Release(Entry* entry);
  void DropFirst();
  void DropLast();  // of those that are undone
  bool IsLast(uint64_t id) const {
    return id != 0 && !entries_.empty() && done_ == entries_.size() &&
           entries_.back().info.id == id;
  }

  int32_t columns_;
  int32_t rows_;
  Reclaimer* reclaimer_;
  TilePool* pool_;
  MemoryBudget budget_;
  std::deque<Entry> entries_;  // in the order in which they were made
  size_t done_ = 0;            // of them; the others are undone
  uint64_t forgotten_ = 0;
};

}  // namespace pheromone::field
