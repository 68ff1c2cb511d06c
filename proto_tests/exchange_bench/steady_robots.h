// Robots that send fifty requests a second, whatever happens to the server, to measure the effect
// of an operator on their answers.
//
//   SteadyRobots robots(arena, {folder + "/pty-1", folder + "/pty-2"}, server.PortOf("udp-1"));
//   std::this_thread::sleep_for(...);
//   std::vector<SteadyResult> results = robots.Take();   // since the last time, or the start
//
// Four of them: one that SENSEs and one that TRACEs over a pty each, and two over UDP. They run in
// a thread of their own until their owner ends.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "proto_tests/exchange_bench/arena.h"
#include "proto_tests/exchange_bench/quantiles.h"

namespace pheromone::bench {

struct SteadyResult {
  std::string robot;  ///< "SENSE over a pty"
  /// From the first request without an answer to the answer, and what each request that was not
  /// made meanwhile would have waited. What still waits for one counts with its time so far.
  Quantiles times = {};
  uint64_t right = 0;
  uint64_t wrong = 0;
  uint64_t lost = 0;     ///< no answer for half a second; the robot then sent another request
  uint64_t late = 0;     ///< of the lost: answered after all
  uint64_t refused = 0;  ///< answered with an ERROR, and asked again
  uint64_t stops = 0;    ///< half a second without a right answer: the fail-safe stops the robot
};

class SteadyRobots {
 public:
  /// Ends this process if a link does not answer. `arena` outlives this.
  SteadyRobots(const Arena& arena, const std::array<std::string, 2>& ptys, uint16_t udp_port);
  SteadyRobots(const SteadyRobots&) = delete;
  SteadyRobots& operator=(const SteadyRobots&) = delete;
  ~SteadyRobots();

  /// What happened since the last call.
  std::vector<SteadyResult> Take();

  /// Waits until each robot has a right answer to something that it asked from now on; false if one
  /// has none after `patience`.
  bool AwaitAnswers(std::chrono::milliseconds patience);

 private:
  class Robot;

  void Run();

  std::mutex mutex_;  // guards robots_
  std::vector<std::unique_ptr<Robot>> robots_;
  std::atomic<bool> stopping_ = false;
  std::thread thread_;
};

}  // namespace pheromone::bench
