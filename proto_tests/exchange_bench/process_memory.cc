#include "proto_tests/exchange_bench/process_memory.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <system_error>

namespace pheromone::bench {
namespace {

constexpr std::chrono::milliseconds kBetweenLooks{20};

// A line of /proc/PID/status such as "VmRSS:"; 0 if the process has gone.
long StatusKib(pid_t process, std::string_view key) {
  std::ifstream status(fmt::format("/proc/{}/status", process));
  for (std::string line; std::getline(status, line);) {
    if (line.rfind(key, 0) == 0) {
      return std::stol(line.substr(key.size()));
    }
  }
  return 0;
}

}  // namespace

long RssKib(pid_t process) {
  return StatusKib(process, "VmRSS:");
}

long FamilyRssKib(pid_t process) {
  long kib = RssKib(process);
  std::error_code gone;
  for (const auto& task :
       std::filesystem::directory_iterator(fmt::format("/proc/{}/task", process), gone)) {
    std::ifstream children(task.path() / "children");
    for (pid_t child = 0; children >> child;) {
      kib += FamilyRssKib(child);
    }
  }
  return kib;
}

ProcessMemory::ProcessMemory(pid_t process) : process_(process), thread_([this] { Look(); }) {}

ProcessMemory::~ProcessMemory() {
  stopping_ = true;
  thread_.join();
}

void ProcessMemory::Look() {
  while (!stopping_) {
    seen_kib_ = std::max(seen_kib_.load(), rss_kib());
    std::this_thread::sleep_for(kBetweenLooks);
  }
}

long ProcessMemory::TakePeakKib() {
  const long peak_kib = std::max(seen_kib_.exchange(0), StatusKib(process_, "VmHWM:"));
  std::ofstream(fmt::format("/proc/{}/clear_refs", process_)) << '5';  // begins VmHWM anew
  return peak_kib;
}

}  // namespace pheromone::bench
