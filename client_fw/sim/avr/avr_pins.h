// The pins of an AVR's ports A to D in libsimavr, seen from outside: driven inputs that survive
// resets, and outputs that are watched.
//
//   AvrPins pins(avr);
//   pins.Drive({'D', 5}, false);                                   // from now on, low
//   pins.Watch({'D', 4}, [](bool high) { ... });
//
// An output counts as low while the firmware does not drive it. Belongs to the AvrMachine; one
// thread.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <functional>

struct avr_irq_t;
struct avr_t;

namespace pheromone::sim {

/// Bit `bit` of port `port`: `{'B', 3}`.
struct AvrPin {
  char port;
  int bit;
};

class AvrPins {
 public:
  /// `avr` must outlive it.
  explicit AvrPins(avr_t* avr) : avr_(avr) {}
  AvrPins(const AvrPins&) = delete;
  AvrPins& operator=(const AvrPins&) = delete;

  void Drive(AvrPin pin, bool high);
  /// Calls back with each change of the output level.
  void Watch(AvrPin pin, std::function<void(bool)> on_change);
  /// After the chip was reset: outputs are undriven, inputs as before.
  void OnReset();

 private:
  struct Watched {
    avr_t* avr;
    AvrPin pin;
    std::function<void(bool)> on_change;
    bool high;
  };
  struct Port {
    uint8_t driven = 0;
    uint8_t levels = 0;
  };

  static void OnLevel(avr_irq_t* irq, uint32_t value, void* watched);
  avr_irq_t* Irq(AvrPin pin) const;

  avr_t* avr_;
  std::array<Port, 4> ports_;
  std::deque<Watched> watched_;  // the simulator keeps pointers to them
};

}  // namespace pheromone::sim
