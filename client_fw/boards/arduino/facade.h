// A robot on an Arduino: the client core (client_fw/core) with a link and wheels.
//
//   #include <Pheromone.h>
//   PheromoneSerial link(Serial, 9600);
//   TwoWheels wheels(power, ticks, {152716, 141000, 500});
//   Pheromone robot(7);
//   void setup() {
//     Serial.begin(9600);
//     robot.settings().law = Law::kDifferential;      // if need be
//     robot.begin(link, wheels, {1000, 500, 0});      // mm, mm, 65 536 a turn
//   }
//   void loop() { robot.step(); }
//
// step() is to be called every millisecond or so. A pause of 60 ms loses bytes of a modem of 9600
// baud, since the core's ring holds 64.
//
// One robot a sketch. Settings are those of the sketch until one is changed over the radio; then
// they are kept in EEPROM, and hold until the sketch's settings change. After a reset that kept
// memory, of an AVR by button or watchdog, requests and odometry go on where they were. After
// power-up the robot is at `start`; after another reset of an ESP its pose is lost. After each it
// is halted until it is resumed.
#pragma once

#include <Arduino.h>
#include <stddef.h>
#include <stdint.h>

#include "client_fw/boards/arduino/link.h"
#include "client_fw/boards/arduino/storage.h"
#include "client_fw/boards/arduino/wheels.h"
#include "client_fw/boards/nonvolatile.h"
#include "client_fw/core/base/moment.h"
#include "client_fw/core/steering/behaviour.h"
#include "client_fw/core/steering/parameters.h"
#include "protocol/signing.h"

namespace pheromone {
namespace arduino {

/// In 1/4096 of a pheromone unit.
struct Sensed {
  int16_t left;
  int16_t right;
};

/// The Board of client_fw/core/robot.h and client_fw/boards/boot.h.
class ArduinoBoard {
 public:
  int radio_get() { return link->get(); }
  bool radio_put(uint8_t byte) { return link->put(byte); }
  bool radio_tx_idle() { return link->idle(); }
  bool channel_busy() { return link->busy(); }
  client::Moment millis() const { return static_cast<client::Moment>(::millis()); }
  void set_load(bool on) { Set(load_pin, on); }
  void set_led(bool on) { Set(led_pin, on); }
  void save_settings(const uint8_t* bytes, uint8_t size);
  bool saved() const { return stored.saved(); }
  uint16_t saves() const { return stored.version(); }
  /// Writes what is to be saved.
  void EndTurn() {
    if (!saved()) {
      stored.Step();
      if (saved()) {
        Storage::Commit();
      }
    }
  }
  /// An Arduino's bootloader and core keep all of them to themselves.
  uint16_t diagnostic(uint8_t /*id*/) const { return 0; }

  PheromoneLink* link = nullptr;
  int8_t led_pin = -1;
  int8_t load_pin = -1;
  uint16_t sketch_crc = 0;  ///< of the sketch's settings
  client::Nonvolatile<Storage, client::kSettingsSize + 2> stored;

 private:
  static void Set(int8_t pin, bool on) {
    if (pin >= 0) {
      digitalWrite(static_cast<uint8_t>(pin), on ? HIGH : LOW);
    }
  }
};

class Pheromone {
 public:
  /// 1 to 254; no other robot on the channel may have it.
  explicit constexpr Pheromone(uint8_t id) : id_(id) {}
  Pheromone(const Pheromone&) = delete;
  Pheromone& operator=(const Pheromone&) = delete;

  /// To be changed before begin().
  client::Parameters& settings() { return parameters_; }
  /// The pin of a LED that shows why the robot stands, and one that is high while it holds a load.
  /// From setup(), before begin().
  void led(uint8_t pin) { board_.led_pin = Output(pin); }
  void load(uint8_t pin) { board_.load_pin = Output(pin); }
  /// The robot's, 16 bytes that outlive it: from then on it signs its frames, and believes signed
  /// ones only. Before begin(). A key belongs to one board and one ID, and to this EEPROM: its
  /// numbers begin anew in another one, or once it was erased.
  template <size_t kSize>
  void key(const uint8_t (&bytes)[kSize]) {
    static_assert(kSize == protocol::kAesBlock, "a key has 16 bytes");
    static_assert(kSize == 0 || protocol::kHasSigning,
                  "this library was compiled without: README.md, \"Signed links\"");
#if PHEROMONE_SIGNING
    parameters_.key = bytes;
#endif
  }

  /// Both must outlive the robot. Takes a third of a second at most, for the boot number in EEPROM.
  void begin(PheromoneLink& link, PheromoneWheels& wheels,
             const client::Pose& start = client::Pose{0, 0, 0});
  void step();

  /// As last received; 0 before.
  Sensed sensed() const;
  /// A set of client::StopFlag: why it stands; 0 while it drives.
  uint8_t stop_flags() const;

 private:
  static int8_t Output(uint8_t pin) {
    pinMode(pin, OUTPUT);
    return static_cast<int8_t>(pin);
  }

  ArduinoBoard board_;
  PheromoneWheels* wheels_ = nullptr;
  client::Parameters parameters_;
  uint8_t id_;
};

}  // namespace arduino
}  // namespace pheromone
