// Packets of ARCOS, the protocol of Pioneer robots (AROS and P2OS before it), decoded and encoded
// on the robot's side.
//
//   FA FB | N | id | data ... | checksum, high byte first       N = bytes after itself, at least 3
//
//   PacketReader reader;
//   reader.Push(bytes);                           // as they come: pieces, several at once, rubbish
//   while (std::optional<Packet> packet = reader.Next()) { ... }
//   Send(MakePacket(0x32, data));
//
// 16-bit values in the data are little-endian. A packet with a wrong checksum is dropped silently,
// as by the robot, and the bytes after its first one are searched again, so that a truncated packet
// does not affect others. A count under 3 or over 200 is invalid (the sources disagree about the
// limit: 200, 204, 249). There is no timeout inside a packet. No errors; one thread.
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
/// Empty if there is none, or an incomplete one, or one of another type; a type byte without
/// magnitude is 0.
std::optional<int> PacketArgument(const Packet& packet);

class PacketReader {
 public:
  void Push(std::span<const uint8_t> bytes);
  /// The next valid packet; empty until more bytes come.
  std::optional<Packet> Next();
  /// Drops an incomplete packet.
  void Clear() { bytes_.clear(); }

  uint64_t bad_checksums() const { return bad_checksums_; }

 private:
  std::vector<uint8_t> bytes_;  // not yet looked at, from the first that may begin a packet
  uint64_t bad_checksums_ = 0;
};

}  // namespace pheromone::sim
