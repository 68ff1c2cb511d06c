#include "server/daemon/captures.h"

#include <spdlog/spdlog.h>

#include <cstdlib>
#include <filesystem>
#include <utility>

#include "server/config/folders.h"
#include "server/daemon/system_clock.h"

namespace pheromone::daemon {
namespace {

std::vector<capture::LinkInfo> Describe(const std::vector<links::LinkConfig>& links) {
  std::vector<capture::LinkInfo> infos;
  infos.reserve(links.size());
  for (const links::LinkConfig& link : links) {
    infos.push_back({link.name, link.gap_timeout_ms, link.kind == links::LinkKind::kUdp});
  }
  return infos;
}

}  // namespace

Captures::Captures(engine::Service* service, const config::Config& config)
    : settings_(config.capture),
      folder_(config::CaptureFolder(settings_, std::getenv("STATE_DIRECTORY"))),
      links_(daemon::Describe(config.links)),
      config_text_(config.text),
      recorder_({service, ReadUtcNs, [this] { return Describe(); },
                 [](const std::string& text) { spdlog::error("{}", text); }}),
      writer_([this] { recorder_.Run(); }) {}

Status Captures::Start() {
  const std::string why = config::WhyUnusable(folder_, std::getenv("STATE_DIRECTORY"));
  if (!why.empty()) {
    return Error{why};
  }
  std::error_code error;
  std::filesystem::create_directory(folder_, error);  // Start reports errors
  capture::RecordingOptions options;
  options.folder = folder_;
  options.file_bytes = settings_.file_mb * 1'000'000;
  options.most_files = settings_.most_files;
  Status started = recorder_.Start(options);
  if (started.ok()) {
    spdlog::info("recording into {}", folder_);
  }
  return started;
}

Status Captures::Stop() {
  Status stopped = recorder_.Stop();
  if (stopped.ok()) {
    spdlog::info("recording stopped");
  }
  return stopped;
}

std::optional<Status> Captures::Settled() const {
  const capture::RecordingStatus status = recorder_.status();
  if (status.recording ? !status.has_state : !status.written) {
    return std::nullopt;
  }
  return status.error.empty() ? Ok() : Status(Error{status.error});
}

control::CaptureView Captures::View() const {
  const capture::RecordingStatus status = recorder_.status();
  control::CaptureView view;
  view.recording = status.recording;
  view.folder = folder_;
  view.file = status.file;
  view.error = status.error;
  view.files = status.files;
  view.bytes = status.bytes;
  view.records = status.records;
  view.lost = status.lost;
  return view;
}

void Captures::SetConfigText(const std::string& text) {
  const std::lock_guard lock(mutex_);
  config_text_ = text;
}

void Captures::Finish() {
  if (!writer_.joinable()) {
    return;
  }
  (void)recorder_.Stop();  // if there is one
  recorder_.Close();
  writer_.join();
  const capture::RecordingStatus status = recorder_.status();
  if (status.files != 0) {
    spdlog::info("recorded {} bytes in {} files, the last one {}; {} records lost", status.bytes,
                 status.files, status.file, status.lost);
  }
}

capture::Start Captures::Describe() const {
  capture::Start start;
  start.version = PHEROMONE_VERSION;
  start.links = links_;
  const std::lock_guard lock(mutex_);
  start.config = config_text_;
  return start;
}

void Captures::Read(links::Connection* line, std::span<const uint8_t> bytes, uint32_t now_ms,
                    const protocol::FrameDecoder& decoder) {
  capture::Connection recorded{line->link, line->connection, line->mark};
  recorder_.Read(&recorded, bytes, now_ms, decoder);
  line->mark = recorded.file;
}

void Captures::Wrote(const links::Connection& line, std::span<const uint8_t> bytes) {
  recorder_.Wrote({line.link, line.connection, line.mark}, bytes);
}

void Captures::Dropped(engine::LinkIndex link, const protocol::Message& message) {
  recorder_.Dropped(link, message);
}

void Captures::Rejected(engine::LinkIndex link, const protocol::Message& message,
                        protocol::Reason answer) {
  recorder_.Rejected(link, message, answer);
}

}  // namespace pheromone::daemon
