#include "server/operators/ctl/export_recording.h"

#include <optional>

#include "server/store/capture/reader.h"

namespace pheromone::ctl {

Status ExportRecordings(const std::vector<std::string>& files, RecordingExport* to) {
  for (const std::string& file : files) {
    playback::Player player(file, [&file](uint64_t from) { return capture::OpenFile(file, from); },
                            {.max_checkpoints = 0,
                             .on_record = [to](const auto& record) { to->Note(record); },
                             .on_answer = [to](const auto& sent) { to->Answer(sent); }});
    while (!player.Survey(UINT64_MAX)) {
    }
    to->Begin(&player);
    while (const std::optional<uint64_t> next_ns = player.next_ns()) {
      if (player.has_views()) {
        to->Until(*next_ns);
      }
      if (to->has_failed() || !player.Step()) {
        break;
      }
    }
    if (player.has_views() && !player.has_failed()) {
      to->End(player.range().end_ns);
    }
    if (!player.problem().empty()) {
      return Error{player.problem()};
    }
  }
  return Ok();
}

}  // namespace pheromone::ctl
