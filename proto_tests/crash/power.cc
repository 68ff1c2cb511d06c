// Power cuts, and failing disks, in one thread and in an order that the seed decides.

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <random>
#include <utility>

#include "proto_tests/crash/checks.h"
#include "server/store/journal/testing/crash_folder.h"
#include "server/store/journal/testing/life.h"

namespace pheromone::crash {
namespace {

using journal::testing::CrashFolder;
using journal::testing::Lives;
using journal::testing::SmallJournal;

constexpr int kLivesOfADisk = 4;
constexpr uint64_t kMaxOperations = 160;
constexpr int kMaxCutsForAMutant = 1000;

struct Figures {
  int cuts = 0;
  uint64_t events = 0;
  uint64_t lost_unacknowledged = 0;
  uint64_t operations = 0;
  uint64_t snapshots = 0;
  uint64_t segments = 0;
};

using Mutate = std::function<void(CrashFolder*, Lives*)>;

// Some lives of one disk, each ended by a cut. Says what is wrong, if anything is.
std::string LiveOnADisk(uint64_t seed, int cuts, const Mutate& mutate, Figures* figures) {
  std::mt19937_64 random(seed);
  CrashFolder folder(random());
  Lives lives(&folder, SmallJournal(), random());
  mutate(&folder, &lives);
  for (int i = 0; i < cuts; ++i) {
    const uint64_t before = lives.submitted();
    std::string wrong = lives.Begin();
    figures->lost_unacknowledged += i > 0 ? before - std::min(before, lives.submitted()) : 0;
    if (!wrong.empty()) {
      return fmt::format("disk {}, after cut {}: {}", seed, i, wrong);
    }
    const uint64_t begun = lives.submitted();
    const uint64_t operations = folder.operations();
    folder.CutAt(1 + random() % kMaxOperations);
    while (!folder.is_off()) {
      lives.Step();
    }
    figures->operations += folder.operations() - operations;
    figures->events += lives.submitted() - begun;
    folder.PowerOn();
    ++figures->cuts;
  }
  figures->snapshots += lives.snapshots();
  const std::string wrong = lives.Begin();
  figures->segments += lives.journal().status().segment_ordinal;
  return wrong.empty() ? "" : fmt::format("disk {}, at the end: {}", seed, wrong);
}

bool FindsMutant(const char* name, uint64_t seed, const Mutate& mutate) {
  Figures figures;
  while (figures.cuts < kMaxCutsForAMutant) {
    const std::string wrong = LiveOnADisk(seed++, kLivesOfADisk, mutate, &figures);
    if (!wrong.empty()) {
      fmt::print("  mutant \"{}\": found after {} cuts: {}\n", name, figures.cuts, wrong);
      return true;
    }
  }
  fmt::print("  mutant \"{}\": NOT FOUND in {} cuts\n", name, figures.cuts);
  return false;
}

}  // namespace

bool CheckPowerCuts(int cuts, uint64_t seed) {
  Figures figures;
  int wrong_disks = 0;
  for (uint64_t disk = 0; figures.cuts < cuts; ++disk) {
    const std::string wrong = LiveOnADisk(
        seed * 1'000'000 + disk, std::min(kLivesOfADisk, cuts - figures.cuts),
        [](CrashFolder*, Lives*) {}, &figures);
    if (!wrong.empty()) {
      fmt::print("  {}\n", wrong);
      ++wrong_disks;
    }
  }
  fmt::print(
      "power: {} cuts over {} events, {} operations on the disk, {} segments, {} snapshots; {} "
      "events lost, none acknowledged; {} disks wrong\n",
      figures.cuts, figures.events, figures.operations, figures.segments, figures.snapshots,
      figures.lost_unacknowledged, wrong_disks);
  const std::pair<const char*, Mutate> mutants[] = {
      {"no sync", [](CrashFolder* folder, Lives*) { folder->ignore_file_syncs = true; }},
      {"no directory sync",
       [](CrashFolder* folder, Lives*) { folder->ignore_folder_syncs = true; }},
      {"answer before sync", [](CrashFolder*, Lives* lives) { lives->acknowledge_early = true; }}};
  bool found_all = true;
  for (const auto& [name, mutate] : mutants) {
    found_all = FindsMutant(name, seed, mutate) && found_all;
  }
  return wrong_disks == 0 && found_all;
}

bool CheckFailures(int runs, uint64_t seed) {
  uint64_t failures = 0;
  uint64_t events = 0;
  int wrong_runs = 0;
  int never_resumed = 0;
  for (int run = 0; run < runs; ++run) {
    std::mt19937_64 random(seed * 1'000'000 + static_cast<uint64_t>(run));
    CrashFolder folder(random());
    Lives lives(&folder, SmallJournal(), random());
    std::string wrong = lives.Begin();
    for (int step = 0; step < 120 && wrong.empty(); ++step) {
      if (random() % 12 == 0) {
        folder.FailSyncs(static_cast<int>(random() % 3));
        folder.FailAppends(static_cast<int>(random() % 2));
      }
      lives.Step();
      lives.PassTime(random() % 200'000);
    }
    folder.FailSyncs(0);
    folder.FailAppends(0);
    lives.PassTime(60'000'000);
    lives.Write();
    never_resumed += lives.journal().Admit() == protocol::Reason::kReadOnly ? 1 : 0;
    failures += lives.journal().status().failures;
    events += lives.submitted();
    folder.CutAt(1 + random() % 10);
    while (!folder.is_off()) {
      lives.Step();
    }
    folder.PowerOn();
    wrong = wrong.empty() ? lives.Begin() : wrong;
    if (!wrong.empty()) {
      fmt::print("  run {}: {}\n", run, wrong);
      ++wrong_runs;
    }
  }
  fmt::print(
      "failures: {} runs, {} failed writes and syncs over {} events, then a power cut each; {} "
      "runs wrong, {} did not resume\n",
      runs, failures, events, wrong_runs, never_resumed);
  return wrong_runs == 0 && never_resumed == 0 && (runs == 0 || failures > 0);
}

}  // namespace pheromone::crash
