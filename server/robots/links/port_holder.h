// Finds which programs have a device open, from /proc, for an error message.
//
//   Error{path + ": busy, " + DescribeHolders(path)}
//
// Without privileges, only the programs of the same user are visible. Reads /proc on each call;
// thread-safe.
#pragma once

#include <string>

namespace pheromone::links {

/// "held by picocom (process 4711, since 2026-11-26 15:22:14)". If no process can be found, the
/// text says so, and whether ModemManager runs, which opens new serial ports to find mobile modems.
/// This process is not listed.
std::string DescribeHolders(const std::string& device, const std::string& proc = "/proc");

}  // namespace pheromone::links
