#include "client_fw/lab/worker_pool.h"

namespace pheromone::lab {

WorkerPool::WorkerPool(int threads) {
  for (int worker = 1; worker < threads; ++worker) {
    others_.emplace_back([this, worker] { Serve(worker); });
  }
}

WorkerPool::~WorkerPool() {
  work_ = nullptr;
  round_.fetch_add(1);
  round_.notify_all();
  for (std::thread& other : others_) {
    other.join();
  }
}

void WorkerPool::Run(const std::function<void(int worker)>& work) {
  work_ = &work;
  running_.store(static_cast<uint32_t>(others_.size()));
  round_.fetch_add(1);
  round_.notify_all();
  work(0);
  for (uint32_t left = running_.load(); left != 0; left = running_.load()) {
    running_.wait(left);
  }
}

void WorkerPool::Serve(int worker) {
  for (uint32_t round = 0;;) {
    round_.wait(round);
    ++round;
    if (work_ == nullptr) {
      return;
    }
    (*work_)(worker);
    if (running_.fetch_sub(1) == 1) {
      running_.notify_all();
    }
  }
}

}  // namespace pheromone::lab
