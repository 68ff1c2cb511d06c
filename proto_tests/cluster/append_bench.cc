// What a committed group costs: EtcdLog::Append with three members on this machine, one at a time,
// beside a write and fdatasync of the same bytes in the same file system, in turn.
//
//   append_bench [ROUNDS]
//
// Prints percentiles in milliseconds and the ratio. A group passes two disks one after the other,
// an etcd leader's and a follower's, which here are the same one.
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <boost/asio/io_context.hpp>

#include "proto_tests/cluster/etcd_members.h"
#include "server/base/testing/temporary_folder.h"
#include "server/cluster/etcd_log.h"

namespace pheromone::cluster {
namespace {

using Clock = std::chrono::steady_clock;

class Bench {
 public:
  explicit Bench(int rounds)
      : rounds_(rounds),
        log_(io_.get_executor(),
             {.members = members_.endpoints(), .cluster = "bench", .new_id = "bench"}),
        file_(open((folder_ / "file").c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600)) {}
  Bench(const Bench&) = delete;
  Bench& operator=(const Bench&) = delete;
  ~Bench() { close(file_); }

  void Run() {
    std::optional<Leader> leader;
    while (!leader) {
      Wait([&](const std::function<void()>& done) {
        log_.TakeLead(0, "bench", [&, done](const Result<Leader>& now) {
          leader = now.ok() ? std::optional(now.value()) : std::nullopt;
          done();
        });
      });
    }
    std::printf("%10s %8s %18s %18s %8s\n", "bytes", "rounds", "append p50/p99", "sync p50/p99",
                "ratio");
    for (const size_t bytes : {size_t{1} << 10, size_t{64} << 10}) {
      Measure(leader->term, bytes);
    }
  }

 private:
  void Wait(const std::function<void(const std::function<void()>&)>& begin) {
    bool is_done = false;
    begin([&] { is_done = true; });
    while (!is_done) {
      io_.restart();
      io_.run_one();
    }
  }

  void Append(const Group& group) {
    Appended outcome = Appended::kUnknown;
    while (outcome == Appended::kUnknown) {
      Wait([&](const std::function<void()>& done) {
        log_.Append(group, [&, done](Appended appended) {
          outcome = appended;
          done();
        });
      });
    }
    if (outcome != Appended::kCommitted) {
      std::fprintf(stderr, "append_bench: fenced\n");
      std::exit(EXIT_FAILURE);
    }
  }

  void Sync(const std::string& bytes) {
    if (write(file_, bytes.data(), bytes.size()) != static_cast<ssize_t>(bytes.size()) ||
        fdatasync(file_) != 0) {
      std::perror("append_bench");
      std::exit(EXIT_FAILURE);
    }
  }

  static double MillisecondsOf(const std::function<void()>& work) {
    const Clock::time_point begin = Clock::now();
    work();
    return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
  }

  void Measure(Term term, size_t bytes) {
    std::vector<double> appends;
    std::vector<double> syncs;
    std::string records(bytes, '\0');
    for (size_t i = 0; i < bytes; ++i) {
      records[i] = static_cast<char>(i * i >> 3 & 0xff);
    }
    for (int round = 0; round < rounds_; ++round) {
      const Group group{next_++, 1, term, records};
      appends.push_back(MillisecondsOf([&] { Append(group); }));
      syncs.push_back(MillisecondsOf([&] { Sync(records); }));
    }
    std::sort(appends.begin(), appends.end());
    std::sort(syncs.begin(), syncs.end());
    const size_t p50 = appends.size() / 2;
    const size_t p99 = appends.size() * 99 / 100;
    std::printf("%10zu %8d %9.2f %8.2f %9.2f %8.2f %8.1f\n", bytes, rounds_, appends[p50],
                appends[p99], syncs[p50], syncs[p99], appends[p50] / syncs[p50]);
  }

  const int rounds_;
  EtcdMembers members_;
  TemporaryFolder folder_;
  boost::asio::io_context io_;
  EtcdLog log_;
  int file_;
  Sequence next_ = 1;
};

}  // namespace
}  // namespace pheromone::cluster

int main(int argc, char** argv) {
  constexpr int kRounds = 2000;
  try {
    pheromone::cluster::Bench(argc > 1 ? std::max(1, std::atoi(argv[1])) : kRounds).Run();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "append_bench: %s\n", error.what());
    return EXIT_FAILURE;
  }
}
