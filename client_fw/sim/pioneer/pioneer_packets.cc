#include "client_fw/sim/pioneer/pioneer_packets.h"

#include <algorithm>
#include <cassert>
#include <iterator>

namespace pheromone::sim {
namespace {

constexpr size_t kBeforeId = 3;  // header and count
constexpr size_t kMinCount = 3;  // an id and the checksum
constexpr size_t kChecksumSize = 2;
constexpr uint8_t kPositive = 0x3B;
constexpr uint8_t kNegative = 0x1B;

}  // namespace

uint16_t PacketChecksum(std::span<const uint8_t> bytes) {
  uint32_t sum = 0;
  size_t i = 0;
  for (; i + 1 < bytes.size(); i += 2) {
    sum += static_cast<uint32_t>(bytes[i] << 8 | bytes[i + 1]);
  }
  if (i < bytes.size()) {
    sum ^= bytes[i];
  }
  return static_cast<uint16_t>(sum);
}

std::vector<uint8_t> MakePacket(uint8_t id, std::span<const uint8_t> data) {
  assert(data.size() + kMinCount <= UINT8_MAX);
  std::vector<uint8_t> packet = {kPioneerHeader[0], kPioneerHeader[1],
                                 static_cast<uint8_t>(data.size() + kMinCount), id};
  // One by one: for a vector this short, g++ 12 at -O3 warns of insert().
  std::copy(data.begin(), data.end(), std::back_inserter(packet));
  const uint16_t checksum = PacketChecksum(std::span(packet).subspan(kBeforeId));
  packet.push_back(static_cast<uint8_t>(checksum >> 8));
  packet.push_back(static_cast<uint8_t>(checksum));
  return packet;
}

std::optional<int> PacketArgument(const Packet& packet) {
  const std::vector<uint8_t>& data = packet.data;
  if (data.empty() || data.size() == 2 || (data[0] != kPositive && data[0] != kNegative)) {
    return std::nullopt;
  }
  const int magnitude = data.size() == 1 ? 0 : data[1] | data[2] << 8;
  return data[0] == kNegative ? -magnitude : magnitude;
}

void PacketReader::Push(std::span<const uint8_t> bytes) {
  bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
}

std::optional<Packet> PacketReader::Next() {
  std::optional<Packet> packet;
  size_t at = 0;
  for (; at < bytes_.size() && !packet; ++at) {
    const auto rest = std::span(bytes_).subspan(at);
    const size_t header = std::min(rest.size(), sizeof kPioneerHeader);
    if (!std::equal(rest.begin(), rest.begin() + static_cast<ptrdiff_t>(header), kPioneerHeader)) {
      continue;
    }
    if (rest.size() < kBeforeId) {
      break;
    }
    const size_t count = rest[2];
    if (count < kMinCount || count > kMaxPioneerCount) {
      continue;
    }
    if (rest.size() < kBeforeId + count) {
      break;
    }
    const auto body = rest.subspan(kBeforeId, count - kChecksumSize);
    const auto checksum = rest.subspan(kBeforeId + body.size(), kChecksumSize);
    if (PacketChecksum(body) != (checksum[0] << 8 | checksum[1])) {
      ++bad_checksums_;
      continue;
    }
    packet = Packet{body[0], {body.begin() + 1, body.end()}};
    at += kBeforeId + count - 1;
  }
  bytes_.erase(bytes_.begin(), bytes_.begin() + static_cast<ptrdiff_t>(at));
  return packet;
}

}  // namespace pheromone::sim
