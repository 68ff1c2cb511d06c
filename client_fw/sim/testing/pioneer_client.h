// What the tests of the simulated Pioneer share: the client's end of the line, written from the
// protocol's description and independent of what is tested.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <string>
#include <vector>

#include "client_fw/sim/pioneer/pioneer_robot.h"

namespace pheromone::sim::testing {

using Bytes = std::vector<uint8_t>;

/// "fa fb 03" to bytes.
inline Bytes Hex(const std::string& text) {
  Bytes bytes;
  for (size_t i = 0; i + 1 < text.size(); i += 3) {
    bytes.push_back(static_cast<uint8_t>(std::stoi(text.substr(i, 2), nullptr, 16)));
  }
  return bytes;
}

inline Bytes operator+(Bytes a, const Bytes& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

/// Header, count and checksum around an id and its data, the sum as the manual puts it: over pairs,
/// with the number of bytes counted down.
inline Bytes Framed(const Bytes& id_and_data) {
  Bytes frame = {0xFA, 0xFB, static_cast<uint8_t>(id_and_data.size() + 2)};
  frame = frame + id_and_data;
  int sum = 0;
  size_t left = id_and_data.size();
  const uint8_t* next = id_and_data.data();
  while (left > 1) {
    sum += next[0] * 256 + next[1];
    sum %= 65536;
    next += 2;
    left -= 2;
  }
  if (left > 0) {
    sum ^= next[0];
  }
  return frame + Bytes{static_cast<uint8_t>(sum / 256), static_cast<uint8_t>(sum % 256)};
}

inline Bytes Command(int id) {
  return Framed({static_cast<uint8_t>(id)});
}

inline Bytes Command(int id, int argument) {
  const int size = std::abs(argument);
  return Framed({static_cast<uint8_t>(id), static_cast<uint8_t>(argument < 0 ? 0x1B : 0x3B),
                 static_cast<uint8_t>(size % 256), static_cast<uint8_t>(size / 256)});
}

enum Id {
  kPulse = 0,
  kOpen = 1,
  kClose = 2,
  kEnable = 4,
  kSetA = 5,
  kSetV = 6,
  kSetO = 7,
  kMove = 8,
  kRotate = 9,
  kSetRv = 10,
  kVel = 11,
  kHead = 12,
  kDHead = 13,
  kConfig = 18,
  kEncoder = 19,
  kRvel = 21,
  kSetRa = 23,
  kSonar = 28,
  kStop = 29,
  kVel2 = 32,
  kIoRequest = 40,
  kHostBaud = 50,
  kEStop = 55,
};

/// Cuts what the robot sent, which has to be packets without gaps and with good sums.
inline std::vector<Bytes> Packets(const Bytes& bytes) {
  std::vector<Bytes> packets;
  for (size_t at = 0; at < bytes.size();) {
    const size_t size = at + 2 < bytes.size() ? bytes[at + 2] + size_t{3} : 0;
    if (size < 6 || at + size > bytes.size()) {
      ADD_FAILURE() << "half a packet at " << at;
      break;
    }
    const Bytes packet(bytes.begin() + static_cast<ptrdiff_t>(at),
                       bytes.begin() + static_cast<ptrdiff_t>(at + size));
    EXPECT_EQ(Framed({packet.begin() + 3, packet.end() - 2}), packet);
    packets.push_back(packet);
    at += size;
  }
  return packets;
}

/// A SIP by its offsets in the frame.
struct Sip {
  explicit Sip(Bytes packet) : bytes(std::move(packet)) {}
  int byte(size_t at) const { return bytes.at(at); }
  int word(size_t at) const { return bytes.at(at) | bytes.at(at + 1) << 8; }
  int signed_word(size_t at) const { return static_cast<int16_t>(word(at)); }

  bool moving() const { return byte(3) == 0x33; }
  int x() const { return word(4); }
  int y() const { return word(6); }
  int heading() const { return signed_word(8); }
  int left() const { return signed_word(10); }
  int right() const { return signed_word(12); }
  int stall() const { return word(15); }
  int setpoint() const { return signed_word(17); }
  int flags() const { return word(19); }
  bool motors() const { return (flags() & 1) != 0; }
  int sonars() const { return byte(22); }

  Bytes bytes;
};

inline bool IsSip(const Bytes& packet) {
  return packet[3] == 0x32 || packet[3] == 0x33;
}

/// A robot and the client's end of its line, in virtual time.
class Client {
 public:
  explicit Client(const PioneerConfig& config = {}, const PlanePose& start = {})
      : robot_(config, start) {}

  /// Sends, and returns what the robot answers at once, but for SIPs, which are kept.
  Bytes Send(const Bytes& bytes) {
    robot_.OnBytes(bytes, now_ms_ * 1'000'000);
    return Collect();
  }
  Bytes Send(int id) { return Send(Command(id)); }
  Bytes Send(int id, int argument) { return Send(Command(id, argument)); }

  /// Lets time pass, in silence.
  void Wait(int64_t ms) { WaitForOthers(ms); }
  /// The same; returns the packets that came, but for SIPs, which are kept.
  Bytes WaitForOthers(int64_t ms) {
    Bytes others;
    for (const int64_t end_ms = now_ms_ + ms; now_ms_ < end_ms;) {
      now_ms_ = std::min(now_ms_ + 1000, end_ms);
      robot_.AdvanceTo(now_ms_ * 1'000'000);
      others = others + Collect();
    }
    return others;
  }
  /// Lets time pass with a PULSE every half a second.
  void Drive(int64_t ms) {
    for (; ms > 0; ms -= 500) {
      Wait(ms < 500 ? ms : 500);
      Send(kPulse);
    }
  }

  void Connect() {
    Send(0);
    Send(1);
    Send(2);
    Send(kOpen);
  }
  void ConnectAndEnable() {
    Connect();
    Send(kEnable, 1);
    Send(kSonar, 0);
  }

  /// The state now, rather than at the last SIP.
  double speed_mm_s() const { return robot_.drive().motion().speed_m_s * 1000; }
  double turn_deg_s() const { return robot_.drive().motion().turn_rad_s * 57.29577951308232; }
  const std::vector<Sip>& sips() const { return sips_; }
  const Sip& last() const { return sips_.back(); }
  const PioneerRobot& robot() const { return robot_; }
  PioneerRobot& robot() { return robot_; }

 private:
  Bytes Collect() {
    Bytes others;
    for (const Bytes& packet : Packets(robot_.TakeOutput())) {
      if (IsSip(packet)) {
        sips_.emplace_back(packet);
      } else {
        others = others + packet;
      }
    }
    return others;
  }

  PioneerRobot robot_;
  int64_t now_ms_ = 0;
  std::vector<Sip> sips_;
};

}  // namespace pheromone::sim::testing
