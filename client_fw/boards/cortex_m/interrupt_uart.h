// One of the mps2-an385's UARTs, driven by interrupts through two rings of bytes.
//
//   InterruptUart radio(0);
//   radio.Start(9600);
//   const int byte = radio.Get();           // -1: none
//   const bool queued = radio.Put(byte);    // false: no room
//   ... OnReceived and OnSent are called by the interrupts' handlers ...
//
// A byte that finds its ring full is lost. Get and Put are for the main loop.
#pragma once

#include <stdint.h>

#include "client_fw/boards/cortex_m/registers.h"

namespace pheromone {
namespace client {

/// Between the main loop and an interrupt: each writes its own index only, after it is done with
/// the byte, hence volatile.
class InterruptRing {
 public:
  bool empty() const { return in_ == out_; }

  int Get() {
    if (empty()) {
      return -1;
    }
    const uint8_t byte = bytes_[out_];
    out_ = After(out_);
    return byte;
  }

  bool Put(uint8_t byte) {
    if (After(in_) == out_) {
      return false;
    }
    bytes_[in_] = byte;
    in_ = After(in_);
    return true;
  }

 private:
  enum : uint8_t { kSize = 128 };
  static uint8_t After(uint8_t index) { return static_cast<uint8_t>((index + 1u) % kSize); }

  volatile uint8_t in_ = 0;
  volatile uint8_t out_ = 0;
  volatile uint8_t bytes_[kSize] = {};
};

class InterruptUart {
 public:
  explicit constexpr InterruptUart(uint8_t number) : number_(number) {}

  void Start(uint32_t baud) {
    UartRegisters& uart = Uart(number_);
    uart.divisor = (kClockHz + baud / 2) / baud;
    uart.control = kUartSend | kUartReceive | kUartSendInterrupt | kUartReceiveInterrupt;
  }

  int Get() { return received_.Get(); }

  bool Put(uint8_t byte) {
    if (!to_send_.Put(byte)) {
      return false;
    }
    DisableInterrupts();
    if (!sending_ && !held_) {
      SendNext();
    }
    EnableInterrupts();
    return true;
  }

  /// What is put is queued only, until released; for the main loop and interrupts.
  void Hold() { held_ = true; }
  void Release() {
    held_ = false;
    if (!sending_) {
      SendNext();
    }
  }

  /// Bytes are queued, or in the UART's buffer; the last may still be on the line when this ends.
  bool sending() const { return sending_ || !to_send_.empty(); }

  // For the interrupts' handlers.
  void OnReceived() {
    UartRegisters& uart = Uart(number_);
    uart.interrupt = kReceiveFull;
    while ((uart.state & kReceiveFull) != 0) {
      received_.Put(static_cast<uint8_t>(uart.data & 0xFFu));
    }
  }
  void OnSent() {
    Uart(number_).interrupt = kSendFull;
    SendNext();
  }

 private:
  // The interrupt signals that the buffer has become empty, not that it is empty: so the first byte
  // is sent directly.
  void SendNext() {
    const int byte = to_send_.Get();
    sending_ = byte >= 0;
    if (sending_) {
      Uart(number_).data = static_cast<uint32_t>(byte);
    }
  }

  InterruptRing received_;
  InterruptRing to_send_;
  volatile bool sending_ = false;
  volatile bool held_ = false;
  uint8_t number_;
};

}  // namespace client
}  // namespace pheromone
