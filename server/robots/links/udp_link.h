// A UDP listener for many robots, real or simulated, each at the source of its last request.
//
//   auto link = MakeUdpLink(io, {.listen = {"127.0.0.1", 4951}}, context);
//
// A datagram holds one or more complete frames; a partial frame at its end is discarded, and so is
// a datagram longer than kMaxDatagramBytes. Each answer is a datagram of its own, sent to the
// source address of the request. For commands, the last source address of each client ID is
// remembered, so memory does not depend on the number of real or pretended robots.
//
// Anyone who can send to the port can impersonate any robot and receive its answers: listen on
// localhost or on a trusted network. Broadcasts go to every remembered address, and to the one
// before it of each client ID: two robots may have the same by mistake, which is reported.
#pragma once

#include <memory>

#include <boost/asio/io_context.hpp>

#include "server/robots/links/link.h"

namespace pheromone::links {

/// No medium access.
std::unique_ptr<Link> MakeUdpLink(boost::asio::io_context& io, const LinkConfig& config,
                                  LinkContext context);

}  // namespace pheromone::links
