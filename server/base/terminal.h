// A terminal device for one program at a time: on one modem, two would destroy each other's frames.
//
//   OpenedTerminal opened = OpenTerminal("/dev/ttyUSB0");
//   if (!opened.status.ok()) { return Error{"/dev/ttyUSB0: " + opened.status.error()}; }
//
// Programs keep each other away with flock(2), which needs no privileges, also works for
// pseudo-terminals, and ends with the process. Thread-safe.
#pragma once

#include <string>

#include "server/base/descriptor.h"
#include "server/base/result.h"

namespace pheromone {

struct OpenedTerminal {
  Descriptor descriptor;  ///< not blocking; its settings are unchanged
  Status status = Ok();   ///< "in use by pheromone-robot (process 4711, since ...)"
  bool in_use = false;    ///< that is why
};

/// The system's message for an error of opening a terminal device, and what to do if it is a matter
/// of permissions.
std::string WhyNotOpened(int error);

/// Opens and locks it until the descriptor is closed.
OpenedTerminal OpenTerminal(const std::string& path);

}  // namespace pheromone
