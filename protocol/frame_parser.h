// The strict receiver without a clock and without counters: one byte in, what it meant out. This is
// all that a robot can afford; FrameDecoder (decoder.h) adds time, counters and messages.
//
//   FrameParser parser;
//   if (parser.Push(byte) == FrameParser::kFrame) Use(parser.body(), parser.size());
//
// The rules are those of decoder.h; the gap timeout is the caller's: it calls Abort().
//
// A coded frame is delivered as the ROUND, or answer to a signed HELLO, that it stands for.
//
// Trust: bytes may come from anyone. Memory is bounded; no input makes the parser read or write
// outside of it.
#pragma once

#include <stdint.h>

#include "protocol/coded_frame.h"
#include "protocol/frame.h"

namespace pheromone {
namespace protocol {

class FrameParser {
 public:
  /// What the byte did.
  enum Result : uint8_t {
    kNothing,      ///< it is part of a frame, or may be
    kFrame,        ///< it completed a valid frame
    kCrcError,     ///< it completed a damaged one
    kBadEscape,    ///< DLE followed by something illegal: discarded
    kOversize,     ///< more than kMaxBody bytes: discarded
    kRunt,         ///< complete, but shorter than ID, OPCODE and CRC
    kRefused,      ///< CRC right, but ID 0 or opcode 0: a line of zero bytes
    kRestart,      ///< DLE STX inside a frame: that one is discarded, another begins
    kIgnored,      ///< one byte outside of frames
    kIgnoredPair,  ///< this one and the DLE before it
  };

  Result Push(uint8_t byte);

  /// Discards what is open.
  void Abort() {
    open_ = false;
    escaped_ = false;
    coded_left_ = 0;
  }

  /// Between DLE STX and the frame's end: a station is sending.
  bool open() const { return open_; }
  /// Nothing is open, not even a DLE.
  bool idle() const { return !open_ && !escaped_; }
  /// The last byte was a DLE that waits for its second half.
  bool escaped() const { return escaped_; }

  /// What is open is a coded frame, whose body is not known before its end.
  bool coded() const { return coded_left_ != 0; }

  /// After kFrame and until the next Push: ID, OPCODE, DATA and CRC, unstuffed; at least 4 bytes.
  /// While a frame is open: what has come of it.
  const uint8_t* body() const { return body_; }
  uint8_t size() const { return size_; }

 private:
  Result Take(uint8_t byte);
  bool BeginsCoded() const;
  Result TakeCoded(uint8_t byte);
  Result Judge() const;

  bool open_ = false;
  bool escaped_ = false;
  uint8_t size_ = 0;
  uint8_t coded_left_ = 0;                      // bytes of a coded frame that are still to come
  uint8_t body_[2 + CodedSize(kMaxCodedRows)];  // the first size_ bytes mean something
};

}  // namespace protocol
}  // namespace pheromone
