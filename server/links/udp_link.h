// A UDP listener: many robots, real or simulated, each wherever its last request came from.
//
//   auto link = MakeUdpLink(io, {.listen_address = "127.0.0.1", .listen_port = 4951}, context);
//
// A datagram holds one or more whole frames: what it leaves open is discarded with it, and so is
// one that is longer than kMostDatagramBytes. Each answer is a datagram of its own, sent to where
// the request came from: it carries the address. For commands, one address is remembered for each
// client ID, from where it was heard last; so memory does not depend on how many there are, or
// pretend to be.
//
// Whoever can send to the port can speak as any robot and be sent its answers: listen on localhost,
// or on a network that is yours. Messages to all robots go to every address remembered.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include <boost/asio/io_context.hpp>

#include "server/links/backoff.h"
#include "server/links/link.h"

namespace pheromone::links {

struct UdpOptions {
  std::string listen_address;  ///< numeric, IPv4 or IPv6
  uint16_t listen_port = 0;    ///< 0: the system chooses, see Link::address
  BackoffOptions backoff;
};

/// No medium access.
std::unique_ptr<Link> MakeUdpLink(boost::asio::io_context& io, UdpOptions options,
                                  LinkContext context);

}  // namespace pheromone::links
