// A TCP listener for many robots, each on its own connection or several on one. All of them belong
// to the same link; the connection only determines where an answer is sent.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include <boost/asio/io_context.hpp>

#include "server/robots/links/backoff.h"
#include "server/robots/links/link.h"

namespace pheromone::links {

struct TcpOptions {
  std::string listen_address;  ///< numeric, IPv4 or IPv6
  uint16_t listen_port = 0;    ///< 0: the system chooses, see Link::address
  uint16_t gap_timeout_ms = 10'000;
  /// When this is exceeded, a connection is closed: the oldest on which no robot has been heard, or
  /// else the one that has been silent for longest.
  size_t max_connections = 64;
  BackoffOptions backoff;
};

/// Answers go to the connection of their request, commands to the connection on which their robot
/// was last heard, and broadcasts to every connection. No medium access.
std::unique_ptr<Link> MakeTcpLink(boost::asio::io_context& io, TcpOptions options,
                                  LinkContext context);

}  // namespace pheromone::links
