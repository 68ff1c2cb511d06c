// Between the links and the engine: a batch goes in, and each message that comes out goes to the
// link it is for.
//
// Thread-safe once all links have been added.
#pragma once

#include <span>
#include <vector>

#include "protocol/frame.h"
#include "server/engine/latency.h"
#include "server/engine/service.h"
#include "server/links/link.h"

namespace pheromone::links {

class Switchboard {
 public:
  /// `service` outlives the switchboard.
  explicit Switchboard(engine::Service* service) : service_(service) {}

  /// Links are added in the order of their LinkIndex, before any is started, and outlive the
  /// switchboard's use.
  void Add(Link* link) { links_.push_back(link); }

  /// Hands a batch to the engine, with those who asked (Service::Handle). What can be answered at
  /// once is appended to `answers`, for the caller to send in its turn.
  void Handle(engine::LinkIndex from, std::span<const protocol::Message> batch,
              std::span<const engine::Asker> askers, std::vector<engine::Outgoing>* answers);

  /// Sends each message on its link. Those of one link go there at once and in their order.
  void Deliver(std::span<const engine::Outgoing> outgoing);

  /// How long batches waited for the engine and were in it.
  engine::LatencyCounts latency() const { return latency_.counts(); }

 private:
  engine::Service* service_;
  std::vector<Link*> links_;
  engine::LatencyHistogram latency_;
};

}  // namespace pheromone::links
