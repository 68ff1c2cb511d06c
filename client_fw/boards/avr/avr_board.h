// The Board of client_fw/core/robot.h on an ATmega1284P: UART 0 is the radio, UART 1 the robot.
//
//   AvrBoard board;     // one of them; it owns the UARTs, timer 1, ports A and D and the EEPROM
//   board.Start();      // before anything else
//
// Everything is for the main loop.
#pragma once

#include <avr/io.h>
#include <avr/wdt.h>
#include <stdint.h>

#include "client_fw/boards/avr/eeprom.h"
#include "client_fw/boards/avr/loop.h"
#include "client_fw/boards/avr/pins.h"
#include "client_fw/boards/avr/uarts.h"
#include "client_fw/boards/nonvolatile.h"
#include "client_fw/core/base/moment.h"
#include "client_fw/core/steering/diagnostics.h"
#include "client_fw/core/steering/settings.h"

namespace pheromone {
namespace client {

class AvrBoard {
 public:
  // Start-up calls no constructors.
  constexpr AvrBoard() = default;

  /// Sets up pins, watchdog, clock and UARTs, and enables interrupts.
  void Start();

  // Required by the core: client_fw/core/robot.h and pioneer.h.
  int radio_get() { return uarts[kRadio].Get(); }
  bool radio_put(uint8_t byte) { return SendRadio(byte); }
  /// PTT is high from the first byte queued to the end of the tail.
  bool radio_tx_idle() const { return (PORTD & kPtt) == 0; }
  bool channel_busy() const { return (PIND & kCarrier) == 0 || !radio_tx_idle(); }
  static Moment millis() { return Millis(); }
  int robot_get() { return uarts[kRobot].Get(); }
  bool robot_put(uint8_t byte) { return SendRobot(byte); }
  static void set_robot_rate(uint8_t number) { SetRobotRate(number); }
  /// The pin is driven from the first call on: until then a resistor holds its level.
  void set_load(bool hold) {
    if (hold) {
      PORTD |= kLoad;
    } else {
      PORTD &= static_cast<uint8_t>(~kLoad);
    }
    DDRD |= kLoad;
  }
  void set_led(bool on) {
    if (on) {
      PORTD |= kLed;
    } else {
      PORTD &= static_cast<uint8_t>(~kLed);
    }
  }
  /// For `size`, see load_settings.
  void save_settings(const uint8_t* from, uint8_t /*size*/) { nonvolatile_.Save(from); }

  uint16_t diagnostic(uint8_t id) const;

  // Also required by client_fw/boards/firmware.h.
  /// There is one size, that of Settings.
  bool load_settings(uint8_t* to, uint8_t /*size*/) { return nonvolatile_.Load(to); }
  /// 16 bytes; false if there is no key.
  static bool load_key(uint8_t* to);
  bool saved() const { return nonvolatile_.saved(); }
  uint16_t saves() const { return nonvolatile_.version(); }
  /// 1 to 254.
  uint8_t id() const;
  static void set_keying(uint16_t lead_ms, uint16_t tail_ms) { keying = {lead_ms, tail_ms}; }
  static constexpr uint32_t radio_baud() { return PHEROMONE_RADIO_BAUD; }
  /// Whether the last reset kept RAM: the reset pin or the watchdog, not the supply.
  bool ram_was_kept() const { return ram_was_kept_; }

  void EndTurn() {
    wdt_reset();
    nonvolatile_.Step();
    SleepIfIdle();
  }

 private:
  Nonvolatile<Eeprom, kSettingsSize> nonvolatile_;
  uint8_t reset_cause_ = 0;  // MCUSR
  bool ram_was_kept_ = false;
};

}  // namespace client
}  // namespace pheromone
