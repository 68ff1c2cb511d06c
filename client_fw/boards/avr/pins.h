// The pins of the ATmega1284P; boards/README.md has a table for the wiring.
#pragma once

#include <avr/io.h>
#include <stdint.h>

namespace pheromone {
namespace client {

// Port D. RXD and TXD are the UARTs' own: 0 and 1 the radio's, 2 and 3 the robot's.
constexpr uint8_t kRadioRxd = 1u << PD0;
constexpr uint8_t kRobotRxd = 1u << PD2;
constexpr uint8_t kPtt = 1u << PD4;      ///< out, high: transmit
constexpr uint8_t kCarrier = 1u << PD5;  ///< in, low: the radio hears a carrier
constexpr uint8_t kLoad = 1u << PD6;     ///< out, high: hold the load
constexpr uint8_t kLed = 1u << PD7;      ///< out, high: light

// Port A: straps to ground, bit by bit the robot's ID; pulled up, so that no strap is ID 0.

}  // namespace client
}  // namespace pheromone
