// The strict streaming decoder: bytes in, messages out. It holds one body, allocates nothing, and
// takes the time as an argument.
//
//   FrameDecoder decoder(20);                       // gap timeout of a UART, ms
//   if (decoder.Push(byte, now_ms)) Use(decoder.message());
//
// Rules (protocol/README.md, "Receiving"):
//  * inside a frame, only DLE, STX and ETX may follow a DLE; anything else discards the frame;
//  * DLE STX starts afresh in any state;
//  * a frame is delivered only if its CRC is right and neither ID nor opcode is 0;
//  * a gap between two bytes of one frame longer than the timeout discards the frame.
// Nothing is ever answered or delivered for what was discarded: it is counted, and that is all.
//
// The rules are carried out by FrameParser (frame_parser.h), which a robot may use by itself.
//
// Trust: bytes may come from anyone. Memory is bounded by kMaxBody; no input makes the decoder read
// or write outside of it.
#pragma once

#include <stddef.h>
#include <stdint.h>

#include "protocol/frame.h"
#include "protocol/frame_parser.h"

namespace pheromone {
namespace protocol {

/// What happened to the bytes so far. Each frame that was begun is counted once, by how it ended;
/// each byte outside of frames is in ignored_bytes. The counters wrap.
struct DecoderCounters {   // plain memory: DecoderCounters() is all zero
  uint32_t frames;         ///< delivered
  uint32_t crc_errors;     ///< complete, but damaged
  uint32_t bad_escapes;    ///< DLE followed by something illegal
  uint32_t oversize;       ///< more than kMaxBody bytes
  uint32_t runts;          ///< complete, but shorter than ID, OPCODE and CRC
  uint32_t refused;        ///< CRC right, but ID 0 or opcode 0: a line of zero bytes
  uint32_t restarts;       ///< DLE STX inside a frame
  uint32_t timeouts;       ///< a gap inside a frame
  uint32_t ignored_bytes;  ///< bytes outside of frames
};

/// Calls `use(&one of a's counters, the same one of b's)` for each counter.
template <typename Use>
void ForEachCounter(DecoderCounters* a, const DecoderCounters& b, Use&& use) {
  static_assert(sizeof(DecoderCounters) == 9 * sizeof(uint32_t), "a counter is missing here");
  use(&a->frames, b.frames);
  use(&a->crc_errors, b.crc_errors);
  use(&a->bad_escapes, b.bad_escapes);
  use(&a->oversize, b.oversize);
  use(&a->runts, b.runts);
  use(&a->refused, b.refused);
  use(&a->restarts, b.restarts);
  use(&a->timeouts, b.timeouts);
  use(&a->ignored_bytes, b.ignored_bytes);
}

inline DecoderCounters& operator+=(DecoderCounters& sum, const DecoderCounters& more) {
  ForEachCounter(&sum, more, [](uint32_t* a, uint32_t b) { *a += b; });
  return sum;
}

/// What happened since `before`, also if a counter has wrapped.
inline DecoderCounters operator-(DecoderCounters now, const DecoderCounters& before) {
  ForEachCounter(&now, before, [](uint32_t* a, uint32_t b) { *a -= b; });
  return now;
}

/// Counts what a byte did.
void Tally(FrameParser::Result event, DecoderCounters* counters);

/// Counts a gap timeout and discards what `parser` has open, if anything.
void TimeOut(FrameParser* parser, DecoderCounters* counters);

class FrameDecoder {
 public:
  /// `gap_timeout_ms`: the longest silence inside a frame; kNoGapTimeout for links that cannot lose
  /// bytes and may dribble them (pty).
  explicit FrameDecoder(uint16_t gap_timeout_ms) : gap_timeout_ms_(gap_timeout_ms) {}

  /// Takes one byte read at `now_ms` (any clock that does not run backwards; it may wrap). Returns
  /// true when this byte completes a valid frame; message() is then good until the next call.
  bool Push(uint8_t byte, uint32_t now_ms);

  /// Takes a block read at once and calls `on_message(const Message&)` for each frame in it.
  template <typename OnMessage>
  void PushBlock(const uint8_t* bytes, size_t size, uint32_t now_ms, OnMessage&& on_message) {
    for (size_t i = 0; i < size; ++i) {
      if (Push(bytes[i], now_ms)) {
        on_message(static_cast<const Message&>(message_));
      }
    }
  }

  /// Discards an open frame whose gap timeout has passed at `now_ms`. Push does this by itself;
  /// call it when it matters that the channel is free again without another byte.
  void Expire(uint32_t now_ms);

  /// Between DLE STX and the frame's end: a station is sending.
  bool frame_open() const { return parser_.open(); }

  /// What is open, and since when nothing has been added to it: for who records a line from the
  /// middle of a frame on.
  const FrameParser& parser() const { return parser_; }
  uint32_t last_byte_ms() const { return last_byte_ms_; }

  const Message& message() const { return message_; }
  const DecoderCounters& counters() const { return counters_; }

 private:
  Message message_;
  DecoderCounters counters_ = {};
  uint32_t last_byte_ms_ = 0;
  uint16_t gap_timeout_ms_;
  FrameParser parser_;
};

}  // namespace protocol
}  // namespace pheromone
