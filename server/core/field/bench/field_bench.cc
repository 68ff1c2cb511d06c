// The benchmark of the field: every figure with its ratio to baselines of the same run.
//
//   field_bench                                all cases: a few minutes
//   field_bench --benchmark_filter=robot-step  some of them (a regular expression over names)
//   field_bench --benchmark_list_tests         their names
//   field_bench --csv FILE                     the figures as CSV, which figure.py draws
//
// Exit status: 0; 1 if a file cannot be written or a case failed; 2 for arguments that make no
// sense.

#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <cstring>
#include <fstream>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "server/core/field/bench/cases.h"
#include "server/core/field/bench/tables.h"

namespace pheromone::field::bench {
namespace {

constexpr int kRepetitions = 7;

// Collects the times of the repetitions, and says how far the run has come.
class Collector : public benchmark::BenchmarkReporter {
 public:
  explicit Collector(const std::vector<Case>& cases) {
    for (const Case& each : cases) {
      cases_.emplace(each.key.name(), &each);
    }
  }

  bool ReportContext(const Context& context) override {
    PrintBasicContext(&GetErrorStream(), context);
    return true;
  }

  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      if (run.run_type != Run::RT_Iteration) {
        continue;
      }
      const std::string& name = run.run_name.function_name;
      if (run.error_occurred) {
        fmt::print(stderr, "{}: {}\n", name, run.error_message);
        failed_ = true;
        continue;
      }
      const Case& measured = *cases_.at(name);
      const double ns = measured.wall_time ? run.GetAdjustedRealTime() : run.GetAdjustedCPUTime();
      results_.Add(measured.key, ns / measured.operations);
      if (run.repetition_index + 1 == run.repetitions) {
        fmt::print(stderr, "{}: {}\n", name, Duration(results_.Find(measured.key)->median));
      }
    }
  }

  const Results& results() const { return results_; }
  bool failed() const { return failed_; }

 private:
  std::map<std::string, const Case*> cases_;
  Results results_;
  bool failed_ = false;
};

std::vector<Case> AllCases() {
  std::vector<Case> all = QueryCases();
  for (auto part : {OptionCases(), RobotStepCases(), SingleCases()}) {
    all.insert(all.end(), part.begin(), part.end());
  }
  return all;
}

void Register(const std::vector<Case>& cases) {
  for (const Case& each : cases) {
    auto* registered = benchmark::RegisterBenchmark(each.key.name().c_str(), each.run)
                           ->Repetitions(kRepetitions)
                           ->MinTime(each.seconds)
                           ->Unit(benchmark::kNanosecond);
    if (each.wall_time) {
      registered->UseRealTime();
    }
  }
}

// Takes "NAME VALUE" or "NAME=VALUE" out of the arguments; empty if it is not among them.
std::optional<std::string> TakeOption(const char* name, std::vector<char*>* arguments) {
  const size_t length = std::strlen(name);
  for (auto at = arguments->begin() + 1; at < arguments->end(); ++at) {
    if (std::strncmp(*at, name, length) != 0) {
      continue;
    }
    if ((*at)[length] == '=') {
      std::string value = *at + length + 1;
      arguments->erase(at);
      return value;
    }
    if ((*at)[length] == '\0' && at + 1 < arguments->end()) {
      std::string value = *(at + 1);
      arguments->erase(at, at + 2);
      return value;
    }
  }
  return std::nullopt;
}

bool WriteFile(const std::string& path, const std::string& content) {
  std::ofstream file(path, std::ios::binary);
  file << content;
  file.close();
  if (!file) {
    fmt::print(stderr, "field_bench: {} cannot be written\n", path);
    return false;
  }
  return true;
}

int Main(std::vector<char*> arguments) {
  const auto csv = TakeOption("--csv", &arguments);
  int count = static_cast<int>(arguments.size());
  benchmark::Initialize(&count, arguments.data());
  if (benchmark::ReportUnrecognizedArguments(count, arguments.data())) {
    fmt::print(stderr, "usage: field_bench [--csv FILE] [--benchmark_filter=REGEX]\n");
    return 2;
  }
  const std::vector<Case> cases = AllCases();
  Register(cases);
  Collector collector(cases);
  benchmark::RunSpecifiedBenchmarks(&collector);
  fmt::print("{}", Tables(collector.results()));

  bool good = !collector.failed();
  if (csv) {
    good &= WriteFile(*csv, Csv(collector.results()));
  }
  return good ? 0 : 1;
}

}  // namespace
}  // namespace pheromone::field::bench

int main(int argc, char** argv) {
  return pheromone::field::bench::Main({argv, argv + argc});
}
