// Divisors of the AVR's clock, computed and checked when the firmware is compiled.
//
// F_CPU is the crystal's frequency in Hz, PHEROMONE_RADIO_BAUD and PHEROMONE_ROBOT_BAUD the bit
// rates of the two UARTs; CMake gives all three. A combination for which the hardware has no
// divisor does not compile.
#pragma once

#include <stdint.h>

namespace pheromone {
namespace client {

/// Timer 1 counts undivided processor cycles up to 16 bits, which makes a millisecond exact for
/// every crystal of whole kHz up to 65 MHz. (In 8 bits, with a prescaler, 20 MHz would overflow.)
constexpr uint32_t kCyclesPerMs = F_CPU / 1000u;
static_assert(F_CPU % 1000u == 0, "F_CPU has to be a whole number of kHz: see clock.h");
static_assert(kCyclesPerMs > 1000u && kCyclesPerMs <= 65536u, "F_CPU is out of range: see clock.h");

/// UBRR for 16 or 8 samples a bit (datasheet, table "Equations for Calculating Baud Rate Register
/// Setting"), rounded to the nearest.
constexpr uint32_t BaudDivisor(uint32_t baud, uint32_t samples) {
  return (F_CPU + baud * samples / 2u) / (baud * samples) - 1u;
}

/// How far the rate is off, in thousandths.
constexpr uint32_t BaudError(uint32_t baud, uint32_t samples) {
  const uint32_t real = F_CPU / (samples * (BaudDivisor(baud, samples) + 1u));
  return (real > baud ? real - baud : baud - real) * 1000u / baud;
}

/// 16 samples a bit are more tolerant, so 8 are used only if 16 do not give the rate.
constexpr uint32_t Samples(uint32_t baud) {
  return BaudError(baud, 16u) <= 5u ? 16u : 8u;
}

/// The setting of a UART.
struct BaudSetting {
  uint16_t divisor;   ///< UBRR
  bool double_speed;  ///< U2X; to be written before UBRR
};

template <uint32_t kBaud>
constexpr BaudSetting SettingFor() {
  static_assert(BaudError(kBaud, Samples(kBaud)) <= 20u,
                "this F_CPU is more than 2 % off this baud rate");
  static_assert(BaudDivisor(kBaud, Samples(kBaud)) <= 4095u, "this baud rate is too slow");
  return BaudSetting{static_cast<uint16_t>(BaudDivisor(kBaud, Samples(kBaud))),
                     Samples(kBaud) == 8u};
}

}  // namespace client
}  // namespace pheromone
