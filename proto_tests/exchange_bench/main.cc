// How many exchanges the daemon makes, and how soon it answers, beside what the machine could do
// without it:
//
//   build/release/bin/exchange_bench
//   build/release/bin/exchange_bench --disk FOLDER --csv FILE
//
//  * UDP over the loopback interface, a socket and one request under way for each client, one frame
//    a datagram, random poses on a map with more than a million live nodes, r = 5 cells: SENSE and
//    TRACE, each in turn with a bare echo of the same datagrams (server_process.h);
//  * ptys at the pace of modems: from a request's last byte to the answer's first (pty_load.h),
//    also while somebody looks at the map (viewer.h);
//  * ptys by turns alone and beside 20 viewers of the stream, two of which do not read
//    (stream_viewers.h);
//  * robots that roam and leave what evaporates, and the server's memory meanwhile;
//  * SENSE on a link with keys, in turn with SENSE on those without;
//  * the same for virtual RFID tags, nine and 10 000 of them: SCAN and READ in turn with SENSE,
//    WRITE with TRACE;
//  * with --disk, a folder on a real disk, all of TRACE again with a journal there, beside a bare
//    loop of write and fdatasync;
//  * robots that ask fifty times a second, alone and beside each of an operator's largest requests
//    (operators.h), with a journal on that disk, or else where temporary files are.
//
//   build/release/bin/exchange_bench --only cluster --disk FOLDER --csv FILE
//
// Two servers with one log in etcd, beside one alone (cluster.h); needs Debian's etcd-server.
//
//   build/release/bin/exchange_bench --only operators --disk FOLDER --csv FILE
//   build/release/bin/exchange_bench --only memory --disk FOLDER
//
// The last is another subject: the server's memory with a field that is full (RunMemory).
//
// Every answer is checked; the exit status is 1 if any was wrong. Rates are the medians of the
// rounds. Not a test: what it prints is for people.
#include <fmt/format.h>
#include <signal.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "proto_tests/exchange_bench/arena.h"
#include "proto_tests/exchange_bench/cluster.h"
#include "proto_tests/exchange_bench/measure.h"
#include "proto_tests/exchange_bench/operators.h"
#include "proto_tests/exchange_bench/report.h"
#include "proto_tests/exchange_bench/server_process.h"
#include "proto_tests/exchange_bench/stream_viewers.h"
#include "proto_tests/exchange_bench/viewer.h"
#include "server/base/number_check.h"
#include "server/base/testing/temporary_folder.h"

namespace pheromone::bench {
namespace {

struct Options {
  std::string pheromoned;
  std::string disk;
  std::string csv;
  std::vector<std::string> only;
  int clients = 64;
  double lasting_seconds = 60;
  OperatorOptions operators;
  Effort effort;
};

constexpr int kManyClients = 2032;  // 8 links of 254: as many as a link takes
constexpr int kBauds[] = {9600, 115'200};

void RunVolatile(const Options& options, Report* report) {
  const TemporaryFolder folder;
  const Arena arena = MakeArena(folder.string(), kLinks, "");
  const ServerProcess server(options.pheromoned, arena.config_file, {}, folder.string());
  Report::Say(fmt::format(
      "{} live nodes, {} rounds of {} s; without a journal pheromoned has {} MiB", arena.live_nodes,
      options.effort.rounds, options.effort.seconds, server.rss_kib() / 1024));
  Measure measure("volatile", folder.string(), options.effort, arena, server, report);
  measure.CompareUdp(Load::kSense, options.clients);
  measure.CompareUdp(Load::kTrace, options.clients);
  for (const int baud : kBauds) {
    for (const int ptys : {1, kLinks.pty}) {
      measure.TimePtys(false, ptys, baud);
    }
  }
  const Viewer viewer(folder.string());
  for (const int baud : kBauds) {
    for (const int ptys : {1, kLinks.pty}) {
      const int before = viewer.pictures();
      measure.TimePtys(false, ptys, baud, " beside a viewer");
      Report::Say(
          fmt::format("         the viewer has seen {} pictures", viewer.pictures() - before));
    }
  }
  measure.Roam(options.clients);
}

// A link with keys, in turn with one without.
void RunSigned(const Options& options, Report* report) {
  const TemporaryFolder folder;
  const std::string keys_file = folder.string() + "/robots.keys";
  std::ofstream keys(keys_file);
  const int clients = std::min(options.clients, 254);  // with a key each
  for (int id = 1; id <= clients; ++id) {
    keys << id << ' ';
    for (const uint8_t byte : BenchKey(static_cast<uint8_t>(id))) {
      keys << fmt::format("{:02x}", byte);
    }
    keys << '\n';
  }
  keys.close();
  std::filesystem::permissions(
      keys_file, std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
  const Arena arena = MakeArena(folder.string(), kLinks,
                                "[[link]]\nname = \"signed\"\nkind = \"udp\"\n"
                                "listen = \"127.0.0.1:0\"\nsecurity = \"require\"\n"
                                "keys = \"robots.keys\"\n");
  const ServerProcess server(options.pheromoned, arena.config_file, {}, folder.string());
  Measure("volatile", folder.string(), options.effort, arena, server, report)
      .CompareSigned(clients);
}

// Ptys alone, and beside viewers of everything.
void RunStream(const Options& options, Report* report) {
  constexpr int kViewers = 20;
  constexpr int kDeaf = 2;
  const TemporaryFolder folder;
  const Arena arena = MakeArena(folder.string(), kLinks, "");
  const ServerProcess server(options.pheromoned, arena.config_file, {}, folder.string());
  Measure measure("volatile", folder.string(), options.effort, arena, server, report);
  const auto say_memory = [&](const char* when) {
    Report::Say(fmt::format("{} pheromoned has {} MiB", when, server.rss_kib() / 1024));
  };
  say_memory("without viewers");
  for (const int baud : kBauds) {
    uint64_t bytes = 0;
    measure.ComparePtys(kLinks.pty, baud, " beside 20 viewers of the stream", [&] {
      const auto viewers = std::make_shared<StreamViewers>(folder.string(), kViewers, kDeaf);
      viewers->AwaitFirst();
      return std::shared_ptr<void>(viewers.get(),
                                   [&bytes, viewers](void*) { bytes += viewers->counts().bytes; });
    });
    Report::Say(
        fmt::format("         the viewers have read {:.1f} MB", static_cast<double>(bytes) / 1e6));
    say_memory("after viewers");
  }
}

// Tags beside SENSE and TRACE, few and many of them.
void RunTags(const Options& options, const std::string& disk, Report* report) {
  constexpr int kMapMm = 30'000;
  for (const int per_side : {3, 100}) {
    const TemporaryFolder folder(disk.empty() ? std::filesystem::temp_directory_path()
                                              : std::filesystem::path(disk));
    const std::string journal = disk.empty() ? "" : "[journal]\nfolder = \"state\"\n";
    const Arena arena = MakeArena(folder.string(), kLinks, journal + TagTables(per_side, kMapMm));
    const ServerProcess server(options.pheromoned, arena.config_file, {}, folder.string());
    Measure measure(disk.empty() ? "volatile" : "durable", folder.string(), options.effort, arena,
                    server, report);
    const TagSites tags(per_side, kMapMm);
    RunLoad(arena, {Load::kTagWriteAll, options.clients, {server.PortOf("udp-1")}, 0, &tags});
    measure.CompareTags(Load::kScan, Load::kSense, tags, options.clients);
    measure.CompareTags(Load::kTagRead, Load::kSense, tags, options.clients);
    measure.CompareTags(Load::kTagWrite, Load::kTrace, tags, options.clients);
  }
}

void RunDurable(const Options& options, Report* report) {
  const TemporaryFolder folder(options.disk);
  const Arena arena = MakeArena(folder.string(), kLinks, "[journal]\nfolder = \"state\"\n");
  const ServerProcess server(options.pheromoned, arena.config_file, {}, folder.string());
  Report::Say(fmt::format("with a journal on {} pheromoned has {} MiB", options.disk,
                          server.rss_kib() / 1024));
  Measure measure("durable", folder.string(), options.effort, arena, server, report);
  measure.CompareUdp(Load::kSense, options.clients);
  for (const int clients : {options.clients, kManyClients}) {
    measure.CompareUdp(Load::kTrace, clients);
  }
  for (const int baud : kBauds) {
    for (const int ptys : {1, kLinks.pty}) {
      TimeSyncs(folder.string(), options.effort, report);
      measure.TimePtys(true, ptys, baud);
    }
  }
}

void RunBesideOperators(Options options, bool only_memory, Report* report) {
  const TemporaryFolder folder(options.disk.empty() ? std::filesystem::temp_directory_path()
                                                    : std::filesystem::path(options.disk));
  options.operators.pheromoned = options.pheromoned;
  options.operators.folder = folder.string();
  if (only_memory) {
    RunMemory(options.operators);
    return;
  }
  RunOperators(options.operators, report);
  Report::Say(
      fmt::format("beside operators: in {} of {} rows an answer took more than 20 ms and "
                  "twice the longest without, or the fail-safe had to stop a robot",
                  report->held_up(), report->beside()));
}

int Main(int argc, char** argv) {
  Options options;
  options.pheromoned =
      (std::filesystem::read_symlink("/proc/self/exe").parent_path() / "pheromoned").string();
  CLI::App app("Exchanges with pheromoned: how many, and how soon", "exchange_bench");
  app.add_option("--pheromoned", options.pheromoned, "The program; default: the one beside this")
      ->check(CLI::ExistingFile);
  app.add_option("--disk", options.disk, "A folder on a disk: with a journal there too")
      ->check(CLI::ExistingDirectory);
  app.add_option("--csv", options.csv, "A file for the numbers");
  app.add_option("--clients", options.clients, "UDP clients")->check(WholeNumber(1, kManyClients));
  app.add_option("--rounds", options.effort.rounds, "Of echo, then exchanges")
      ->check(WholeNumber(1, 1000));
  app.add_option("--seconds", options.effort.seconds, "Of each half of a round");
  app.add_option("--pty-rounds", options.effort.pty_rounds, "Of ptys with and without viewers");
  app.add_option("--bytes-at-once", options.effort.bytes_at_once,
                 "That reach a pty together: 8 are typical of a UART's FIFO; default: 1")
      ->check(WholeNumber(1, 64));
  app.add_option("--pty-seconds", options.effort.pty_seconds, "Of each case with ptys");
  app.add_option("--roaming-seconds", options.effort.roaming_seconds, "Of robots that roam");
  app.add_option("--syncs", options.effort.syncs, "Of the bare disk");
  app.add_option(
         "--only", options.only,
         "Only these: volatile, signed, stream, tags, durable (with --disk), operators, memory, "
         "cluster (with "
         "--disk); default: all but the last two")
      ->check(CLI::IsMember(
          {"volatile", "signed", "stream", "tags", "durable", "operators", "memory", "cluster"}));
  app.add_option("--lasting-seconds", options.lasting_seconds, "Of a cluster's changes at the end");
  app.add_option("--operator-seconds", options.operators.seconds,
                 "Of robots alone, and of robots beside each of an operator's requests");
  int patience_s = 60;
  app.add_option("--patience", patience_s, "Seconds, for an operator's request")
      ->check(WholeNumber(1, 3600));
  app.add_option("--field-mib", options.operators.field_mib, "The limit of a field that is full")
      ->check(WholeNumber(16, 65536));
  CLI11_PARSE(app, argc, argv);
  signal(SIGPIPE, SIG_IGN);

  Report report(options.csv);
  options.operators.patience = std::chrono::seconds(patience_s);
  const auto wants = [&](const char* part) {
    return options.only.empty() ? std::string("memory") != part && std::string("cluster") != part
                                : std::ranges::find(options.only, part) != options.only.end();
  };
  if (wants("volatile")) {
    RunVolatile(options, &report);
  }
  if (wants("signed")) {
    RunSigned(options, &report);
  }
  if (wants("stream")) {
    RunStream(options, &report);
  }
  if (wants("tags")) {
    RunTags(options, "", &report);
    if (!options.disk.empty()) {
      RunTags(options, options.disk, &report);
    }
  }
  if (wants("durable") && !options.disk.empty()) {
    RunDurable(options, &report);
  }
  if (wants("operators")) {
    RunBesideOperators(options, false, &report);
  }
  if (wants("memory")) {
    RunBesideOperators(options, true, &report);
  }
  if (wants("cluster") && !options.disk.empty()) {
    const TemporaryFolder folder(options.disk);
    RunCluster({.pheromoned = options.pheromoned,
                .folder = folder.string(),
                .clients = options.clients,
                .many_clients = kManyClients,
                .effort = options.effort,
                .lasting_seconds = options.lasting_seconds},
               &report);
  }
  return report.wrong() == 0 ? 0 : 1;
}

}  // namespace
}  // namespace pheromone::bench

int main(int argc, char** argv) {
  return pheromone::bench::Main(argc, argv);
}
