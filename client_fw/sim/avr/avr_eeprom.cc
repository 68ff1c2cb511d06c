#include "client_fw/sim/avr/avr_eeprom.h"

#include <simavr/avr_eeprom.h>
#include <simavr/sim_avr.h>

#include <algorithm>
#include <cstring>
#include <stdexcept>
#include <string>

namespace pheromone::sim {
namespace {

// EECR.
constexpr uint8_t kRead = 0x01;
constexpr uint8_t kProgram = 0x02;
constexpr uint8_t kProgramEnable = 0x04;
constexpr uint8_t kReadyInterrupt = 0x08;
constexpr uint8_t kMode = 0x30;
constexpr uint8_t kEraseAndWrite = 0x00;
constexpr uint8_t kEraseOnly = 0x10;

constexpr uint64_t kEnabledCycles = 4;
constexpr uint64_t kEraseAndWriteUs = 3400;
constexpr uint64_t kOneOfThemUs = 1800;

avr_eeprom_t* Find(avr_t* avr) {
  for (avr_io_t* io = avr->io_port; io != nullptr; io = io->next) {
    if (std::strcmp(io->kind, "eeprom") == 0) {
      return reinterpret_cast<avr_eeprom_t*>(io);  // its first member
    }
  }
  throw std::runtime_error("this AVR has no EEPROM");
}

}  // namespace

AvrEeprom::AvrEeprom(avr_t* avr) : avr_(avr), eeprom_(Find(avr)) {
  avr->io[AVR_DATA_TO_IO(eeprom_->r_eecr)].w = {this, &WriteControl};
}

void AvrEeprom::Load(const std::vector<uint8_t>& contents) {
  if (contents.size() > eeprom_->size) {
    throw std::runtime_error("an EEPROM of " + std::to_string(eeprom_->size) +
                             " bytes cannot hold " + std::to_string(contents.size()));
  }
  std::copy(contents.begin(), contents.end(), eeprom_->eeprom);
}

std::vector<uint8_t> AvrEeprom::contents() const {
  return {eeprom_->eeprom, eeprom_->eeprom + eeprom_->size};
}

void AvrEeprom::OnReset(uint32_t rubbish) {
  avr_->data[eeprom_->r_eearl] = static_cast<uint8_t>(rubbish);
  avr_->data[eeprom_->r_eearh] = static_cast<uint8_t>(rubbish >> 8 & (eeprom_->size - 1u) >> 8);
  Control() = static_cast<uint8_t>(rubbish >> 16 & kMode);
  if (programming_) {
    Control() |= kProgram;
    avr_cycle_timer_register(avr_, done_cycle_ > avr_->cycle ? done_cycle_ - avr_->cycle : 0,
                             &EndOfProgramming, this);
  }
}

void AvrEeprom::OnPowerLoss(uint8_t garbage) {
  if (programming_) {
    programming_ = false;
    eeprom_->eeprom[address_] = garbage;
  }
}

uint8_t& AvrEeprom::Control() {
  return avr_->data[eeprom_->r_eecr];
}

uint16_t AvrEeprom::Address() const {
  const int address = avr_->data[eeprom_->r_eearl] | (avr_->data[eeprom_->r_eearh] << 8);
  return static_cast<uint16_t>(address & (eeprom_->size - 1));  // a power of two
}

void AvrEeprom::WriteControl(avr_t* avr, uint16_t /*address*/, uint8_t value, void* self) {
  AvrEeprom& eeprom = *static_cast<AvrEeprom*>(self);
  uint8_t& control = eeprom.Control();
  const bool enabled = (control & kProgramEnable) != 0;
  const uint8_t state = static_cast<uint8_t>(control & (kProgram | kProgramEnable));
  control = static_cast<uint8_t>(state | (value & (kMode | kReadyInterrupt)));
  if (!eeprom.programming_) {
    if ((value & kProgram) != 0 && enabled) {
      eeprom.Program(static_cast<uint8_t>(value & kMode));
    } else if ((value & kProgramEnable) != 0) {
      control |= kProgramEnable;
      // Counted from the end of this instruction, which takes two cycles.
      avr_cycle_timer_register(avr, 2 + kEnabledCycles, &EndOfEnable, self);
    }
    if ((value & kRead) != 0 && !eeprom.programming_) {
      avr->data[eeprom.eeprom_->r_eedr] = eeprom.eeprom_->eeprom[eeprom.Address()];
    }
  }
  if ((control & kReadyInterrupt) != 0 && !eeprom.programming_) {
    avr_raise_interrupt(avr, &eeprom.eeprom_->ready);
  }
}

void AvrEeprom::Program(uint8_t mode) {
  Control() = static_cast<uint8_t>((Control() & ~kProgramEnable) | kProgram);
  programming_ = true;
  address_ = Address();
  const uint8_t data = avr_->data[eeprom_->r_eedr];
  if (mode == kEraseAndWrite) {
    value_ = data;
  } else if (mode == kEraseOnly) {
    value_ = 0xFF;
  } else {
    value_ = static_cast<uint8_t>(eeprom_->eeprom[address_] & data);
  }
  const uint64_t us = mode == kEraseAndWrite ? kEraseAndWriteUs : kOneOfThemUs;
  const uint64_t cycles = us * avr_->frequency / 1'000'000;
  done_cycle_ = avr_->cycle + cycles;
  avr_cycle_timer_register(avr_, cycles, &EndOfProgramming, this);
}

uint64_t AvrEeprom::EndOfEnable(avr_t* /*avr*/, uint64_t /*when*/, void* self) {
  AvrEeprom& eeprom = *static_cast<AvrEeprom*>(self);
  eeprom.Control() = static_cast<uint8_t>(eeprom.Control() & ~kProgramEnable);
  return 0;
}

uint64_t AvrEeprom::EndOfProgramming(avr_t* avr, uint64_t /*when*/, void* self) {
  AvrEeprom& eeprom = *static_cast<AvrEeprom*>(self);
  eeprom.programming_ = false;
  ++eeprom.writes_;
  eeprom.eeprom_->eeprom[eeprom.address_] = eeprom.value_;
  eeprom.Control() = static_cast<uint8_t>(eeprom.Control() & ~kProgram);
  if ((eeprom.Control() & kReadyInterrupt) != 0) {
    avr_raise_interrupt(avr, &eeprom.eeprom_->ready);
  }
  return 0;
}

}  // namespace pheromone::sim
