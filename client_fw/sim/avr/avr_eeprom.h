// The EEPROM of an AVR in libsimavr, with the write time of the real chip. The simulator's own
// EEPROM writes at once, so that no power loss could interrupt a write.
//
// A byte is being programmed for 3.4 ms (1.8 ms if only erased or only written); until then EEPE
// stays set, and neither reading nor another write is begun. A reset leaves the programming alone,
// and rubbish in the registers that the data sheet calls undefined;
// a loss of power leaves an arbitrary byte behind. The contents outlive both.
//
// Belongs to the AvrMachine; one thread. Source: ATmega1284P data sheet (8272G), section 8.4.
#pragma once

#include <cstdint>
#include <vector>

struct avr_eeprom_t;
struct avr_t;

namespace pheromone::sim {

class AvrEeprom {
 public:
  /// Takes over the EEPROM of `avr`, which must outlive it. Throws std::runtime_error if there is
  /// none.
  explicit AvrEeprom(avr_t* avr);
  AvrEeprom(const AvrEeprom&) = delete;
  AvrEeprom& operator=(const AvrEeprom&) = delete;

  /// From address 0; the rest is kept. Throws std::runtime_error if it does not fit.
  void Load(const std::vector<uint8_t>& contents);
  std::vector<uint8_t> contents() const;
  /// Bytes programmed since the machine was created: wear.
  uint64_t writes() const { return writes_; }

  /// After a reset: continues programming. Registers that are undefined then, the address and the
  /// mode, get the bits of `rubbish`.
  void OnReset(uint32_t rubbish);
  /// After a loss of power: a byte being programmed becomes `garbage`.
  void OnPowerLoss(uint8_t garbage);

 private:
  static void WriteControl(avr_t* avr, uint16_t address, uint8_t value, void* self);
  static uint64_t EndOfEnable(avr_t* avr, uint64_t when, void* self);
  static uint64_t EndOfProgramming(avr_t* avr, uint64_t when, void* self);

  uint8_t& Control();
  uint16_t Address() const;
  void Program(uint8_t mode);

  avr_t* avr_;
  avr_eeprom_t* eeprom_;
  bool programming_ = false;
  uint64_t done_cycle_ = 0;
  uint16_t address_ = 0;
  uint8_t value_ = 0;
  uint64_t writes_ = 0;
};

}  // namespace pheromone::sim
