// Runs the real decoder and the naive one over the same bytes. Host only.
#pragma once

#include <tuple>
#include <vector>

#include "protocol/decoder.h"
#include "protocol/testing/naive_protocol.h"
#include "protocol/testing/vectors.h"

namespace pheromone::testing {

/// What a decoder made of a stream.
struct Heard {
  std::vector<Bytes> bodies;
  protocol::DecoderCounters counters = {};
  bool frame_open = false;
};

inline void Append(const Bytes& bytes, uint32_t at_ms, std::vector<TimedByte>* to) {
  for (const uint8_t byte : bytes) {
    to->push_back({byte, at_ms});
  }
}

/// The real decoder, one byte at a time.
inline Heard Listen(const std::vector<TimedByte>& stream, uint16_t gap_timeout_ms) {
  protocol::FrameDecoder decoder(gap_timeout_ms);
  Heard heard;
  for (const TimedByte& timed : stream) {
    if (decoder.Push(timed.byte, timed.at_ms)) {
      heard.bodies.push_back(ToBody(decoder.message()));
    }
  }
  heard.counters = decoder.counters();
  heard.frame_open = decoder.frame_open();
  return heard;
}

/// The same for bytes that arrive without a pause.
inline Heard Listen(const Bytes& bytes, uint16_t gap_timeout_ms) {
  std::vector<TimedByte> stream;
  Append(bytes, 0, &stream);
  return Listen(stream, gap_timeout_ms);
}

inline auto Tie(const protocol::DecoderCounters& c) {
  return std::tie(c.frames, c.crc_errors, c.bad_escapes, c.oversize, c.runts, c.refused, c.restarts,
                  c.timeouts, c.ignored_bytes);
}

/// Whether the real decoder heard exactly what the naive one reads: the same messages, the same
/// counts, the same frame left open.
inline bool Agree(const Heard& heard, const NaiveResult& naive) {
  return heard.bodies == naive.bodies && Tie(heard.counters) == Tie(naive.counters) &&
         heard.frame_open == naive.frame_open;
}

}  // namespace pheromone::testing
