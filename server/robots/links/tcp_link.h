// A TCP listener for many robots, each on its own connection or several on one. All of them belong
// to the same link; the connection only determines where an answer is sent.
#pragma once

#include <memory>

#include <boost/asio/io_context.hpp>

#include "server/robots/links/link.h"

namespace pheromone::links {

/// Answers go to the connection of their request, commands to the connection on which their robot
/// was last heard, and broadcasts to every connection. No medium access.
std::unique_ptr<Link> MakeTcpLink(boost::asio::io_context& io, const LinkConfig& config,
                                  LinkContext context);

}  // namespace pheromone::links
