// The memory of a server whose field is full: what operators.h calls RunMemory.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <string>
#include <string_view>
#include <thread>

#include "proto_tests/exchange_bench/operator_stage.h"
#include "proto_tests/exchange_bench/operators.h"
#include "proto_tests/exchange_bench/process_memory.h"
#include "proto_tests/exchange_bench/report.h"

namespace pheromone::bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kPeakFactor = 1.25;
constexpr double kPeakSlackMib = 128;
constexpr double kReturnFactor = 1.2;
constexpr std::chrono::seconds kReturnPatience{30};  // for memory to go back
constexpr std::chrono::seconds kFilePatience{300};   // for a snapshot's or a recording's file
constexpr std::chrono::milliseconds kLook{100};

// Of the files of a folder whose names end so: how many, and how large they are together.
struct Files {
  int count = 0;
  uint64_t bytes = 0;
  bool operator==(const Files&) const = default;
};

Files FilesOf(const std::string& folder, std::string_view ending) {
  Files files;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(folder, none)) {
    if (entry.path().string().ends_with(ending)) {
      ++files.count;
      files.bytes += std::filesystem::file_size(entry.path(), none);
    }
  }
  return files;
}

class MemoryRun {
 public:
  MemoryRun(const OperatorOptions& options, OperatorStage* stage)
      : limit_mib_(options.field_mib), stage_(*stage), memory_(stage->server().pid()) {}

  void Run() {
    const double empty = Step("an empty server", 0, [] { return HttpAnswer{200, ""}; });
    const double full = Step("the field filled", 0, [&] {
      const int parts = stage_.Fill();
      return HttpAnswer{parts > 0 ? 200 : 0, "nothing was painted"};
    });
    Report::Say(fmt::format("  the field says that it has {:.0f} of {} MiB",
                            stage_.StatusNumber("used_bytes") / 1048576, limit_mib_));
    Step("a snapshot", full, [&] { return Snapshot(); });
    Step("a recording", full, [&] { return Recording(); });
    Step("a reload with another tau", full, [&] { return stage_.Reload(900'001); });
    Step("erase-all", empty,
         [&] { return stage_.Post("/api/v1/erase", R"({"pheromone": "paint", "all": true})"); });
    Report::Say(fmt::format(
        "the most in all: {:.0f} MiB, {:.2f} x the limit; {}", peak_mib_, peak_mib_ / limit_mib_,
        peak_mib_ <= kPeakFactor * limit_mib_ + kPeakSlackMib ? "within 1.25 x + 128 MiB"
                                                              : "MORE than 1.25 x + 128 MiB"));
  }

 private:
  double RssMib() const { return static_cast<double>(memory_.rss_kib()) / 1024; }

  // Says what the step took, and what is left some time after it: there should be no more than a
  // fifth above `before_mib`, unless that is 0. Returns what is left.
  template <typename Do>
  double Step(const std::string& name, double before_mib, Do&& act) {
    memory_.TakePeakKib();
    const auto begin = Clock::now();
    const HttpAnswer answer = act();
    const double took_s = std::chrono::duration<double>(Clock::now() - begin).count();
    const auto deadline = Clock::now() + kReturnPatience;
    while (before_mib > 0 && RssMib() > kReturnFactor * before_mib && Clock::now() < deadline) {
      std::this_thread::sleep_for(kLook);
    }
    const double rss_mib = RssMib();
    const double peak_mib = static_cast<double>(memory_.TakePeakKib()) / 1024;
    peak_mib_ = std::max(peak_mib_, peak_mib);
    std::string back;
    if (before_mib > 0) {
      back = fmt::format("; before it {:.0f} MiB: {}", before_mib,
                         rss_mib <= kReturnFactor * before_mib ? "back within 20 %" : "NOT BACK");
    }
    Report::Say(fmt::format("{:28}{:7.1f} s  VmRSS {:6.0f} MiB, at most {:6.0f} MiB: {:.2f} x{}{}",
                            name, took_s, rss_mib, peak_mib, peak_mib / limit_mib_, back,
                            answer.status == 200 ? "" : "; " + answer.body));
    return rss_mib;
  }

  // A server may only promise one, and make it after the next change.
  HttpAnswer Snapshot() {
    const std::string folder = stage_.folder() + "/state";
    const Files before = FilesOf(folder, ".snapshot");
    HttpAnswer answer = stage_.Post("/api/v1/snapshot", "{}");
    stage_.Post("/api/v1/paint", R"({"pheromone": "paint", "points_m": [[1, 1]]})");
    const auto deadline = Clock::now() + kFilePatience;
    while (answer.status == 200 && FilesOf(folder, ".snapshot") == before) {
      if (Clock::now() > deadline) {
        return {0, "no snapshot was made"};
      }
      std::this_thread::sleep_for(kLook);
    }
    return answer;
  }

  // Until its file grows no more.
  HttpAnswer Recording() {
    HttpAnswer answer = stage_.Post("/api/v1/capture", R"({"action": "start"})");
    const std::string folder = stage_.folder() + "/captures";
    const auto deadline = Clock::now() + kFilePatience;
    for (Files before, now = FilesOf(folder, ""); now != before && Clock::now() < deadline;
         now = FilesOf(folder, "")) {
      before = now;
      std::this_thread::sleep_for(std::chrono::seconds(1));
    }
    const HttpAnswer stopped = stage_.Post("/api/v1/capture", R"({"action": "stop"})");
    return answer.status == 200 ? stopped : answer;
  }

  const int limit_mib_;
  OperatorStage& stage_;
  ProcessMemory memory_;
  double peak_mib_ = 0;
};

}  // namespace

void RunMemory(const OperatorOptions& options) {
  OperatorStage stage(options, SideBeyond(options.field_mib));
  stage.Restart();
  MemoryRun(options, &stage).Run();
}

}  // namespace pheromone::bench
