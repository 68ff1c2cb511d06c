// ARCOS packets by the letter of its description, slowly and with the whole packet at hand: what
// the tests and the fuzzer of pioneer_packet.h compare with. For tests only.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace pheromone {
namespace client {

using Bytes = std::vector<uint8_t>;

/// From "fa fb 03".
inline Bytes Hex(const std::string& text) {
  Bytes bytes;
  for (size_t at = 0; at + 1 < text.size(); at += 3) {
    bytes.push_back(static_cast<uint8_t>(std::stoul(text.substr(at, 2), nullptr, 16)));
  }
  return bytes;
}

/// Pairs, high byte first, are added up; a last byte alone is xored into the low byte.
inline unsigned NaiveChecksum(const Bytes& body) {
  unsigned sum = 0;
  for (size_t at = 0; at + 1 < body.size(); at += 2) {
    sum = (sum + body[at] * 256u + body[at + 1]) % 65536u;
  }
  return body.size() % 2 == 0 ? sum : sum ^ body.back();
}

inline Bytes NaivePacket(const Bytes& body) {
  Bytes packet = {0xFA, 0xFB, static_cast<uint8_t>(body.size() + 2)};
  packet.reserve(body.size() + 5);
  for (const uint8_t byte : body) {  // g++ 12 takes an insert here for an overrun
    packet.push_back(byte);
  }
  packet.push_back(static_cast<uint8_t>(NaiveChecksum(body) / 256));
  packet.push_back(static_cast<uint8_t>(NaiveChecksum(body) % 256));
  return packet;
}

/// The bodies of all packets in a stream without pauses. After FA FB and a count of 0 to 2, and
/// after a packet with a wrong checksum, the search goes on with the next byte.
inline std::vector<Bytes> NaiveBodies(const Bytes& stream) {
  std::vector<Bytes> bodies;
  size_t at = 0;
  while (at + 2 < stream.size()) {
    if (stream[at] != 0xFA || stream[at + 1] != 0xFB) {
      ++at;
      continue;
    }
    const size_t count = stream[at + 2];
    if (count < 3) {
      at += 3;
      continue;
    }
    if (at + 3 + count > stream.size()) {
      break;
    }
    const auto begin = stream.begin() + static_cast<std::ptrdiff_t>(at) + 3;
    const Bytes body(begin, begin + static_cast<std::ptrdiff_t>(count) - 2);
    at += 3 + count;
    if (stream[at - 2] * 256u + stream[at - 1] == NaiveChecksum(body)) {
      bodies.push_back(body);
    }
  }
  return bodies;
}

/// The body of a SIP.
struct Sip {
  uint8_t type = 0x33;
  uint16_t x = 0;
  uint16_t y = 0;
  uint16_t th = 0;
  uint16_t stall = 0;
  uint16_t flags = 0x0001;                       ///< motors on
  std::vector<std::pair<int, int>> sonars = {};  ///< number, mm
  size_t size = 38;  ///< bytes of the body kept, as of firmware that knows only so many

  Bytes Body() const {
    const auto low = [](uint16_t word) { return static_cast<uint8_t>(word % 256); };
    const auto high = [](uint16_t word) { return static_cast<uint8_t>(word / 256); };
    Bytes body = {type,       low(x),      high(x), low(y), high(y),    low(th),
                  high(th),   0x11,        0x22,    0x33,   0x44,       125,
                  low(stall), high(stall), 0x55,    0x66,   low(flags), high(flags)};
    body.resize(19);  // and the compass
    body.push_back(static_cast<uint8_t>(sonars.size()));
    for (const auto& [number, mm] : sonars) {
      body.push_back(static_cast<uint8_t>(number));
      body.push_back(static_cast<uint8_t>(mm % 256));
      body.push_back(static_cast<uint8_t>(mm / 256));
    }
    body.resize(body.size() + 18);  // the rest of new firmware
    body.resize(std::min(body.size(), size + 3 * sonars.size()));
    return body;
  }
};

}  // namespace client
}  // namespace pheromone
