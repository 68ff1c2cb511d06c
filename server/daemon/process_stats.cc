#include "server/daemon/process_stats.h"

#include <sys/resource.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <system_error>

namespace pheromone::daemon {
namespace {

double Seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_usec) / 1e6;
}

}  // namespace

ProcessStats ReadProcessFigures() {
  ProcessStats figures;
  uint64_t pages = 0;  // the second figure of the file; the first is the address space
  std::ifstream("/proc/self/statm") >> pages >> pages;
  figures.resident_bytes = pages * static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
  std::error_code ignored;
  std::filesystem::directory_iterator descriptor("/proc/self/fd", ignored);
  for (; !ignored && descriptor != std::filesystem::directory_iterator();
       descriptor.increment(ignored)) {
    ++figures.open_descriptors;
  }
  rusage usage{};
  if (getrusage(RUSAGE_SELF, &usage) == 0) {
    figures.cpu_s = Seconds(usage.ru_utime) + Seconds(usage.ru_stime);
  }
  return figures;
}

}  // namespace pheromone::daemon
