#include "server/operators/ctl/replay_commands.h"

#include <fmt/format.h>

#include <iostream>
#include <utility>

#include "server/operators/ctl/map_commands.h"
#include "server/store/capture/reader.h"
#include "server/store/capture/replay.h"

namespace pheromone::ctl {
namespace {

void PrintAnswer(const std::vector<capture::LinkInfo>& links, uint64_t field_time_ms,
                 const capture::Sent& sent) {
  uint8_t wire[protocol::kMaxFrame];
  const size_t size = protocol::EncodeFrame(sent.message, wire, sizeof wire);
  std::string line =
      fmt::format("{} {} ", field_time_ms, sent.link < links.size() ? links[sent.link].name : "?");
  for (size_t i = 0; i < size; ++i) {
    line += fmt::format("{:02X}", wire[i]);
  }
  std::cout << line << '\n';
}

Status ReplayOne(capture::CaptureReader* reader, capture::Replay* replay) {
  while (true) {
    PHEROMONE_TRY(std::optional<capture::Found> next, reader->Next());
    Status same = next ? replay->Take(*next) : replay->Finish();
    if (!same.ok()) {
      return Error{reader->name() + ": " + same.error()};
    }
    if (!next) {
      return Ok();
    }
  }
}

std::string Describe(const capture::Replay& replay) {
  const capture::ReplayReport& report = replay.report();
  std::string text = fmt::format("{} packets, {} messages, {} other events, {} answers in {} bytes",
                                 report.packets, report.messages, report.events, report.answers,
                                 report.answer_bytes);
  const std::pair<uint64_t, const char*> rest[] = {
      {report.said_again, "sent again"},
      {report.dropped, "never sent"},
      {report.from_before, "from before the recording"},
      {report.under_way, "in flight at the end"}};
  for (const auto& [count, what] : rest) {
    text += count != 0 ? fmt::format(", {} {}", count, what) : "";
  }
  return report.state_hash ? fmt::format("{}; state hash {:016x}", text, *report.state_hash) : text;
}

}  // namespace

int ReplayFiles(const std::vector<std::string>& files, bool answers) {
  for (const std::string& file : files) {
    Result<ByteReader::Source> source = capture::OpenFile(file);
    if (!source.ok()) {
      return Fail(kFailed, source.error());
    }
    capture::CaptureReader reader(std::move(source).value(), file);
    const capture::Replay* running = nullptr;
    capture::Replay replay([&](uint64_t field_time_ms, const capture::Sent& sent) {
      if (answers) {
        PrintAnswer(running->start().links, field_time_ms, sent);
      }
    });
    running = &replay;
    const Status same = ReplayOne(&reader, &replay);
    if (!same.ok()) {
      std::cout.flush();
      const bool replayed = replay.report().messages != 0 || replay.report().packets != 0;
      return Fail(kFailed, same.error() +
                               (replayed ? "\n  identical up to there: " + Describe(replay) : ""));
    }
    if (!answers) {
      std::cout << file << ": identical: " << Describe(replay) << '\n';
    }
  }
  return 0;
}

}  // namespace pheromone::ctl
