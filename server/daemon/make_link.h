// Makes links and trackers from their configuration.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include <boost/asio/io_context.hpp>

#include "server/formats/maps/geodesy.h"
#include "server/robots/links/link.h"
#include "server/robots/links/tracker_link.h"

namespace pheromone::daemon {

/// `node` is this server's in its cluster; a link that only others have sends and hears nothing.
std::unique_ptr<links::Link> MakeLink(boost::asio::io_context& io, links::LinkConfig config,
                                      links::LinkContext context, const std::string& node);

/// `datum` is the geographic position of the map's (0, 0), if configured. `service` outlives the
/// tracker.
std::unique_ptr<links::TrackerLink> MakeTracker(boost::asio::io_context& io,
                                                const links::TrackerConfig& config,
                                                const std::optional<maps::Wgs84>& datum,
                                                engine::Service* service, links::LinkLog log,
                                                const links::BackoffOptions& backoff);

}  // namespace pheromone::daemon
