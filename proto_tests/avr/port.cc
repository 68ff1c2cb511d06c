// UART 0 of an ATmega1284P.
#include "proto_tests/conformance/port.h"

#include "proto_tests/avr_core/polled_uart.h"

namespace pheromone {
namespace conformance {

void StartPort() {
  core_boundary::SetUpUart();
}

uint8_t Receive() {
  return core_boundary::Receive();
}

void Send(uint8_t byte) {
  core_boundary::Send(byte);
}

}  // namespace conformance
}  // namespace pheromone
