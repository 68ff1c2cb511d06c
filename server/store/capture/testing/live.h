// A server in virtual time, recorded as the daemon records: service, lines with decoders of their
// own, a recorder that writes files; and what the tests do with the files.
//
//   Live live(folder, config);
//   live.Record();
//   live.Hear(0, frame_bytes);               // on line 0
//   live.Finish();
//   EXPECT_EQ(ReplayError(live.Files()[0]), "");
//
// RecordingTest has a folder, which goes with the test.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "server/base/file.h"
#include "server/base/testing/temporary_folder.h"
#include "server/core/engine/service/service.h"
#include "server/core/engine/testing/bench.h"
#include "server/core/engine/testing/scripted_log.h"
#include "server/store/capture/reader.h"
#include "server/store/capture/recorder.h"
#include "server/store/capture/replay.h"

namespace pheromone::capture::testing {

/// The records of a file held in memory, up to its end or the first mistake.
inline std::vector<Found> RecordsOf(const std::string& bytes, std::string* error = nullptr) {
  bool given = false;
  CaptureReader reader(
      [&]() -> std::string_view {
        return std::exchange(given, true) ? std::string_view() : std::string_view(bytes);
      },
      "test.pcapng");
  std::vector<Found> all;
  while (true) {
    Result<std::optional<Found>> next = reader.Next();
    if (!next.ok() && error != nullptr) {
      *error = next.error();
    }
    if (!next.ok() || !next.value()) {
      return all;
    }
    all.push_back(*std::move(next.value()));
  }
}

/// The first difference, or what is wrong with the file; empty if all is the same.
inline std::string ReplayError(const std::string& bytes, ReplayReport* report = nullptr) {
  std::string error;
  const std::vector<Found> records = RecordsOf(bytes, &error);
  Replay replay;
  for (const Found& found : records) {
    PHEROMONE_TRY_STATUS(replay.Take(found));
  }
  if (report != nullptr) {
    *report = replay.report();
  }
  const Status whole = replay.Finish();
  return !error.empty() ? error : whole.ErrorOr("");
}

/// A file of these records, numbered anew.
inline std::string FileOf(const std::vector<Found>& records) {
  std::string bytes = EncodeFileHeader(std::get<Start>(records.front().record).links, "test");
  uint64_t number = 0;
  for (const Found& found : records) {
    bytes += EncodeRecord(found.record, ++number);
  }
  return bytes;
}

inline std::string FrameOf(const protocol::Message& message) {
  std::string wire(protocol::kMaxFrame, '\0');
  wire.resize(protocol::EncodeFrame(message, reinterpret_cast<uint8_t*>(wire.data()), wire.size()));
  return wire;
}

class Live {
 public:
  /// A conversation as in server/robots/links, which hands over everything at once.
  struct Session {
    Connection line;
    protocol::FrameDecoder decoder;
    std::vector<protocol::Message> queue;  ///< held back by `slow`
  };

  Live(std::string folder, const engine::EngineConfig& config, uint64_t start_ms = 0)
      : folder_(std::move(folder)),
        service_(
            &log_,
            [this] {
              return engine::ClockReading{now_ms, static_cast<int64_t>(kUtcMs + now_ms)};
            },
            start_ms),
        recorder_({&service_, [this] { return (kUtcMs + now_ms) * 1'000'000; },
                   [this] { return Describe(); },
                   [this](const std::string& text) { complaints.push_back(text); }}),
        writer_([this] { recorder_.Run(); }) {
    now_ms = start_ms;
    std::filesystem::create_directories(folder_);
    static_cast<void>(service_.Configure(config, 7));
    const auto links = static_cast<engine::LinkIndex>(config.links.size());
    for (engine::LinkIndex link = 0; link < links; ++link) {
      conversations.push_back({{link, 1, 0}, protocol::FrameDecoder(kGapTimeoutMs), {}});
    }
  }
  Live(const Live&) = delete;
  Live& operator=(const Live&) = delete;
  ~Live() { Finish(); }

  Status Record() {
    options.folder = folder_;
    return recorder_.Start(options);
  }

  /// Bytes arrive on a line, at once.
  void Hear(size_t at, const std::string& bytes) {
    Session& on = conversations[at];
    const std::span span(reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size());
    std::vector<protocol::Message> batch;
    std::vector<engine::Outgoing> out;
    recorder_.BeginRead();
    recorder_.Read(&on.line, span, static_cast<uint32_t>(now_ms), on.decoder);
    on.decoder.PushBlock(span.data(), span.size(), static_cast<uint32_t>(now_ms),
                         [&](const protocol::Message& message) { batch.push_back(message); });
    if (!batch.empty()) {
      service_.Handle(on.line.link, batch, &out);
    }
    Deliver(out);
    recorder_.EndRead();
  }

  void Deliver(const std::vector<engine::Outgoing>& out) {
    for (const engine::Outgoing& one : out) {
      conversations[one.link].queue.push_back(one.message);
    }
    if (!slow) {
      Flush();
    }
  }

  /// Writes what waits on each line, all at once.
  void Flush() {
    for (Session& conversation : conversations) {
      std::string block;
      for (const protocol::Message& message : conversation.queue) {
        block += FrameOf(message);
      }
      if (!conversation.queue.empty()) {
        recorder_.Wrote(conversation.line,
                        {reinterpret_cast<const uint8_t*>(block.data()), block.size()});
      }
      conversation.queue.clear();
    }
  }

  void Advance() {
    std::vector<engine::Outgoing> out;
    service_.AdvanceIfDue(&out);
    Deliver(out);
  }

  /// Sends what waited for the log.
  void Release() {
    std::vector<engine::Outgoing> out;
    service_.Release(&out);
    Deliver(out);
  }

  /// Ends the recording, if there is one, and waits until it is written.
  void Finish() {
    if (writer_.joinable()) {
      static_cast<void>(recorder_.Stop());
      recorder_.Close();
      writer_.join();
    }
  }

  /// Their contents, in order.
  std::vector<std::string> Files() const {
    std::vector<std::string> paths;
    for (const auto& entry : std::filesystem::directory_iterator(folder_)) {
      paths.push_back(entry.path().string());
    }
    std::sort(paths.begin(), paths.end());
    std::vector<std::string> files;
    for (const std::string& path : paths) {
      files.push_back(ReadFile(path).value());
    }
    return files;
  }

  engine::Service& service() { return service_; }
  engine::testing::ScriptedLog& log() { return log_; }
  Recorder& recorder() { return recorder_; }

  static constexpr uint64_t kUtcMs = 1'700'000'000'000;
  static constexpr uint16_t kGapTimeoutMs = 20;

  std::atomic<uint64_t> now_ms{0};  ///< which the writer's thread reads
  bool datagrams = false;           ///< link 0 is one
  bool slow = false;                ///< nothing is written before Flush
  RecordingOptions options;
  std::vector<Session> conversations;
  std::vector<std::string> complaints;

 private:
  capture::Start Describe() const {
    capture::Start start;
    start.version = "test";
    start.config = "# a comment\n";
    start.links = {{"radio-a", kGapTimeoutMs, datagrams}, {"radio-b", kGapTimeoutMs, false}};
    return start;
  }

  const std::string folder_;
  engine::testing::ScriptedLog log_;
  engine::Service service_;
  Recorder recorder_;
  std::thread writer_;
};

class RecordingTest : public ::testing::Test {
 protected:
  const TemporaryFolder temporary_;
  const std::string folder_ = temporary_ / "captures";
};

}  // namespace pheromone::capture::testing
