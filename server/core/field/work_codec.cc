// Encodes and decodes changes in progress (work.h), and hashes them.

#include <memory>
#include <utility>
#include <vector>

#include "server/base/hash.h"
#include "server/core/field/field.h"
#include "server/core/field/work.h"

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
