// The daemon's recordings: server/capture with what it needs of a running server, a thread that
// writes, and a tap for the links.
//
//   Captures captures(&service, config);
//   links ... context.tap = &captures;
//   const Status started = captures.Start();
//   ...                                      // links and service run
//   captures.Finish();                       // after the links
//
// An operator who starts or ends one waits for the disk (Settled); links never do. Thread-safe,
// but for Finish.
#pragma once

#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "server/base/result.h"
#include "server/capture/recorder.h"
#include "server/config/config.h"
#include "server/engine/control.h"
#include "server/engine/service.h"
#include "server/links/tap.h"

namespace pheromone::daemon {

class Captures final : public links::Tap {
 public:
  /// `service` outlives the captures.
  Captures(engine::Service* service, const config::Config& config);
  ~Captures() override { Finish(); }

  /// Begins a recording as configured; the folder is made if it is not there. Not before the
  /// service is configured. Errors: there is one already; the folder cannot be used.
  Status Start();
  /// Ends it. What was recorded is being written still. Errors: there is none.
  Status Stop();
  /// Whether the first file of a recording that was started is there, or the last one of a
  /// recording that was ended is whole; nothing: not yet. Errors: it ended by itself.
  std::optional<Status> Settled() const;
  engine::CaptureView View() const;

  /// A halt to all robots is about to be sent, of which the log does not know.
  void Unlogged(engine::LinkIndex link, const protocol::Message& halt) {
    recorder_.Unlogged(link, halt);
  }

  /// The text of the configuration has changed; the next file has it.
  void SetConfigText(const std::string& text);

  /// Ends the recording, if there is one, and waits until it is written.
  void Finish();

  void BeginRead() override { recorder_.BeginRead(); }
  void EndRead() override { recorder_.EndRead(); }
  void Read(links::Line* line, std::span<const uint8_t> bytes, uint32_t now_ms,
            const protocol::FrameDecoder& decoder) override;
  void Wrote(const links::Line& line, std::span<const uint8_t> bytes) override;
  void LeftOut(engine::LinkIndex link, const protocol::Message& message) override;
  void TurnedAway(engine::LinkIndex link, const protocol::Message& message,
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
