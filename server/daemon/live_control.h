// The control interface over the running server: its service, its log, its links.
//
//   LiveControl control({.service = &service, .log = &log, .links = &links, ...});
//   control.SampleLinks();                      // about once a second
//   const auto views = control.GetLinks();      // from any thread
//
// What it says was changed is durable: it waits for the log, in the caller's thread, for a few
// seconds at the most. Everything it is given outlives it; the list of links does not change any
// more once others may call. Thread-safe.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "server/config/config.h"
#include "server/daemon/captures.h"
#include "server/engine/control.h"
#include "server/links/link.h"
#include "server/links/switchboard.h"

namespace pheromone::daemon {

struct LiveParts {
  engine::Service* service = nullptr;
  engine::OrderedLog* log = nullptr;  ///< asked under the service's lock
  links::Switchboard* switchboard = nullptr;
  const std::vector<std::unique_ptr<links::Link>>* links = nullptr;
  Captures* captures = nullptr;
  std::function<uint64_t()> now_ms;  ///< the present field time; called under the service's lock
  std::function<config::Config()> config;  ///< the one in effect
  std::function<Result<std::vector<std::string>>()> reload;
  std::function<bool()> snapshot;             ///< asks the journal for one; false: there is none
  std::chrono::milliseconds patience{5'000};  ///< with a log or a recording that waits for the disk
};

class LiveControl final : public engine::Control {
 public:
  explicit LiveControl(LiveParts parts)
      : parts_(std::move(parts)), started_(std::chrono::steady_clock::now()) {}

  engine::StatusView GetStatus(bool with_hash) const override;
  std::vector<engine::LinkView> GetLinks() const override;
  std::vector<engine::ClientView> GetClients() const override;
  engine::FieldView GetField() const override;
  engine::CaptureView GetCapture() const override { return parts_.captures->View(); }
  std::vector<std::string> GetConfig() const override;
  Status CheckHealth() const override;

  Status Edit(const field::FieldEdit& edit) override;
  Status Issue(std::string_view link, uint8_t id, protocol::CommandCode code,
               std::span<const uint8_t> arguments) override;
  Result<std::vector<std::string>> HaltAll() override;
  Result<std::vector<std::string>> Reload() override { return parts_.reload(); }
  Result<std::string> Snapshot() override;
  Status StartCapture() override;
  Status StopCapture() override;

  /// Measures how busy the links are. To be called about once a second, by one thread.
  void SampleLinks();

 private:
  Status AwaitDurable(std::chrono::milliseconds patience) const;
  void SendHaltsUnlogged();

  struct Sample {
    uint64_t bytes = 0;
    double bytes_per_s = 0;
  };

  const LiveParts parts_;
  const std::chrono::steady_clock::time_point started_;
  mutable std::mutex mutex_;  // of what follows
  std::vector<Sample> samples_;
  std::chrono::steady_clock::time_point sampled_;
};

}  // namespace pheromone::daemon
