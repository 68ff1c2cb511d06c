// [journal]
#include <string_view>

#include "server/config/sections.h"

namespace pheromone::config {
namespace {

constexpr std::string_view kDurabilities[] = {"durable", "relaxed", "none"};
constexpr int64_t kMaxSegmentMib = 1024;
constexpr int64_t kMaxSnapshotMib = 1 << 20;
constexpr int64_t kMaxSnapshotMs = int64_t{7} * 24 * 3'600'000;
constexpr int64_t kMaxSyncMs = 60'000;

}  // namespace

void ReadJournal(const Value& root, Notes* notes, JournalConfig* journal) {
  const TableReader table(TableOf(root, "journal", notes), "journal", &notes->problems);
  table.AllowOnly({"folder", "durability", "evaporate_while_down", "segment_mib", "snapshot_mib",
                   "snapshot_s", "keep_snapshots", "sync_s"});
  const auto mib = [&](std::string_view key, int64_t most) {
    return static_cast<uint64_t>(table.Integer(key, 1, most, 64).value_or(1)) << 20;
  };
  const auto ms = [&](std::string_view key, int64_t least, int64_t most, int64_t fallback) {
    return static_cast<uint64_t>(
        table.Scaled(key, kSecondsToMs, least, most, fallback).value_or(least));
  };
  journal->folder = table.String("folder", "").value_or("");
  journal->durability = static_cast<JournalConfig::Durability>(
      table.OneOf("durability", kDurabilities, 0).value_or(0));
  journal->evaporate_while_down = table.Boolean("evaporate_while_down", true).value_or(true);
  journal->segment_bytes = mib("segment_mib", kMaxSegmentMib);
  journal->snapshot_bytes = mib("snapshot_mib", kMaxSnapshotMib);
  journal->snapshot_ms = ms("snapshot_s", 1'000, kMaxSnapshotMs, 3'600'000);
  journal->keep_snapshots =
      static_cast<uint32_t>(table.Integer("keep_snapshots", 1, 100, 2).value_or(1));
  journal->sync_interval_ms = ms("sync_s", 1, kMaxSyncMs, 1'000);
  if (journal->durability != JournalConfig::Durability::kRelaxed) {
    table.Without({"sync_s"}, "durability = \"durable\" or \"none\"", "only with \"relaxed\"");
  }
}

}  // namespace pheromone::config
