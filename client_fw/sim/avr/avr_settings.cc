#include "client_fw/sim/avr/avr_settings.h"

#include <array>

#include "client_fw/boards/nonvolatile.h"

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
  for (uint16_t start = 0; start < starts; ++start) {
    nonvolatile.Save(packed.data());
    while (!nonvolatile.saved()) {
      nonvolatile.Step();
    }
  }
  return HostEeprom::Bytes();
}

}  // namespace pheromone::sim
