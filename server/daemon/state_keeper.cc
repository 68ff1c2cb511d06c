#include "server/daemon/state_keeper.h"

#include <spdlog/spdlog.h>

#include <chrono>
#include <cstdlib>
#include <utility>

#include "server/config/folders.h"
#include "server/daemon/system_clock.h"
#include "server/engine/field_clock.h"
#include "server/journal/open.h"
#include "server/journal/retention.h"

namespace pheromone::daemon {
namespace {

constexpr uint64_t kStalledUs = 1'000'000;          // from then on it is told
constexpr uint64_t kBetweenReportsUs = 10'000'000;  // while it lasts

using Durability = config::JournalConfig::Durability;

uint64_t SteadyMicroseconds() {
  return static_cast<uint64_t>(std::chrono::duration_cast<std::chrono::microseconds>(
                                   std::chrono::steady_clock::now().time_since_epoch())
                                   .count());
}

void TellOfJournal(bool is_trouble, const std::string& text) {
  spdlog::log(is_trouble ? spdlog::level::err : spdlog::level::info, "{}", text);
}

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

StateKeeper::StateKeeper(const config::JournalConfig& config)
    : config_(config),
      folder_name_(config::JournalFolder(config, std::getenv("STATE_DIRECTORY"))) {}

StateKeeper::~StateKeeper() {
  EndThreads();
}

Result<std::unique_ptr<StateKeeper>> StateKeeper::Open(const config::JournalConfig& config) {
  std::unique_ptr<StateKeeper> keeper(new StateKeeper(config));
  if (keeper->folder_name_.empty()) {
    spdlog::info("journal: none; the state lives as long as this process");
    return keeper;
  }
  const Status opened = keeper->OpenFolder();
  if (!opened.ok()) {
    return Error{"journal: " + opened.error()};
  }
  return keeper;
}

Status StateKeeper::OpenFolder() {
  auto folder = journal::PosixFolder::Open(folder_name_, journal::PosixFolder::Mode::kOwner);
  if (!folder.ok()) {
    return Error{folder.error()};
  }
  folder_ = std::move(folder).value();
  auto opened =
      journal::OpenJournal(folder_.get(), SettingsOf(config_), SteadyMicroseconds, TellOfJournal);
  if (!opened.ok()) {
    return Error{opened.error()};
  }
  journal::Opened& found = opened.value();
  for (const std::string& line : found.report) {
    spdlog::warn("journal: {}", line);
  }
  journal_ = std::move(found.journal);
  engine_ = std::move(found.engine);
  state_lost_ = found.state_lost;
  if (!engine_.configured()) {
    spdlog::info("journal: {} is new", folder_name_);
  } else {
    start_ms_ = engine::FieldClock::ResumeAt(found.stamp, ReadSystemClocks().utc_ms,
                                             config_.evaporate_while_down);
    spdlog::info("journal: {} goes on after sequence {}, {} s of field time later", folder_name_,
                 engine_.sequence(), (start_ms_ - found.stamp.field_time_ms) / 1000);
  }
  if (config_.durability == Durability::kRelaxed) {
    spdlog::warn(
        "journal: relaxed: robots are answered before the disk is; a crash may lose up to {} ms "
        "of what they were told",
        config_.sync_interval_ms);
  }
  return Ok();
}

engine::OrderedLog* StateKeeper::log() {
  return journal_ != nullptr ? static_cast<engine::OrderedLog*>(journal_.get()) : &volatile_log_;
}

void StateKeeper::Start(std::function<void()> on_durable) {
  if (journal_ == nullptr) {
    return;
  }
  journal_->OnDurable(std::move(on_durable));
  journal_->OnSnapshotDue([this](uint64_t ordinal) {
    const std::lock_guard lock(mutex_);
    snapshot_due_ = ordinal;
    wake_.notify_one();
  });
  writer_ = std::thread([this] { journal_->WriteUntilStopped(); });
  snapshot_maker_ = std::thread([this] { MakeSnapshots(); });
}

void StateKeeper::MakeSnapshots() {
  for (;;) {
    uint64_t ordinal = 0;
    {
      std::unique_lock lock(mutex_);
      wake_.wait(lock, [this] { return stopping_ || snapshot_due_; });
      if (stopping_) {
        return;
      }
      ordinal = *std::exchange(snapshot_due_, std::nullopt);
    }
    const auto made = journal::MakeSnapshot(ordinal, config_.keep_snapshots, folder_.get());
    if (!made.ok()) {
      spdlog::error("journal: no snapshot was made: {}", made.error());
    } else if (made.value().events != 0) {
      spdlog::debug("journal: snapshot at sequence {}, {} files removed", made.value().sequence,
                    made.value().removed);
    }
  }
}

void StateKeeper::EndThreads() {
  if (journal_ != nullptr) {
    journal_->Stop();
  }
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    wake_.notify_one();
  }
  for (std::thread* thread : {&writer_, &snapshot_maker_}) {
    if (thread->joinable()) {
      thread->join();
    }
  }
}

bool StateKeeper::Stop(uint64_t state_hash) {
  EndThreads();
  const Status closed = journal_ != nullptr ? journal_->Close(state_hash) : Ok();
  if (!closed.ok()) {
    spdlog::error("{}", closed.error());
  }
  return closed.ok();
}

bool StateKeeper::AskForSnapshot() {
  if (journal_ != nullptr) {
    journal_->AskForSnapshot();
  }
  return journal_ != nullptr;
}

// A disk that fails is told of by the journal itself; one that never answers cannot be.
void StateKeeper::ReportStall() {
  if (journal_ == nullptr) {
    return;
  }
  const journal::JournalStatus now = journal_->status();
  if (!now.healthy) {
    return;  // it has said so, and says when that ends
  }
  const uint64_t stalled_us = now.stalled_us;
  if (stalled_us >= kStalledUs &&
      (stalled_us_ == 0 || stalled_us >= stalled_us_ + kBetweenReportsUs)) {
    spdlog::error("journal: {}: the disk has taken nothing for {:.1f} s; answers to changes wait",
                  folder_name_, static_cast<double>(stalled_us) / 1e6);
    stalled_us_ = stalled_us;
  } else if (stalled_us < kStalledUs && stalled_us_ != 0) {
    spdlog::info("journal: {}: the disk takes changes again", folder_name_);
    stalled_us_ = 0;
  }
}

std::optional<journal::JournalStatus> StateKeeper::status() const {
  return journal_ != nullptr ? std::optional(journal_->status()) : std::nullopt;
}

}  // namespace pheromone::daemon
