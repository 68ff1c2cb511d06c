// A microcontroller that runs the conformance image, seen as two streams of bytes. The chip is
// selected when a test is linked: proto_tests/avr/ has the ATmega1284P in libsimavr,
// proto_tests/qemu/ the Cortex-M3 in QEMU.
#pragma once

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

namespace pheromone::conformance {

class Target {
 public:
  Target() = default;
  virtual ~Target() = default;
  Target(const Target&) = delete;
  Target& operator=(const Target&) = delete;

  /// Queues bytes for its UART.
  virtual void Send(const std::vector<uint8_t>& bytes) = 0;

  /// The next byte from its UART. Throws std::runtime_error if the processor crashed or stopped, or
  /// has been silent for much longer than any command takes.
  virtual uint8_t Receive() = 0;
};

/// Powers one up. Throws std::runtime_error if the image or the simulator is unsuitable.
std::unique_ptr<Target> MakeTarget();

/// sizeof(int) and sizeof(void*) of the chip's compiler.
std::pair<int, int> TargetSizes();

}  // namespace pheromone::conformance
