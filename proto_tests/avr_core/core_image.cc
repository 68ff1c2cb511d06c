// The image for the ATmega1284P: reads a request of core_turn.h from UART0 as length u16 and bytes,
// runs the core for one turn, sends the reply in the same way. Polled: the core is under test, and
// time is part of the request.
#include <stdint.h>

#include "proto_tests/avr_core/core_turn.h"
#include "proto_tests/avr_core/polled_uart.h"

namespace pheromone {
namespace core_boundary {
namespace {

uint8_t request[kMaxRequest];
uint8_t reply[kMaxReply];
CoreTurn core;

void Serve() {
  const uint8_t low = Receive();
  uint16_t size = static_cast<uint16_t>(low | static_cast<uint16_t>(Receive()) << 8);
  for (uint16_t i = 0; i < size; ++i) {
    const uint8_t byte = Receive();
    if (i < kMaxRequest) {
      request[i] = byte;
    }
  }
  size = core.Run(request, size <= kMaxRequest ? size : uint16_t{0}, reply);
  Send(static_cast<uint8_t>(size & 0xFFu));
  Send(static_cast<uint8_t>(size >> 8));
  for (uint16_t i = 0; i < size; ++i) {
    Send(reply[i]);
  }
}

}  // namespace
}  // namespace core_boundary
}  // namespace pheromone

int main() {
  pheromone::core_boundary::SetUpUart();
  for (;;) {
    pheromone::core_boundary::Serve();
  }
}
