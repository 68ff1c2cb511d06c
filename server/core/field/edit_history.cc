#include "server/core/field/edit_history.h"

#include <algorithm>
#include <utility>

#include "server/base/hash.h"
#include "server/core/field/diffusion.h"

namespace pheromone::field {

EditHistory::EditHistory(int32_t columns, int32_t rows, Reclaimer* reclaimer, TilePool* pool)
    : columns_(columns), rows_(rows), reclaimer_(reclaimer), pool_(pool) {}

const EditHistory::Entry* EditHistory::Next(bool redo) const {
  const bool exists = redo ? done_ < entries_.size() : done_ != 0;
  return exists ? &entries_[redo ? done_ : done_ - 1] : nullptr;
}

void EditHistory::SetLimit(uint64_t bytes) {
  budget_.limit_bytes = bytes;
  while (!entries_.empty() && budget_.used_bytes > bytes) {
    done_ != 0 ? DropFirst() : DropLast();
  }
}

std::unique_ptr<CellMap> EditHistory::MakeCells() {
  return std::make_unique<CellMap>(columns_, rows_, &budget_, reclaimer_, pool_);
}

EditHistory::Entry* EditHistory::Open(const EditInfo& info, uint64_t continues) {
  if (IsLast(info.id) || IsLast(continues)) {
    return &entries_.back();
  }
  while (entries_.size() > done_) {
    DropLast();
  }
  if (entries_.size() == kMaxEdits) {
    DropFirst();
  }
  entries_.push_back({info, {}});
  ++done_;
  return &entries_.back();
}

EditHistory::Sheet* EditHistory::SheetOf(Entry* entry, const PheromoneLaw& law) {
  const auto place = std::find_if(entry->sheets.begin(), entry->sheets.end(),
                                  [&](const Sheet& sheet) { return sheet.type >= law.type; });
  if (place != entry->sheets.end() && place->type == law.type) {
    return &*place;
  }
  return &*entry->sheets.insert(place, {law.type, law.diffuses(), MakeCells()});
}

bool EditHistory::Record(const EditInfo& info, uint64_t continues, const PheromoneLaw& law,
                         NodeIndex node, NodeState before) {
  Entry* const entry = Open(info, continues);
  Sheet* const sheet = SheetOf(entry, law);
  if (sheet->cells->Read(node).level != 0) {
    return true;
  }
  while (!Put(sheet, node, {}, before)) {
    if (entries_.size() == 1) {
      ForgetAll();
      return false;
    }
    DropFirst();  // which moves no entry
  }
  return true;
}

uint64_t EditHistory::IdOf(uint64_t id, uint64_t continues) const {
  return IsLast(id) ? id : IsLast(continues) ? continues : 0;
}

// `before` is the stored state; of a node that was not stored, empty. False: there is no memory.
bool EditHistory::Put(Sheet* sheet, NodeIndex node, NodeState before, NodeState state) {
  const NodeState stored = Packed(sheet->diffuses, state);
  if (!sheet->cells->Write(node, stored)) {
    return false;
  }
  sheet->hash += HashOf(node, stored) - (before.level != 0 ? HashOf(node, before) : 0);
  return true;
}

uint64_t EditHistory::HashOf(NodeIndex node, NodeState stored) {
  const auto key = static_cast<uint64_t>(node.row) << 32 | static_cast<uint64_t>(node.column);
  return HashStep(HashStep(0, key), PackNode(stored));
}

// The memory of the nodes is released in portions, like that of an erased map.
void EditHistory::Release(Entry* entry) {
  for (const Sheet& sheet : entry->sheets) {
    if (sheet.cells->tile_count() != 0) {
      sheet.cells->Clear();
      budget_.Give(CellMap::TopBytes(columns_, rows_));
    }
  }
  entry->sheets.clear();
}

void EditHistory::DropFirst() {
  Release(&entries_.front());
  entries_.pop_front();
  if (done_ != 0) {
    --done_;
    ++forgotten_;
  }
}

void EditHistory::DropLast() {
  Release(&entries_.back());
  entries_.pop_back();
}

void EditHistory::Forget(uint8_t type) {
  for (size_t i = 0; i < entries_.size();) {
    Entry& entry = entries_[i];
    const auto its = std::find_if(entry.sheets.begin(), entry.sheets.end(),
                                  [&](const Sheet& sheet) { return sheet.type == type; });
    if (its != entry.sheets.end()) {
      Entry gone{{}, {}};
      gone.sheets.push_back(std::move(*its));
      Release(&gone);
      entry.sheets.erase(its);
    }
    if (!entry.sheets.empty()) {
      ++i;
      continue;
    }
    forgotten_ += i < done_ ? 1 : 0;
    done_ -= i < done_ ? 1 : 0;
    entries_.erase(entries_.begin() + static_cast<std::ptrdiff_t>(i));
  }
}

void EditHistory::ForgetAll() {
  while (!entries_.empty()) {
    DropFirst();
  }
}

void EditHistory::Save(ByteWriter* writer) const {
  SaveParts([&](const auto& write) { write(writer); },
            [&](const CellMap& cells) { cells.Save(writer); });
}

void EditHistory::Restore(const FieldConfig& config, ByteReader* reader) {
  const uint64_t limit_bytes = std::exchange(budget_.limit_bytes, UINT64_MAX);
  forgotten_ = reader->U64();
  const uint32_t count = reader->Count();
  done_ = reader->Count();
  if (count > kMaxEdits || done_ > count) {
    reader->Fail("more edits to be undone than there can be");
  }
  for (uint32_t i = 0; i < count && reader->ok(); ++i) {
    Entry& entry = entries_.emplace_back();
    DecodeFields(reader, &entry.info);
    int last_type = 0;
    for (uint32_t left = reader->Count(); left > 0 && reader->ok(); --left) {
      const uint8_t type = reader->U8UpTo(kMaxType, "a pheromone type");
      const PheromoneLaw* law = config.FindLaw(type);
      if (law == nullptr || law->is_blend() || type <= last_type) {
        reader->Fail("an edit to be undone of a pheromone that has no nodes");
        break;
      }
      last_type = type;
      Sheet& sheet = entry.sheets.emplace_back(Sheet{type, law->diffuses(), MakeCells()});
      const uint32_t most = sheet.diffuses ? DiffusionLayer::kMaxContent : law->max_level();
      sheet.cells->Restore(reader, {columns_, rows_}, Packed(sheet.diffuses, {most, 0}).level);
      sheet.cells->ForEach([&](NodeIndex node, NodeState stored) {
        sheet.hash += HashOf(node, stored);
        if (sheet.diffuses && stored.time_ms >> kContentBits != 0) {
          reader->Fail("an invalid node value of an edit to be undone");
        }
      });
      if (sheet.cells->tile_count() == 0) {
        reader->Fail("an edit to be undone without nodes");
      }
    }
    if (entry.sheets.empty()) {
      reader->Fail("an edit to be undone without nodes");
    }
  }
  if (!reader->ok()) {
    ForgetAll();
  }
  budget_.limit_bytes = limit_bytes;
}

uint64_t EditHistory::Hash() const {
  uint64_t hash = forgotten_ != 0 ? Hash64({'F', forgotten_}) : 0;
  for (size_t i = 0; i < entries_.size(); ++i) {
    const Entry& entry = entries_[i];
    uint64_t its = Hash64({'U', i, i < done_ ? 1u : 0u, HashFields(entry.info)});
    for (const Sheet& sheet : entry.sheets) {
      its = HashStep(HashStep(its, sheet.type), sheet.hash);
    }
    hash += its;
  }
  return hash;
}

}  // namespace pheromone::field
