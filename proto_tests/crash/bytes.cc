// Truncation and damage at every byte of the last 4 KiB.

#include <fmt/format.h>

#include <random>

#include "proto_tests/crash/checks.h"
#include "server/store/journal/format.h"
#include "server/store/journal/recovery.h"
#include "server/store/journal/testing/borders.h"
#include "server/store/journal/testing/crash_folder.h"
#include "server/store/journal/testing/life.h"

namespace pheromone::crash {
namespace {

constexpr size_t kLastBytes = 4096;

class Case {
 public:
  Case(const journal::testing::Lives& lives, journal::testing::CrashFolder* folder,
       const std::string& name)
      : lives_(lives), folder_(*folder), name_(name), whole_(folder->Contents(name)) {
    borders_ = journal::testing::BordersOf(whole_);
  }

  size_t size() const { return whole_.size(); }

  // With these contents the state must be that of the last whole record before `byte`, and that
  // place be told.
  bool IsRecoveredUpTo(const std::string& contents, size_t byte) {
    folder_.Contents(name_) = contents;
    const auto recovered = journal::Recover(folder_);
    folder_.Contents(name_) = whole_;
    const journal::testing::Border last = journal::testing::LastBefore(borders_, byte);
    const bool is_at_a_border = contents.size() == last.at;
    return recovered.ok() && recovered.value().sequence == last.sequence &&
           recovered.value().engine.StateHash() == lives_.hashes()[last.sequence] &&
           (is_at_a_border || (recovered.value().findings.size() == 1 &&
                               recovered.value().findings[0].byte == last.at));
  }

  const std::string& whole() const { return whole_; }

 private:
  const journal::testing::Lives& lives_;
  journal::testing::CrashFolder& folder_;
  const std::string name_;
  const std::string whole_;
  std::vector<journal::testing::Border> borders_;
};

}  // namespace

bool CheckBytes(uint64_t seed) {
  std::mt19937_64 random(seed);
  journal::testing::CrashFolder folder(seed);
  journal::JournalSettings settings = journal::testing::SmallJournal();
  settings.segment_bytes = uint64_t{1} << 20;
  journal::testing::Lives lives(&folder, settings, seed);
  const std::string name = journal::SegmentName(1);
  std::string wrong = lives.Begin();
  while (wrong.empty() && folder.Contents(name).size() < 3 * kLastBytes) {
    for (uint64_t i = random() % 6; i > 0; --i) {
      lives.Submit();
    }
    lives.Write();
  }
  Case one(lives, &folder, name);
  int wrong_cuts = 0;
  int wrong_bytes = 0;
  for (size_t at = one.size() - kLastBytes; at < one.size(); ++at) {
    wrong_cuts += one.IsRecoveredUpTo(one.whole().substr(0, at), at) ? 0 : 1;
    std::string damaged = one.whole();
    damaged[at] = static_cast<char>(damaged[at] ^ static_cast<char>(1 + random() % 255));
    wrong_bytes += one.IsRecoveredUpTo(damaged, at) ? 0 : 1;
  }
  fmt::print(
      "bytes: a segment of {} bytes with {} events; {} truncations, {} wrong; {} damaged bytes, {} "
      "wrong\n",
      one.size(), lives.submitted(), kLastBytes, wrong_cuts, kLastBytes, wrong_bytes);
  return wrong.empty() && wrong_cuts == 0 && wrong_bytes == 0;
}

}  // namespace pheromone::crash
