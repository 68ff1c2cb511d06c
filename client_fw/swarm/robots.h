// The configuration and creation of a scenario's robots.
//
//   RobotConfig config;                               // the host's core with an ideal drive
//   config.pioneer = sim::FindPioneerModel("p3dx");   // now it drives a simulated Pioneer
//   config.image = "pheromone_client_avr.elf";        // and now that image does
//   std::unique_ptr<sim::MobileRobot> robot = MakeRobot(config, &medium);
//
// Only a build that found libsimavr can run images: HasAvrRobots().
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "client_fw/sim/mobile_robot.h"
#include "client_fw/sim/pioneer/pioneer_models.h"
#include "client_fw/sim/pioneer/pioneer_robot.h"
#include "client_fw/sim/radio_medium.h"
#include "client_fw/sim/simulated_robot.h"

namespace pheromone::swarm {

/// The client's parameters, its drive with the obstacles, start, and modem are those of any
/// SimulatedRobot. `power_on_ms`, `power_off_ms` and the odometry errors of `drive` are for ideal
/// drives only.
struct RobotConfig : sim::SimulatedRobotConfig {
  const sim::PioneerModel* pioneer = nullptr;  ///< null: an ideal differential drive
  std::string image = {};                      ///< of an AVR, which needs a Pioneer; empty: none
  std::optional<sim::KeyedModem> keyed = {};   ///< of an AVR; none: it keys itself
  sim::RangeFinder range = {};                 ///< of a Pioneer's sonars and bumpers; may be empty
  double radius_m = 0.25;                      ///< of the disc that `drive.blocked` stops
};

/// `medium` must outlive the robot, and the robot the medium's last event. Throws
/// std::runtime_error if an image cannot be run.
std::unique_ptr<sim::MobileRobot> MakeRobot(const RobotConfig& config, sim::RadioMedium* medium);

/// What MakeRobot and MakeAvrRobot make of a robot with a Pioneer: the Pioneer, in its
/// surroundings, and its client, which knows the length of the Pioneer's counts.
sim::PioneerConfig PioneerOf(const RobotConfig& config);
client::Parameters ClientOf(const RobotConfig& config);

/// Whether this build can run AVR images. It is then under the terms of libsimavr, the GPL.
bool HasAvrRobots();

/// The client's image that was built with this program; empty if none was.
std::string BuiltAvrImage();
/// That of a robot with a net (client_fw/core/tasks/forager.h).
std::string BuiltForagerImage();

/// MakeRobot for a robot with an image. Its client's settings (core/steering/settings.h) are in its
/// EEPROM, and `boot_counter` is the number of earlier starts; except for ID and key, the rest of
/// `client` is fixed in the image. With a key, the client's signed image is run in place of
/// BuiltAvrImage().
std::unique_ptr<sim::MobileRobot> MakeAvrRobot(const RobotConfig& config, sim::RadioMedium* medium);

}  // namespace pheromone::swarm
