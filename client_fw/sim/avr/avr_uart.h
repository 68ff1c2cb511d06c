// A UART of an AVR in libsimavr that behaves like the real one. It replaces the simulator's own,
// which is 10 % slow, never loses a byte, does not know its baud rate, and reports a byte before it
// has been sent.
//
//   AvrUart uart(avr, '0', 9600);
//   uart.set_on_sent([](uint8_t byte, uint64_t cycle) { ... });   // its stop bit is over
//   uart.Deliver(0x10, cycle);                                    // its stop bit ends then
//
// Sending: a data register and a shift register. UDRE says that the former is free, TXC that both
// are empty; a byte is reported when its stop bit has ended. Receiving: two bytes are kept; one
// more that comes before the firmware has read is lost and counted, and DOR is set. All three
// interrupts are level-triggered as on the real chip, except TXC. Only 8N1 is understood.
//
// Bytes that come in closer than a byte lasts at the nominal rate are delayed to that distance, as
// by a wire: the caller may deliver a whole block at once.
//
// Time is in cycles of the AVR. The firmware's divisor is compared with the peer's rate at every
// byte. More than 2 % off is an error(); with `may_differ`, the byte is then what the receiver's
// samples find on the line, as long as the byte lasts there and idle after it: another byte, or
// without a stop bit. To the peer such a one is lost; the firmware has a framing error. Errors too
// are another format than 8N1, and a byte written to a transmitter that is full. Belongs to the
// AvrMachine; one thread. Source: ATmega1284P data sheet (8272G), chapter 19.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <string>

struct avr_irq_t;
struct avr_t;
struct avr_uart_t;

namespace pheromone::sim {

struct AvrUartCounters {
  uint64_t sent = 0;      ///< stop bit has left
  uint64_t received = 0;  ///< came in and was kept
  uint64_t overruns = 0;  ///< lost because the firmware had not read the two before
  uint64_t deaf = 0;      ///< came in while the receiver was off
};

/// What may be wrong with a byte that comes in.
enum class AvrByteFault {
  kNone,
  kNoStopBit,  ///< a framing error
  kOverrun,    ///< one before it was lost in the receiver
};

class AvrUart {
 public:
  /// Takes over UART `name` ('0' or '1') of `avr`, which must outlive it. Throws std::runtime_error
  /// if the chip has none.
  AvrUart(avr_t* avr, char name, int64_t nominal_baud, bool may_differ = false);
  AvrUart(const AvrUart&) = delete;
  AvrUart& operator=(const AvrUart&) = delete;

  /// The peer's rate from now on.
  void set_nominal_baud(int64_t baud) { nominal_baud_ = baud; }

  /// Called with each byte sent and the cycle at which its stop bit ended.
  void set_on_sent(std::function<void(uint8_t, uint64_t)> on_sent) {
    on_sent_ = std::move(on_sent);
  }

  /// A byte whose stop bit ends at `cycle`, or as soon after the one before as a byte lasts.
  void Deliver(uint8_t byte, uint64_t cycle, AvrByteFault fault = AvrByteFault::kNone);

  /// After a reset: registers as after power-up; bytes on the wire still arrive.
  void OnReset();

  const AvrUartCounters& counters() const { return counters_; }
  /// Bytes delivered that have not arrived yet.
  size_t underway() const { return underway_.size(); }
  /// An error in the firmware's use of the UART; empty if there is none.
  const std::string& error() const { return error_; }

 private:
  struct Arrival {
    uint8_t byte;
    uint64_t cycle;
    AvrByteFault fault;
  };

  static uint8_t ReadData(avr_t* avr, uint16_t address, void* self);
  static void WriteData(avr_t* avr, uint16_t address, uint8_t value, void* self);
  static void WriteStatus(avr_t* avr, uint16_t address, uint8_t value, void* self);
  static void WriteControl(avr_t* avr, uint16_t address, uint8_t value, void* self);
  static void OnReturn(avr_irq_t* irq, uint32_t running, void* self);
  static uint64_t EndOfSent(avr_t* avr, uint64_t when, void* self);
  static uint64_t EndOfReceived(avr_t* avr, uint64_t when, void* self);

  uint8_t& Register(uint16_t address) const;
  void ScheduleArrival();
  void ShowFaults();
  void Request();
  uint64_t CyclesPerBit() const;
  uint64_t CyclesPerByte();
  bool SameRate() const;
  int64_t Baud() const;
  void Fail(const std::string& what);

  avr_t* avr_;
  avr_uart_t* uart_;
  int64_t nominal_baud_;
  bool may_differ_;
  std::function<void(uint8_t, uint64_t)> on_sent_;
  AvrUartCounters counters_;
  std::string error_;

  std::deque<Arrival> underway_;  // on the wire to us
  uint64_t last_arrival_ = 0;     // of those given to Deliver
  std::deque<Arrival> received_;  // at most two

  bool shifting_ = false;
  uint8_t shift_ = 0;
  bool holding_ = false;  // the data register is full
  uint8_t held_ = 0;
};

}  // namespace pheromone::sim
