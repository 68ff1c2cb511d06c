// crash_test: what the journal promises, tried by crashing. Prints figures; exit status 0 if every
// promise held, 1 if not, 2 for a mistake in the command line.
//
//   build/release/bin/crash_test                       200 kills, 1000 power cuts
//   build/release/bin/crash_test --rounds 10 --cuts 60
//
// A full disk is tried with the daemon itself: server/daemon/disk_full_test.py.
#include <cstdint>
#include <exception>
#include <iostream>
#include <string>

#include <CLI/CLI.hpp>

#include "proto_tests/crash/checks.h"

namespace {

int Main(int argc, char** argv) {
  CLI::App app("Tries by crashing what the journal promises.", "crash_test");
  int rounds = 200;
  int cuts = 1000;
  uint64_t changes = 400'000;
  uint64_t seed = 1;
  std::string only;
  std::string serve;
  app.add_option("--rounds", rounds, "Processes to kill")->check(CLI::NonNegativeNumber);
  app.add_option("--cuts", cuts, "Power cuts")->check(CLI::NonNegativeNumber);
  app.add_option("--changes", changes, "Changes under load; 0: none")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--seed", seed, "Other traffic, other crashes");
  app.add_option("--only", only, "One of them")
      ->check(CLI::IsMember({"kill", "power", "bytes", "failures", "load"}));
  app.add_option("--serve", serve, "Be the process to be killed")->group("");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  using namespace pheromone::crash;  // NOLINT(google-build-using-namespace)
  if (!serve.empty()) {
    return ServeUntilKilled(serve, seed);
  }
  const auto wanted = [&only](const char* name) { return only.empty() || only == name; };
  bool good = true;
  good = (!wanted("bytes") || CheckBytes(seed)) && good;
  good = (!wanted("failures") || CheckFailures(cuts, seed)) && good;
  good = (!wanted("power") || CheckPowerCuts(cuts, seed)) && good;
  good = (!wanted("kill") || CheckKills(argv[0], rounds, seed)) && good;
  good = (!wanted("load") || changes == 0 || CheckLoad(changes, seed)) && good;
  std::cout << (good ? "crash_test: ok" : "crash_test: FAILED") << std::endl;
  return good ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return Main(argc, argv);
  } catch (const std::exception& error) {
    std::cerr << "crash_test: " << error.what() << '\n';
    return 1;
  }
}
