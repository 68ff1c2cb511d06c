#include "client_fw/swarm/robots.h"

#include <cassert>
#include <cmath>

#include "client_fw/sim/pioneer/host_pioneer_robot.h"

namespace pheromone::swarm {

sim::PioneerConfig PioneerOf(const RobotConfig& config) {
  assert(config.pioneer != nullptr);
  sim::PioneerConfig pioneer;
  pioneer.model = *config.pioneer;
  pioneer.model.radius_mm = static_cast<int>(std::lround(config.radius_m * 1000));
  pioneer.blocked = config.drive.blocked;
  pioneer.range = config.range;
  return pioneer;
}

client::Parameters ClientOf(const RobotConfig& config) {
  client::Parameters client = config.client;
  if (config.pioneer->distance_mm != 1) {  // whole millimetres need no setting
    client.drive_scale = static_cast<uint16_t>(std::lround(config.pioneer->distance_mm * 10'000));
  }
  return client;
}

std::unique_ptr<sim::MobileRobot> MakeRobot(const RobotConfig& config, sim::RadioMedium* medium) {
  if (!config.image.empty()) {
    return MakeAvrRobot(config, medium);
  }
  if (config.pioneer == nullptr) {
    return std::make_unique<sim::SimulatedRobot>(config, medium);
  }
  sim::HostPioneerRobotConfig host;
  host.client = ClientOf(config);
  host.pioneer = PioneerOf(config);
  host.start = config.start;
  host.turnaround_ns = config.turnaround_ns;
  host.cleaner = config.cleaner;
  host.forager = config.forager;
  return std::make_unique<sim::HostPioneerRobot>(host, medium);
}

}  // namespace pheromone::swarm
