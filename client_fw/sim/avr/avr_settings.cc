#include "client_fw/sim/avr/avr_settings.h"

#include <array>

#include "client_fw/boards/nonvolatile.h"
#include "protocol/aes.h"
#include "protocol/crc16.h"

namespace pheromone::sim {
namespace {

// Nonvolatile is designed for one chip with one EEPROM; here there is one per thread.
struct HostEeprom {
  static std::vector<uint8_t>& Bytes() {
    static thread_local std::vector<uint8_t> bytes;
    return bytes;
  }
  static uint8_t Read(uint8_t at) { return Bytes()[at]; }
  static bool Ready() { return true; }
  static void Write(uint8_t at, uint8_t value) { Bytes()[at] = value; }
};

}  // namespace

std::vector<uint8_t> AvrEepromWith(const client::Settings& settings, uint16_t starts) {
  HostEeprom::Bytes().assign(255, 0xFF);  // up to the ID
  client::Nonvolatile<HostEeprom, client::kSettingsSize> nonvolatile;
  std::array<uint8_t, client::kSettingsSize> packed{};
  client::PackSettings(settings, packed.data());
  nonvolatile.BeginBehind(static_cast<uint16_t>(starts - 1u));
  nonvolatile.Save(packed.data());
  while (!nonvolatile.saved()) {
    nonvolatile.Step();
  }
  return HostEeprom::Bytes();
}

void GiveAvrKey(const uint8_t* key, std::vector<uint8_t>* eeprom) {
  constexpr size_t kKeyAddress = 0x200;  // client_fw/boards/avr/eeprom.h
  eeprom->resize(kKeyAddress, 0xFF);
  eeprom->insert(eeprom->end(), key, key + protocol::kAesBlock);
  const uint16_t check = protocol::Check(key, protocol::kAesBlock);
  eeprom->push_back(static_cast<uint8_t>(check & 0xFFu));
  eeprom->push_back(static_cast<uint8_t>(check >> 8));
}

}  // namespace pheromone::sim
