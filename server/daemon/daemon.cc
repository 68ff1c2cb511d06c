#include "server/daemon/daemon.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <utility>

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/strand.hpp>

#include "server/core/engine/service/service.h"
#include "server/daemon/audit.h"
#include "server/daemon/captures.h"
#include "server/daemon/cluster_member.h"
#include "server/daemon/field_saver.h"
#include "server/daemon/http_front_end.h"
#include "server/daemon/link_set.h"
#include "server/daemon/live_config.h"
#include "server/daemon/live_control.h"
#include "server/daemon/scheduling.h"
#include "server/daemon/service_manager.h"
#include "server/daemon/signal_watch.h"
#include "server/daemon/system_clock.h"
#include "server/daemon/upkeep.h"
#include "server/daemon/watchdog.h"
#include "server/daemon/work_queue.h"
#include "server/robots/links/link_router.h"
#include "server/store/journal/service_state.h"

namespace pheromone::daemon {
namespace {

using std::chrono::milliseconds;

// The engine processes due work in bounded steps. Other work is done between two of them, however
// much is due.
constexpr milliseconds kShortestTick{20};
// The pause between two portions of a large change.
constexpr std::chrono::microseconds kBetweenPortions{200};
// The same while snapshots do not keep up: about 200 000 nodes a second.
constexpr std::chrono::microseconds kBetweenPortionsBehind{20'000};

}  // namespace

class Daemon::Impl {
 public:
  Impl(config::Config config, std::unique_ptr<JournalOwner> journal, Reload reload,
       std::string save_field)
      : strand_(boost::asio::make_strand(io_)),
        signals_({.stop = [this](int signal) { StopFor(signal); },
                  .reload = [this] { ReloadSoon(); },
                  .save = [this] { SaveSoon(); }}),
        ticker_(strand_),
        journal_(std::move(journal)),
        member_(MakeMember(config, journal_.get())),
        service_(
            log(), [] { return ReadSystemClocks(); },
            member_ != nullptr ? journal_->last_ms() : journal_->start_ms(),
            journal_->TakeEngine()),
        saver_(
            &service_, [this] { return FieldTime(); }, std::move(save_field)),
        router_(&service_),
        captures_(&service_, config),
        links_(io_, config, &service_, &router_, &captures_),
        io_threads_(config.daemon.io_threads),
        record_at_start_(config.capture.start),
        config_(std::move(config), std::move(reload), &service_, &captures_),
        control_({.service = &service_,
                  .log = log(),
                  .router = &router_,
                  .links = &links_.links(),
                  .trackers = &links_.trackers(),
                  .link_configs = &config_.links(),
                  .captures = &captures_,
                  .now_ms = [this] { return FieldTime(); },
                  .config = [this] { return config_.Get(); },
                  .run_edit = [this](auto work) { return edits_.Add(std::move(work)); },
                  .run_operation = [this](auto work) { return operations_.Add(std::move(work)); },
                  .reload = [this] { return ReadConfigurationAgain(); },
                  .reload_secrets = [this] { return Read(&LiveConfig::ReadSecretsAgain); },
                  .change_tau =
                      [this](uint8_t type, int64_t tau_ms) {
                        Status changed = config_.ChangeTau(type, tau_ms);
                        if (changed.ok()) {
                          control_.TellConfigured();
                        }
                        return changed;
                      },
                  .keys = [this] { return config_.Keys(); },
                  .drop_revoked = [this] { links_.DropRevoked(); },
                  .snapshot = [this](auto done) { MakeSnapshot(std::move(done)); },
                  .is_kept = !journal_->folder().empty(),
                  .cluster = member_ != nullptr ? std::optional(member_->live()) : std::nullopt}),
        edits_({.name = "an edit"}),
        operations_({.name = "an operation"}),
        audit_(&control_, journal_->folder()),
        front_end_(&control_, config_.control(), config_.Web()),
        upkeep_(strand_, {.service = &service_,
                          .journal = journal_.get(),
                          .links = &links_,
                          .control = &control_,
                          .operations = &operations_,
                          .is_member = member_ != nullptr}) {
    service_.OnPortion([this](std::span<const engine::Outgoing> out) {
      router_.Deliver({out.begin(), out.end()});
      std::this_thread::sleep_for(journal_->IsBehind() ? kBetweenPortionsBehind : kBetweenPortions);
    });
    service_.OnEarlierDeadline([this] { boost::asio::post(strand_, [this] { Tick(); }); });
    service_.OnRevoked([this] { boost::asio::post(strand_, [this] { links_.DropRevoked(); }); });
    if (member_ != nullptr) {
      service_.OnChange([this](const engine::Event& event) { return member_->Forward(event); });
      service_.OnConfigured(
          [this] { boost::asio::post(strand_, [this] { control_.TellConfigured(); }); });
    }
    service_.OnArrival([this](const engine::GoalEnded& arrival) {
      boost::asio::post(strand_,
                        [this, arrival] { spdlog::info("{}", control_.TellArrival(arrival)); });
    });
  }

  int Run() {
    std::signal(SIGPIPE, SIG_IGN);  // writing to a closed connection is an error value here
    if (member_ != nullptr) {
      signals_.Start();  // it may wait for the others
    }
    if (!BeginWithTheState() || !BeginToRecord()) {
      if (member_ != nullptr) {
        member_->Stop();
      }
      EndJournal();
      signals_.End();
      return must_restart_ ? 1 : stopping_ ? 0 : kMisconfigured;
    }
    has_begun_ = true;
    (void)control_.TellRefusals();  // those of before the start were told then
    boost::asio::post(strand_, [this] { Tick(); });
    upkeep_.Start();
    if (member_ == nullptr) {
      signals_.Start();
    }
    // First: a second server beside a running one must not drive its robots.
    const bool started = front_end_.Open() && links_.Start();
    if (started) {
      boost::asio::post(strand_, [this] { BeReady(); });
    } else {
      boost::asio::post(strand_, [this] { Stop(); });
    }
    std::vector<std::thread> threads;
    threads.reserve(static_cast<size_t>(io_threads_));
    for (int i = 0; i < io_threads_; ++i) {
      threads.emplace_back([this] {
        TakeShortTurns();
        io_.run();
      });
    }
    for (std::thread& thread : threads) {
      thread.join();
    }
    operations_.Close();
    edits_.Close();
    if (member_ != nullptr) {
      member_->EndForwarding();  // the front end waits for its operators
    }
    control_.Stop();
    front_end_.Close();
    if (member_ != nullptr) {
      member_->Stop();  // not before: operators still may halt the robots of all servers
    }
    captures_.Finish();
    // A failed start must not replace the file saved by an earlier run.
    const bool saved = !started || must_restart_ || saver_.SaveAtEnd();
    const bool kept = EndJournal();
    upkeep_.Summarise();
    signals_.End();
    return started && saved && kept && !must_restart_ ? 0 : 1;
  }

 private:
  // The journal's threads run from here on, since a large configuration is written to the log while
  // it is applied; then the configuration is that of the state.
  bool BeginWithTheState() {
    journal_->Start([this] { ReleaseSoon(); },
                    [this] { return journal::ServiceState::Freeze(&service_); });
    if (member_ != nullptr) {
      const Status begun = BeginInTheCluster();
      if (!begun.ok()) {
        spdlog::critical("cluster: {}", begun.error());
        must_restart_ = true;  // its address may come later
        return false;
      }
      if (stopping_ || follows_at_start_) {
        return !stopping_;
      }
    }
    const bool begins_epoch = journal_->membership().Get().new_epoch;
    const Status configured =
        config_.TakeAtStart(begins_epoch || (member_ == nullptr && journal_->state_lost()));
    if (configured.ok() && begins_epoch) {
      (void)log()->WhenDurable(
          service_.Inspect([](const engine::Engine& engine) { return engine.sequence(); }),
          [this] { (void)operations_.Add([this] { journal_->membership().EndNewEpoch(); }); });
    }
    if (!configured.ok()) {
      spdlog::critical("{}", configured.error());
      must_restart_ = service_.Inspect([this](const engine::Engine& /*it*/) {
        return log()->Admit() != protocol::Reason::kNone || !log()->Trouble().empty();
      });
      if (must_restart_ && member_ == nullptr) {  // else it does not lead any more, for instance
        spdlog::critical(
            "free space on the disk of {}, or mend that disk, and start the server again: the "
            "state is unchanged",
            journal_->folder());
      } else if (!journal_->folder().empty() && !must_restart_) {
        spdlog::critical(
            "the state in {} is unchanged: use the configuration that it was written with, move it "
            "to the new one (pheromonectl journal resample --config FILE {}), or move the folder "
            "away to start with an empty state",
            journal_->folder(), journal_->folder());
      }
    }
    return configured.ok();
  }

  engine::OrderedLog* log() { return member_ != nullptr ? member_->log() : journal_->log(); }

  // A server that follows has the configuration of the one that leads.
  Status BeginInTheCluster() {
    PHEROMONE_TRY_STATUS(member_->Start(
        {.service = &service_,
         .deliver = [this](const std::vector<engine::Outgoing>& out) { router_.Deliver(out); },
         .committed = [this] { ReleaseSoon(); },
         .restart =
             [this](const std::string& why) {
               spdlog::error("cluster: {}; this process ends, to start again from its journal",
                             why);
               must_restart_ = true;
               member_->Interrupt();
               boost::asio::post(strand_, [this] { Stop(); });
             },
         .change =
             [this](const cluster::OperatorChange& change,
                    const std::function<void(cluster::OperatorResult)>& done) {
               control_.Accept(change, done);
             },
         .halt = [this] { return control_.HaltHere(); },
         .freeze = [this]() -> std::unique_ptr<journal::StateSource> {
           const bool has_state =
               service_.Inspect([](const engine::Engine& engine) { return engine.configured(); });
           return has_state ? journal::ServiceState::Freeze(&service_) : nullptr;
         }}));
    switch (member_->AwaitBegin()) {
      case ClusterMember::Begun::kStopped:
        stopping_ = true;
        break;
      case ClusterMember::Begun::kLeads:
        service_.ResumeAt(journal_->start_ms());
        break;
      case ClusterMember::Begun::kFollows:
        follows_at_start_ = true;
        if (service_.Inspect([](const engine::Engine& it) { return it.shared_config(); }) !=
            config_.AsRead()) {
          spdlog::warn(
              "cluster: this machine's configuration differs from the one in effect, which is that "
              "of the server that leads; make the files equal");
        }
        break;
    }
    return Ok();
  }

  bool EndJournal() {
    const bool is_whole = member_ == nullptr || (!must_restart_ && member_->is_committed());
    return journal_->Stop(is_whole ? std::optional(service_.StateHash()) : std::nullopt);
  }

  bool BeginToRecord() {
    const Status recording = record_at_start_ ? captures_.Start() : Ok();
    if (!recording.ok()) {
      spdlog::critical("cannot record: {}", recording.error());
    }
    return recording.ok();
  }

  void ReleaseSoon() {
    if (!release_posted_.exchange(true)) {
      boost::asio::post(strand_, [this] { Release(); });
    }
  }

  // Sends answers whose changes have become durable.
  void Release() {
    release_posted_ = false;
    std::vector<engine::Outgoing> out;
    service_.Release(&out);
    router_.Deliver(out);
  }

  // The present field time. Under the service's lock.
  uint64_t FieldTime() { return service_.FieldTimeInside(); }

  void BeReady() {
    upkeep_.BeReady();
    if (const auto interval = service_manager::AliveInterval()) {
      watchdog_ = std::make_unique<Watchdog>(strand_, &service_, *interval, service_manager::Alive);
      watchdog_->Start();
    }
  }

  // A stuck log must not block the signal thread: everything else is posted.
  void StopFor(int signal) {
    boost::asio::post(strand_, [this, signal] {
      spdlog::info("{}: stopping", signal == SIGINT ? "interrupted" : "terminated");
      if (member_ == nullptr || !operations_.Add([this] { HandOverAndStop(); })) {
        Stop();
      }
    });
    if (member_ != nullptr) {
      member_->Interrupt();
    }
  }

  // Another server leads before the robots here have to go elsewhere.
  void HandOverAndStop() {
    service_manager::Stopping();
    member_->HandOver();
    boost::asio::post(strand_, [this] { Stop(); });
  }

  void ReloadSoon() {
    if (!has_begun_) {
      spdlog::warn("SIGHUP ignored: the server starts");
    } else if (!stopping_) {
      control_.Reload([](const auto& /*notes*/) {});  // what comes of it is in the log
    }
  }

  void SaveSoon() {
    if (!has_begun_) {
      spdlog::warn("SIGUSR1 ignored: the server starts");
      return;
    }
    if (!operations_.Add([this] { saver_.SaveBeside(); }) && !stopping_) {
      spdlog::warn("SIGUSR1 ignored: too many requests are pending");
    }
  }

  // As an operation.
  template <typename Outcome>
  Outcome Read(Outcome (LiveConfig::*read)()) {
    service_manager::Reloading();
    Outcome outcome = (config_.*read)();
    if (const auto certificate = config_.Web().tls; outcome.ok() && certificate) {
      front_end_.SetCertificate(*certificate);
    }
    if (outcome.ok()) {
      links_.SetKeys(config_.Keys());
    }
    if (!stopping_) {
      service_manager::Ready(upkeep_.DescribeState());
    }
    return outcome;
  }

  // Returns the settings that require a restart.
  Result<std::vector<std::string>> ReadConfigurationAgain() {
    auto notes = Read(&LiveConfig::ReadAgain);
    if (notes.ok()) {
      control_.TellConfigured();
    }
    return notes;
  }

  void MakeSnapshot(control::Control::DoneWith<std::optional<std::string>> done) {
    if (journal_->folder().empty()) {
      done(std::optional<std::string>());
      return;
    }
    journal_->Snapshot([done = std::move(done)](const Result<std::string>& made) {
      done(made.ok() ? Result<std::optional<std::string>>(made.value()) : made.error());
    });
  }

  // Ends everything that keeps io_ busy, and so Run.
  void Stop() {
    stopping_ = true;
    service_manager::Stopping();
    if (watchdog_) {
      watchdog_->Stop();
    }
    ticker_.cancel();
    upkeep_.Stop();
    links_.Stop();
  }

  // Waits for the engine's next deadline, if there is one. If the deadline moves forward, this is
  // called again (OnEarlierDeadline) and restarts the timer.
  void Tick() {
    const auto due = service_.MillisecondsToDeadline();
    if (stopping_ || !due) {
      return;
    }
    constexpr auto kDay = static_cast<uint64_t>(milliseconds(std::chrono::hours(24)).count());
    ticker_.expires_after(std::max(milliseconds(std::min(*due, kDay)), kShortestTick));
    ticker_.async_wait([this](const boost::system::error_code& error) {
      if (error || stopping_) {
        return;
      }
      std::vector<engine::Outgoing> out;
      service_.AdvanceIfDue(&out);
      router_.Deliver(out);
      Tick();
    });
  }

  boost::asio::io_context io_;
  boost::asio::strand<boost::asio::io_context::executor_type> strand_;
  SignalWatch signals_;
  boost::asio::steady_timer ticker_;
  bool follows_at_start_ = false;
  std::atomic<bool> has_begun_{false};  // the state is there: it may be reread and saved
  std::atomic<bool> must_restart_{false};
  std::unique_ptr<JournalOwner> journal_;
  std::atomic<bool> release_posted_{false};
  std::unique_ptr<ClusterMember> member_;  // null: this server is alone
  engine::Service service_;
  FieldSaver saver_;
  links::LinkRouter router_;
  Captures captures_;
  LinkSet links_;
  const int io_threads_;
  const bool record_at_start_;
  LiveConfig config_;
  std::unique_ptr<Watchdog> watchdog_;  // if required by the service manager
  LiveControl control_;
  WorkQueue edits_;
  WorkQueue operations_;  // long requests of signals and operators
  Audit audit_;
  HttpFrontEnd front_end_;
  Upkeep upkeep_;
  std::atomic<bool> stopping_{false};
};

Daemon::Daemon(config::Config config, std::unique_ptr<JournalOwner> journal, Reload reload,
               std::string save_field)
    : impl_(std::make_unique<Impl>(std::move(config), std::move(journal), std::move(reload),
                                   std::move(save_field))) {}

Daemon::~Daemon() = default;

int Daemon::Run() {
  return impl_->Run();
}

}  // namespace pheromone::daemon
