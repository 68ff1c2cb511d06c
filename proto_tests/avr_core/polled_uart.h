// UART0 of the ATmega1284P without interrupts: for images whose code under test has no time of its
// own.
#pragma once

#include <avr/io.h>
#include <stdint.h>

namespace pheromone {
namespace core_boundary {

/// 2 Mbit/s at 16 MHz.
inline void SetUpUart() {
  UCSR0A = 1u << U2X0;
  UBRR0L = 0;
  UCSR0B = 1u << RXEN0 | 1u << TXEN0;
}

inline uint8_t Receive() {
  while ((UCSR0A & 1u << RXC0) == 0) {
  }
  return UDR0;
}

inline void Send(uint8_t byte) {
  while ((UCSR0A & 1u << UDRE0) == 0) {
  }
  UDR0 = byte;
}

}  // namespace core_boundary
}  // namespace pheromone
