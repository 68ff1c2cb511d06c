// Snapshots under full load: robots that TRACE as fast as the journal takes it, and what that costs
// them. The figures are for reading; what must hold is that the recovered state is the one that
// was.

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <random>
#include <thread>
#include <utility>
#include <vector>

#include "proto_tests/crash/checks.h"
#include "server/base/testing/temporary_folder.h"
#include "server/core/engine/service/service.h"
#include "server/core/engine/testing/bench.h"
#include "server/store/journal/open.h"
#include "server/store/journal/posix_folder.h"
#include "server/store/journal/recovery.h"
#include "server/store/journal/retention.h"
#include "server/store/journal/service_state.h"
#include "server/store/journal/snapshot_writer.h"

namespace pheromone::crash {
namespace {

using engine::testing::Hello;
using engine::testing::ReasonOf;
using engine::testing::Trace;

constexpr uint8_t kRobots = 64;

uint64_t Microseconds() {
  return static_cast<uint64_t>(std::chrono::duration_cast<std::chrono::microseconds>(
                                   std::chrono::steady_clock::now().time_since_epoch())
                                   .count());
}

// How long the service was held for one batch of 64 requests.
class Holds {
 public:
  void Add(uint64_t us) { us_.push_back(us); }
  std::string Text() {
    std::sort(us_.begin(), us_.end());
    return us_.empty()
               ? "none"
               : fmt::format("p50 {}, p99 {}, longest {} us over {} batches", us_[us_.size() / 2],
                             us_[us_.size() * 99 / 100], us_.back(), us_.size());
  }

 private:
  std::vector<uint64_t> us_;
};

// Makes each snapshot that is due, in a thread of its own.
class Snapshots {
 public:
  using Freeze = std::function<std::unique_ptr<journal::StateSource>()>;

  Snapshots(journal::Folder* folder, journal::LocalJournal* log) : folder_(folder), log_(log) {}
  // Before anything is asked for.
  void Start(Freeze freeze) {
    freeze_ = std::move(freeze);
    thread_ = std::thread([this] { Run(); });
  }
  Snapshots(const Snapshots&) = delete;
  Snapshots& operator=(const Snapshots&) = delete;
  ~Snapshots() { End(); }

  void Ask() {
    const std::lock_guard lock(mutex_);
    due_ = true;
    wake_.notify_one();
  }
  void End() {
    {
      const std::lock_guard lock(mutex_);
      ended_ = true;
      wake_.notify_one();
    }
    if (thread_.joinable()) {
      thread_.join();
    }
  }
  bool is_at_it() const { return is_at_it_; }
  int made() const { return made_; }
  int failed() const { return failed_; }

 private:
  void Run() {
    for (;;) {
      {
        std::unique_lock lock(mutex_);
        wake_.wait(lock, [this] { return ended_ || due_; });
        if (!std::exchange(due_, false)) {
          return;
        }
      }
      is_at_it_ = true;
      const bool made = Make();
      is_at_it_ = false;
      ++(made ? made_ : failed_);
    }
  }

  bool Make() {
    const std::unique_ptr<journal::StateSource> state = freeze_();
    const auto written = journal::SnapshotWriter::Write(state.get(), folder_);
    if (!written.ok()) {
      return false;
    }
    // Shared: set_value is still at work when a waiter returns.
    const auto on_disk = std::make_shared<std::promise<void>>();
    log_->WhenOnDisk(written.value()->sequence(), [on_disk] { on_disk->set_value(); });
    on_disk->get_future().wait();
    return written.value()->GiveName().ok() && journal::RemoveWhatIsNotNeeded(2, folder_).ok();
  }

  journal::Folder* folder_;
  journal::LocalJournal* log_;
  Freeze freeze_;
  std::mutex mutex_;
  std::condition_variable wake_;
  bool due_ = false;
  bool ended_ = false;
  std::atomic<bool> is_at_it_{false};
  std::atomic<int> made_{0};
  std::atomic<int> failed_{0};
  std::thread thread_;
};

engine::EngineConfig Config() {
  engine::EngineConfig config = engine::testing::SmallConfig();
  config.field.map.width_um = 30'000'000;
  config.field.map.height_um = 30'000'000;
  config.field.memory_bytes = uint64_t{256} << 20;
  return config;
}

bool Run(journal::PosixFolder* folder, uint64_t changes, uint64_t seed) {
  journal::JournalSettings settings;
  settings.segment_bytes = uint64_t{2} << 20;
  settings.snapshot_bytes = uint64_t{4} << 20;
  auto opened =
      journal::OpenJournal(folder, settings, Microseconds, [](bool, const std::string&) {});
  if (!opened.ok()) {
    fmt::print("load: {}\n", opened.error());
    return false;
  }
  journal::LocalJournal& log = *opened.value().journal;
  Snapshots snapshots(folder, &log);
  log.OnSnapshotDue([&snapshots] { snapshots.Ask(); });
  std::thread writer([&log] { log.WriteUntilStopped(); });
  engine::Service service(
      &log,
      [] {
        return engine::ClockReading{Microseconds() / 1'000, 0};
      },
      0, std::move(opened.value().engine));
  snapshots.Start([&service] { return journal::ServiceState::Freeze(&service); });
  (void)service.Configure(Config(), 1);

  std::mt19937_64 random(seed);
  const auto place = [&random] { return static_cast<int32_t>(random() % 30'000); };
  std::vector<protocol::Message> batch;
  for (uint8_t id = 1; id <= kRobots; ++id) {
    batch.push_back(Hello(id, 1));
  }
  std::vector<engine::Outgoing> out;
  service.Handle(0, batch, &out);
  std::vector<uint8_t> seq(kRobots + 1, 0);
  Holds beside_a_snapshot;
  Holds otherwise;
  const uint64_t begun_us = Microseconds();
  while (log.status().appended < changes) {
    batch.clear();
    for (uint8_t id = 1; id <= kRobots; ++id) {
      batch.push_back(Trace(id, static_cast<uint8_t>(seq[id] + 1), place(), place(), 0, 2));
      ++seq[id];
    }
    out.clear();
    const bool at_it = snapshots.is_at_it();
    const uint64_t at_us = Microseconds();
    service.Handle(0, batch, &out);
    (at_it ? beside_a_snapshot : otherwise).Add(Microseconds() - at_us);
    for (const engine::Outgoing& it : out) {
      if (ReasonOf(it.message) == protocol::Reason::kBusy) {
        --seq[it.message.id];
      }
    }
    out.clear();
    service.Release(&out);
  }
  snapshots.End();  // while there is somebody who writes what it may wait for
  log.Stop();
  writer.join();
  const double seconds = static_cast<double>(Microseconds() - begun_us) / 1e6;
  const uint64_t state_hash = service.StateHash();
  const bool closed = log.Close(state_hash).ok();
  const auto recovered = journal::Recover(*folder);
  const bool same = closed && recovered.ok() &&
                    recovered.value().engine.StateHash() == state_hash &&
                    recovered.value().sequence == log.status().appended;
  fmt::print(
      "load: {} durable changes, {:.0f} a second, TRACE of {} robots; {} snapshots beside them, {} "
      "failed; the recovered state is {}\n  the service was held, without a snapshot: {}\n  beside "
      "one: {}\n",
      log.status().durable, static_cast<double>(log.status().durable) / seconds, kRobots,
      snapshots.made(), snapshots.failed(), same ? "the same" : "ANOTHER ONE", otherwise.Text(),
      beside_a_snapshot.Text());
  return same && snapshots.made() > 0 && snapshots.failed() == 0;
}

}  // namespace

bool CheckLoad(uint64_t changes, uint64_t seed) {
  const TemporaryFolder temporary;
  auto folder = journal::PosixFolder::Open(temporary.string(), journal::PosixFolder::Mode::kOwner);
  return folder.ok() && Run(folder.value().get(), changes, seed);
}

}  // namespace pheromone::crash
