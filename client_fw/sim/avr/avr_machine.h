// An ATmega1284P, or a smaller AVR of its kind, that runs a robot's image: libsimavr in virtual
// time, with UARTs, EEPROM, resets and sleep as on the real chip.
//
//   AvrMachine machine({.image = "pheromone_client_avr.elf"});
//   machine.OnSent(AvrMachine::kRadio, [&](uint8_t byte, int64_t time_ns) { ... });
//   machine.Send(AvrMachine::kRobot, 0xFA, machine.now_ns() + 1'041'667);
//   machine.RunTo(1'000'000'000);
//
// UART0 is the radio, UART1 the robot; an ATmega328P has no UART1, and calls about it throw
// std::out_of_range. Time is int64_t nanoseconds since the machine was made; resets do not affect
// it. The same calls give the same run, and the steps of RunTo do not matter, as long as no input
// is given later than its time.
//
// Added to libsimavr 1.6: byte times without a parity bit, read from the registers at each byte;
// transmission through a data and a shift register, reported at the stop bit; a receive buffer of
// two bytes; baud rates compared with what the peers use; flags that interrupt although they rose
// before their mask; four cycles to enter an interrupt; EEPROM writes that take time; resets that
// keep RAM and leave rubbish in undefined registers. Not simulated: cycles for which the EEPROM
// halts the processor, wake-up times, and pins of the UARTs as pins.
//
// One thread; the simulator's log is global. Callbacks come from inside RunTo and Reset; they may
// call Send and SetPin, nothing else, and must not throw.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "client_fw/sim/avr/avr_image.h"
#include "client_fw/sim/avr/avr_pins.h"
#include "client_fw/sim/avr/avr_uart.h"

namespace pheromone::sim {

struct AvrMachineConfig {
  std::string image;                ///< an ELF file
  std::string mcu = "atmega1284p";  ///< or "atmega328p", as libsimavr calls them
  uint32_t frequency_hz = 16'000'000;
  int64_t radio_baud = 9600;
  int64_t robot_baud = 9600;          ///< the image looks for it (AvrUart, `may_differ`)
  std::vector<uint8_t> eeprom = {};   ///< from address 0; the rest is erased
  std::vector<AvrPin> grounded = {};  ///< pins that straps connect to ground
  uint64_t seed = 1;                  ///< of the contents of RAM after power-up
};

class AvrMachine {
 public:
  enum Port { kRadio, kRobot };
  enum class Cause {
    kPowerOn,   ///< RAM is arbitrary
    kBrownOut,  ///< RAM has lost some of its bits
    kExternal,  ///< RAM is as it was
    kWatchdog,  ///< RAM is as it was; the watchdog is on
  };

  /// Loads the image and switches the power on. Throws std::runtime_error if the file or the
  /// simulator is unsuitable.
  explicit AvrMachine(const AvrMachineConfig& config);
  ~AvrMachine();
  AvrMachine(const AvrMachine&) = delete;
  AvrMachine& operator=(const AvrMachine&) = delete;

  /// Runs until `time_ns`, or an instruction longer. Throws std::runtime_error if the firmware
  /// crashes, sleeps for good, or uses its UARTs wrongly (AvrUart::error).
  void RunTo(int64_t time_ns);
  int64_t now_ns() const;

  /// A byte to the firmware, whose stop bit ends at `time_ns`: not before now, and at least a
  /// byte's time after the previous byte; earlier bytes are delayed.
  void Send(Port port, uint8_t byte, int64_t time_ns, AvrByteFault fault = AvrByteFault::kNone);
  /// Bytes from the firmware, each at the end of its stop bit.
  void OnSent(Port port, std::function<void(uint8_t byte, int64_t time_ns)> callback);

  /// The robot's rate from now on; to be changed while nothing is underway.
  void set_robot_baud(int64_t baud);

  /// Drives an input from outside, from now on.
  void SetPin(AvrPin pin, bool high);
  /// Changes of an output; an undriven pin counts as low.
  void OnPin(AvrPin pin, std::function<void(bool high, int64_t time_ns)> callback);

  /// Resets now. A power loss is kPowerOn: everything in progress is lost.
  void Reset(Cause cause);
  /// Resets that the firmware's watchdog made.
  uint64_t watchdog_resets() const;

  std::vector<uint8_t> eeprom() const;
  /// A register, or a byte of RAM, by its address in the data space.
  uint8_t data(uint16_t address) const;
  const AvrUartCounters& uart(Port port) const;
  /// Bytes given to Send that have not arrived.
  size_t underway(Port port) const;

  uint64_t cycles() const;
  uint64_t cycles_asleep() const;

  const AvrImageSize& image_size() const;
  /// The maximum depth of the stack since power-up, in bytes: RAM above the static variables is
  /// then filled with noise, and bytes that have changed were used. (Space that a function reserves
  /// but does not write to is not detected.)
  uint16_t stack_bytes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace pheromone::sim
