// From the configuration of a link, or of a tracker, to the link or tracker itself.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include <boost/asio/io_context.hpp>

#include "server/config/config.h"
#include "server/links/link.h"
#include "server/links/tracker_link.h"
#include "server/maps/geodesy.h"

namespace pheromone::daemon {

/// `seed` makes the link's waits before a retry differ from those of others.
std::unique_ptr<links::Link> MakeLink(boost::asio::io_context& io, const config::LinkConfig& config,
                                      links::LinkContext context, uint32_t seed);

/// `datum` is where on the Earth the map's (0, 0) is, if it is somewhere. `service` outlives the
/// tracker.
std::unique_ptr<links::TrackerLink> MakeTracker(boost::asio::io_context& io,
                                                const config::TrackerConfig& config,
                                                const std::optional<maps::Wgs84>& datum,
                                                engine::Service* service, links::LinkLog log,
                                                uint32_t seed);

}  // namespace pheromone::daemon
