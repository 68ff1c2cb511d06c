// Who has a device open, as far as /proc tells: for the words of an error.
//
//   Error{path + ": busy, " + DescribeHolders(path)}
//
// Without special rights, only the programs of the same user can be looked into. Reads /proc at
// each call; thread-safe.
#pragma once

#include <string>

namespace pheromone::links {

/// "held by picocom (process 4711)". If nobody can be found, that is said, and whether ModemManager
/// runs, which opens new serial ports to find out whether they are telephones. `device` has no
/// symbolic links in it. This process is not told of.
std::string DescribeHolders(const std::string& device, const std::string& proc = "/proc");

}  // namespace pheromone::links
