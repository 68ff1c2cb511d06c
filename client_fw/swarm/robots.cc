#include "client_fw/swarm/robots.h"

#include "client_fw/sim/host_pioneer_robot.h"

namespace pheromone::swarm {

std::unique_ptr<sim::MobileRobot> MakeRobot(const RobotConfig& config, sim::RadioMedium* medium) {
  if (!config.image.empty()) {
    return MakeAvrRobot(config, medium);
  }
  if (config.pioneer == nullptr) {
    return std::make_unique<sim::SimulatedRobot>(config, medium);
  }
  sim::HostPioneerRobotConfig host;
  host.client = config.client;
  host.pioneer.model = *config.pioneer;
  host.pioneer.blocked = config.drive.blocked;
  host.start = config.start;
  host.turnaround_ns = config.turnaround_ns;
  return std::make_unique<sim::HostPioneerRobot>(host, medium);
}

}  // namespace pheromone::swarm
