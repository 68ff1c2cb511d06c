// For sketches that reach the server by Wi-Fi or Ethernet. Apart from Pheromone.h: an AVR pays 400
// bytes of flash for IPAddress.
#pragma once

#include "client_fw/boards/arduino/udp_link.h"

using pheromone::arduino::PheromoneUdp;
