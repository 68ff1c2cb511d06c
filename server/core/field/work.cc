#include "server/core/field/work.h"

#include <algorithm>
#include <cassert>
#include <utility>

#include "server/base/hash.h"
#include "server/core/field/field.h"

namespace pheromone::field {
namespace {

uint64_t HashEdit(const FieldEdit& edit) {
  uint64_t hash =
      Hash64({edit.type, static_cast<uint64_t>(edit.shape), static_cast<uint64_t>(edit.action),
              edit.level, static_cast<uint64_t>(edit.radius_um), edit.points.size()});
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
  if (work.kind == Work::Kind::kEdit) {
    EncodeFields(work.edit, writer);
  } else {
    SavePlan(*work.plan, writer);
  }
}

Work RestoreWork(const FieldConfig& config, ByteReader* reader) {
  Work work;
  work.id = reader->U64();
  work.kind = static_cast<Work::Kind>(
      reader->U8UpTo(static_cast<uint8_t>(Work::Kind::kLay), "the kind of a change under way"));
  work.phase = static_cast<Work::Phase>(
      reader->U8UpTo(static_cast<uint8_t>(Work::Phase::kApply), "the phase of a change"));
  work.counted = reader->U64();
  work.missing_bytes = reader->U64();
  work.swept = reader->Flag();
  work.done = reader->U64();
  work.reserved_bytes = reader->U64();
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
  if (work.done > static_cast<uint64_t>(raster.value().node_count) ||
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
                 work.reserved_bytes,
                 work.kind == Work::Kind::kEdit ? HashEdit(work.edit) : work.plan->size()});
}

// --- The field's part.

void Field::BeginEdit(uint64_t id, const FieldEdit& edit, std::shared_ptr<const Raster> raster,
                      uint64_t now_ms) {
  assert(accepts_work());
  Work work;
  work.id = id;
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

// One portion of the first pending change.
void Field::MakePortion(uint64_t now_ms) {
  Work& work = works_.front();
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
  budget_.Give(works_.front().reserved_bytes);
  finished_.push_back({works_.front().id, std::move(outcome)});
  works_.pop_front();
}

// True once the memory for the complete edit is reserved. False: not yet, or the edit has failed
// for lack of memory.
bool Field::ReserveForEdit(Work* work, uint64_t now_ms) {
  const auto apply = [work] {
    work->phase = Work::Phase::kApply;
    return true;
  };
  if (work->edit.action == FieldEdit::Action::kErase) {
    return apply();
  }
  const uint8_t type = work->edit.type;
  const std::vector<TileIndex>& tiles = work->raster->tiles;
  const bool diffuses = FindLaw(type)->diffuses();
  const auto leaf_of = [](TileIndex tile) {
    return std::pair(tile.column / kLeafSide, tile.row / kLeafSide);
  };
  const uint64_t end = std::min<uint64_t>(tiles.size(), work->counted + kTilesCountedAtOnce);
  for (; work->counted < end; ++work->counted) {
    const TileIndex tile = tiles[work->counted];
    const bool leaf_counted =
        work->counted > 0 && leaf_of(tiles[work->counted - 1]) == leaf_of(tile);
    const bool top_counted = work->missing_bytes != 0;
    work->missing_bytes += diffuses ? layers_.diffusing[type]->BytesMissing(
                                          tile.column, tile.row, leaf_counted, top_counted)
                                    : layers_.cells[type]->BytesMissing(tile.column, tile.row,
                                                                        leaf_counted, top_counted);
  }
  if (work->counted < tiles.size()) {
    return false;
  }
  if (budget_.Take(work->missing_bytes)) {
    work->reserved_bytes = work->missing_bytes;
    return apply();
  }
  if (!work->swept) {
    work->swept = true;
    // Some of the counted tiles may have been removed: count again.
    work->counted = 0;
    work->missing_bytes = 0;
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
  if (edit.shape == FieldEdit::Shape::kAll && edit.action == FieldEdit::Action::kErase) {
    EraseAll(edit.type);
    return true;
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
      SetLevel(law, node, 0, now_ms);
    } else if (!IsBlocked(node)) {
      uint64_t level = edit.level;
      level += edit.action == FieldEdit::Action::kAdd ? LevelOf(edit.type, node, now_ms) : 0;
      level = std::min<uint64_t>(level, law.max_level());
      const bool stored = SetLevel(law, node, static_cast<uint32_t>(level), now_ms);
      assert(stored);
      (void)stored;
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
      SetLevel(*law, node, 0, now_ms);
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
        SetLevel(*law, it.node, wanted, now_ms);
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
