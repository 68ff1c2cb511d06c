// A server's lives on one disk: random traffic goes through an engine and its journal until the
// power goes, and what the next life finds is held against what the last one did.
//
//   CrashFolder folder(seed);
//   Lives lives(&folder, SmallJournal(), seed);
//   std::string wrong = lives.Begin();            // empty: as it must be
//   folder.CutAt(40);
//   while (!folder.is_off()) lives.Step();
//   folder.PowerOn();
//   wrong = lives.Begin();                        // the next life
//
// What must be found: the state after the first n of the submitted events, n at least the number of
// those that were acknowledged. Its hash tells that each was applied once and in order.
//
// Everything happens in an order that the seed decides; the second thread that writes an event
// ahead has its turn between two groups only.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "server/core/engine/testing/random_traffic.h"
#include "server/store/journal/open.h"
#include "server/store/journal/snapshot_writer.h"

namespace pheromone::journal::testing {

/// Segments, queue and snapshots so small that a few hundred events need many.
inline JournalSettings SmallJournal() {
  JournalSettings settings;
  settings.segment_bytes = 3'000;
  settings.snapshot_bytes = 6'000;
  settings.queue_bytes = 4'000;
  settings.snapshot_ms = 5'000;
  settings.piece_bytes = 200;
  return settings;
}

/// Writes an event ahead, as an operator's thread does, and is the writing thread meanwhile: after
/// each WriteOnce it calls `written`.
Status WriteAhead(LocalJournal* journal, engine::Event* event,
                  const std::function<void()>& written);

class Lives {
 public:
  Lives(Folder* folder, const JournalSettings& settings, uint64_t seed);

  /// Opens the journal and begins a life. Says what is wrong with what was found, if anything is;
  /// the life goes on from there all the same.
  std::string Begin();
  /// Some events, or some of what the journal's threads do.
  void Step();
  /// An orderly end.
  Status End();

  /// The state's hash after each sequence; that of the last life's events that nobody was told of
  /// and that were lost is forgotten.
  const std::vector<uint64_t>& hashes() const { return hashes_; }
  uint64_t submitted() const { return hashes_.size() - 1; }
  uint64_t acknowledged() const { return acknowledged_; }
  uint64_t snapshots() const { return snapshots_; }
  LocalJournal& journal() { return *opened_->journal; }
  const Opened& opened() const { return *opened_; }
  const engine::Engine& engine() const { return opened_->engine; }
  /// What the journal told: changes refused, changes taken again.
  const std::vector<std::string>& told() const { return told_; }

  /// A mutant, for tests of the tests: robots are answered before anything is on the disk.
  bool acknowledge_early = false;

  /// One event, if the journal takes it now; false if it does not.
  bool Submit();
  /// What the writing thread does until there is nothing to do; time passes between attempts.
  void Write();
  void PassTime(uint64_t us) { now_us_ += us; }
  /// What the thread that makes snapshots does until it has to wait: the snapshot that is due is
  /// written, and gets its name if the log is on the disk up to it.
  void MakeDueSnapshot();
  /// The state is held still now, and written with the next MakeDueSnapshot.
  void AskForSnapshot() { snapshot_due_ = true; }

 private:
  uint64_t Below(uint64_t limit) { return random_() % limit; }
  void Acknowledge();

  Folder* folder_;
  JournalSettings settings_;
  std::mt19937_64 random_;
  engine::testing::RandomTraffic traffic_;
  std::optional<Opened> opened_;
  std::vector<uint64_t> hashes_{0};
  uint64_t acknowledged_ = 0;
  uint64_t snapshots_ = 0;
  bool snapshot_due_ = false;
  std::unique_ptr<SnapshotWriter> snapshot_;  // written, and waits for the log
  std::vector<std::string> told_;
  std::vector<engine::Outgoing> out_;
  uint64_t now_us_ = 1'000'000;
};

}  // namespace pheromone::journal::testing
