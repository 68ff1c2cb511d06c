// Encoding and decoding of a field's state. In the order of types: the nodes, tile by tile; whether
// there is memory that outlives its tiles; the diffusing contents, with their totals; then the
// edits to be undone, the sweep, and the changes under way. The addresses of tiles are not part of
// the state: no answer depends on them.

#include <bit>
#include <memory>
#include <optional>
#include <utility>

#include "server/core/field/field.h"

namespace pheromone::field {
namespace {

// A tile's position in the order of the sweep, leaf by leaf.
struct TilePlace {
  uint32_t leaf = 0;
  uint8_t place = 0;
};

// Tiles are in order, so each map has exactly one encoding, and no tile occurs twice.
class TileOrder {
 public:
  explicit TileOrder(ByteReader* reader) : reader_(*reader) {}

  TilePlace Read(int32_t leaves) {
    const TilePlace tile{reader_.U32(), reader_.U8()};
    const uint64_t key = uint64_t{tile.leaf} << 8 | tile.place;
    if (tile.leaf >= static_cast<uint32_t>(leaves)) {
      reader_.Fail("a tile is not on the map");
    } else if (key < next_) {
      reader_.Fail("tiles are out of order");
    }
    next_ = key + 1;
    return reader_.ok() ? tile : TilePlace{};
  }

 private:
  ByteReader& reader_;
  uint64_t next_ = 0;
};

// The node in a slot of a tile.
NodeIndex NodeAt(TilePlace tile, int32_t leaf_columns, int slot) {
  const auto leaf = static_cast<int32_t>(tile.leaf);
  return {
      (leaf % leaf_columns * kLeafSide + tile.place % kLeafSide) * kTileSide + slot % kTileSide,
      (leaf / leaf_columns * kLeafSide + tile.place / kLeafSide) * kTileSide + slot / kTileSide};
}

// Calls visit(slot) for each bit.
template <typename Visit>
void ForEachBit(uint64_t bits, Visit&& visit) {
  for (; bits != 0; bits &= bits - 1) {
    visit(std::countr_zero(bits));
  }
}

// The parameters of a law that determine the meaning of a stored node.
void SaveChange(const LawChange* change, ByteWriter* writer) {
  writer->Flag(change != nullptr);
  if (change != nullptr) {
    writer->U64(change->at_ms);
    writer->U8(static_cast<uint8_t>(change->from.evaporation));
    writer->I64(change->from.tau_ms);
    writer->I64(change->from.quantum_micro);
    writer->U16(change->from.max_count);
  }
}

std::optional<LawChange> RestoreChange(uint8_t type, ByteReader* reader) {
  if (!reader->Flag()) {
    return std::nullopt;
  }
  LawChange change;
  change.at_ms = reader->U64();
  PheromoneLaw& from = change.from;
  from.type = type;
  from.evaporation = static_cast<Evaporation>(
      reader->U8UpTo(static_cast<uint8_t>(Evaporation::kExponential), "a law's evaporation"));
  from.tau_ms = reader->I64();
  from.quantum_micro = reader->I64();
  from.max_count = reader->U16();
  if (from.tau_ms < 0 || from.tau_ms > kMaxTauMs || from.quantum_micro < 1 ||
      from.quantum_micro > kMaxQuantumMicro || change.at_ms > kTimeMask) {
    reader->Fail("an earlier law with invalid values");
  }
  return change;
}

}  // namespace

void CellMap::Save(ByteWriter* writer) const {
  writer->Flag(has_top_);
  writer->Count(tile_count_);
  for (int32_t i = 0; i < leaf_count(); ++i) {
    const Leaf* leaf = FindLeaf(i % leaf_columns_, i / leaf_columns_);
    for (size_t p = 0; leaf != nullptr && p < leaf->place.size(); ++p) {
      const Tile* tile = leaf->place[p].tile.load(std::memory_order_relaxed);
      if (tile == nullptr) {
        continue;
      }
      const uint64_t occupied = leaf->place[p].occupied.load(std::memory_order_relaxed);
      writer->U32(static_cast<uint32_t>(i));
      writer->U8(static_cast<uint8_t>(p));
      writer->U64(occupied);
      ForEachBit(occupied, [&](int slot) {
        writer->U64(tile->word[static_cast<size_t>(slot)].load(std::memory_order_relaxed));
      });
    }
  }
}

void CellMap::Restore(ByteReader* reader, NodeIndex size, uint32_t max_level) {
  const bool has_top = reader->Flag();
  const uint32_t tiles = reader->Count();
  TileOrder order(reader);
  for (uint32_t i = 0; i < tiles && reader->ok(); ++i) {
    const TilePlace tile = order.Read(leaf_count());
    const uint64_t occupied = reader->U64();
    if (occupied == 0) {
      reader->Fail("an empty tile");
    }
    ForEachBit(occupied, [&](int slot) {
      const NodeIndex node = NodeAt(tile, leaf_columns_, slot);
      const NodeState state = UnpackNode(reader->U64());
      if (node.column >= size.column || node.row >= size.row) {
        reader->Fail("a node is not on the map");
      } else if (state.level == 0 || state.level > max_level) {
        reader->Fail("a node level above the maximum of its pheromone");
      } else {
        Write(node, state);
      }
    });
  }
  if (reader->ok() && !has_top && tile_count_ != 0) {
    reader->Fail("nodes without a table");
  }
  if (reader->ok() && has_top && !has_top_ && budget_->Take(BytesOfTop())) {
    has_top_ = true;
  }
}

void DiffusionLayer::Save(ByteWriter* writer) const {
  writer->Count(tile_count_);
  for (const Leaf* leaf : leaves_) {
    ForEachPlace(*leaf, [&](size_t place) {
      const TileView tile = View(leaf->place[place]);
      writer->U32(static_cast<uint32_t>(leaf->row * leaf_columns_ + leaf->column));
      writer->U8(static_cast<uint8_t>(place));
      writer->U64(tile.occupied);
      ForEachBit(tile.occupied, [&](int slot) { writer->U32(tile[static_cast<size_t>(slot)]); });
    });
  }
  for (const uint64_t total : {totals_.deposited, totals_.sum, totals_.evaporated, totals_.lost}) {
    writer->U64(total);
  }
  writer->U64(refused_tiles_);
}

void DiffusionLayer::Restore(ByteReader* reader) {
  const uint32_t tiles = reader->Count();
  TileOrder order(reader);
  for (uint32_t i = 0; i < tiles && reader->ok(); ++i) {
    const TilePlace tile = order.Read(leaf_columns_ * leaf_rows_);
    const uint64_t occupied = reader->U64();
    if (occupied == 0) {
      reader->Fail("an empty tile");
    }
    ForEachBit(occupied, [&](int slot) {
      const NodeIndex node = NodeAt(tile, leaf_columns_, slot);
      const uint32_t content = reader->U32();
      if (node.column >= columns_ || node.row >= rows_) {
        reader->Fail("a node is not on the map");
      } else if (content == 0 || content > kMaxContent) {
        reader->Fail("an invalid node value");
      } else {
        Write(node, content);
      }
    });
  }
  const uint64_t sum = totals_.sum;
  for (uint64_t* total :
       {&totals_.deposited, &totals_.sum, &totals_.evaporated, &totals_.lost, &refused_tiles_}) {
    *total = reader->U64();
  }
  if (totals_.sum != sum || totals_.deposited != sum + totals_.evaporated + totals_.lost) {
    reader->Fail("the sums of a diffusing pheromone do not agree");
  }
}

void Field::Save(ByteWriter* writer) const {
  for (size_t type = 1; type < kTypes; ++type) {
    layers_.cells[type]->Save(writer);
    layers_.diffusing[type]->Save(writer);
    writer->U64(stepped_ms_[type]);
  }
  history_.Save(writer);
  SaveRest(writer);
}

void Field::SaveRest(ByteWriter* writer) const {
  writer->U8(sweep_.type);
  writer->I32(sweep_.leaf);
  writer->U64(sweep_.earliest_ms);
  writer->U64(sweep_.cycle_ms);
  writer->U64(sweep_.next_ms);
  writer->Flag(is_rebasing_);
  if (is_rebasing_) {
    writer->U8(rebase_type_);
    writer->I32(rebase_row_);
    for (uint8_t type = 1; type < kTypes; ++type) {
      SaveChange(current().ChangeOf(type), writer);
    }
  }
  writer->Count(works_.size());
  for (const Work& work : works_) {
    SaveWork(work, writer);
  }
}

// The earlier laws, and the changes in progress.
void Field::RestoreWorks(ByteReader* reader) {
  is_rebasing_ = reader->Flag();
  if (is_rebasing_) {
    rebase_type_ = reader->U8UpTo(kTypes - 1, "a pheromone type");
    rebase_row_ = reader->I32();
    auto setup = std::make_unique<Setup>(current().shared);
    for (uint8_t type = 1; type < kTypes; ++type) {
      setup->change[type] = RestoreChange(type, reader);
      if (setup->change[type] && (setup->law[type] == nullptr || setup->law[type]->is_blend() ||
                                  setup->law[type]->diffuses())) {
        reader->Fail("an earlier law of a pheromone that has no nodes");
        setup->change[type].reset();
      }
    }
    if (rebase_type_ == 0 || rebase_row_ < 0) {
      reader->Fail("the walk over nodes of earlier laws is not on the map");
    }
    Publish(std::move(setup));
  }
  uint32_t left = reader->Count();
  if (left > kMaxWorks) {
    reader->Fail("too many changes in progress");
  }
  for (; left > 0 && reader->ok(); --left) {
    works_.push_back(RestoreWork(config(), history_, reader));
    if (works_.size() > 1 && works_.back().reverses()) {
      reader->Fail("an undoing that waits for another change");
    }
    budget_.used_bytes += works_.back().reserved_bytes;
  }
}

// Once it is known under which law each node was stored.
void Field::HashNodes(ByteReader* reader) {
  ForEach([&](uint8_t type, NodeIndex node, NodeState state) {
    const PheromoneLaw& law = StoredLaw(type, state);
    if (state.level > law.max_level()) {
      reader->Fail("a node level above the maximum of its pheromone");
    }
    hashes_[type] += NodeHash(law, node, state);
  });
}

std::unique_ptr<Field> Field::Restore(std::shared_ptr<const FieldConfig> config, ByteReader* reader,
                                      const Kernel& kernel) {
  std::unique_ptr<Field> field(new Field(std::move(config), kernel, Empty{}));
  const MapGeometry& map = field->config().map;
  // The limit may have been lowered below the present use.
  field->budget_.limit_bytes = UINT64_MAX;
  for (uint8_t type = 1; type < kTypes && reader->ok(); ++type) {
    const PheromoneLaw* law = field->FindLaw(type);
    const bool holds = law != nullptr && !law->is_blend();
    CellMap& cells = *field->layers_.cells[type];
    DiffusionLayer& diffusing = *field->layers_.diffusing[type];
    cells.Restore(reader, {map.columns(), map.rows()}, holds ? UINT32_MAX : 0);
    diffusing.Restore(reader);
    if ((cells.tile_count() != 0 && law->diffuses()) ||
        (!diffusing.empty() && !(holds && law->diffuses()))) {
      reader->Fail("pheromone of a type that cannot hold any");
    }
    field->stepped_ms_[type] = reader->U64();
    if (field->stepped_ms_[type] > kTimeMask) {
      reader->Fail("timestamp out of range");
    }
  }
  if (reader->ok()) {
    field->history_.Restore(field->config(), reader);
  }
  SweepState& sweep = field->sweep_;
  sweep.type = reader->U8();
  sweep.leaf = reader->I32();
  sweep.earliest_ms = reader->U64();
  sweep.cycle_ms = reader->U64();
  sweep.next_ms = reader->U64();
  if (sweep.type < 1 || sweep.type >= kTypes || sweep.leaf < 0 ||
      sweep.leaf >= field->layers_.cells[1]->leaf_count()) {
    reader->Fail("the sweep is not on the map");
  }
  if (reader->ok()) {
    field->RestoreWorks(reader);
  }
  if (reader->ok()) {
    field->HashNodes(reader);
  }
  field->budget_.limit_bytes = field->config().memory_bytes;
  return reader->ok() ? std::move(field) : nullptr;
}

std::unique_ptr<Field> Field::Clone() const {
  ByteWriter writer;
  Save(&writer);
  ByteReader reader(writer.bytes());
  return Restore(current().shared, &reader, kernel_);
}

}  // namespace pheromone::field
