// The control interface over the running server: its service, its log, its links.
//
//   LiveControl control({.service = &service, .log = &log, .links = &links, ...});
//   control.SampleLinks();                      // about once a second
//   control.TellWhatChanged();                  // after it
//   const auto views = control.GetLinks();      // from any thread
//   ...
//   control.Stop();                             // answers all waiting callers
//
// A successful change is durable: the log calls back, or a deadline does after a few seconds; no
// thread waits. Long operations run on the given queues. A halt of all robots needs neither and
// does not wait for the disk.
//
// All arguments outlive it, except for the log's callbacks; the list of links must not change once
// other threads may call. Thread-safe.
#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "server/cluster/peer_wire.h"
#include "server/config/config.h"
#include "server/daemon/captures.h"
#include "server/daemon/deadlines.h"
#include "server/daemon/revocations.h"
#include "server/operators/control/control.h"
#include "server/robots/links/link.h"
#include "server/robots/links/link_router.h"
#include "server/robots/links/tracker_link.h"

namespace pheromone::daemon {

/// The other servers, if this one is of a cluster (server/cluster). Any thread.
struct LiveCluster {
  /// Passes a change to the server that orders them; false, without calling back: this one does, or
  /// none is reached.
  std::function<bool(cluster::OperatorChange, std::function<void(cluster::OperatorResult)>)>
      forward;
  std::function<bool()> has_leader;  ///< another server orders the changes, and is reached
  std::function<void()> halt_peers;  ///< lets all others halt their robots, at once
  std::function<control::ClusterView()> view;
  std::function<void(std::string_view successor, control::Control::Done)> step_down;
};

struct LiveParts {
  /// Queues work for another thread; false if the queue is full, and the work is not done.
  using Run = std::function<bool(std::function<void()>)>;
  using Snapshot = std::function<void(control::Control::DoneWith<std::optional<std::string>>)>;

  engine::Service* service = nullptr;
  engine::OrderedLog* log = nullptr;
  links::LinkRouter* router = nullptr;
  const std::vector<std::unique_ptr<links::Link>>* links = nullptr;
  const std::vector<std::unique_ptr<links::TrackerLink>>* trackers = nullptr;
  const std::vector<links::LinkConfig>* link_configs = nullptr;  ///< as many, in the same order
  Captures* captures = nullptr;
  std::function<uint64_t()> now_ms;  ///< the present field time; called under the service's lock
  std::function<config::Config()> config;  ///< the one in effect
  Run run_edit;                            ///< one edit after the other
  Run run_operation;                       ///< reload, the beginning and end of a recording
  std::function<Result<std::vector<std::string>>()> reload;  ///< called as an operation
  std::function<Status()> reload_secrets;                    ///< likewise; in a cluster
  std::function<Status(uint8_t, int64_t)> change_tau;        ///< likewise
  std::function<LinkKeys()> keys;      ///< of the signed links, as their files have them
  std::function<void()> drop_revoked;  ///< the links take no key that the state has as revoked
  Snapshot snapshot;                   ///< asks the journal for one
  bool is_kept = false;                ///< there is a journal
  std::optional<LiveCluster> cluster{};
  std::chrono::milliseconds patience{5'000};  ///< with a log or a recording that waits for the disk
  std::chrono::milliseconds snapshot_patience{12'000};  ///< below that of the HTTP server
};

/// Empty, or a warning that field time has reached its end, with the remedy.
std::string TroubleWithFieldTime(uint64_t now_ms);

class LiveControl final : public control::Control {
 public:
  explicit LiveControl(LiveParts parts)
      : parts_(std::move(parts)), started_(std::chrono::steady_clock::now()) {}
  ~LiveControl() override { Stop(); }

  control::StatusView GetStatus(bool with_hash) const override;
  std::vector<control::LinkView> GetLinks() const override;
  std::vector<control::TrackerView> GetTrackers() const override;
  std::vector<control::ClientView> GetClients() const override;
  control::FieldView GetField() const override;
  std::vector<field::Path> GetPaths() const override;
  control::CaptureView GetCapture() const override { return parts_.captures->View(); }
  control::TagPage GetTags(uint16_t first) const override;
  std::optional<uint16_t> FindTag(std::string_view name) const override;
  control::SymbolPage GetSymbols(size_t first) const override;
  std::vector<control::NetView> GetNets() const override;
  control::ConfigView GetConfig() const override;
  Status CheckHealth() const override;

  std::unique_ptr<control::Subscription> Subscribe(control::ListenerOptions options) override {
    return board_.Subscribe(std::move(options));
  }
  void Announce(const control::Notice& notice) override { board_.Publish(notice); }

  void Edit(const field::FieldEdit& edit, DoneWith<control::EditOutcome> done) override;
  void Reverse(bool redo, DoneWith<control::ReverseOutcome> done) override;
  void Issue(std::string_view link, uint8_t id, protocol::CommandCode code,
             std::span<const uint8_t> arguments, Done done) override;
  void SetGoal(std::string_view link, uint8_t id, field::PointUm point, uint32_t tolerance_um,
               Done done) override;
  void CancelGoal(std::string_view link, uint8_t id, Done done) override;
  void ChangeTags(const engine::TagsChanged& change, Done done) override;
  void ChangeNets(const engine::NetsChanged& change, Done done) override;
  void RevokeKeys(std::span<const uint8_t> robots,
                  DoneWith<std::vector<std::string>> done) override;
  void HaltAll(DoneWith<std::vector<std::string>> done) override;
  void ChangeTau(uint8_t type, int64_t tau_ms, Done done) override;
  void Reload(DoneWith<std::vector<std::string>> done) override;
  void Snapshot(DoneWith<std::optional<std::string>> done) override;
  void StartCapture(Done done) override;
  void StopCapture(Done done) override;
  void StepDown(std::string_view successor, Done done) override;

  /// Makes an operator's change that another server has passed on.
  void Accept(const cluster::OperatorChange& change,
              const std::function<void(cluster::OperatorResult)>& done);
  /// Halts all robots that are connected here, without the log. Another server has logged it, or
  /// cannot.
  void HaltHere();

  /// Measures the utilisation of the links. To be called about once a second, by one thread.
  void SampleLinks();

  /// Notifies subscribers of changes of links, recording and log since the last call; takes no lock
  /// that a robot waits for. To be called about once a second. A link that went down and came up in
  /// between is reported as up, a second time.
  void TellWhatChanged();

  /// Notifies them of robots' records that nets have refused since the last call; returns the words
  /// for the log. To be called about once a second.
  std::vector<std::string> TellRefusals();

  /// Notifies them that another configuration is in effect.
  void TellConfigured();

  /// Notifies them that a robot is at its goal; returns the words for the log.
  std::string TellArrival(const engine::GoalEnded& arrival);

  /// Answers all callers that wait for the disk, now and from now on. Called after the queues have
  /// ended.
  void Stop() { deadlines_->Stop(); }

 private:
  using TimePoint = std::chrono::steady_clock::time_point;

  void Revoke(const engine::KeysRevoked& change, const Done& done);
  void EditNow(const field::FieldEdit& edit, const DoneWith<control::EditOutcome>& done);
  // Where another server orders the changes, passes on one; else false, without calling.
  template <typename T, typename Change, typename Convert>
  bool Forwards(const Change& change, const DoneWith<T>& done, Convert convert) const {
    return parts_.cluster &&
           parts_.cluster->forward({0, change}, [done, convert](const cluster::OperatorResult& it) {
             done(it.ok ? Result<T>(convert(it)) : Error{it.text});
           });
  }
  template <typename Change>
  bool Forwards(const Change& change, const Done& done) const {
    return parts_.cluster &&
           parts_.cluster->forward({0, change}, [done](const cluster::OperatorResult& it) {
             done(it.ok ? Ok() : Status(Error{it.text}));
           });
  }
  // Makes the change here, and sends what robots are to know.
  void Submit(const engine::Event& change, const Done& done);
  template <typename T>
  void DoneIfDurable(const Result<T>& made, const DoneWith<T>& done) const {
    if (!made.ok()) {
      done(made);
      return;
    }
    AwaitDurable(parts_.patience, [done, made](const Status& durable) {
      done(durable.ok() ? made : Result<T>(durable.error()));
    });
  }
  void AwaitDurable(std::chrono::milliseconds patience, Done done) const;
  std::vector<std::string> ServedLinks() const;
  void SendHaltsUnlogged(int transmissions);
  void ChangeCapture(Status (Captures::*change)(), const Done& done);
  void AwaitCapture(TimePoint deadline, const Done& done);
  void TellCapture();

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
  control::NoticeBoard board_;
  // The last notifications, in order.
  struct LinkTold {
    bool up = false;
    TimePoint since;
    std::string reason;
    bool operator==(const LinkTold&) const = default;
  };
  std::map<std::string, uint64_t> told_refusals_;  // of each net; for TellRefusals alone
  bool has_told_ = false;                          // TellRefusals was called before
  std::mutex telling_;                             // of what follows; taken before the board's
  std::vector<LinkTold> links_told_;
  bool recording_told_ = false;
  std::string trouble_told_;
};

}  // namespace pheromone::daemon
