#include "proto_tests/exchange_bench/viewer.h"

#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <string_view>
#include <thread>

#include "proto_tests/exchange_bench/http_call.h"

namespace pheromone::bench {
namespace {

constexpr std::string_view kTarget = "/api/v1/field?pheromone=1&nodes_per_cell=16";
constexpr std::chrono::milliseconds kPeriod{100};
constexpr std::chrono::seconds kPatience{10};

}  // namespace

Viewer::Viewer(const std::string& folder) {
  void* const shared =
      mmap(nullptr, sizeof(int), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  pictures_ = static_cast<volatile int*>(shared);
  process_ = fork();
  if (process_ == 0) {
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    for (auto next = std::chrono::steady_clock::now();; next += kPeriod) {
      std::this_thread::sleep_until(next);
      const HttpAnswer answer = Call(folder + "/pheromoned.sock", "GET", kTarget, "", kPatience);
      *pictures_ = *pictures_ + (answer.status == 200 ? 1 : 0);
    }
  }
}

Viewer::~Viewer() {
  kill(process_, SIGTERM);
  waitpid(process_, nullptr, 0);
  munmap(const_cast<int*>(pictures_), sizeof(int));
}

}  // namespace pheromone::bench
