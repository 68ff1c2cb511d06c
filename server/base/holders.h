// Who has a device, a socket or a port, from /proc, for an error message.
//
//   Error{path + ": in use by " + DescribeProcess(pid)}
//
// Without privileges, only what processes of the same user have open is visible. Reads /proc on
// each call; thread-safe.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace pheromone {

/// "pheromoned (process 4711, since 2026-11-26 15:22:14)", local time; less where /proc tells less.
std::string DescribeProcess(int pid, const std::string& proc = "/proc");

/// The processes that have `target` open, by number, without this one: a path, which may have
/// symbolic links, or "socket:[4711]".
std::vector<int> HoldersOf(const std::string& target, const std::string& proc = "/proc");

/// The process that has the lock (flock) of an open file; nothing if it cannot be seen.
std::optional<int> HolderOfLock(int descriptor, const std::string& proc = "/proc");

enum class Transport { kTcp, kUdp };

/// The process that listens on a port, whatever the address; nothing if it cannot be seen.
std::optional<int> HolderOfPort(uint16_t port, Transport transport = Transport::kTcp,
                                const std::string& proc = "/proc");

}  // namespace pheromone
