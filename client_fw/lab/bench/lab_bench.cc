// lab_bench: how many robots the lab moves in real time, where the time goes, and what others need
// in the same run. By hand; some minutes for all sizes on two cores.
//
//   lab_bench [--robots 1000,10000,100000] [--steps 200] [--csv FILE]
//
// Robots in real time = robots * 0.2 s / time of a step, from the median of the steps; "best" is
// from the 10th percentile. Time is the thread's CPU time where there is one thread, and wall time
// where there are two, which means little on a machine that does something else.
#include <fmt/format.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "client_fw/lab/bench/worlds.h"
#include "client_fw/swarm/scenario/run.h"
#include "client_fw/swarm/scenario/scenario.h"
#include "server/base/file.h"
#include "server/base/number_check.h"

namespace pheromone::lab::bench {
namespace {

constexpr double kStepS = 0.2;
constexpr size_t kMostFirmware = 10'000;  // robots, for which that level is meant
constexpr int kWarmUpSteps = 250;         // of 50 s: trails live for some 30

double WallNs() {
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration<double, std::nano>(now).count();
}

// Of this thread.
double CpuNs() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e9 + static_cast<double>(now.tv_nsec);
}

double Quantile(std::vector<double> values, double share) {
  const auto at = static_cast<size_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(at), values.end());
  return values[at];
}

// Of a step, in ns a robot.
struct StepCost {
  double median = 0;
  double best = 0;

  double in_real_time() const { return kStepS * 1e9 / median; }
  double best_in_real_time() const { return kStepS * 1e9 / best; }
};

template <typename Step>
StepCost Measure(size_t robots, int steps, double (*ns_now)(), Step&& step) {
  for (int i = 0; i < kWarmUpSteps; ++i) {
    step();
  }
  std::vector<double> ns;
  for (int i = 0; i < steps; ++i) {
    const double start = ns_now();
    step();
    ns.push_back((ns_now() - start) / static_cast<double>(robots));
  }
  return {Quantile(ns, 0.5), Quantile(ns, 0.1)};
}

void MustBeOk(const Status& status) {
  if (!status.ok()) {
    fmt::print(stderr, "lab_bench: {}\n", status.error());
    std::exit(1);
  }
}

int64_t ResidentMib() {
  std::ifstream statm("/proc/self/statm");
  int64_t all = 0;
  int64_t resident = 0;
  statm >> all >> resident;
  return resident * sysconf(_SC_PAGESIZE) / (1 << 20);
}

constexpr const char* kPhaseNames[] = {"sense", "behave", "loads",   "deposit", "advance",
                                       "roll",  "grid",   "collide", "commit"};
constexpr size_t kPhaseCount = std::size(kPhaseNames);
static_assert(kPhaseCount == std::size(World::kPhases));

// The medians of the phases, in ns a robot.
std::vector<double> SplitOf(World* world, int steps) {
  std::vector<std::vector<double>> ns(kPhaseCount);
  for (int i = 0; i < steps; ++i) {
    for (size_t p = 0; p < kPhaseCount; ++p) {
      const double start = CpuNs();
      MustBeOk(world->Run(World::kPhases[p]));
      ns[p].push_back((CpuNs() - start) / static_cast<double>(world->robots().count));
    }
  }
  std::vector<double> medians;
  medians.reserve(ns.size());
  for (const std::vector<double>& of_phase : ns) {
    medians.push_back(Quantile(of_phase, 0.5));
  }
  return medians;
}

// Robots in real time on the level with bytes on the air: pheromone-swarm run, 250 robots that lay
// trails on the same pheromone, at 115 200 baud, which holds few of their frames.
double RadioLevel() {
  std::string starts;
  for (int i = 0; i < 250; ++i) {
    const int row = i / 16;
    starts += fmt::format("[{}, {}, {}],", 0.5 + i % 16, 0.5 + row, 37 * i % 360);
  }
  const Result<swarm::Scenario> scenario = swarm::ParseScenario(
      fmt::format(
          "[run]\nduration_s = 20\n[radio]\nbaud = 115200\n"
          "[map]\nwidth_m = 16.5\nheight_m = 16.5\ncell_m = 0.1\n[antennas]\nbias_m = 0.33\n"
          "[[pheromone]]\ntype = 1\nname = \"trail\"\ncore_m = 0.1\nsigma_m = 0.4\n"
          "tau_s = 15\nquantum = 0.125\nmaximum = 1.0\ndirectional = true\n"
          "[[robots]]\npheromone = \"trail\"\ntrail = true\nlost_trail = \"straight\"\n"
          "starts = [{}]\n",
          starts),
      "radio.toml");
  if (!scenario.ok()) {
    fmt::print(stderr, "lab_bench: {}\n", scenario.error());
    std::exit(1);
  }
  const double start = CpuNs();
  const swarm::SwarmRecord record = swarm::RunScenario(scenario.value(), {});
  return static_cast<double>(record.robots.size()) * 20 / ((CpuNs() - start) / 1e9);
}

// Level "firmware", whose steps are shorter: as many of them as take 0.2 s are measured at once.
void MeasureFirmware(size_t robots, int steps, double radio) {
  constexpr int kStepsOfPeriod = 200 / kFirmwareStepMs;
  uint64_t hashes[2] = {};
  for (const int threads : {1, 2}) {
    const auto world = MakeFirmwareWorld({robots, 1}, threads);
    const StepCost cost = Measure(robots, steps, threads == 1 ? CpuNs : WallNs, [&] {
      for (int i = 0; i < kStepsOfPeriod; ++i) {
        MustBeOk(world->Step());
      }
    });
    hashes[threads - 1] = world->Hash();
    fmt::print(
        "{:>7} robots, {} thread{}, level firmware: {:.0f} ns a robot and 0.2 s, {:.0f} in real "
        "time (best {:.0f}), {} MiB; {:.0f} x level radio\n",
        robots, threads, threads == 1 ? " " : "s", cost.median, cost.in_real_time(),
        cost.best_in_real_time(), ResidentMib(), cost.in_real_time() / radio);
  }
  fmt::print("        the same bytes with 1 and 2 threads: {}\n",
             hashes[0] != 0 && hashes[0] == hashes[1] ? "yes" : "NO");
}

void PrintSplit(World* world, int steps) {
  const std::vector<double> split = SplitOf(world, std::max(steps / 4, 10));
  const auto robots = static_cast<double>(world->robots().count);
  fmt::print("        ns a robot and step:");
  for (size_t p = 0; p < kPhaseCount; ++p) {
    fmt::print(" {} {:.0f}{}", kPhaseNames[p], split[p], p + 1 < kPhaseCount ? "," : "");
  }
  fmt::print("; {:.1f} nodes a robot\n", static_cast<double>(world->field().node_count()) / robots);
}

// Level "field", beside level "radio" and a swept map. Returns rows of the table.
std::string MeasureField(size_t robots, int steps, double radio) {
  std::string rows;
  StepCost costs[2];
  uint64_t hashes[2] = {};
  for (const int threads : {1, 2}) {
    const auto world = MakeWorld({robots, 1}, threads);
    const StepCost cost =
        Measure(robots, steps, threads == 1 ? CpuNs : WallNs, [&] { MustBeOk(world->Step()); });
    costs[threads - 1] = cost;
    hashes[threads - 1] = world->Hash();
    const int64_t resident_mib = ResidentMib();
    fmt::print(
        "{:>7} robots, {} thread{}: {:.0f} ns, {:.0f} in real time (best {:.0f}), {} MiB; "
        "{:.0f} x level radio\n",
        robots, threads, threads == 1 ? " " : "s", cost.median, cost.in_real_time(),
        cost.best_in_real_time(), resident_mib, cost.in_real_time() / radio);
    rows += fmt::format("{},{},{:.1f},{:.0f},{:.0f},{}\n", robots, threads, cost.median,
                        cost.in_real_time(), cost.best_in_real_time(), resident_mib);
    if (threads == 1) {
      PrintSplit(world.get(), steps);
    }
  }
  fmt::print("        the same bytes with 1 and 2 threads: {}\n",
             hashes[0] != 0 && hashes[0] == hashes[1] ? "yes" : "NO");
  DenseWorld dense({robots, 1});
  const StepCost swept = Measure(robots, std::max(steps / 4, 10), CpuNs, [&] { dense.Step(); });
  fmt::print("        dense sweep: {:.0f} in real time; 1 thread is {:.2f} x that, 2 {:.2f} x\n",
             swept.in_real_time(), swept.median / costs[0].median, swept.median / costs[1].median);
  return rows;
}

int Main(const std::vector<size_t>& sizes, int steps, const std::string& csv) {
  std::setvbuf(stdout, nullptr, _IOLBF, 0);  // each line as soon as it is known
  std::string table = "robots,threads,ns_per_robot_step,robots_in_real_time,best,resident_mib\n";
  const double radio = RadioLevel();
  fmt::print("level radio (pheromone-swarm run, 250 robots): {:.0f} robots in real time\n", radio);
  for (const size_t robots : sizes) {
    table += MeasureField(robots, steps, radio);
    if (robots <= kMostFirmware) {
      MeasureFirmware(robots, steps, radio);
    }
  }
  // Where robots are few, what costs is the floor.
  const Size sparse{1000, 100};
  const auto world = MakeWorld(sparse, 1);
  const StepCost ours = Measure(sparse.robots, steps, CpuNs, [&] { MustBeOk(world->Step()); });
  DenseWorld dense(sparse);
  const StepCost swept = Measure(sparse.robots, 10, CpuNs, [&] { dense.Step(); });
  fmt::print("1000 robots on 316 x 316 m, 1 thread: {:.0f} in real time, {:.1f} x dense sweep\n",
             ours.in_real_time(), swept.median / ours.median);
  if (!csv.empty()) {
    MustBeOk(WriteFile(csv, table));
  }
  return 0;
}

}  // namespace
}  // namespace pheromone::lab::bench

int main(int argc, char** argv) {
  CLI::App app("How many robots the lab moves in real time.");
  std::vector<size_t> robots = {1'000, 10'000, 100'000};
  int steps = 200;
  std::string csv;
  app.add_option("--robots", robots, "How many")
      ->delimiter(',')
      ->check(pheromone::WholeNumber(1, 1'000'000));
  app.add_option("--steps", steps, "That are measured, of each size")
      ->check(pheromone::WholeNumber(10, 100'000));
  app.add_option("--csv", csv, "Write the rows to this file");
  CLI11_PARSE(app, argc, argv);
  return pheromone::lab::bench::Main(robots, steps, csv);
}
