// Makes links and trackers from their configuration.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include <boost/asio/io_context.hpp>

#include "server/config/config.h"
#include "server/formats/maps/geodesy.h"
#include "server/robots/links/link.h"
#include "server/robots/links/tracker_link.h"

namespace pheromone::daemon {

/// `seed` is for the jitter of the link's retry delays.
std::unique_ptr<links::Link> MakeLink(boost::asio::io_context& io, const config::LinkConfig& config,
                                      links::LinkContext context, uint32_t seed);

/// `datum` is the geographic position of the map's (0, 0), if configured. `service` outlives the
/// tracker.
std::unique_ptr<links::TrackerLink> MakeTracker(boost::asio::io_context& io,
                                                const config::TrackerConfig& config,
                                                const std::optional<maps::Wgs84>& datum,
                                                engine::Service* service, links::LinkLog log,
                                                uint32_t seed);

}  // namespace pheromone::daemon
