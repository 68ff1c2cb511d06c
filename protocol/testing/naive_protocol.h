// The frame, CRC and receiving rules a second time, as literally and as wastefully as they can be
// written from protocol/README.md: the oracle that tests and fuzzers hold the real code against. It
// shares nothing with that code but the counters' struct, keeps whole streams and allocates freely.
// Host only.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "protocol/decoder.h"
#include "protocol/testing/vectors.h"

namespace pheromone::testing {

/// x16 + x15 + x2 + 1, reflected, start 0, bit by bit.
inline uint16_t NaiveCrc16(const Bytes& bytes) {
  unsigned crc = 0;
  for (const uint8_t byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) {
      const bool carry = (crc & 1u) != 0;
      crc >>= 1;
      if (carry) {
        crc ^= 0xA001u;
      }
    }
  }
  return static_cast<uint16_t>(crc);
}

/// The frame around ID, OPCODE and DATA.
inline Bytes NaiveEncode(const Bytes& body) {
  Bytes plain = body;
  const uint16_t crc = NaiveCrc16(body);
  plain.push_back(static_cast<uint8_t>(crc % 256));
  plain.push_back(static_cast<uint8_t>(crc / 256));
  Bytes wire{0x10, 0x02};
  for (const uint8_t byte : plain) {
    wire.insert(wire.end(), byte == 0x10 ? 2 : 1, byte);
  }
  wire.push_back(0x10);
  wire.push_back(0x03);
  return wire;
}

struct TimedByte {
  uint8_t byte = 0;
  uint32_t at_ms = 0;
};

struct NaiveResult {
  std::vector<Bytes> bodies;  ///< ID, OPCODE, DATA of what is delivered
  protocol::DecoderCounters counters = {};
  uint32_t starts = 0;      ///< DLE STX seen
  bool frame_open = false;  ///< the last of them has not ended
  bool lone_dle = false;    ///< the last byte is a DLE outside of a frame
};

/// Reads a whole stream by its indices. `gap_timeout_ms` 0: no timeout.
class NaiveDecoder {
 public:
  NaiveDecoder(const std::vector<TimedByte>& stream, uint32_t gap_timeout_ms)
      : stream_(stream), gap_timeout_ms_(gap_timeout_ms) {}

  NaiveResult Run() {
    size_t at = 0;
    while (at < stream_.size()) {
      const bool dle = stream_[at].byte == 0x10;
      if (dle && at + 1 == stream_.size()) {
        result_.lone_dle = true;
        return result_;
      }
      if (dle && stream_[at + 1].byte == 0x02 && !GapBefore(at + 1)) {
        ++result_.starts;
        at = ReadFrame(at + 2);
      } else {
        ++result_.counters.ignored_bytes;
        ++at;
      }
    }
    return result_;
  }

 private:
  bool GapBefore(size_t at) const {
    return gap_timeout_ms_ != 0 && stream_[at].at_ms - stream_[at - 1].at_ms > gap_timeout_ms_;
  }

  // From behind a DLE STX; returns where to go on.
  size_t ReadFrame(size_t at) {
    protocol::DecoderCounters& counters = result_.counters;
    Bytes inside;
    while (at < stream_.size()) {
      if (GapBefore(at)) {
        ++counters.timeouts;
        return at;
      }
      if (stream_[at].byte != 0x10) {
        inside.push_back(stream_[at].byte);
        at += 1;
      } else if (at + 1 == stream_.size()) {
        break;
      } else if (GapBefore(at + 1)) {
        ++counters.timeouts;
        return at + 1;
      } else if (stream_[at + 1].byte == 0x10) {
        inside.push_back(0x10);
        at += 2;
      } else if (stream_[at + 1].byte == 0x02) {
        ++counters.restarts;
        return at;
      } else if (stream_[at + 1].byte == 0x03) {
        Finish(inside);
        return at + 2;
      } else {
        ++counters.bad_escapes;
        return at + 2;
      }
      if (inside.size() > 68) {
        ++counters.oversize;
        return at;
      }
    }
    result_.frame_open = true;
    return stream_.size();
  }

  void Finish(const Bytes& inside) {
    protocol::DecoderCounters& counters = result_.counters;
    if (inside.size() < 4) {
      ++counters.runts;
      return;
    }
    Bytes body = inside;
    body.resize(inside.size() - 2);
    const unsigned sent = inside[inside.size() - 2] + 256u * inside[inside.size() - 1];
    if (NaiveCrc16(body) != sent) {
      ++counters.crc_errors;
    } else if (body[0] == 0 || body[1] == 0) {
      ++counters.refused;
    } else {
      ++counters.frames;
      result_.bodies.push_back(body);
    }
  }

  const std::vector<TimedByte>& stream_;
  const uint32_t gap_timeout_ms_;
  NaiveResult result_;
};

}  // namespace pheromone::testing
