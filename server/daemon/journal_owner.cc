#include "server/daemon/journal_owner.h"

#include <spdlog/spdlog.h>

#include <chrono>
#include <cstdlib>
#include <utility>

#include "server/config/folders.h"
#include "server/daemon/service_manager.h"
#include "server/daemon/system_clock.h"
#include "server/store/journal/open.h"
#include "server/store/journal/retention.h"

namespace pheromone::daemon {
namespace {

constexpr uint64_t kStalledUs = 1'000'000;          // after this time it is reported
constexpr uint64_t kBetweenReportsUs = 10'000'000;  // while it lasts

constexpr uint64_t kBetweenProgressUs = 5'000'000;
constexpr int kAttempts = 3;  // to copy a state that changes faster than it can be copied
constexpr std::chrono::milliseconds kBetweenFreezes{100};

using Durability = config::JournalConfig::Durability;

uint64_t SteadyMicroseconds() {
  return static_cast<uint64_t>(std::chrono::duration_cast<std::chrono::microseconds>(
                                   std::chrono::steady_clock::now().time_since_epoch())
                                   .count());
}

void TellOfJournal(bool is_trouble, const std::string& text) {
  spdlog::log(is_trouble ? spdlog::level::err : spdlog::level::info, "{}", text);
}

// Reports the progress of a recovery: to the service manager at once and every few seconds, so that
// it waits; to the log if it takes long.
class RecoveryReport {
 public:
  explicit RecoveryReport(const std::string& folder) : folder_(folder) {}

  void Tell(const journal::Progress& now) {
    const uint64_t now_us = SteadyMicroseconds();
    if (now_us < next_us_) {
      return;
    }
    const auto mib = [](uint64_t bytes) { return static_cast<double>(bytes) / (1 << 20); };
    const std::string text =
        fmt::format("reading the journal: {:.2f} of {:.2f} MiB, {} changes replayed",
                    mib(now.bytes_done), mib(now.bytes_total), now.events);
    service_manager::Starting(text);
    if (next_us_ != 0) {
      spdlog::info("{}: {}", folder_, text);
    }
    next_us_ = now_us + kBetweenProgressUs;
  }

 private:
  const std::string& folder_;
  uint64_t next_us_ = 0;
};

journal::JournalSettings SettingsOf(const config::JournalConfig& config) {
  journal::JournalSettings settings;
  settings.relaxed = config.durability == Durability::kRelaxed;
  settings.segment_bytes = config.segment_bytes;
  settings.snapshot_bytes = config.snapshot_bytes;
  settings.snapshot_ms = config.snapshot_ms;
  settings.keep_snapshots = config.keep_snapshots;
  settings.sync_interval_ms = config.sync_interval_ms;
  return settings;
}

}  // namespace

JournalOwner::JournalOwner(const config::JournalConfig& config, bool is_member)
    : config_(config),
      is_member_(is_member),
      membership_(is_member),
      folder_name_(config::JournalFolder(config, std::getenv("STATE_DIRECTORY"))) {}

JournalOwner::~JournalOwner() {
  EndThreads();
}

Result<std::unique_ptr<JournalOwner>> JournalOwner::Open(const config::JournalConfig& config,
                                                         bool is_member) {
  std::unique_ptr<JournalOwner> journal(new JournalOwner(config, is_member));
  if (journal->folder_name_.empty()) {
    spdlog::info("journal: none; the state is lost when this process ends");
    return journal;
  }
  const Status opened = journal->OpenFolder();
  if (!opened.ok()) {
    return Error{"journal: " + opened.error()};
  }
  return journal;
}

Status JournalOwner::OpenFolder() {
  PHEROMONE_TRY(folder_,
                journal::PosixFolder::Open(folder_name_, journal::PosixFolder::Mode::kOwner));
  PHEROMONE_TRY_STATUS(membership_.Read(folder_.get()));
  RecoveryReport report(folder_name_);
  auto opened =
      journal::OpenJournal(folder_.get(), SettingsOf(config_), SteadyMicroseconds, TellOfJournal,
                           [&report](const journal::Progress& progress) { report.Tell(progress); });
  if (!opened.ok()) {
    return opened.error();
  }
  journal::Opened& found = opened.value();
  for (const std::string& line : found.report) {
    spdlog::warn("journal: {}", line);
  }
  if (found.state_lost) {
    const bool others_have_them = is_member_ && !membership_.Get().founds;
    spdlog::warn("journal: {}",
                 others_have_them
                     ? "changes may be missing here; the cluster's log has them"
                     : "acknowledged changes may be missing; a new epoch begins and robots "
                       "must send HELLO again");
  }
  journal_ = std::move(found.journal);
  engine_ = std::move(found.engine);
  state_lost_ = found.state_lost;
  if (!engine_.configured()) {
    spdlog::info("journal: {} is new", folder_name_);
  } else {
    last_ms_ = found.stamp.field_time_ms;
    last_sequence_ = engine_.sequence();
    start_ms_ =
        membership_.StartMs(found.stamp, ReadSystemClocks().utc_ms, config_.evaporate_while_down);
    spdlog::info("journal: {} resumed after sequence {}, {} s of field time later", folder_name_,
                 engine_.sequence(), (start_ms_ - found.stamp.field_time_ms) / 1000);
  }
  if (config_.durability == Durability::kRelaxed) {
    spdlog::warn(
        "journal: relaxed: answers do not wait for the disk; a crash may lose up to {} ms of "
        "acknowledged changes",
        config_.sync_interval_ms);
  }
  return Ok();
}

engine::OrderedLog* JournalOwner::log() {
  return journal_ != nullptr ? static_cast<engine::OrderedLog*>(journal_.get()) : &volatile_log_;
}

void JournalOwner::Start(std::function<void()> on_durable, Freeze freeze) {
  if (journal_ == nullptr) {
    return;
  }
  freeze_ = std::move(freeze);
  journal_->OnDurable(std::move(on_durable));
  journal_->OnSnapshotDue([this] {
    const std::lock_guard lock(mutex_);
    snapshot_due_ = true;
    wake_.notify_one();
  });
  writer_ = std::thread([this] { journal_->WriteUntilStopped(); });
  snapshot_maker_ = std::thread([this] { MakeSnapshots(); });
}

void JournalOwner::Snapshot(SnapshotDone done) {
  std::string refusal;
  {
    const std::lock_guard lock(mutex_);
    if (journal_ == nullptr) {
      refusal = "no journal is kept, so no snapshot can be made";
    } else if (!no_more_.empty()) {
      refusal = no_more_;
    } else if (asked_.size() >= kMaxSnapshotWaiters) {
      refusal = std::to_string(asked_.size()) + " requests for a snapshot are already pending";
    } else {
      asked_.push_back(std::move(done));
      wake_.notify_one();
      return;
    }
  }
  done(Error{refusal});
}

void JournalOwner::MakeSnapshots() {
  for (;;) {
    std::vector<SnapshotDone> asked;
    bool stopping = false;
    Result<std::string> made = Error{""};
    {
      std::unique_lock lock(mutex_);
      wake_.wait(lock, [this] { return stopping_ || snapshot_due_ || !asked_.empty(); });
      stopping = stopping_;
      snapshot_due_ = false;
      asked.swap(asked_);
      is_making_ = no_more_.empty();
      made = Error{no_more_};
    }
    if (is_making_) {
      journal_->SnapshotBegins();
      {
        const std::lock_guard lock(mutex_);
        snapshot_due_ = false;  // told again meanwhile: this one has all that was due
      }
      made = MakeSnapshot();
      journal_->SnapshotEnds(made.ok());
      const std::lock_guard lock(mutex_);
      is_making_ = false;
      wake_.notify_all();
    }
    if (made.ok()) {
      spdlog::log(asked.empty() ? spdlog::level::debug : spdlog::level::info,
                  "journal: snapshot {}", made.value());
    } else if (WhyNoMore().empty()) {
      spdlog::error("journal: no snapshot was made: {}", made.error());
    }
    for (const SnapshotDone& done : asked) {
      done(made);
    }
    if (stopping) {
      return;
    }
  }
}

// Another copy of the state may be in progress; it will end.
std::unique_ptr<journal::StateSource> JournalOwner::FreezeWhenPossible() {
  for (;;) {
    if (auto state = freeze_()) {
      return state;
    }
    std::unique_lock lock(mutex_);
    if (wake_.wait_for(lock, kBetweenFreezes, [this] { return !no_more_.empty(); })) {
      return nullptr;
    }
  }
}

// False if no more snapshots are made first.
bool JournalOwner::AwaitDisk(uint64_t sequence) {
  journal_->WhenOnDisk(sequence, [this, sequence] {
    const std::lock_guard lock(mutex_);
    on_disk_ = sequence;
    wake_.notify_all();
  });
  std::unique_lock lock(mutex_);
  wake_.wait(lock, [&] { return !no_more_.empty() || on_disk_ >= sequence; });
  return on_disk_ >= sequence;
}

std::string JournalOwner::WhyNoMore() {
  const std::lock_guard lock(mutex_);
  return no_more_;
}

void JournalOwner::EndSnapshots(const std::string& why) {
  std::unique_lock lock(mutex_);
  if (no_more_.empty()) {
    no_more_ = why;
  }
  wake_.notify_all();
  wake_.wait(lock, [this] { return !is_making_; });
}

Result<std::string> JournalOwner::MakeSnapshot() {
  Result<std::unique_ptr<journal::SnapshotWriter>> written = Error{""};
  bool is_to_try = true;
  for (int attempt = 0; attempt < kAttempts && is_to_try; ++attempt) {
    const std::unique_ptr<journal::StateSource> state = FreezeWhenPossible();
    if (state == nullptr) {
      return Error{WhyNoMore()};
    }
    written = journal::SnapshotWriter::Write(state.get(), folder_.get());
    is_to_try = !written.ok() && state->ShouldTryAgain();
  }
  if (!written.ok()) {
    return written.error();
  }
  journal::SnapshotWriter& snapshot = *written.value();
  if (!AwaitDisk(snapshot.sequence())) {
    return Error{WhyNoMore()};
  }
  PHEROMONE_TRY_STATUS(snapshot.GiveName());
  const Result<uint64_t> removed =
      journal::RemoveWhatIsNotNeeded(config_.keep_snapshots, folder_.get());
  if (!removed.ok()) {
    spdlog::error("journal: obsolete files could not be removed: {}", removed.error());
  }
  return folder_name_ + "/" + snapshot.name();
}

void JournalOwner::EndThreads() {
  if (journal_ != nullptr) {
    journal_->Stop();
  }
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    no_more_ = "the server is stopping";
    wake_.notify_all();
  }
  for (std::thread* thread : {&writer_, &snapshot_maker_}) {
    if (thread->joinable()) {
      thread->join();
    }
  }
}

bool JournalOwner::Stop(std::optional<uint64_t> state_hash) {
  EndThreads();
  const Status closed = journal_ != nullptr ? journal_->Close(state_hash) : Ok();
  if (!closed.ok()) {
    spdlog::error("{}", closed.error());
  }
  return closed.ok();
}

// The journal itself reports a disk that fails; it cannot report one that never responds.
void JournalOwner::ReportStall() {
  if (journal_ == nullptr) {
    return;
  }
  const journal::JournalStatus now = journal_->status();
  if (!now.healthy) {
    return;  // the journal has reported this, and will report the end
  }
  const uint64_t stalled_us = now.stalled_us;
  if (stalled_us >= kStalledUs &&
      (stalled_us_ == 0 || stalled_us >= stalled_us_ + kBetweenReportsUs)) {
    spdlog::error(
        "journal: {}: no response from the disk for {:.1f} s; answers to changes are delayed",
        folder_name_, static_cast<double>(stalled_us) / 1e6);
    stalled_us_ = stalled_us;
  } else if (stalled_us < kStalledUs && stalled_us_ != 0) {
    spdlog::info("journal: {}: the disk responds again", folder_name_);
    stalled_us_ = 0;
  }
}

}  // namespace pheromone::daemon
