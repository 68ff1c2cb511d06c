// Drives a robot in real time: moves the bytes between an AttachedRobot, its Pioneer and its modem.
//
//   AttachOptions options;
//   options.robot = ParseAddress("192.168.1.7:8101", 9600).value();
//   options.servers = {ParseAddress("udp:192.168.1.2:4951", 9600).value()};
//   options.client.start = ...;
//   const Result<bool> stands = Attach(options, StopOnSignals());
//
// Prints what happens (Reporter). Blocks until it is told to stop; nothing else in it blocks.
#pragma once

#include <csignal>
#include <cstdint>
#include <vector>

#include "client_fw/attach/address.h"
#include "client_fw/core/steering/parameters.h"
#include "server/base/result.h"

namespace pheromone::attach {

struct AttachOptions {
  Address robot;
  std::vector<Address> servers;  ///< ways to the server; of several, all UDP or all TCP (Servers)
  client::Parameters client;
  int64_t duration_ms = 0;      ///< 0: until it is told to stop
  int64_t status_every_ms = 0;  ///< a line about pose, intensities and wheels; 0: none
};

/// Runs until `*stop` is not 0, or for the duration; then stops the robot and closes its session.
/// False: the robot could not be told, or did not confirm that it stands. Error: another program
/// has one of the two terminals, whom the message names; nothing was begun.
Result<bool> Attach(const AttachOptions& options, const volatile std::sig_atomic_t* stop);

}  // namespace pheromone::attach
