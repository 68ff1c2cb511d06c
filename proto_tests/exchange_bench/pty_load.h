// Clients on ptys at the pace of a modem: how long the server takes from a request's last byte to
// the first one of its answer.
#pragma once

#include <string>
#include <vector>

#include "proto_tests/exchange_bench/arena.h"
#include "proto_tests/exchange_bench/quantiles.h"

namespace pheromone::bench {

struct PtyLoadOptions {
  bool trace = false;
  int baud = 9600;                ///< a byte takes ten bits
  std::vector<std::string> ptys;  ///< each with one client, whose ID is 1
  double seconds = 10;
  size_t bytes_at_once = 1;  ///< that a port hands over together, but for a request's last ones
};

struct PtyLoadResult {
  Quantiles times;
  uint64_t wrong = 0;
  uint64_t lost = 0;  ///< no answer for a second; the client then sent another request
  uint64_t late = 0;  ///< of the lost: answered after all
};

/// Bytes are written when a port would have received and handed them over, and after an answer the
/// client pauses for the time that sending it would have taken. Every answer is checked, byte for
/// byte.
PtyLoadResult RunPtyLoad(const Arena& arena, const PtyLoadOptions& options);

}  // namespace pheromone::bench
