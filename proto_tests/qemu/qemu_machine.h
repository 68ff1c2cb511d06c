// QEMU's mps2-an385 (a Cortex-M3) in a child process, its two UARTs as streams of bytes.
//
//   QemuMachine machine(PHEROMONE_QEMU, image);
//   machine.Send(0, {0x01, 0x00, 'I'});
//   const uint8_t first = machine.Receive(0);
//
// It runs in real time, at its own pace: timing is not tested, and QEMU simulates neither baud
// rates nor overruns. The process ends with the object. One thread.
#pragma once

#include <sys/types.h>

#include <array>
#include <cstdint>
#include <deque>
#include <string>
#include <vector>

namespace pheromone::conformance {

class QemuMachine {
 public:
  static constexpr size_t kUarts = 2;

  /// Starts the program `qemu` with `image`, both by their full paths; with semihosting, whose
  /// files are in `folder`, if that is not empty. Throws std::runtime_error if that is impossible;
  /// if QEMU itself ends with an error, Receive will say so.
  QemuMachine(const std::string& qemu, const std::string& image, const std::string& folder = "");
  ~QemuMachine();
  QemuMachine(const QemuMachine&) = delete;
  QemuMachine& operator=(const QemuMachine&) = delete;

  /// Queues bytes for a UART.
  void Send(size_t uart, const std::vector<uint8_t>& bytes);

  /// Waits for a byte from a UART.
  uint8_t Receive(size_t uart);

  /// Bytes that Receive would not wait for.
  size_t available(size_t uart) const { return lines_.at(uart).from_machine.size(); }

  /// Waits until bytes can go either way on any UART, and moves them. Throws std::runtime_error, as
  /// Receive does, if the process has ended or nothing could move for kPatienceMs.
  void Move();

  /// A minute: every command is answered in a thousandth of it.
  static constexpr int kPatienceMs = 60'000;

 private:
  struct Line {
    int socket = -1;
    std::deque<uint8_t> to_machine;
    std::deque<uint8_t> from_machine;
  };

  std::array<Line, kUarts> lines_;
  pid_t process_ = -1;
};

}  // namespace pheromone::conformance
