#include "server/daemon/daemon.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <mutex>
#include <optional>
#include <random>
#include <thread>
#include <utility>

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/strand.hpp>

#include "server/config/describe.h"
#include "server/daemon/captures.h"
#include "server/daemon/describe.h"
#include "server/daemon/field_saver.h"
#include "server/daemon/front_door.h"
#include "server/daemon/live_control.h"
#include "server/daemon/make_link.h"
#include "server/daemon/service_manager.h"
#include "server/daemon/system_clock.h"
#include "server/daemon/watchdog.h"
#include "server/engine/service.h"
#include "server/links/switchboard.h"

namespace pheromone::daemon {
namespace {

using std::chrono::milliseconds;

// The engine does what is due in bounded steps. Between two of them others have a turn, however
// much is due.
constexpr milliseconds kShortestTick{20};
// How often trouble is told, at the most.
constexpr milliseconds kBetweenReports{1000};

// A stop signal often comes twice at once: timeout(1), for one, signals its child and its group.
constexpr std::chrono::seconds kImpatience{1};

// What an epoch begins with where the state is new: robots say hello again. With a journal, a
// restart goes on in the old one.
uint16_t RandomEpoch(uint16_t other_than) {
  std::random_device random;
  std::uniform_int_distribution<int> any(1, UINT16_MAX);
  int epoch = 0;
  do {
    epoch = any(random);
  } while (epoch == other_than);
  return static_cast<uint16_t>(epoch);
}

void LogLines(const std::vector<std::string>& lines) {
  for (const std::string& line : lines) {
    spdlog::info("{}", line);
  }
}

void LogOfLink(links::Severity severity, const std::string& text) {
  spdlog::log(severity == links::Severity::kInfo ? spdlog::level::info : spdlog::level::warn, "{}",
              text);
}

// What --check says in full is not worth a line at every start.
void LogWarnings(const std::vector<std::string>& warnings) {
  for (const std::string& warning : warnings) {
    spdlog::debug("{}", warning);
  }
}

}  // namespace

class Daemon::Impl {
 public:
  Impl(config::Config config, std::unique_ptr<StateKeeper> keeper, Reload reload,
       std::string save_field)
      : config_(std::move(config)),
        reload_(std::move(reload)),
        strand_(boost::asio::make_strand(io_)),
        signals_(signal_io_, SIGINT, SIGTERM, SIGHUP),
        ticker_(strand_),
        reporter_(strand_),
        keeper_(std::move(keeper)),
        field_clock_(keeper_->start_ms()),
        service_(
            keeper_->log(), [this] { return ReadClocks(); }, keeper_->start_ms(),
            keeper_->TakeEngine()),
        saver_(
            &service_, [this] { return FieldTime(); }, std::move(save_field)),
        switchboard_(&service_),
        captures_(&service_, config_),
        control_({.service = &service_,
                  .log = keeper_->log(),
                  .switchboard = &switchboard_,
                  .links = &links_,
                  .captures = &captures_,
                  .now_ms = [this] { return FieldTime(); },
                  .config = [this] { return Config(); },
                  .reload = [this] { return ReadConfigurationAgain(); },
                  .snapshot = [this] { return keeper_->AskForSnapshot(); }}),
        door_(&control_, config_.control, config_.web) {
    signals_.add(SIGUSR1);
    service_.OnEarlierDeadline([this] { boost::asio::post(strand_, [this] { Tick(); }); });
  }

  int Run() {
    std::signal(SIGPIPE, SIG_IGN);  // writing to who hung up is an error value here
    if (!BeginWithTheState()) {
      keeper_->Stop(service_.StateHash());
      return 1;
    }
    LogWarnings(config_.warnings);
    LogLines(config::DescribeConfig(config_));
    if (config_.capture.start) {
      const Status recording = captures_.Start();
      if (!recording.ok()) {
        spdlog::critical("cannot record: {}", recording.error());
        return 1;
      }
    }
    MakeLinks();
    AwaitSignal();
    boost::asio::post(strand_, [this] { Tick(); });
    ReportTrouble();
    std::vector<std::thread> threads;
    threads.reserve(static_cast<size_t>(config_.daemon.io_threads));
    std::thread signal_thread([this] { signal_io_.run(); });
    const bool started = StartLinks();
    if (started) {
      door_.Open();
      boost::asio::post(strand_, [this] { BeReady(); });
    } else {
      boost::asio::post(strand_, [this] { Stop(); });
    }
    for (int i = 0; i < config_.daemon.io_threads; ++i) {
      threads.emplace_back([this] { io_.run(); });
    }
    for (std::thread& thread : threads) {
      thread.join();
    }
    door_.Close();
    captures_.Finish();
    // A start that failed must not replace what an earlier run has saved.
    const bool saved = !started || saver_.SaveAtEnd();
    const bool kept = keeper_->Stop(service_.StateHash());
    Summarise();
    signal_io_.stop();
    signal_thread.join();
    BlockSignals();
    return started && saved && kept ? 0 : 1;
  }

 private:
  // The configuration is that of the state from here on, and the journal's threads run.
  bool BeginWithTheState() {
    const uint16_t epoch = service_.Inspect([](const auto& engine) { return engine.epoch(); });
    const Status configured =
        service_.Configure(config_.engine, RandomEpoch(epoch), keeper_->state_lost());
    if (!configured.ok()) {
      spdlog::critical("{}", configured.error());
      if (!keeper_->folder().empty()) {
        spdlog::critical(
            "the state in {} stays as it is: go on with the configuration that it was made with, "
            "or name another [journal] folder to begin anew (\"pheromonectl map resample\" takes a "
            "saved field along)",
            keeper_->folder());
      }
      return false;
    }
    keeper_->Start([this] {
      if (!release_posted_.exchange(true)) {
        boost::asio::post(strand_, [this] { Release(); });
      }
    });
    return true;
  }

  // What has become durable goes out.
  void Release() {
    release_posted_ = false;
    std::vector<engine::Outgoing> out;
    service_.Release(&out);
    switchboard_.Deliver(out);
  }

  // The service's clock, read along so that the field time is known between events too. Under the
  // service's lock.
  engine::ClockReading ReadClocks() {
    const engine::ClockReading reading = ReadSystemClocks();
    field_clock_.Read(reading);
    return reading;
  }

  // The present field time. Under the service's lock.
  uint64_t FieldTime() { return field_clock_.Read(ReadSystemClocks()).field_time_ms; }

  config::Config Config() const {
    const std::lock_guard lock(config_mutex_);
    return config_;
  }

  void MakeLinks() {
    std::random_device random;
    for (size_t i = 0; i < config_.links.size(); ++i) {
      links_.push_back(MakeLink(io_, config_.links[i],
                                {config_.links[i].name, static_cast<engine::LinkIndex>(i),
                                 &switchboard_, LogOfLink, &captures_},
                                random()));
      switchboard_.Add(links_.back().get());
    }
    for (const config::TrackerConfig& tracker : config_.trackers) {
      const auto log = [name = tracker.name](links::Severity severity, const std::string& text) {
        LogOfLink(severity, fmt::format("{}: {}", name, text));
      };
      trackers_.push_back(MakeTracker(io_, tracker, config_.datum, &service_, log, random()));
    }
  }

  // False if a required link did not come up.
  bool StartLinks() {
    bool good = true;
    size_t up = 0;
    for (size_t i = 0; i < links_.size(); ++i) {
      const Status status = links_[i]->Start();
      up += status.ok() ? 1u : 0u;
      if (!status.ok() && config_.links[i].required) {
        spdlog::critical("link {} is required and did not come up: {}", links_[i]->name(),
                         status.error());
        good = false;
      }
    }
    for (const auto& tracker : trackers_) {
      (void)tracker->Start();  // it says itself what failed, and tries again
    }
    if (good) {
      spdlog::info("ready: {} of {} links up", up, links_.size());
    }
    return good;
  }

  void BeReady() {
    told_ = DescribeState();
    service_manager::Ready(told_);
    if (const auto interval = service_manager::AliveInterval()) {
      watchdog_ = std::make_unique<Watchdog>(strand_, &service_, keeper_->log(), *interval,
                                             service_manager::Alive);
      watchdog_->Start();
    }
  }

  std::string DescribeState() const {
    const auto up = std::count_if(links_.begin(), links_.end(),
                                  [](const auto& link) { return link->state().up; });
    const size_t robots = service_.Inspect([](const auto& engine) { return CountRobots(engine); });
    return fmt::format("{} of {} links up, robots {}", up, links_.size(), robots);
  }

  static size_t CountRobots(const engine::Engine& engine) {
    size_t count = 0;
    engine.robots().ForEach([&count](auto&&...) { ++count; });
    return count;
  }

  void AwaitSignal() {
    signals_.async_wait([this](const boost::system::error_code& error, int signal) {
      if (error) {
        return;
      }
      if (signal == SIGHUP) {
        boost::asio::post(strand_, [this] {
          if (!stopping_) {
            (void)ReadConfigurationAgain();  // it says itself what is wrong
          }
        });
      } else if (signal == SIGUSR1) {
        boost::asio::post(strand_, [this] { saver_.SaveBeside(); });
      } else {
        TakeStopSignal(signal);
      }
      AwaitSignal();
    });
  }

  void TakeStopSignal(int signal) {
    const auto now = std::chrono::steady_clock::now();
    if (!told_to_stop_at_) {
      told_to_stop_at_ = now;
      boost::asio::post(strand_, [this, signal] {  // a log that is stuck must not stop this thread
        spdlog::info("{}: stopping", signal == SIGINT ? "interrupted" : "terminated");
        Stop();
      });
    } else if (now - *told_to_stop_at_ >= kImpatience) {
      std::_Exit(128 + signal);
    }
  }

  // With signals_ goes its handler: a signal that comes between that and the end of the process
  // would spoil the exit status.
  static void BlockSignals() {
    sigset_t signals;
    sigemptyset(&signals);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGUSR1}) {
      sigaddset(&signals, signal);
    }
    pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  }

  // Everything that keeps io_ busy ends, and with it Run.
  void Stop() {
    stopping_ = true;
    service_manager::Stopping();
    if (watchdog_) {
      watchdog_->Stop();
    }
    ticker_.cancel();
    reporter_.cancel();
    for (const auto& link : links_) {
      link->Stop();
    }
    for (const auto& tracker : trackers_) {
      tracker->Stop();
    }
  }

  // Waits for the engine's next deadline, if there is one. What brings it forward calls this again
  // (OnEarlierDeadline), and with it the timer is set anew.
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
      switchboard_.Deliver(out);
      Tick();
    });
  }

  // Once for each second in which there was more of it.
  void ReportTrouble() {
    reporter_.expires_after(kBetweenReports);
    reporter_.async_wait([this](const boost::system::error_code& error) {
      if (error || stopping_) {
        return;
      }
      control_.SampleLinks();
      std::string trouble = DescribeTrouble(Counters());
      if (trouble != trouble_) {
        trouble_ = std::move(trouble);
        spdlog::warn("so far: {}", trouble_);
      }
      if (std::string state = DescribeState(); state != told_) {
        told_ = std::move(state);
        service_manager::Tell(told_);
      }
      ReportTrouble();
    });
  }

  engine::EngineCounters Counters() const {
    return service_.Inspect([](const engine::Engine& engine) { return engine.counters(); });
  }

  // By SIGHUP, or by the operator from another thread. Returns what waits for a restart.
  Result<std::vector<std::string>> ReadConfigurationAgain() {
    const std::lock_guard lock(config_mutex_);
    service_manager::Reloading();
    auto outcome = TakeConfiguration();
    service_manager::Ready(DescribeState());
    return outcome;
  }

  Result<std::vector<std::string>> TakeConfiguration() {
    Result<config::Config> loaded = reload_();
    if (!loaded.ok()) {
      spdlog::error("the configuration stays as it was:\n{}", loaded.error());
      return Error{loaded.error()};
    }
    config::Config& next = loaded.value();
    std::vector<std::string> notes;
    if (next.links != config_.links) {
      notes.emplace_back("changed links need a restart");
    }
    if (next.trackers != config_.trackers || next.datum != config_.datum) {
      notes.emplace_back("changed trackers, or their datum, need a restart");
    }
    if (next.journal != config_.journal || next.capture != config_.capture) {
      notes.emplace_back("changed [journal] or [capture] settings need a restart");
    }
    if (next.daemon != config_.daemon || next.control != config_.control ||
        next.web != config_.web) {
      notes.emplace_back("changed [daemon], [control] or [web] settings need a restart");
    }
    for (const std::string& note : notes) {
      spdlog::warn("{}", note);
    }
    // Links know themselves by their place among those they were started with.
    next.engine.links = config_.engine.links;
    const uint16_t epoch = service_.Inspect([](const auto& engine) { return engine.epoch(); });
    const Status status = service_.Configure(next.engine, RandomEpoch(epoch));
    if (!status.ok()) {
      spdlog::error("the configuration stays as it was: {}", status.error());
      return Error{status.error()};
    }
    config_.engine = next.engine;
    captures_.SetConfigText(next.text);
    LogWarnings(next.warnings);
    LogLines(config::DescribeConfig(config_));
    spdlog::info("configuration read again");
    return notes;
  }

  void Summarise() const {
    LogLines(DescribeCounters(service_.counters()));
    if (const std::string trouble = DescribeTrouble(Counters()); !trouble.empty()) {
      spdlog::info("{}", trouble);
    }
    for (const auto& link : links_) {
      spdlog::info("{}", DescribeLink(link->name(), link->counters()));
    }
    const auto [robots, time_ms] = service_.Inspect([](const engine::Engine& engine) {
      return std::pair(CountRobots(engine), engine.field_time_ms());
    });
    spdlog::info("robots {}, last change at field time {} ms, state hash {:016x}", robots, time_ms,
                 service_.StateHash());
    spdlog::info("stopped");
  }

  mutable std::mutex config_mutex_;
  config::Config config_;
  const Reload reload_;
  boost::asio::io_context io_;
  boost::asio::strand<boost::asio::io_context::executor_type> strand_;
  boost::asio::io_context signal_io_;  // of its own: it hears a second signal when io_ is stuck
  boost::asio::signal_set signals_;
  std::optional<std::chrono::steady_clock::time_point> told_to_stop_at_;  // of signal_io_'s thread
  boost::asio::steady_timer ticker_;
  boost::asio::steady_timer reporter_;
  std::unique_ptr<StateKeeper> keeper_;
  std::atomic<bool> release_posted_{false};
  engine::FieldClock field_clock_;
  engine::Service service_;
  FieldSaver saver_;
  links::Switchboard switchboard_;
  Captures captures_;
  std::vector<std::unique_ptr<links::Link>> links_;
  std::vector<std::unique_ptr<links::TrackerLink>> trackers_;
  std::unique_ptr<Watchdog> watchdog_;  // if the service manager wants one
  LiveControl control_;
  FrontDoor door_;
  std::string trouble_;
  std::string told_;  // the service manager
  bool stopping_ = false;
};

Daemon::Daemon(config::Config config, std::unique_ptr<StateKeeper> keeper, Reload reload,
               std::string save_field)
    : impl_(std::make_unique<Impl>(std::move(config), std::move(keeper), std::move(reload),
                                   std::move(save_field))) {}

Daemon::~Daemon() = default;

int Daemon::Run() {
  return impl_->Run();
}

}  // namespace pheromone::daemon
