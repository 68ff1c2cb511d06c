// UDP clients that send as fast as they are answered, each with one request in flight.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "proto_tests/exchange_bench/arena.h"
#include "proto_tests/exchange_bench/quantiles.h"
#include "proto_tests/exchange_bench/tags.h"

namespace pheromone::bench {

enum class Load {
  kEcho,   ///< SENSE requests that come back as they are
  kSense,  ///< SENSE
  kTrace,  ///< TRACE, after a HELLO
  kRoam,   ///< TRACE of the pheromone that evaporates, after a HELLO
  kScan,   ///< SCAN for tags
  kTagRead,
  kTagWrite,    ///< after a HELLO, and a SYMBOL with the client's unique ID
  kTagWriteAll  ///< the same, on one tag after the other, until each has a block
};

/// Of a client on a signed link.
std::array<uint8_t, 16> BenchKey(uint8_t id);

struct LoadOptions {
  Load load = Load::kSense;
  int clients = 64;
  std::vector<uint16_t> ports;  ///< of the links; each takes the next 254 clients
  double seconds = 2;
  const TagSites* tags = nullptr;  ///< for those about tags
  bool is_signed = false;          ///< SENSE: by clients with BenchKey
};

struct LoadResult {
  double per_second = 0;  ///< right answers
  uint64_t right = 0;
  uint64_t wrong = 0;  ///< anything received that was not the answer to the request
  uint64_t lost = 0;   ///< no answer for half a second; the client then sent another request
  uint64_t late = 0;   ///< of the lost: answered after all
  Quantiles times;     ///< from before a request is sent to after its answer was read
};

/// Each client has a socket of its own. Every answer is checked, byte for byte.
LoadResult RunLoad(const Arena& arena, const LoadOptions& options);

}  // namespace pheromone::bench
