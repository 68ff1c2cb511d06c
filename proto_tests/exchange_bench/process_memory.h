// The memory of a process and its children, from /proc.
#pragma once

#include <sys/types.h>

#include <atomic>
#include <thread>

namespace pheromone::bench {

/// The resident memory of `process`; 0 if it has gone.
long RssKib(pid_t process);

/// The same of it and of all that it has started, children's children too.
long FamilyRssKib(pid_t process);

/// Samples continuously, in a thread of its own, until it is destroyed.
class ProcessMemory {
 public:
  explicit ProcessMemory(pid_t process);
  ProcessMemory(const ProcessMemory&) = delete;
  ProcessMemory& operator=(const ProcessMemory&) = delete;
  ~ProcessMemory();

  long rss_kib() const { return FamilyRssKib(process_); }

  /// The most since the last call: the system's own mark for the process (VmHWM), or what was seen
  /// of it together with its children, whichever is more.
  long TakePeakKib();

 private:
  void Look();

  const pid_t process_;
  std::atomic<long> seen_kib_ = 0;
  std::atomic<bool> stopping_ = false;
  std::thread thread_;
};

}  // namespace pheromone::bench
