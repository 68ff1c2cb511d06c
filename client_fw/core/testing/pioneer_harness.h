// A Pioneer client in virtual time, with a small robot at the other end of the cable that can be
// made to fail in each way. For tests only.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "client_fw/core/pioneer/pioneer.h"
#include "client_fw/core/testing/naive_arcos.h"

namespace pheromone {
namespace client {

/// A command as the robot understands it.
struct Heard {
  uint32_t at_ms;
  uint8_t command;
  int argument;  ///< 0 if it had none

  bool operator==(const Heard& other) const {
    return command == other.command && argument == other.argument;
  }
};

inline std::ostream& operator<<(std::ostream& out, const Heard& heard) {
  return out << "command " << int{heard.command} << " (" << heard.argument << ") at " << heard.at_ms
             << " ms";
}

class PioneerHarness {
 public:
  explicit PioneerHarness(uint32_t start_ms = 5000, int16_t count_100nm = kPioneerCount100Nm)
      : now_ms(start_ms), pioneer(static_cast<uint16_t>(start_ms), count_100nm) {}

  uint16_t now16() const { return static_cast<uint16_t>(now_ms); }

  void ToClient(const Bytes& bytes) {
    for (const uint8_t byte : bytes) {
      pioneer.OnByte(byte, now16());
    }
  }
  void ToClient(const Sip& packet) { ToClient(NaivePacket(packet.Body())); }

  /// One millisecond: SIP, Poll, and what the robot does with a command.
  void Step() {
    ++now_ms;
    if (open && on && now_ms % 100 == 0 && !mute) {
      ToClient(sip);
    }
    pioneer.Poll(now16());
    if (pioneer.tx_size() == 0 || jammed) {
      return;
    }
    Bytes sent;
    while (pioneer.tx_size() != 0) {
      sent.push_back(*pioneer.tx());
      pioneer.OnPut(now16());
    }
    const std::vector<Bytes> bodies = NaiveBodies(sent);
    ASSERT_EQ(1u, bodies.size()) << "not a packet";
    ASSERT_EQ(NaivePacket(bodies[0]), sent);
    Hear(bodies[0]);
  }

  void Run(uint32_t ms) {
    for (uint32_t i = 0; i < ms; ++i) {
      Step();
    }
  }

  /// Runs until the client has sent something more, for at most `limit_ms`.
  bool RunUntilHeard(uint32_t limit_ms = 3000) {
    const size_t before = heard.size();
    for (uint32_t i = 0; i < limit_ms && heard.size() == before; ++i) {
      Step();
    }
    return heard.size() > before;
  }

  /// Runs until odometry is known and what opens a session has been sent.
  void Connect() {
    for (int i = 0; i < 5000 && !pioneer.known(); ++i) {
      Step();
    }
    ASSERT_TRUE(pioneer.known());
    Run(100);
    heard.clear();
  }

  /// The next SIP, now.
  void Tell(uint16_t x, uint16_t y, uint16_t th) {
    sip.x = x;
    sip.y = y;
    sip.th = th;
    ToClient(sip);
  }

  int CountOf(PioneerCommand command) const {
    int count = 0;
    for (const Heard& it : heard) {
      count += it.command == static_cast<uint8_t>(command);
    }
    return count;
  }

  uint32_t now_ms;
  Pioneer pioneer;
  std::vector<Heard> heard;

  // The robot.
  std::string subclass = "p3dx";
  Sip sip;
  int synced = 0;  ///< echoes given; 3: in a session
  bool open = false;
  int closed = 0;  ///< sessions ended by CLOSE
  // What may be wrong.
  bool on = true;
  bool mute = false;       ///< hears and obeys, but is not heard
  bool deaf = false;       ///< hears nothing
  int deaf_to = -1;        ///< does not hear this command
  bool jammed = false;     ///< the client's UART takes no byte
  int lost_replies = 0;    ///< to be lost from now on
  bool lose_open = false;  ///< the next OPEN does not arrive

 private:
  void Hear(const Bytes& body) {
    Heard command = {now_ms, body[0], 0};
    if (body.size() > 1) {
      ASSERT_EQ(4u, body.size());
      ASSERT_TRUE(body[1] == 0x3B || body[1] == 0x1B);
      command.argument = (body[2] + 256 * body[3]) * (body[1] == 0x3B ? 1 : -1);
    }
    heard.push_back(command);
    if (!on || deaf || command.command == deaf_to) {
      return;
    }
    if (synced == 3) {
      Obey(command);
    } else if (command.command < 3 && body.size() == 1) {  // in sequence or not, as by MobileSim
      synced = command.command + 1;
      Reply();
    } else {
      synced = 0;
    }
  }

  void Obey(const Heard& command) {
    if (command.command == 1) {
      open = !lose_open;
      lose_open = false;
    } else if (command.command == 2) {
      open = false;
      synced = 0;
      ++closed;
      sip.flags = 0;
    } else if (command.command == 4) {
      sip.flags = static_cast<uint16_t>((sip.flags & ~1) | command.argument);
    } else if (command.command == 28) {
      sip.flags = static_cast<uint16_t>((sip.flags & ~0x1E) | command.argument * 2);
    }
  }

  void Reply() {
    if (mute || lost_replies > 0) {
      lost_replies -= lost_replies > 0;
      return;
    }
    Bytes body = {static_cast<uint8_t>(synced - 1)};
    if (synced == 3) {
      const std::string names = "Test_1" + std::string(1, '\0') + "Pioneer" + std::string(1, '\0') +
                                subclass + std::string(1, '\0');
      body.insert(body.end(), names.begin(), names.end());
    }
    ToClient(NaivePacket(body));
  }
};

}  // namespace client
}  // namespace pheromone
