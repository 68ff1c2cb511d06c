#include "client_fw/swarm/parallel_runs.h"

#include <atomic>
#include <thread>
#include <vector>

namespace pheromone::swarm {

void RunInParallel(size_t count, const std::function<void(size_t)>& run) {
  std::atomic<size_t> next = 0;
  const auto work = [&] {
    for (size_t i = next++; i < count; i = next++) {
      run(i);
    }
  };
  std::vector<std::jthread> threads;
  for (unsigned i = 1; i < std::thread::hardware_concurrency(); ++i) {
    threads.emplace_back(work);
  }
  work();
  threads.clear();  // waits for them
}

}  // namespace pheromone::swarm
