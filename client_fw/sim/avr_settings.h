// What is in the EEPROM of an AVR robot that was told its settings, as if an operator had done so
// over the radio.
//
//   AvrRobotConfig config;
//   config.machine.eeprom = AvrEepromWith(settings, /*starts=*/17);
//
// `starts` is how often it was switched on and told something before: HELLO's nonce will be the
// next number, so that another run is another start. Pure; any thread.
#pragma once

#include <cstdint>
#include <vector>

#include "client_fw/core/settings.h"

namespace pheromone::sim {

/// `starts` is at least 1. The result goes to address 0 (client_fw/boards/avr/eeprom.h).
std::vector<uint8_t> AvrEepromWith(const client::Settings& settings, uint16_t starts);

}  // namespace pheromone::sim
