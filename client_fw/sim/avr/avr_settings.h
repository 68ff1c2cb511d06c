// The contents of the EEPROM of an AVR robot whose settings an operator has changed over the radio.
//
//   AvrRobotConfig config;
//   config.machine.eeprom = AvrEepromWith(settings, /*starts=*/17);
//   GiveAvrKey(key, &config.machine.eeprom);                   // its image signs frames
//
// `starts` is the number of earlier starts: HELLO's nonce will be the next number, so that each run
// is a new start. Pure; any thread.
#pragma once

#include <cstdint>
#include <vector>

#include "client_fw/core/steering/settings.h"

namespace pheromone::sim {

/// The result goes to address 0 (client_fw/boards/avr/eeprom.h).
std::vector<uint8_t> AvrEepromWith(const client::Settings& settings, uint16_t starts);

/// Adds the robot's key, of kAesBlock bytes, as `pheromonectl keys export --eeprom` does.
void GiveAvrKey(const uint8_t* key, std::vector<uint8_t>* eeprom);

}  // namespace pheromone::sim
