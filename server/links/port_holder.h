// Finds which programs have a device open, from /proc, for an error message.
//
//   Error{path + ": busy, " + DescribeHolders(path)}
//
// Without privileges, only the programs of the same user are visible. Reads /proc on each call;
// thread-safe.
#pragma once

#include <string>

namespace pheromone::links {

/// "held by picocom (process 4711)". If nobody can be found, that is said, and whether ModemManager
/// runs, which opens new serial ports to find out whether they are telephones. `device` has no
/// symbolic links in it. This process is not told of.
std::string DescribeHolders(const std::string& device, const std::string& proc = "/proc");

}  // namespace pheromone::links
