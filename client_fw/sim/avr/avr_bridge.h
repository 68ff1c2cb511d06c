// Connects an AVR machine with two terminals of the host, serial ports or ptys, at the pace of a
// clock: the firmware runs on a simulated chip; the radio modem and the Pioneer may be real or
// simulated.
//
//   AvrBridge bridge(&machine, radio_fd, robot_fd);
//   for (;;) { bridge.Step(NanosecondsSinceTheStart()); ... wait a millisecond ... }
//
// Bytes that came in are spaced by the UARTs as a line would; bytes that go out are written when
// their stop bit has passed. A chip with one UART has no robot_fd: -1. Time is the machine's; the
// clock is the caller's, who owns both descriptors, which must be open, raw, and non-blocking. A
// byte that a terminal does not accept, such as a pty without a reader, is lost. One thread.
#pragma once

#include <cstdint>

#include "client_fw/sim/avr/avr_machine.h"

namespace pheromone::sim {

class AvrBridge {
 public:
  /// The machine must outlive the bridge, which uses it exclusively.
  AvrBridge(AvrMachine* machine, int radio_fd, int robot_fd = -1);
  AvrBridge(const AvrBridge&) = delete;
  AvrBridge& operator=(const AvrBridge&) = delete;

  /// Lets the machine catch up with `now_ns`. False if one of the terminals is gone. Throws as
  /// AvrMachine does.
  bool Step(int64_t now_ns);

  /// Bytes that a terminal did not accept.
  uint64_t lost() const { return lost_; }

 private:
  bool Read(AvrMachine::Port port, int fd);
  void Write(int fd, uint8_t byte);

  AvrMachine* machine_;
  int radio_fd_;
  int robot_fd_;
  uint64_t lost_ = 0;
};

}  // namespace pheromone::sim
