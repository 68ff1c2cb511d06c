#include "client_fw/sim/avr/avr_uart.h"

#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>

#include <cstdlib>
#include <cstring>
#include <stdexcept>

namespace pheromone::sim {
namespace {

constexpr uint64_t kBitsAByte = 10;  // start, eight, stop
constexpr size_t kReceiveBuffer = 2;
constexpr int64_t kTolerancePercent = 2;

// UCSRnA.
constexpr uint8_t kReceiveComplete = 0x80;
constexpr uint8_t kTransmitComplete = 0x40;
constexpr uint8_t kDataRegisterEmpty = 0x20;
constexpr uint8_t kDataOverrun = 0x08;
constexpr uint8_t kFramingError = 0x10;
constexpr uint8_t kDoubleSpeed = 0x02;
constexpr uint8_t kWritableStatus = 0x03;  // U2X, MPCM
// UCSRnB.
constexpr uint8_t kReceiveInterrupt = 0x80;
constexpr uint8_t kTransmitInterrupt = 0x40;
constexpr uint8_t kDataRegisterInterrupt = 0x20;
constexpr uint8_t kReceiverOn = 0x10;
constexpr uint8_t kTransmitterOn = 0x08;
constexpr uint8_t kNineBits = 0x04;
// UCSRnC: asynchronous, no parity, one stop bit, eight bits.
constexpr uint8_t kEightNoneOne = 0x06;

avr_uart_t* Find(avr_t* avr, char name) {
  for (avr_io_t* io = avr->io_port; io != nullptr; io = io->next) {
    if (std::strcmp(io->kind, "uart") == 0) {
      auto* uart = reinterpret_cast<avr_uart_t*>(io);  // its first member
      if (uart->name == name) {
        return uart;
      }
    }
  }
  throw std::runtime_error(std::string("this AVR has no UART") + name);
}

// What a receiver at rate `to` reads of a byte sent at rate `from`: it samples in the middle of
// each of its bits. Bit 8 is the stop bit.
unsigned Sampled(uint8_t byte, int64_t from, int64_t to) {
  const unsigned line = byte * 2u | ~0x1FFu;  // start bit, byte, and high from the stop bit on
  unsigned sampled = 0;
  for (int64_t bit = 0; bit < 9; ++bit) {
    const int64_t at = (2 * bit + 3) * from / (2 * to);
    sampled |= (at > 9 ? 1u : line >> at & 1u) << bit;
  }
  return sampled;
}

}  // namespace

AvrUart::AvrUart(avr_t* avr, char name, int64_t nominal_baud, bool may_differ)
    : avr_(avr), uart_(Find(avr, name)), nominal_baud_(nominal_baud), may_differ_(may_differ) {
  const auto io = [avr](uint16_t address) -> auto& {
    return avr->io[AVR_DATA_TO_IO(address)];
  };
  io(uart_->r_udr).r = {this, &ReadData};
  io(uart_->r_udr).w = {this, &WriteData};
  io(uart_->r_ucsra).r = {nullptr, nullptr};
  io(uart_->r_ucsra).w = {this, &WriteStatus};
  io(uart_->r_ucsrb).w = {this, &WriteControl};
  io(uart_->ubrrl.reg).w = {nullptr, nullptr};
  // A level-triggered interrupt is raised again if its condition still holds when its handler
  // returns.
  for (avr_int_vector_t* vector : {&uart_->rxc, &uart_->udrc}) {
    avr_irq_register_notify(vector->irq + AVR_INT_IRQ_RUNNING, &OnReturn, this);
  }
  OnReset();
}

void AvrUart::OnReset() {
  shifting_ = false;
  holding_ = false;
  received_.clear();
  Register(uart_->r_ucsra) = kDataRegisterEmpty;
  Register(uart_->r_ucsrb) = 0;  // the simulator's own switches its transmitter on
  Register(uart_->r_ucsrc) = kEightNoneOne;
  if (!underway_.empty()) {
    ScheduleArrival();
  }
}

void AvrUart::OnReturn(avr_irq_t* /*irq*/, uint32_t running, void* self) {
  if (running == 0) {
    static_cast<AvrUart*>(self)->Request();
  }
}

void AvrUart::Request() {
  const uint8_t status = Register(uart_->r_ucsra);
  const uint8_t control = Register(uart_->r_ucsrb);
  if ((status & kReceiveComplete) != 0 && (control & kReceiveInterrupt) != 0) {
    avr_raise_interrupt(avr_, &uart_->rxc);
  }
  if ((status & kDataRegisterEmpty) != 0 && (control & kDataRegisterInterrupt) != 0) {
    avr_raise_interrupt(avr_, &uart_->udrc);
  }
}

uint8_t& AvrUart::Register(uint16_t address) const {
  return avr_->data[address];
}

uint8_t AvrUart::ReadData(avr_t* avr, uint16_t address, void* self) {
  AvrUart& uart = *static_cast<AvrUart*>(self);
  if (!uart.received_.empty()) {
    avr->data[address] = uart.received_.front().byte;
    uart.received_.pop_front();
  }
  uint8_t& status = uart.Register(uart.uart_->r_ucsra);
  status = static_cast<uint8_t>(status & ~kDataOverrun);
  uart.ShowFaults();
  if (uart.received_.empty()) {
    status = static_cast<uint8_t>(status & ~kReceiveComplete);
    avr_clear_interrupt(avr, &uart.uart_->rxc);
  }
  return avr->data[address];
}

void AvrUart::WriteData(avr_t* avr, uint16_t /*address*/, uint8_t value, void* self) {
  AvrUart& uart = *static_cast<AvrUart*>(self);
  if ((uart.Register(uart.uart_->r_ucsrb) & kTransmitterOn) == 0) {
    return;
  }
  if (uart.holding_) {
    uart.Fail("was given a byte while its data register was full");
    return;
  }
  if (uart.shifting_) {
    uart.holding_ = true;
    uart.held_ = value;
    uint8_t& status = uart.Register(uart.uart_->r_ucsra);
    status = static_cast<uint8_t>(status & ~kDataRegisterEmpty);
    avr_clear_interrupt(avr, &uart.uart_->udrc);
    return;
  }
  uart.shifting_ = true;
  uart.shift_ = value;
  avr_cycle_timer_register(avr, uart.CyclesPerByte(), &EndOfSent, self);
}

void AvrUart::WriteStatus(avr_t* avr, uint16_t address, uint8_t value, void* self) {
  AvrUart& uart = *static_cast<AvrUart*>(self);
  const uint8_t kept = static_cast<uint8_t>(avr->data[address] & ~kWritableStatus);
  avr->data[address] = static_cast<uint8_t>(kept | (value & kWritableStatus));
  if ((value & kTransmitComplete) != 0) {
    avr_clear_interrupt(avr, &uart.uart_->txc);  // the flag too
  }
}

void AvrUart::WriteControl(avr_t* avr, uint16_t address, uint8_t value, void* self) {
  AvrUart& uart = *static_cast<AvrUart*>(self);
  avr->data[address] = value;
  if ((value & kReceiverOn) == 0) {
    uart.received_.clear();
    uint8_t& status = uart.Register(uart.uart_->r_ucsra);
    status = static_cast<uint8_t>(status & ~(kReceiveComplete | kDataOverrun));
    avr_clear_interrupt(avr, &uart.uart_->rxc);
  }
  // A flag that was set before its mask interrupts as soon as permitted; the simulator's own never
  // did.
  uart.Request();
  if ((value & kTransmitInterrupt) != 0 &&
      (uart.Register(uart.uart_->r_ucsra) & kTransmitComplete) != 0) {
    avr_raise_interrupt(avr, &uart.uart_->txc);
  }
}

uint64_t AvrUart::EndOfSent(avr_t* avr, uint64_t when, void* self) {
  AvrUart& uart = *static_cast<AvrUart*>(self);
  ++uart.counters_.sent;
  const unsigned seen = uart.SameRate() ? uart.shift_ | 0x100u
                                        : Sampled(uart.shift_, uart.Baud(), uart.nominal_baud_);
  if (uart.on_sent_ && (seen & 0x100u) != 0) {
    uart.on_sent_(static_cast<uint8_t>(seen), when);
  }
  if (!uart.holding_) {
    uart.shifting_ = false;
    avr_raise_interrupt(avr, &uart.uart_->txc);
    return 0;
  }
  uart.holding_ = false;
  uart.shift_ = uart.held_;
  avr_raise_interrupt(avr, &uart.uart_->udrc);
  return when + uart.CyclesPerByte();
}

// The flags are those of the byte that is read next.
void AvrUart::ShowFaults() {
  const AvrByteFault fault = received_.empty() ? AvrByteFault::kNone : received_.front().fault;
  uint8_t& status = Register(uart_->r_ucsra);
  status = static_cast<uint8_t>(status & ~kFramingError);
  if (fault == AvrByteFault::kNoStopBit) {
    status |= kFramingError;
  } else if (fault == AvrByteFault::kOverrun) {
    status |= kDataOverrun;
  }
}

void AvrUart::Deliver(uint8_t byte, uint64_t cycle, AvrByteFault fault) {
  // Rounded down: a peer whose bytes last exactly this long must not be slowed by a rounding.
  const uint64_t nominal = avr_->frequency * kBitsAByte / static_cast<uint64_t>(nominal_baud_) - 1;
  if (last_arrival_ != 0 && cycle < last_arrival_ + nominal) {
    cycle = last_arrival_ + nominal;
  }
  last_arrival_ = cycle;
  underway_.push_back({byte, cycle, fault});
  if (underway_.size() == 1) {
    ScheduleArrival();
  }
}

void AvrUart::ScheduleArrival() {
  const uint64_t at = underway_.front().cycle;
  avr_cycle_timer_register(avr_, at > avr_->cycle ? at - avr_->cycle : 0, &EndOfReceived, this);
}

uint64_t AvrUart::EndOfReceived(avr_t* avr, uint64_t /*when*/, void* self) {
  AvrUart& uart = *static_cast<AvrUart*>(self);
  Arrival arrival = uart.underway_.front();
  uart.underway_.pop_front();
  if (!uart.SameRate()) {
    const unsigned seen = Sampled(arrival.byte, uart.nominal_baud_, uart.Baud());
    arrival.byte = static_cast<uint8_t>(seen);
    arrival.fault = (seen & 0x100u) != 0 ? arrival.fault : AvrByteFault::kNoStopBit;
  }
  if ((uart.Register(uart.uart_->r_ucsrb) & kReceiverOn) == 0) {
    ++uart.counters_.deaf;
  } else if (uart.received_.size() == kReceiveBuffer) {
    ++uart.counters_.overruns;
    uart.Register(uart.uart_->r_ucsra) |= kDataOverrun;
  } else {
    uart.CyclesPerByte();  // for its check
    ++uart.counters_.received;
    uart.received_.push_back(arrival);
    uart.ShowFaults();
    avr_raise_interrupt(avr, &uart.uart_->rxc);
  }
  return uart.underway_.empty() ? 0 : uart.underway_.front().cycle;
}

// At the firmware's setting, which is read for every byte.
uint64_t AvrUart::CyclesPerBit() const {
  const uint64_t divisor =
      1u + (Register(uart_->ubrrl.reg) | (static_cast<uint32_t>(Register(uart_->ubrrh.reg)) << 8));
  return ((Register(uart_->r_ucsra) & kDoubleSpeed) != 0 ? 8 : 16) * divisor;
}

int64_t AvrUart::Baud() const {
  return static_cast<int64_t>(avr_->frequency / CyclesPerBit());
}

bool AvrUart::SameRate() const {
  return std::abs(Baud() - nominal_baud_) * 100 <= nominal_baud_ * kTolerancePercent;
}

uint64_t AvrUart::CyclesPerByte() {
  if (!may_differ_ && !SameRate()) {
    Fail("is set to " + std::to_string(Baud()) + " baud instead of " +
         std::to_string(nominal_baud_));
  }
  if (Register(uart_->r_ucsrc) != kEightNoneOne || (Register(uart_->r_ucsrb) & kNineBits) != 0) {
    Fail("is not set to eight bits, no parity, one stop bit");
  }
  return kBitsAByte * CyclesPerBit();
}

void AvrUart::Fail(const std::string& what) {
  if (error_.empty()) {
    error_ = std::string("the firmware's UART") + uart_->name + ' ' + what;
  }
}

}  // namespace pheromone::sim
