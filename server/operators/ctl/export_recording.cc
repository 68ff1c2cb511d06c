#include "server/operators/ctl/export_recording.h"

#include <array>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string_view>
#include <system_error>

#include "server/base/file.h"
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

Status CheckExportOutput(const std::string& out, const std::vector<std::string>& files) {
  PHEROMONE_TRY_STATUS(CheckOutput(out, files));
  constexpr std::string_view kRecording = "\n\r\r\n";  // as every pcapng file begins
  std::array<char, kRecording.size()> head{};
  std::error_code ignored;
  const bool is_recording = std::filesystem::is_regular_file(out, ignored) &&
                            std::ifstream(out, std::ios::binary).read(head.data(), head.size()) &&
                            std::string_view(head.data(), head.size()) == kRecording;
  return is_recording ? Status(Error{out + ": is a recording, expected another name to export to"})
                      : Ok();
}

}  // namespace pheromone::ctl
