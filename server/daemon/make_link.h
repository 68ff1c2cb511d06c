// From a link's configuration to the link.
#pragma once

#include <cstdint>
#include <memory>

#include <boost/asio/io_context.hpp>

#include "server/config/config.h"
#include "server/links/link.h"

namespace pheromone::daemon {

/// `seed` makes the link's waits before a retry differ from those of others.
std::unique_ptr<links::Link> MakeLink(boost::asio::io_context& io, const config::LinkConfig& config,
                                      links::LinkContext context, uint32_t seed);

}  // namespace pheromone::daemon
