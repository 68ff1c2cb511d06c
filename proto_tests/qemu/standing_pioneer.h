// A Pioneer on UART 1 of a machine in QEMU, whose UART 0 is the radio. For tests only.
//
//   StandingPioneer pioneer(&machine);
//   pioneer.Listen();                       // answers what has come, as often as there may be more
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "proto_tests/qemu/qemu_machine.h"

namespace pheromone::conformance {

using Bytes = std::vector<uint8_t>;

constexpr size_t kRadio = 0;
constexpr size_t kRobot = 1;

// A frame of ARCOS: client_fw/core/pioneer/pioneer_packet.h.
inline Bytes Packet(const Bytes& body) {
  Bytes packet;
  packet.reserve(body.size() + 5);
  for (const int byte : {0xFA, 0xFB, static_cast<int>(body.size() + 2)}) {
    packet.push_back(static_cast<uint8_t>(byte));
  }
  for (const uint8_t byte : body) {
    packet.push_back(byte);
  }
  unsigned sum = 0;
  for (size_t i = 0; i + 1 < body.size(); i += 2) {
    sum += static_cast<unsigned>(body[i] << 8 | body[i + 1]);
  }
  if (body.size() % 2 != 0) {
    sum ^= body.back();
  }
  packet.push_back(static_cast<uint8_t>(sum >> 8 & 0xFF));
  packet.push_back(static_cast<uint8_t>(sum & 0xFF));
  return packet;
}

// A Pioneer that stands at some X: greets as it should, and reports after each command.
class StandingPioneer {
 public:
  explicit StandingPioneer(QemuMachine* machine) : machine_(machine) {}

  void Listen() {
    while (machine_->available(kRobot) != 0) {
      heard_.push_back(machine_->Receive(kRobot));
      TakeCommand();
    }
  }

  std::vector<Bytes> commands;
  uint16_t x = 0;

 private:
  // A robot that was reset (its watchdog runs in real time) leaves half a command behind.
  void TakeCommand() {
    while (heard_.size() >= 6) {
      const size_t size = heard_[2] + 3u;
      const bool begins = heard_[0] == 0xFA && heard_[1] == 0xFB && size >= 6 && size <= 200;
      if (begins && heard_.size() < size) {
        return;
      }
      const auto begin = heard_.begin();
      if (begins && Packet(Bytes(begin + 3, begin + heard_[2] + 1)) ==
                        Bytes(begin, begin + static_cast<std::ptrdiff_t>(size))) {
        commands.emplace_back(begin, begin + static_cast<std::ptrdiff_t>(size));
        heard_.erase(begin, begin + static_cast<std::ptrdiff_t>(size));
        Obey(commands.back());
      } else {
        heard_.erase(begin);
      }
    }
  }

  void Obey(const Bytes& command) {
    const uint8_t number = command[3];
    if (number == 2 && phase_ != kOpen) {
      const std::string names("Robot\0Pioneer\0p3dx-sh\0", 22);
      Bytes body = {2};
      body.insert(body.end(), names.begin(), names.end());
      machine_->Send(kRobot, Packet(body));
      phase_ = kGreeted;
    } else if (number <= 2 && (phase_ == kClosed || number != 1)) {
      phase_ = kClosed;  // SYNC0, SYNC1, or CLOSE
      machine_->Send(kRobot, command);
    } else {
      phase_ = kOpen;
      machine_->Send(kRobot, Packet({0x32,
                                     static_cast<uint8_t>(x & 0xFF),
                                     static_cast<uint8_t>(x >> 8),
                                     0,
                                     0,
                                     0,
                                     0,
                                     0,
                                     0,
                                     0,
                                     0,
                                     120,
                                     0,
                                     0,
                                     0,
                                     0,
                                     1,
                                     0,
                                     0,
                                     0}));
    }
  }

  enum Phase { kClosed, kGreeted, kOpen };
  QemuMachine* machine_;
  Bytes heard_;
  Phase phase_ = kClosed;
};

}  // namespace pheromone::conformance
