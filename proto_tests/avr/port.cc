// UART 0 of an ATmega1284P.
#include "proto_tests/conformance/port.h"

#include <avr/io.h>

namespace pheromone {
namespace conformance {

void StartPort() {
  UCSR0A = 1u << U2X0;  // first: the simulator computes a byte's time when UBRR0L is written
  UBRR0H = 0;
  UBRR0L = 0;  // 2 Mbit/s at 16 MHz
  UCSR0C = (1u << UCSZ01) | (1u << UCSZ00);
  UCSR0B = (1u << RXEN0) | (1u << TXEN0);
}

uint8_t Receive() {
  while ((UCSR0A & (1u << RXC0)) == 0) {
  }
  return UDR0;
}

void Send(uint8_t byte) {
  while ((UCSR0A & (1u << UDRE0)) == 0) {
  }
  UDR0 = byte;
}

}  // namespace conformance
}  // namespace pheromone
