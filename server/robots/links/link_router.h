// Connects the links to the engine: passes batches to the engine and routes each outgoing message
// to its link.
//
// Thread-safe once all links have been added.
#pragma once

#include <span>
#include <vector>

#include "protocol/frame.h"
#include "server/core/engine/service/latency.h"
#include "server/core/engine/service/service.h"
#include "server/robots/links/clock.h"
#include "server/robots/links/link.h"
#include "server/robots/radio/channel_options.h"

namespace pheromone::links {

class LinkRouter {
 public:
  /// `service` outlives the router, and begins with it.
  explicit LinkRouter(engine::Service* service, Clock::time_point begin = Clock::now())
      : service_(service), begin_(begin) {}

  /// Links are added in the order of their LinkIndex, before any is started, and outlive the
  /// router's use.
  void Add(Link* link) { links_.push_back(link); }

  /// Passes a batch to the engine, with its requesters (Service::Handle). Immediate answers are
  /// appended to `answers`, for the caller to send.
  void Handle(engine::LinkIndex from, std::span<const protocol::Message> batch,
              std::span<const engine::Asker> askers, std::vector<engine::Outgoing>* answers);

  /// Sends each message on its link. The messages of one link are passed together and in order.
  /// Answers to forwarded requests are left to the server that has forwarded them.
  void Deliver(std::span<const engine::Outgoing> outgoing);

  /// The robots of a link that take part in rounds, as the log knows them, and that any server has
  /// heard in the last half minute. Who has heard whom is not in the log: in its first half minute,
  /// a server takes robots for present of which it does not know.
  std::vector<radio::RoundMember> MembersOfRounds(engine::LinkIndex link,
                                                  Clock::time_point now) const;

  /// The latency of batches: waiting for the engine plus processing.
  engine::LatencyCounts latency() const { return latency_.counts(); }

 private:
  engine::Service* service_;
  const Clock::time_point begin_;
  std::vector<Link*> links_;
  engine::LatencyHistogram latency_;
};

}  // namespace pheromone::links
