#include "client_fw/sim/avr/avr_pins.h"

#include <simavr/avr_ioport.h>
#include <simavr/sim_avr.h>

#include <cassert>
#include <utility>

namespace pheromone::sim {
namespace {

constexpr uint16_t kPinRegister[] = {0x20, 0x23, 0x26, 0x29};  // PINA to PIND

uint8_t Bit(int bit) {
  return static_cast<uint8_t>(1u << bit);
}

}  // namespace

void AvrPins::Drive(AvrPin pin, bool high) {
  assert(pin.port >= 'A' && pin.port <= 'D' && pin.bit >= 0 && pin.bit < 8);
  Port& port = ports_[static_cast<size_t>(pin.port - 'A')];
  port.driven |= Bit(pin.bit);
  port.levels =
      static_cast<uint8_t>(high ? port.levels | Bit(pin.bit) : port.levels & ~Bit(pin.bit));
  avr_ioport_external_t external{};
  external.name = static_cast<unsigned char>(pin.port) & 0x7Fu;
  external.mask = port.driven;
  external.value = port.levels;
  avr_ioctl(avr_, static_cast<uint32_t>(AVR_IOCTL_IOPORT_SET_EXTERNAL(pin.port)), &external);
  avr_raise_irq(Irq(pin), high ? 1 : 0);
}

void AvrPins::Watch(AvrPin pin, std::function<void(bool)> on_change) {
  watched_.push_back({avr_, pin, std::move(on_change), false});
  avr_irq_register_notify(Irq(pin), &OnLevel, &watched_.back());
}

// The registers are cleared by now, but the simulator only updates them on changes. (It must not be
// given unchanged levels: after a low level on an external interrupt's pin it polls that pin each
// cycle.)
void AvrPins::OnReset() {
  for (char name = 'A'; name <= 'D'; ++name) {
    const auto index = static_cast<size_t>(name - 'A');
    if (Irq({name, 0}) == nullptr) {
      continue;  // this chip has no such port
    }
    const uint8_t high = ports_[index].driven & ports_[index].levels;
    for (int bit = 0; bit < 8; ++bit) {
      const uint32_t level = (high & Bit(bit)) != 0 ? 1 : 0;
      avr_irq_t* irq = Irq({name, bit});
      if ((irq->value & 1u) != level) {
        avr_raise_irq(irq, level);
      }
    }
    avr_->data[kPinRegister[index]] = high;
  }
}

// Inputs come here too.
void AvrPins::OnLevel(avr_irq_t* /*irq*/, uint32_t value, void* watched) {
  Watched& one = *static_cast<Watched*>(watched);
  avr_ioport_state_t state{};
  avr_ioctl(one.avr, static_cast<uint32_t>(AVR_IOCTL_IOPORT_GETSTATE(one.pin.port)), &state);
  const bool high = (value & 1u) != 0 && (state.ddr & Bit(one.pin.bit)) != 0;
  if (high != one.high) {
    one.high = high;
    one.on_change(high);
  }
}

avr_irq_t* AvrPins::Irq(AvrPin pin) const {
  return avr_io_getirq(avr_, static_cast<uint32_t>(AVR_IOCTL_IOPORT_GETIRQ(pin.port)), pin.bit);
}

}  // namespace pheromone::sim
