// Links over one serial line, real or virtual.
#pragma once

#include <memory>
#include <string>

#include <boost/asio/io_context.hpp>

#include "server/robots/links/link.h"
#include "server/robots/links/port.h"

namespace pheromone::links {

/// The link that all ports have. `address` is for messages and status.
std::unique_ptr<Link> MakePortLink(boost::asio::io_context& io, std::unique_ptr<Port> port,
                                   const std::string& address, const LinkConfig& config,
                                   LinkContext context);

/// A virtual modem. See MakePtyPort for the symbolic link `config.path`.
std::unique_ptr<Link> MakePtyLink(boost::asio::io_context& io, const LinkConfig& config,
                                  LinkContext context);

/// A radio modem, shared by its robots: answers observe the server gap and the response window, and
/// wait while another carrier is present, if the modem signals it. Without medium access: a cable,
/// with one robot at its end.
std::unique_ptr<Link> MakeSerialLink(boost::asio::io_context& io, const LinkConfig& config,
                                     LinkContext context);

}  // namespace pheromone::links
