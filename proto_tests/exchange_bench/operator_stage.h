// A pheromoned with a map for operators: a corner of it is used by the robots of the arena;
// operators change another pheromone, "paint", on the whole map, so that the robots' correct
// answers stay the same.
#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <string_view>

#include "proto_tests/exchange_bench/arena.h"
#include "proto_tests/exchange_bench/fed_watchdog.h"
#include "proto_tests/exchange_bench/http_call.h"
#include "proto_tests/exchange_bench/operators.h"
#include "proto_tests/exchange_bench/server_process.h"
#include "proto_tests/exchange_bench/steady_robots.h"

namespace pheromone::bench {

/// Nodes along a side of a map that has no room in a field of this limit.
int SideBeyond(int field_mib);

class OperatorStage {
 public:
  /// So many nodes along a side of the map. `options` outlives this. The server is not started yet.
  OperatorStage(const OperatorOptions& options, int nodes);
  OperatorStage(const OperatorStage&) = delete;
  OperatorStage& operator=(const OperatorStage&) = delete;
  ~OperatorStage();

  /// Starts a server with an empty journal, replacing one that may be stuck.
  void Restart();

  HttpAnswer Post(std::string_view target, std::string_view body) const;
  HttpAnswer Get(std::string_view target) const;

  /// Reads the configuration again: with another tau of "paint", and `more` appended.
  HttpAnswer Reload(int tau_s, const std::string& more = "");

  /// Paints the map in parts of the maximum size of an edit, until the server refuses one. Returns
  /// the number of nodes painted.
  int Fill() const;

  /// The number behind this key in the server's status; 0 if there is none.
  double StatusNumber(std::string_view key) const;

  int nodes() const { return nodes_; }
  double side_m() const { return (nodes_ - 1) * kCellMm / 1000.0; }
  const std::string& folder() const { return folder_; }
  const ServerProcess& server() const { return *server_; }
  /// The robots start with the first call after a start of the server.
  SteadyRobots& robots();
  FedWatchdog& watchdog() { return watchdog_; }

 private:
  const OperatorOptions& options_;
  const int nodes_;
  const std::string folder_;
  const Arena arena_;
  FedWatchdog watchdog_;
  std::unique_ptr<ServerProcess> server_;
  std::unique_ptr<SteadyRobots> robots_;
};

}  // namespace pheromone::bench
