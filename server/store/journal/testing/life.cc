#include "server/store/journal/testing/life.h"

#include <algorithm>
#include <chrono>
#include <future>
#include <utility>

#include "server/core/engine/event_codec.h"
#include "server/store/journal/retention.h"

namespace pheromone::journal::testing {
namespace {

// Every kind of event but a net's has a place, and a configuration has not more bytes than a
// segment.
engine::EngineConfig ConfigOfLives() {
  engine::EngineConfig config = engine::testing::RichConfig(true);
  config.field.obstacles = {};
  config.nets.clear();
  return config;
}

}  // namespace

Status WriteAhead(LocalJournal* journal, engine::Event* event,
                  const std::function<void()>& written) {
  std::future<Status> ahead =
      std::async(std::launch::async, [journal, event] { return journal->WriteAhead(event); });
  while (ahead.wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
    journal->WriteOnce();
    written();
  }
  return ahead.get();
}

Lives::Lives(Folder* folder, const JournalSettings& settings, uint64_t seed)
    : folder_(folder), settings_(settings), random_(seed), traffic_(seed, ConfigOfLives()) {}

std::string Lives::Begin() {
  opened_.reset();
  snapshot_due_ = false;
  snapshot_.reset();
  Result<Opened> opened = OpenJournal(
      folder_, settings_, [this] { return now_us_; },
      [this](bool, const std::string& text) { told_.push_back(text); });
  if (!opened.ok()) {
    return "cannot be opened: " + opened.error();
  }
  opened_ = std::move(opened).value();
  opened_->journal->OnSnapshotDue([this] { snapshot_due_ = true; });
  const engine::Engine& engine = opened_->engine;
  const uint64_t found = engine.sequence();
  const std::string numbers = "found " + std::to_string(found) + ", submitted " +
                              std::to_string(submitted()) + ", acknowledged " +
                              std::to_string(acknowledged_);
  std::string wrong;
  if (found > submitted()) {
    wrong = numbers + ": more than there was";
  } else if (found < acknowledged_) {
    wrong = numbers + ": acknowledged changes are missing";
  } else if (found != 0 && engine.StateHash() != hashes_[found]) {
    wrong = numbers + ": the state is another one";
  } else if (opened_->state_lost) {
    wrong = numbers + ": taken for damaged";
  }
  hashes_.resize(found + 1);
  acknowledged_ = found;
  return wrong;
}

bool Lives::Submit() {
  engine::Engine& engine = opened_->engine;
  if (journal().Admit() != protocol::Reason::kNone) {
    return false;
  }
  engine::Event event = engine.configured() ? traffic_.Next(engine) : traffic_.First();
  // Nobody waits for the first one. What is small would need no writing thread.
  if (engine.configured() && std::holds_alternative<engine::ConfigChanged>(event) &&
      engine::EncodedBytesAtMost(event) > settings_.piece_bytes) {
    const Status ahead = WriteAhead(&journal(), &event, [this] { Acknowledge(); });
    if (!ahead.ok() || journal().Admit() != protocol::Reason::kNone) {
      return false;
    }
  }
  if (journal().IsRotationDue() && engine.configured()) {
    journal().Rotate(engine.StateHash());
  }
  const uint64_t sequence = journal().Append(traffic_.stamp(), event);
  out_.clear();
  engine.Apply(sequence, traffic_.stamp(), event, &out_);
  hashes_.push_back(engine.StateHash());
  Acknowledge();
  return true;
}

void Lives::Acknowledge() {
  acknowledged_ =
      std::max(acknowledged_, acknowledge_early ? submitted() : journal().DurableSequence());
}

void Lives::Write() {
  while (journal().WriteOnce()) {
    Acknowledge();
  }
  Acknowledge();
}

void Lives::MakeDueSnapshot() {
  if (!snapshot_ && std::exchange(snapshot_due_, false)) {
    CopiedState state(opened_->engine, traffic_.stamp());
    Result<std::unique_ptr<SnapshotWriter>> written = SnapshotWriter::Write(&state, folder_);
    if (!written.ok()) {
      told_.push_back(written.error());
      return;
    }
    snapshot_ = std::move(written).value();
  }
  if (snapshot_ && journal().status().durable >= snapshot_->sequence()) {
    Status done = snapshot_->GiveName();
    if (done.ok()) {
      ++snapshots_;
      const Result<uint64_t> removed = RemoveWhatIsNotNeeded(settings_.keep_snapshots, folder_);
      done = removed.ok() ? Ok() : Status(Error{removed.error()});
    }
    if (!done.ok()) {
      told_.push_back(done.error());
    }
    snapshot_.reset();
  }
}

void Lives::Step() {
  for (uint64_t events = Below(6); events > 0; --events) {
    Submit();
  }
  if (Below(3) != 0) {
    journal().WriteOnce();
    Acknowledge();
  }
  if (Below(5) == 0) {
    MakeDueSnapshot();
  }
  PassTime(Below(40'000));
}

Status Lives::End() {
  Write();
  return journal().Close(opened_->engine.StateHash());
}

}  // namespace pheromone::journal::testing
