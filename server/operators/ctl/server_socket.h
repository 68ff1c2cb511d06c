// Which server is talked to: its Unix socket, and whose it may be.
//
//   PHEROMONE_TRY(const ServerSocket socket, ChooseSocket(options.socket));
//   if (socket.is_found) { ... }   // nobody named it
//
// A socket that merely lies in the working directory could be anybody's, such as in /tmp: it is
// used only if it is this user's or root's.
#pragma once

#include <sys/types.h>

#include <string>

#include "server/base/result.h"

namespace pheromone::ctl {

struct ServerSocket {
  std::string path;
  bool is_named = false;  ///< on the command line
  bool is_found = false;  ///< in the working directory: CheckOwner must accept who serves it
};

/// `named`, or $PHEROMONE_SOCKET, or pheromoned.sock in the working directory if it exists, or
/// /run/pheromone/pheromoned/pheromoned.sock. Error: the one in the working directory is another
/// user's.
Result<ServerSocket> ChooseSocket(const std::string& named);

/// Error unless `owner` is this user or root; `verb` says what the owner does: "belongs to".
Status CheckOwner(const std::string& socket, const std::string& verb, uid_t owner);

/// The socket of the service configured by /etc/pheromone/NAME.toml.
std::string SocketOf(const std::string& instance);

/// The service whose socket it is, "lab" of /run/pheromone/lab/pheromoned.sock; empty: of none.
std::string InstanceOf(const std::string& socket);

/// /etc/pheromone/NAME.toml.
std::string ConfigOf(const std::string& instance);

/// The same, if the service has one; else empty. `instance` may be empty: none.
std::string ServiceConfigOf(const std::string& instance);

/// A user's name, or the number if there is none. For one thread.
std::string UserName(uid_t id);

}  // namespace pheromone::ctl
