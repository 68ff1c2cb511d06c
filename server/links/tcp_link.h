// A TCP listener: many robots, each over a connection of its own or several over one. All of them
// belong to the one link; a connection is only where to answer.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include <boost/asio/io_context.hpp>

#include "server/links/backoff.h"
#include "server/links/link.h"

namespace pheromone::links {

struct TcpOptions {
  std::string listen_address;  ///< numeric, IPv4 or IPv6
  uint16_t listen_port = 0;    ///< 0: the system chooses, see Link::address
  uint16_t gap_timeout_ms = 10'000;
  /// One more, and one is closed: the first of those on which no robot has spoken, else the one
  /// silent for longest.
  size_t max_connections = 64;
  BackoffOptions backoff;
};

/// Answers go to the connection that asked for them, commands to the one from which their robot
/// spoke last, messages to all robots to every connection. No medium access.
std::unique_ptr<Link> MakeTcpLink(boost::asio::io_context& io, TcpOptions options,
                                  LinkContext context);

}  // namespace pheromone::links
