// In a build without libsimavr: see avr_robots.cc.
#include <stdexcept>

#include "client_fw/swarm/robots.h"

namespace pheromone::swarm {

bool HasAvrRobots() {
  return false;
}

std::string BuiltAvrImage() {
  return {};
}

std::string BuiltForagerImage() {
  return {};
}

std::unique_ptr<sim::MobileRobot> MakeAvrRobot(const RobotConfig& /*config*/,
                                               sim::RadioMedium* /*medium*/) {
  throw std::runtime_error("this build has no AVR robots: libsimavr was not found");
}

}  // namespace pheromone::swarm
