// What interrupts and the main loop share in addition to bytes: the clock, and a flag that
// something happened. The flag is bit 0 of GPIOR0, one of the AVR's general purpose I/O registers,
// which single instructions can set and clear: every interrupt sets it.
//
//   StartClock();
//   for (;;) {
//     ... look at everything there is, Millis() ...
//     SleepIfIdle();
//   }
#pragma once

#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <stdint.h>

#include "client_fw/boards/avr/clock.h"

namespace pheromone {
namespace client {

/// Counted by an interrupt; use Millis().
extern volatile uint16_t clock_ms;

/// For interrupts: there is something to do for the main loop.
inline void WakeLoop() {
  GPIOR0 |= 1u;
}

/// Sleeps until the next interrupt, but not if one has occurred since the last call: its data may
/// not have been processed. The instruction after sei() comes before any interrupt.
inline void SleepIfIdle() {
  cli();
  if ((GPIOR0 & 1u) == 0) {
    sei();
    sleep_cpu();
  }
  sei();
  GPIOR0 &= static_cast<uint8_t>(~1u);
}

/// Milliseconds since StartClock, modulo 65 536. For the main loop.
inline uint16_t Millis() {
  cli();
  const uint16_t now_ms = clock_ms;
  sei();
  return now_ms;
}

inline void StartClock() {
  OCR1A = static_cast<uint16_t>(CyclesPerMs(F_CPU) - 1u);
  TIMSK1 = 1u << OCIE1A;              // before the flag can be raised
  TCCR1B = 1u << WGM12 | 1u << CS10;  // clear on compare, no prescaler
  SMCR = 1u << SE;                    // sleep_cpu() means idle mode
}

}  // namespace client
}  // namespace pheromone
