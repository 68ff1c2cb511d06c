// The frame decoder against the naive one, over any bytes at any times. The first byte of the input
// chooses the gap timeout; then each byte follows a byte that says how long after the one before.

#include <cstdint>
#include <cstdlib>
#include <vector>

#include "protocol/testing/listen.h"
#include "protocol/testing/naive_protocol.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size == 0) {
    return 0;
  }
  const auto gap_ms = static_cast<uint16_t>(data[0] % 64);
  std::vector<pheromone::testing::TimedByte> stream;
  uint32_t now_ms = 0xFFFFFFF0u;  // the clock wraps soon
  for (size_t i = 1; i + 1 < size; i += 2) {
    now_ms += data[i] % 64;
    stream.push_back({data[i + 1], now_ms});
  }
  const pheromone::testing::NaiveResult naive =
      pheromone::testing::NaiveDecoder(stream, gap_ms).Run();
  if (!Agree(pheromone::testing::Listen(stream, gap_ms), naive)) {
    std::abort();
  }
  return 0;
}
