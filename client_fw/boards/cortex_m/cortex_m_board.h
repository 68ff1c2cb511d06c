// The Board of client_fw/core/robot.h on Arm's mps2-an385 (Cortex-M3): UART 0 is the radio, UART 1
// the robot. Meant for QEMU, and as the pattern for a real Cortex-M.
//
//   CortexMBoard board;     // one of them: it owns UARTs 0 and 1, GPIO 0, watchdog and SysTick
//   board.Start();          // before anything else
//
// Pins of GPIO 0, all high when active, so that a machine without GPIO has neither straps nor a
// carrier: 0-7 in: the ID; 8 in: carrier; 9 out: PTT; 10 out: hold the load; 11 out: the LED.
//
// This board has no EEPROM. RAM is used instead, which survives resets but not a loss of power:
// settings are then lost, and nonces begin at 1 again, so that "at most once" does not hold after a
// power loss. A board of your own needs a Storage (nonvolatile.h) that survives it. So does
// signing: images with it use a file of QEMU's host (semihosted_eeprom.h).
//
// For the main loop, except where marked for interrupts.
#pragma once

#include <stdint.h>

#include "client_fw/boards/cortex_m/interrupt_uart.h"
#include "client_fw/boards/cortex_m/registers.h"
#include "client_fw/boards/cortex_m/semihosted_eeprom.h"
#include "client_fw/boards/nonvolatile.h"
#include "client_fw/core/base/moment.h"
#include "client_fw/core/steering/diagnostics.h"
#include "client_fw/core/steering/parameters.h"
#include "protocol/signing.h"

namespace pheromone {
namespace client {

#if PHEROMONE_SIGNING
using CortexMStorage = SemihostedEeprom;
#else
/// RAM used as the EEPROM.
struct ResetProofRam {
  static void Begin() {}
  static bool Ready() { return true; }
  static uint8_t Read(uint8_t at) { return bytes[at]; }
  static void Write(uint8_t at, uint8_t value) { bytes[at] = value; }

  static bool LoadKey(uint8_t* /*to*/) { return false; }

  static uint8_t bytes[256];
};
using CortexMStorage = ResetProofRam;
#endif

class CortexMBoard {
 public:
  constexpr CortexMBoard() = default;

  void Start();

  // Required by the core: client_fw/core/robot.h and pioneer_drive.h.
  /// Bytes received before radio_tx_idle has reported the end of our own transmission wait until
  /// then: QEMU's bytes take no time, so an answer may arrive before our last stop bit.
  int radio_get() { return transmitting_ ? -1 : radio_.Get(); }
  bool radio_put(uint8_t byte);
  bool radio_tx_idle() {
    transmitting_ = radio_.sending() || line_busy_ms_ != 0;
    return !transmitting_;
  }
  bool channel_busy();
  Moment millis() const { return now_ms_; }
  int robot_get() { return robot_.Get(); }
  bool robot_put(uint8_t byte) { return robot_.Put(byte); }
  static void set_robot_rate(uint8_t /*number*/) {}  // QEMU ignores it
  void set_load(bool hold);
  void set_led(bool on);
  void save_settings(const uint8_t* from, uint8_t /*size*/) { nonvolatile_.Save(from); }

  /// There are no framing errors in QEMU, and bytes wait until they are taken.
  uint16_t diagnostic(uint8_t id) const {
    const uint8_t cause = ram_was_kept_ ? kExternalReset : kPowerOnReset;
    return id == kResetCause ? cause : uint8_t{0};
  }

  // Also required by client_fw/boards/firmware.h.
  bool load_settings(uint8_t* to, uint8_t /*size*/) { return nonvolatile_.Load(to); }
  static bool load_key(uint8_t* to) { return CortexMStorage::LoadKey(to); }
  bool saved() const { return nonvolatile_.saved(); }
  uint16_t saves() const { return nonvolatile_.version(); }
  uint8_t id() const;
  /// A lead or tail may take a millisecond longer.
  void set_keying(uint16_t lead_ms, uint16_t tail_ms) {
    lead_ms_ = lead_ms;
    tail_ms_ = tail_ms;
  }
  static constexpr uint32_t radio_baud() { return 9600; }
  bool ram_was_kept() const { return ram_was_kept_; }
  void EndTurn();

  // The interrupts'.
  void OnMillisecond();
  void OnReceived(InterruptUart* uart);
  void OnSent(InterruptUart* uart);
  InterruptUart* radio() { return &radio_; }
  InterruptUart* robot() { return &robot_; }

 private:
  InterruptUart radio_{0};
  InterruptUart robot_{1};
  Nonvolatile<CortexMStorage, kSettingsSize> nonvolatile_;
  volatile uint32_t now_ms_ = 0;
  uint16_t lead_ms_ = 0;
  uint16_t tail_ms_ = 0;
  volatile uint16_t lead_left_ms_ = 0;
  volatile uint16_t line_busy_ms_ = 0;  // after the last byte has gone to the shift register
  volatile bool happened_ = false;      // an interrupt, since the last EndTurn
  bool transmitting_ = false;           // the last value reported
  bool ram_was_kept_ = false;
};

}  // namespace client
}  // namespace pheromone
