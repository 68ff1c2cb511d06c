// Makes links and trackers from their configuration.
#pragma once

#include <memory>
#include <optional>

#include <boost/asio/io_context.hpp>

#include "server/formats/maps/geodesy.h"
#include "server/robots/links/link.h"
#include "server/robots/links/tracker_link.h"

namespace pheromone::daemon {

std::unique_ptr<links::Link> MakeLink(boost::asio::io_context& io, links::LinkConfig config,
                                      links::LinkContext context);

/// `datum` is the geographic position of the map's (0, 0), if configured. `service` outlives the
/// tracker.
std::unique_ptr<links::TrackerLink> MakeTracker(boost::asio::io_context& io,
                                                const links::TrackerConfig& config,
                                                const std::optional<maps::Wgs84>& datum,
                                                engine::Service* service, links::LinkLog log,
                                                const links::BackoffOptions& backoff);

}  // namespace pheromone::daemon
