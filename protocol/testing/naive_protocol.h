// The frame, CRC and receiving rules a second time, as literally and as wastefully as they can be
// written from protocol/README.md: the oracle that tests and fuzzers hold the real code against. It
// shares nothing with that code but the counters' struct, keeps whole streams and allocates freely.
// Host only.
#pragma once

#include <algorithm>
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

/// A coded frame's bytes after its beginnings, whose number of rows is known, as ROUND, or with
/// another ID as the answer to a signed HELLO; or nothing if there is too much damage: of each row
/// every byte, with every value, is tried.
inline Bytes NaiveReadCoded(uint8_t id, const Bytes& code, size_t rows) {
  const auto p_of = [](const Bytes& row) {
    uint8_t sum = 0;
    for (const uint8_t byte : row) {
      sum = static_cast<uint8_t>(sum ^ byte);
    }
    return sum;
  };
  // The sum of 2^column times each byte, as polynomials over GF(2), modulo 0x11D.
  const auto q_of = [](const Bytes& row) {
    unsigned sum = 0;
    for (size_t column = 0; column < row.size(); ++column) {
      sum ^= static_cast<unsigned>(row[column]) << column;
    }
    for (int bit = 15; bit >= 8; --bit) {
      sum ^= ((sum >> bit) & 1u) != 0 ? 0x11Du << (bit - 8) : 0u;
    }
    return static_cast<uint8_t>(sum);
  };
  std::vector<Bytes> lines(rows + 1, Bytes(8));
  for (size_t i = 0; i < 8 * rows; ++i) {
    lines[i % rows][i / rows] = code[i];
  }
  std::copy_n(code.begin() + static_cast<std::ptrdiff_t>(8 * rows), 8, lines[rows].begin());
  std::vector<size_t> lost;
  for (size_t row = 0; row <= rows; ++row) {
    Bytes& line = lines[row];
    const uint8_t p = code[8 * rows + 8 + row];
    const uint8_t q = code[9 * rows + 9 + row];
    bool good = p_of(line) == p || q_of(line) == q;
    for (size_t at = 0; at < size_t{8} * 256 && !good; ++at) {
      Bytes changed = line;
      changed[at / 256] = static_cast<uint8_t>(at % 256);
      if (p_of(changed) == p && q_of(changed) == q) {
        line = changed;
        good = true;
      }
    }
    if (!good) {
      lost.push_back(row);
    }
  }
  if (!lost.empty()) {  // of several, only the last, and the CRC tells whether the others matter
    for (size_t column = 0; column < 8; ++column) {
      Bytes others;
      for (size_t row = 0; row <= rows; ++row) {
        others.push_back(row == lost.back() ? uint8_t{0} : lines[row][column]);
      }
      lines[lost.back()][column] = p_of(others);
    }
  }
  Bytes body{id, id == 0xFF ? uint8_t{0xF3} : uint8_t{0xF1}};
  for (size_t i = 0; i < 8 * rows; ++i) {
    body.push_back(lines[i % rows][i / rows]);
  }
  // A ROUND's length follows from its sixth byte; if it is signed, six bytes follow its DATA.
  const size_t plain = 6 + size_t{4} * (body[7] % 16u) + body[7] / 16u;
  const size_t of_hello = rows == 5 ? 34 : 15 + 5;
  const std::vector<size_t> lengths =
      id == 0xFF ? std::vector<size_t>{plain, plain + 6} : std::vector<size_t>{of_hello};
  for (const size_t data : lengths) {
    if (data + 2 > 8 * rows) {
      break;
    }
    const Bytes read(body.begin(), body.begin() + static_cast<std::ptrdiff_t>(2 + data));
    if (NaiveCrc16(read) == body[2 + data] + 256u * body[3 + data]) {
      return read;
    }
  }
  return {};
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
    // A DLE is an ID only if it is doubled, as nobody sends it.
    const bool is_dle = at < stream_.size() && stream_[at].byte == 0x10;
    const bool is_doubled = is_dle && at + 1 < stream_.size() && stream_[at + 1].byte == 0x10;
    if (is_doubled ? !GapBefore(at) && IsCoded(at + 1) : !is_dle && IsCoded(at)) {
      return ReadCoded(is_doubled ? at + 1 : at);
    }
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

  // Whether a coded frame begins behind a DLE STX.
  bool IsCoded(size_t at) const {
    if (at + 2 >= stream_.size() || GapBefore(at) || GapBefore(at + 1) || GapBefore(at + 2)) {
      return false;
    }
    const unsigned opcode = stream_[at + 1].byte;
    const unsigned rows = stream_[at + 2].byte % 16u;
    const bool is_said = rows + stream_[at + 2].byte / 16u == 15;
    return is_said && (stream_[at].byte == 0xFF
                           ? (opcode == 0xF4 || opcode == 0xF5) && rows >= 1 && rows <= 8
                           : (opcode == 0xF6 || opcode == 0xF7) && (rows == 3 || rows == 5));
  }

  size_t ReadCoded(size_t at) {
    protocol::DecoderCounters& counters = result_.counters;
    const bool first = stream_[at + 1].byte % 2 == 0;
    const uint8_t id = stream_[at].byte == 0x00 ? uint8_t{0x10} : stream_[at].byte;
    const size_t rows = stream_[at + 2].byte % 16;
    at += 3;
    const size_t begin = at + (first ? 5 : 0);
    const size_t end = begin + 10 * (rows + 1);
    Bytes code;
    for (; at < end; ++at) {
      if (at == stream_.size()) {
        result_.frame_open = true;
        return at;
      }
      if (GapBefore(at)) {
        ++counters.timeouts;
        return at;
      }
      if (at >= begin) {
        code.push_back(stream_[at].byte);
      }
    }
    const Bytes body = NaiveReadCoded(id, code, rows);
    if (body.empty()) {
      ++counters.crc_errors;
    } else {
      ++counters.frames;
      result_.bodies.push_back(body);
    }
    return end;
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
