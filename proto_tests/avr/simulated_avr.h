// An ATmega1284P in libsimavr that runs an image and talks over UART0.
//
//   SimulatedAvr avr(path);
//   avr.Send({0x01, 0x00, 'I'});
//   const uint8_t first = avr.Receive();
//
// Time is virtual: the processor runs only inside Receive, as fast as the host can, and the same
// bytes give the same run. The simulator hides overruns (a receive buffer of 64 bytes; here bytes
// wait until there is room) and baud rates: a UART's timing is not tested. One thread; the
// simulator's log is global.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <string>
#include <vector>

struct avr_irq_t;
struct avr_t;

namespace pheromone::conformance {

class SimulatedAvr {
 public:
  /// Loads the ELF file `image` and powers it up at 16 MHz. Throws std::runtime_error if the file
  /// or the simulator is unsuitable.
  explicit SimulatedAvr(const std::string& image);
  ~SimulatedAvr();
  SimulatedAvr(const SimulatedAvr&) = delete;
  SimulatedAvr& operator=(const SimulatedAvr&) = delete;

  /// Queues bytes for UART0.
  void Send(const std::vector<uint8_t>& bytes);

  /// Runs until UART0 has sent a byte. Throws std::runtime_error if the processor crashes or stops,
  /// or sends nothing for kPatienceCycles.
  uint8_t Receive();

  /// Cycles since power-up.
  uint64_t cycles() const;

  /// 10 s at 16 MHz: every command is answered in a hundredth of this time.
  static constexpr uint64_t kPatienceCycles = 160'000'000;

 private:
  void Feed();

  avr_t* avr_;
  avr_irq_t* input_;
  std::deque<uint8_t> to_avr_;
  std::deque<uint8_t> from_avr_;
  bool may_send_ = true;  // XON
};

}  // namespace pheromone::conformance
