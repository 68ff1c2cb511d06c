// How many exchanges the daemon makes, and how soon it answers, beside what the machine could do
// without it:
//
//   build/release/bin/exchange_bench
//   build/release/bin/exchange_bench --folder DISK --extra-config durable.toml --clients 254
//
//  * UDP over the loopback interface, a socket and one request under way for each client, one frame
//    a datagram, random poses on a map with more than a million live nodes, r = 5 cells: SENSE and
//    TRACE, each in turn with a bare echo of the same datagrams (server_process.h);
//  * ptys at the pace of modems: from a request's last byte to the answer's first (pty_load.h);
//  * with --folder on a real disk, a bare loop of write and fdatasync there.
//
// Every answer is checked; the exit status is 1 if any was wrong. Rates are the medians of the
// rounds. Not a test: what it prints is for people.
#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>

#include <CLI/CLI.hpp>

#include "proto_tests/exchange_bench/arena.h"
#include "proto_tests/exchange_bench/pty_load.h"
#include "proto_tests/exchange_bench/server_process.h"
#include "proto_tests/exchange_bench/udp_load.h"

namespace pheromone::bench {
namespace {

struct Options {
  std::string pheromoned;
  std::string extra_config;
  std::string folder;
  std::string meanwhile;
  std::vector<std::string> arguments;
  int clients = 64;
  int rounds = 5;
  double seconds = 2;
  double pty_seconds = 10;
  int syncs = 1000;
};

double Median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// A process group that runs beside the measurements.
class Meanwhile {
 public:
  explicit Meanwhile(const std::string& command) {
    if (command.empty()) {
      return;
    }
    process_ = fork();
    if (process_ == 0) {
      setpgid(0, 0);
      execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
      _exit(127);
    }
    setpgid(process_, process_);
  }
  Meanwhile(const Meanwhile&) = delete;
  Meanwhile& operator=(const Meanwhile&) = delete;
  ~Meanwhile() {
    if (process_ > 0) {
      kill(-process_, SIGTERM);
      waitpid(process_, nullptr, 0);
    }
  }

 private:
  pid_t process_ = -1;
};

class Bench {
 public:
  Bench(const Options& options, const Arena& arena, const ServerProcess& server, int links)
      : options_(options), arena_(arena) {
    for (int i = 1; i <= links; ++i) {
      ports_.push_back(server.PortOf(fmt::format("udp-{}", i)));
    }
  }

  /// `what` in turn with the echo.
  void CompareUdp(std::string_view name, Load what) {
    const EchoProcess echo;
    const std::vector<uint16_t> echo_ports(ports_.size(), echo.port());
    std::vector<double> rates;
    std::vector<double> echo_rates;
    std::vector<double> ratios;
    LoadResult sum;
    for (int round = 0; round < options_.rounds; ++round) {
      const LoadResult bare =
          RunLoad(arena_, {Load::kEcho, options_.clients, echo_ports, options_.seconds});
      LoadResult served = RunLoad(arena_, {what, options_.clients, ports_, options_.seconds});
      echo_rates.push_back(bare.per_second);
      rates.push_back(served.per_second);
      ratios.push_back(bare.per_second > 0 ? served.per_second / bare.per_second : 0);
      sum.right += served.right;
      sum.wrong += served.wrong + bare.wrong;
      sum.lost += served.lost;
      sum.times = std::move(served.times);
    }
    fmt::print("{:5} {:8.0f}/s, bare echo {:8.0f}/s: {:3.0f} %; {} right, {} wrong, {} lost; {}\n",
               name, Median(rates), Median(echo_rates), 100 * Median(ratios), sum.right, sum.wrong,
               sum.lost, sum.times.Text());
    wrong_ += sum.wrong;
  }

  void TimePtys(std::string_view name, bool trace, int ptys, int baud, const std::string& folder) {
    PtyLoadOptions load{trace, baud, {}, options_.pty_seconds};
    for (int i = 1; i <= ptys; ++i) {
      load.ptys.push_back(fmt::format("{}/pty-{}", folder, i));
    }
    PtyLoadResult result = RunPtyLoad(arena_, load);
    fmt::print("{:5} on {:2} ptys at {:6} baud: {}; {} wrong, {} lost\n", name, ptys, baud,
               result.times.Text(), result.wrong, result.lost);
    wrong_ += result.wrong;
  }

  /// What the disk does by itself, a record of the size of an event at a time.
  void TimeSyncs(const std::string& folder) const {
    const std::string path = folder + "/syncs";
    const int handle = open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
    const std::array<char, 64> record{};
    Quantiles times;
    for (int i = 0; i < options_.syncs; ++i) {
      const auto begin = std::chrono::steady_clock::now();
      if (write(handle, record.data(), record.size()) < 0 || fdatasync(handle) != 0) {
        break;
      }
      times.Add(std::chrono::steady_clock::now() - begin);
    }
    close(handle);
    fmt::print("write and fdatasync alone: {}\n", times.Text());
  }

  uint64_t wrong() const { return wrong_; }

 private:
  const Options& options_;
  const Arena& arena_;
  std::vector<uint16_t> ports_;
  uint64_t wrong_ = 0;
};

int Run(const Options& options, const std::string& folder) {
  std::string extra;
  if (!options.extra_config.empty()) {
    std::ifstream file(options.extra_config);
    extra.assign(std::istreambuf_iterator<char>(file), {});
  }
  constexpr int kPtys = 16;
  const int links = (options.clients + 253) / 254;
  const Arena arena = MakeArena(folder, {links, kPtys}, extra);
  const ServerProcess server(options.pheromoned, arena.config_file, options.arguments, folder);
  const Meanwhile meanwhile(options.meanwhile);
  fmt::print("{} clients, {} live nodes, {} rounds of {} s; pheromoned has {} MiB\n",
             options.clients, arena.live_nodes, options.rounds, options.seconds,
             server.rss_kib() / 1024);
  Bench bench(options, arena, server, links);
  bench.CompareUdp("SENSE", Load::kSense);
  bench.CompareUdp("TRACE", Load::kTrace);
  if (!options.folder.empty()) {
    bench.TimeSyncs(folder);
  }
  for (const bool trace : {false, true}) {
    for (const int baud : {9600, 115'200}) {
      for (const int ptys : {1, kPtys}) {
        bench.TimePtys(trace ? "TRACE" : "SENSE", trace, ptys, baud, folder);
      }
    }
  }
  fmt::print("pheromoned has {} MiB\n", server.rss_kib() / 1024);
  return bench.wrong() == 0 ? 0 : 1;
}

int Main(int argc, char** argv) {
  Options options;
  options.pheromoned =
      (std::filesystem::read_symlink("/proc/self/exe").parent_path() / "pheromoned").string();
  CLI::App app("Exchanges with pheromoned: how many, and how soon", "exchange_bench");
  app.add_option("--pheromoned", options.pheromoned, "The program; default: the one beside this")
      ->check(CLI::ExistingFile);
  app.add_option("--extra-config", options.extra_config, "TOML to append to the configuration")
      ->check(CLI::ExistingFile);
  app.add_option("--argument", options.arguments, "Another argument for pheromoned; repeatable");
  app.add_option("--folder", options.folder, "Where files go, on a disk of interest")
      ->check(CLI::ExistingDirectory);
  app.add_option("--meanwhile", options.meanwhile, "A shell command to run beside all this");
  app.add_option("--clients", options.clients, "UDP clients; 254 share a link")
      ->check(CLI::Range(1, 2540));
  app.add_option("--rounds", options.rounds, "Of echo, then exchanges")->check(CLI::Range(1, 1000));
  app.add_option("--seconds", options.seconds, "Of each half of a round");
  app.add_option("--pty-seconds", options.pty_seconds, "Of each case with ptys");
  app.add_option("--syncs", options.syncs, "Of the bare disk");
  CLI11_PARSE(app, argc, argv);
  signal(SIGPIPE, SIG_IGN);
  std::setbuf(stdout, nullptr);

  const std::string parent =
      options.folder.empty() ? std::filesystem::temp_directory_path().string() : options.folder;
  std::string folder = parent + "/exchange_bench.XXXXXX";
  if (mkdtemp(folder.data()) == nullptr) {
    fmt::print(stderr, "exchange_bench: cannot make a folder in {}\n", parent);
    return 1;
  }
  const int status = Run(options, std::filesystem::absolute(folder).string());
  std::filesystem::remove_all(folder);
  return status;
}

}  // namespace
}  // namespace pheromone::bench

int main(int argc, char** argv) {
  return pheromone::bench::Main(argc, argv);
}
