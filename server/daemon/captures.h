// The daemon's recordings: connects server/store/capture to the running server, with a writing
// thread and a tap for the links.
//
//   Captures captures(&service, config);
//   links ... context.tap = &captures;
//   const Status started = captures.Start();
//   ...                                      // links and service run
//   captures.Finish();                       // after the links
//
// Starting and stopping a recording wait for the disk (Settled); links never do. Thread-safe,
// except for Finish.
#pragma once

#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "server/base/result.h"
#include "server/config/config.h"
#include "server/core/engine/service/service.h"
#include "server/operators/control/control.h"
#include "server/robots/links/tap.h"
#include "server/store/capture/recorder.h"

namespace pheromone::daemon {

class Captures final : public links::Tap {
 public:
  /// `service` outlives the captures.
  Captures(engine::Service* service, const config::Config& config);
  ~Captures() override { Finish(); }

  /// Starts a recording as configured, and creates the folder if needed. Not before the service is
  /// configured. Errors: one is in progress; the folder cannot be used.
  Status Start();
  /// Stops the recording. Its queue is still being written. Errors: none is in progress.
  Status Stop();
  /// Whether the first file of a started recording exists, or the last one of a stopped recording
  /// is complete; empty: not yet. Errors: it stopped by itself.
  std::optional<Status> Settled() const;
  control::CaptureView View() const;

  /// A halt of all robots is about to be sent without an event in the log.
  void Unlogged(engine::LinkIndex link, const protocol::Message& halt) {
    recorder_.Unlogged(link, halt);
  }

  /// The text of the configuration has changed; the next file will contain it.
  void SetConfigText(const std::string& text);

  /// Stops the recording, if any, and waits until it is written.
  void Finish();

  void BeginRead() override { recorder_.BeginRead(); }
  void EndRead() override { recorder_.EndRead(); }
  void Read(links::Connection* line, std::span<const uint8_t> bytes, uint32_t now_ms,
            const protocol::FrameDecoder& decoder) override;
  void Wrote(const links::Connection& line, std::span<const uint8_t> bytes) override;
  void Dropped(engine::LinkIndex link, const protocol::Message& message) override;
  void Rejected(engine::LinkIndex link, const protocol::Message& message,
                protocol::Reason answer) override;

 private:
  capture::Start Describe() const;

  const config::CaptureSettings settings_;
  const std::string folder_;
  const std::vector<capture::LinkInfo> links_;
  mutable std::mutex mutex_;
  std::string config_text_;
  capture::Recorder recorder_;
  std::thread writer_;
};

}  // namespace pheromone::daemon
