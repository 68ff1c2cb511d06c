// Divisors of the AVR's clock, computed and checked when the firmware is compiled.
//
// F_CPU is the crystal's frequency in Hz, PHEROMONE_RADIO_BAUD the radio's bit rate and
// PHEROMONE_ROBOT_BAUDS those at which the robot is looked for; CMake gives all three. A
// combination for which the hardware has no divisor does not compile. The usual crystals, 7.3728,
// 11.0592, 14.7456, 16, 18.432 and 20 MHz, give every rate from 300 to 57 600 baud; those of UARTs,
// the first three and the fifth, give all rates exactly.
#pragma once

#include <stdint.h>

namespace pheromone {
namespace client {

/// Timer 1 counts undivided processor cycles up to 16 bits, which makes a millisecond exact for
/// every crystal of whole kHz up to 65 MHz, and for others to half a cycle. (In 8 bits, with a
/// prescaler, 20 MHz would overflow.)
constexpr uint32_t CyclesPerMs(uint32_t crystal_hz) {
  return (crystal_hz + 500u) / 1000u;
}

/// How far a millisecond is off, in millionths: a crystal itself is off by 50.
constexpr uint32_t MillisecondErrorPpm(uint32_t crystal_hz) {
  const uint32_t real_hz = CyclesPerMs(crystal_hz) * 1000u;
  return (real_hz > crystal_hz ? real_hz - crystal_hz : crystal_hz - real_hz) /
         (crystal_hz / 1000000u);
}

/// UBRR for 16 or 8 samples a bit (datasheet, table "Equations for Calculating Baud Rate Register
/// Setting"), rounded to the nearest.
constexpr uint32_t BaudDivisor(uint32_t crystal_hz, uint32_t baud, uint32_t samples) {
  return (crystal_hz + baud * samples / 2u) / (baud * samples) - 1u;
}

/// How far the rate is off, in thousandths.
constexpr uint32_t BaudError(uint32_t crystal_hz, uint32_t baud, uint32_t samples) {
  const uint32_t real = crystal_hz / (samples * (BaudDivisor(crystal_hz, baud, samples) + 1u));
  return (real > baud ? real - baud : baud - real) * 1000u / baud;
}

/// 16 samples a bit are more tolerant, so 8 are used only if 16 do not give the rate.
constexpr uint32_t Samples(uint32_t crystal_hz, uint32_t baud) {
  return BaudError(crystal_hz, baud, 16u) <= 5u ? 16u : 8u;
}

/// The largest error in thousandths that a receiver of eight bits tolerates, with as much of the
/// peer's.
constexpr uint32_t kMaxBaudError = 20u;

/// The setting of a UART.
struct BaudSetting {
  uint16_t divisor;   ///< UBRR
  bool double_speed;  ///< U2X; to be written before UBRR
};

/// UBRR with U2X.
template <uint32_t kCrystalHz, uint32_t kBaud>
constexpr uint16_t DoubleSpeedDivisor() {
  static_assert(BaudError(kCrystalHz, kBaud, 8u) <= kMaxBaudError,
                "this F_CPU is more than 2 % off this baud rate");
  static_assert(BaudDivisor(kCrystalHz, kBaud, 8u) <= 4095u, "this baud rate is too slow");
  return static_cast<uint16_t>(BaudDivisor(kCrystalHz, kBaud, 8u));
}

template <uint32_t kCrystalHz, uint32_t kBaud>
constexpr BaudSetting SettingFor() {
  static_assert(CyclesPerMs(kCrystalHz) > 1000u && CyclesPerMs(kCrystalHz) <= 65536u,
                "F_CPU is out of range: see clock.h");
  static_assert(MillisecondErrorPpm(kCrystalHz) <= 100u, "F_CPU gives no millisecond: see clock.h");
  static_assert(BaudError(kCrystalHz, kBaud, Samples(kCrystalHz, kBaud)) <= kMaxBaudError,
                "this F_CPU is more than 2 % off this baud rate");
  static_assert(BaudDivisor(kCrystalHz, kBaud, Samples(kCrystalHz, kBaud)) <= 4095u,
                "this baud rate is too slow");
  return BaudSetting{
      static_cast<uint16_t>(BaudDivisor(kCrystalHz, kBaud, Samples(kCrystalHz, kBaud))),
      Samples(kCrystalHz, kBaud) == 8u};
}

}  // namespace client
}  // namespace pheromone
