// Replays recordings for an export: each from its beginning to its end, with the moments between
// its records.
//
//   class Tables : public RecordingExport { ... };
//   Tables tables(folder);
//   const Status exported = ExportRecordings({"lab-1.pcapng", "lab-2.pcapng"}, &tables);
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "server/base/result.h"
#include "server/core/engine/service/traffic.h"
#include "server/operators/playback/player.h"
#include "server/store/capture/record.h"

namespace pheromone::ctl {

/// What recordings are exported to. Times are UTC in ns, as the player has them.
class RecordingExport {
 public:
  virtual ~RecordingExport() = default;

  /// Another recording; the player is valid until the next one begins.
  virtual void Begin(const playback::Player* player) = 0;
  /// Shows all moments before the next record, which is at `next_ns`; the engine is as it was since
  /// the record before. From here on, the player has views.
  virtual void Until(uint64_t next_ns) = 0;
  /// What the engine gives for a record, before it.
  virtual void Answer(const capture::Sent& /*sent*/) {}
  /// A record that was replayed.
  virtual void Note(const capture::Record& record) = 0;
  /// The last moment of a recording that could be replayed to its end.
  virtual void End(uint64_t end_ns) = 0;
  /// Whether it cannot be written, so that the rest need not be replayed.
  virtual bool has_failed() const = 0;
};

/// In order, up to the first that cannot be replayed to its end. The error says why; not that `to`
/// has failed.
Status ExportRecordings(const std::vector<std::string>& files, RecordingExport* to);

/// That writing `out` replaces no recording: neither one of these files nor any other.
Status CheckExportOutput(const std::string& out, const std::vector<std::string>& files);

}  // namespace pheromone::ctl
