// Packets of ARCOS, the protocol of Pioneer robots (AROS and P2OS before it), as the robot's side
// cuts them out of a line and puts them onto it.
//
//   FA FB | N | id | data ... | checksum, high byte first       N = bytes after itself, at least 3
//
//   PacketReader reader;
//   reader.Push(bytes);                           // as they come: pieces, several at once, rubbish
//   while (std::optional<Packet> packet = reader.Next()) { ... }
//   Send(MakePacket(0x32, data));
//
// 16-bit values in the data are little-endian. A packet with a wrong checksum is dropped without a
// word, as the robot does, and what follows its first byte is searched again, so that a cut packet
// costs nothing but itself. A count under 3 or over 200 is no packet (the sources disagree about
// the limit: 200, 204, 249). There is no timeout inside a packet. No errors; one thread.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace pheromone::sim {

constexpr uint8_t kPioneerHeader[] = {0xFA, 0xFB};
constexpr size_t kMaxPioneerCount = 200;

struct Packet {
  uint8_t id = 0;
  std::vector<uint8_t> data;
};

/// Of id and data: successive bytes in pairs, the first one high, are added modulo 65536; a last
/// odd byte is xored into the low byte.
uint16_t PacketChecksum(std::span<const uint8_t> bytes);

/// Requires at most 252 bytes of data.
std::vector<uint8_t> MakePacket(uint8_t id, std::span<const uint8_t> data);

/// The numeric argument of a command: a type byte, 0x3B or 0x1B for negative, and a magnitude.
/// Nothing if there is none, or half of one, or it is of another type; a type byte without
/// magnitude is 0.
std::optional<int> PacketArgument(const Packet& packet);

class PacketReader {
 public:
  void Push(std::span<const uint8_t> bytes);
  /// The next good packet; nothing until more bytes come.
  std::optional<Packet> Next();
  /// Forgets a packet that has begun.
  void Clear() { bytes_.clear(); }

  uint64_t bad_checksums() const { return bad_checksums_; }

 private:
  std::vector<uint8_t> bytes_;  // not yet looked at, from the first that may begin a packet
  uint64_t bad_checksums_ = 0;
};

}  // namespace pheromone::sim
