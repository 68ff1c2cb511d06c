// Robots that run an AVR's image, if libsimavr is available: a program that includes this file is
// under the terms of the GPL. Otherwise no_avr_robots.cc replaces it.
#include <stdexcept>

#include "client_fw/sim/avr/avr_robot.h"
#include "client_fw/sim/avr/avr_settings.h"
#include "client_fw/swarm/robots.h"

namespace pheromone::swarm {
namespace {

// One that was given by its file is taken at its word.
std::string SignedImageOf(const std::string& image) {
  if (image == BuiltForagerImage()) {
    throw std::runtime_error("the image of a robot with a net does not sign frames");
  }
  return image == BuiltAvrImage() ? PHEROMONE_SIGNED_AVR_IMAGE : image;
}

}  // namespace

bool HasAvrRobots() {
  return true;
}

std::string BuiltAvrImage() {
  return PHEROMONE_CLIENT_AVR_IMAGE;
}

std::string BuiltForagerImage() {
  return PHEROMONE_FORAGER_AVR_IMAGE;
}

std::unique_ptr<sim::MobileRobot> MakeAvrRobot(const RobotConfig& config,
                                               sim::RadioMedium* medium) {
  sim::AvrRobotConfig avr;
  avr.machine.image = config.image;
  avr.machine.eeprom = sim::AvrEepromWith(ClientOf(config), config.client.boot_counter);
  if (config.client.key != nullptr) {
    avr.is_signed = true;
    avr.machine.image = SignedImageOf(config.image);
    sim::GiveAvrKey(config.client.key, &avr.machine.eeprom);
  }
  avr.machine.seed = config.client.boot_counter;
  avr.id = config.client.id;
  avr.pioneer = PioneerOf(config);
  avr.start = config.start;
  avr.keyed = config.keyed;
  return std::make_unique<sim::AvrRobot>(avr, medium);
}

}  // namespace pheromone::swarm
