// The frame decoder against the naive one, over any bytes at any times, one by one and in blocks.
// The first byte of the input chooses the gap timeout; then each byte follows a byte that says how
// long after the one before.

#include <cstdint>
#include <vector>

#include "proto_tests/fuzz/require.h"
#include "protocol/testing/listen.h"
#include "protocol/testing/naive_protocol.h"

namespace {

using pheromone::fuzz::Require;

// As a link hears it: what came at one time is a block, before which there is a look at the clock.
// The counts of the blocks add up to those of all.
pheromone::testing::Heard ListenToBlocks(const std::vector<pheromone::testing::TimedByte>& stream,
                                         uint16_t gap_ms) {
  pheromone::protocol::FrameDecoder decoder(gap_ms);
  pheromone::testing::Heard heard;
  for (size_t at = 0; at < stream.size();) {
    const uint32_t now_ms = stream[at].at_ms;
    pheromone::testing::Bytes block;
    for (; at < stream.size() && stream[at].at_ms == now_ms; ++at) {
      block.push_back(stream[at].byte);
    }
    const pheromone::protocol::DecoderCounters before = decoder.counters();
    decoder.Expire(now_ms);
    decoder.PushBlock(block.data(), block.size(), now_ms,
                      [&heard](const pheromone::protocol::Message& message) {
                        heard.bodies.push_back(pheromone::testing::ToBody(message));
                      });
    heard.counters += decoder.counters() - before;
  }
  heard.frame_open = decoder.frame_open();
  return heard;
}

}  // namespace

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
  Require(Agree(pheromone::testing::Listen(stream, gap_ms), naive));
  Require(Agree(ListenToBlocks(stream, gap_ms), naive));
  return 0;
}
