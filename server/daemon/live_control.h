// The control interface over the running server: its service, its log, its links.
//
//   LiveControl control({.service = &service, .log = &log, .links = &links, ...});
//   control.SampleLinks();                      // about once a second
//   const auto views = control.GetLinks();      // from any thread
//   ...
//   control.Stop();                             // who still waits is answered
//
// What it says was changed is durable: the log calls back, or a deadline does after a few seconds;
// no thread waits. What may take long is done by the queues that it is given. A halt to all needs
// neither: it is not held back for the disk.
//
// Everything it is given outlives it, but for the log's callbacks; the list of links does not
// change any more once others may call. Thread-safe.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "server/config/config.h"
#include "server/daemon/captures.h"
#include "server/daemon/deadlines.h"
#include "server/engine/control.h"
#include "server/links/link.h"
#include "server/links/switchboard.h"

namespace pheromone::daemon {

struct LiveParts {
  /// Has something done by another thread; false: there is no room, and it will not be done.
  using Run = std::function<bool(std::function<void()>)>;
  using Snapshot = std::function<void(engine::Control::DoneWith<std::optional<std::string>>)>;

  engine::Service* service = nullptr;
  engine::OrderedLog* log = nullptr;
  links::Switchboard* switchboard = nullptr;
  const std::vector<std::unique_ptr<links::Link>>* links = nullptr;
  const std::vector<config::LinkConfig>* link_configs = nullptr;  ///< as many, in the same order
  Captures* captures = nullptr;
  std::function<uint64_t()> now_ms;  ///< the present field time; called under the service's lock
  std::function<config::Config()> config;  ///< the one in effect
  Run run_edit;                            ///< one edit after the other
  Run run_operation;                       ///< reload, the beginning and end of a recording
  std::function<Result<std::vector<std::string>>()> reload;  ///< called as an operation
  Snapshot snapshot;                          ///< asks the journal for one; nothing: there is none
  std::chrono::milliseconds patience{5'000};  ///< with a log or a recording that waits for the disk
  std::chrono::milliseconds snapshot_patience{12'000};  ///< below that of the HTTP server
};

/// Empty, or that field time does not go on any more and what to do about it.
std::string TroubleWithFieldTime(uint64_t now_ms);

class LiveControl final : public engine::Control {
 public:
  explicit LiveControl(LiveParts parts)
      : parts_(std::move(parts)), started_(std::chrono::steady_clock::now()) {}
  ~LiveControl() override { Stop(); }

  engine::StatusView GetStatus(bool with_hash) const override;
  std::vector<engine::LinkView> GetLinks() const override;
  std::vector<engine::ClientView> GetClients() const override;
  engine::FieldView GetField() const override;
  engine::CaptureView GetCapture() const override { return parts_.captures->View(); }
  std::vector<std::string> GetConfig() const override;
  Status CheckHealth() const override;

  void Edit(const field::FieldEdit& edit, DoneWith<engine::EditOutcome> done) override;
  void Issue(std::string_view link, uint8_t id, protocol::CommandCode code,
             std::span<const uint8_t> arguments, Done done) override;
  void HaltAll(DoneWith<std::vector<std::string>> done) override;
  void Reload(DoneWith<std::vector<std::string>> done) override;
  void Snapshot(DoneWith<std::optional<std::string>> done) override;
  void StartCapture(Done done) override;
  void StopCapture(Done done) override;

  /// Measures how busy the links are. To be called about once a second, by one thread.
  void SampleLinks();

  /// Answers all who wait for the disk: at once, and from now on. After the queues have ended.
  void Stop() { deadlines_->Stop(); }

 private:
  using TimePoint = std::chrono::steady_clock::time_point;

  void EditNow(const field::FieldEdit& edit, const DoneWith<engine::EditOutcome>& done);
  void AwaitDurable(std::chrono::milliseconds patience, Done done) const;
  void SendHaltsUnlogged(int transmissions);
  void ChangeCapture(Status (Captures::*change)(), Done done);
  void AwaitCapture(TimePoint deadline, const Done& done);

  struct Sample {
    uint64_t bytes = 0;
    double bytes_per_s = 0;
  };

  const LiveParts parts_;
  const TimePoint started_;
  const std::shared_ptr<Deadlines> deadlines_ = std::make_shared<Deadlines>();
  mutable std::mutex mutex_;  // of what follows
  std::vector<Sample> samples_;
  TimePoint sampled_;
};

}  // namespace pheromone::daemon
