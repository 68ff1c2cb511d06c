// kill -9 of a real process on a real disk. The traffic of the process is determined by a seed, so
// whoever has the seed and the state that it began with knows the state after each of its events.

#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <random>
#include <thread>
#include <utility>

#include "proto_tests/crash/checks.h"
#include "server/base/bytes.h"
#include "server/base/testing/temporary_folder.h"
#include "server/core/engine/testing/random_traffic.h"
#include "server/store/journal/open.h"
#include "server/store/journal/posix_folder.h"
#include "server/store/journal/recovery.h"
#include "server/store/journal/retention.h"
#include "server/store/journal/snapshot_writer.h"

namespace pheromone::crash {
namespace {

using engine::testing::RandomTraffic;

// What the process says on its standard output: a letter and a number.
constexpr char kAcknowledged = 'a';    // up to this sequence
constexpr char kSnapshotBegins = 's';  // of the state after this sequence
constexpr size_t kReportBytes = 9;
constexpr int kPatienceMs = 60'000;

void Report(char what, uint64_t number) {
  ByteWriter writer;
  writer.U8(static_cast<uint8_t>(what));
  writer.U64(number);
  if (write(STDOUT_FILENO, writer.bytes().data(), kReportBytes) !=
      static_cast<ssize_t>(kReportBytes)) {
    std::_Exit(3);  // nobody listens any more
  }
}

journal::JournalSettings Settings() {
  journal::JournalSettings settings;
  settings.segment_bytes = 20'000;
  settings.snapshot_bytes = 40'000;
  settings.queue_bytes = 20'000;
  return settings;
}

engine::EngineConfig Config() {
  return engine::testing::RichConfig(true);
}

uint64_t Microseconds() {
  return static_cast<uint64_t>(std::chrono::duration_cast<std::chrono::microseconds>(
                                   std::chrono::steady_clock::now().time_since_epoch())
                                   .count());
}

// The traffic of one round: from the state that the last one left.
class Round {
 public:
  Round(uint64_t seed, const engine::Stamp& last) : traffic_(seed, Config()) {
    if (last.field_time_ms != 0) {
      traffic_.ResumeAt(last);
    }
  }

  engine::Event Next(const engine::Engine& engine) {
    return engine.configured() ? traffic_.Next(engine) : traffic_.First();
  }
  const engine::Stamp& stamp() const { return traffic_.stamp(); }

 private:
  RandomTraffic traffic_;
};

class Victim {
 public:
  Victim(const std::string& program, const std::string& folder, uint64_t seed) {
    int ends[2];
    if (pipe(ends) != 0) {
      std::abort();
    }
    process_ = fork();
    if (process_ == 0) {
      dup2(ends[1], STDOUT_FILENO);
      close(ends[0]);
      close(ends[1]);
      execl(program.c_str(), program.c_str(), "--serve", folder.c_str(), "--seed",
            std::to_string(seed).c_str(), static_cast<char*>(nullptr));
      std::_Exit(4);
    }
    close(ends[1]);
    from_ = ends[0];
  }
  Victim(const Victim&) = delete;
  Victim& operator=(const Victim&) = delete;
  ~Victim() {
    Kill();
    close(from_);
  }

  // The next report; nothing at the end, or if it says nothing for too long.
  std::optional<std::pair<char, uint64_t>> Listen() {
    std::string bytes(kReportBytes, '\0');
    for (size_t done = 0; done < bytes.size();) {
      pollfd ready{from_, POLLIN, 0};
      if (poll(&ready, 1, kPatienceMs) <= 0) {
        return std::nullopt;
      }
      const ssize_t count = read(from_, bytes.data() + done, bytes.size() - done);
      if (count <= 0) {
        return std::nullopt;
      }
      done += static_cast<size_t>(count);
    }
    ByteReader reader(bytes);
    const auto what = static_cast<char>(reader.U8());
    return std::pair(what, reader.U64());
  }

  void Kill() {
    if (process_ > 0) {
      kill(process_, SIGKILL);
      waitpid(process_, nullptr, 0);
      process_ = -1;
    }
  }

 private:
  pid_t process_ = -1;
  int from_ = -1;
};

struct Figures {
  int rounds = 0;
  int in_a_snapshot = 0;
  int unfinished_snapshots = 0;
  uint64_t events = 0;
  uint64_t acknowledged = 0;
};

class Killer {
 public:
  Killer(std::string program, std::string folder, uint64_t seed)
      : program_(std::move(program)), folder_(std::move(folder)), seed_(seed), random_(seed) {}

  // Empty if all is as it must be.
  std::string Kill(int round, Figures* figures) {
    const uint64_t acknowledged = RunAVictim(round, figures);
    const auto folder = journal::PosixFolder::Open(folder_, journal::PosixFolder::Mode::kReader);
    if (!folder.ok()) {
      return folder.error();
    }
    figures->unfinished_snapshots += HasUnfinished(*folder.value()) ? 1 : 0;
    const auto found = journal::Recover(*folder.value());
    if (!found.ok()) {
      return found.error();
    }
    const uint64_t sequence = found.value().sequence;
    const uint64_t before = expected_.sequence();
    Round events(seed_ + static_cast<uint64_t>(round), stamp_);
    std::vector<engine::Outgoing> out;
    while (expected_.sequence() < sequence) {
      const engine::Event event = events.Next(expected_);
      out.clear();
      expected_.Apply(expected_.sequence() + 1, events.stamp(), event, &out);
      stamp_ = events.stamp();
    }
    figures->events += sequence - before;
    figures->acknowledged += acknowledged - std::min(acknowledged, before);
    ++figures->rounds;
    if (sequence < acknowledged) {
      return fmt::format("found {}, acknowledged {}", sequence, acknowledged);
    }
    if (found.value().lost || found.value().differs) {
      return fmt::format("taken for damaged: {}", found.value().findings.front().Text());
    }
    return found.value().engine.StateHash() == expected_.StateHash()
               ? ""
               : fmt::format("the state after {} is another one", sequence);
  }

 private:
  // The last sequence that it acknowledged.
  uint64_t RunAVictim(int round, Figures* figures) {
    Victim victim(program_, folder_, seed_ + static_cast<uint64_t>(round));
    const bool in_a_snapshot = round % 2 == 1;
    uint64_t left = 1 + random_() % 60;
    bool begun = !in_a_snapshot;
    uint64_t acknowledged = 0;
    while (left > 0) {
      const auto report = victim.Listen();
      if (!report) {
        break;
      }
      if (report->first == kSnapshotBegins && !begun) {
        begun = true;
        left = 1 + random_() % 4;
        ++figures->in_a_snapshot;
      } else if (report->first == kAcknowledged) {
        acknowledged = report->second;
      }
      left -= begun ? 1 : 0;
    }
    victim.Kill();
    while (const auto report = victim.Listen()) {  // said before it died
      acknowledged = report->first == kAcknowledged ? report->second : acknowledged;
    }
    return acknowledged;
  }

  static bool HasUnfinished(const journal::Folder& folder) {
    const std::vector<std::string> names = folder.List().value();
    return std::any_of(names.begin(), names.end(), [](const std::string& name) {
      return name.ends_with(journal::kUnfinished);
    });
  }

  const std::string program_;
  const std::string folder_;
  const uint64_t seed_;
  std::mt19937_64 random_;
  engine::Engine expected_;
  engine::Stamp stamp_;
};

}  // namespace

bool CheckKills(const std::string& program, int rounds, uint64_t seed) {
  if (rounds == 0) {
    return true;
  }
  TemporaryFolder folder;
  Figures figures;
  int wrong_rounds = 0;
  Killer killer(program, folder / "journal", seed);
  for (int round = 0; round < rounds && wrong_rounds == 0; ++round) {
    const std::string wrong = killer.Kill(round, &figures);
    if (!wrong.empty()) {
      fmt::print("  round {}: {}; the journal is in {}\n", round, wrong, folder.string());
      ++wrong_rounds;
      folder.Keep();
    }
  }
  fmt::print(
      "kill: {} rounds, {} of them while a snapshot was made ({} left unfinished), {} events "
      "recovered, {} acknowledged; {} wrong\n",
      figures.rounds, figures.in_a_snapshot, figures.unfinished_snapshots, figures.events,
      figures.acknowledged, wrong_rounds);
  return wrong_rounds == 0 && figures.acknowledged > 0;
}

int ServeUntilKilled(const std::string& path, uint64_t seed) {
  auto folder = journal::PosixFolder::Open(path, journal::PosixFolder::Mode::kOwner);
  if (!folder.ok()) {
    return 1;
  }
  auto opened = journal::OpenJournal(folder.value().get(), Settings(), Microseconds,
                                     [](bool, const std::string&) {});
  if (!opened.ok()) {
    return 1;
  }
  journal::LocalJournal& log = *opened.value().journal;
  std::mutex mutex;
  std::condition_variable wake;
  std::unique_ptr<journal::CopiedState> state;  // to be written
  std::atomic<bool> snapshot_due{false};
  log.OnDurable([&log] { Report(kAcknowledged, log.DurableSequence()); });
  log.OnSnapshotDue([&snapshot_due] { snapshot_due = true; });
  std::thread writer([&log] { log.WriteUntilStopped(); });
  std::thread snapshots([&] {
    for (;;) {
      std::unique_ptr<journal::CopiedState> mine;
      {
        std::unique_lock lock(mutex);
        wake.wait(lock, [&] { return state != nullptr; });
        mine = std::move(state);
      }
      Report(kSnapshotBegins, mine->header().sequence);
      const auto written = journal::SnapshotWriter::Write(mine.get(), folder.value().get());
      // Shared: set_value is still at work when a waiter returns.
      const auto on_disk = std::make_shared<std::promise<void>>();
      log.WhenOnDisk(mine->header().sequence, [on_disk] { on_disk->set_value(); });
      on_disk->get_future().wait();
      if (written.ok() && written.value()->GiveName().ok()) {
        (void)journal::RemoveWhatIsNotNeeded(2, folder.value().get());
      }
    }
  });
  engine::Engine& engine = opened.value().engine;
  Round events(seed, opened.value().stamp);
  std::vector<engine::Outgoing> out;
  for (;;) {
    if (snapshot_due.exchange(false)) {
      auto copy = std::make_unique<journal::CopiedState>(engine, events.stamp());
      const std::lock_guard lock(mutex);
      state = std::move(copy);
      wake.notify_one();
    }
    if (log.Admit() != protocol::Reason::kNone) {
      std::this_thread::yield();
      continue;
    }
    const engine::Event event = events.Next(engine);
    if (log.IsRotationDue() && engine.configured()) {
      log.Rotate(engine.StateHash());
    }
    const uint64_t sequence = log.Append(events.stamp(), event);
    out.clear();
    engine.Apply(sequence, events.stamp(), event, &out);
  }
}

}  // namespace pheromone::crash
