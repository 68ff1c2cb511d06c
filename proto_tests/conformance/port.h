// The UART of the microcontroller that runs the conformance image; each chip has its own
// (proto_tests/avr/port.cc, proto_tests/qemu/port.cc). Polled. C++14 without its library.
#pragma once

#include <stdint.h>

namespace pheromone {
namespace conformance {

void StartPort();
/// Waits for a byte.
uint8_t Receive();
/// Waits until there is room for it.
void Send(uint8_t byte);

}  // namespace conformance
}  // namespace pheromone
