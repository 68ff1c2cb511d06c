// The contents of the EEPROM of an AVR robot whose settings an operator has changed over the radio.
//
//   AvrRobotConfig config;
//   config.machine.eeprom = AvrEepromWith(settings, /*starts=*/17);
//
// `starts` is the number of earlier starts: HELLO's nonce will be the next number, so that each run
// is a new start. Pure; any thread.
#pragma once

#include <cstdint>
#include <vector>

#include "client_fw/core/steering/settings.h"

namespace pheromone::sim {

/// `starts` is at least 1. The result goes to address 0 (client_fw/boards/avr/eeprom.h).
std::vector<uint8_t> AvrEepromWith(const client::Settings& settings, uint16_t starts);

}  // namespace pheromone::sim
