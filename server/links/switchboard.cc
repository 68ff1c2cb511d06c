#include "server/links/switchboard.h"

#include <chrono>

namespace pheromone::links {

void Switchboard::Handle(engine::LinkIndex from, std::span<const protocol::Message> batch,
                         std::vector<protocol::Message>* own) {
  std::vector<engine::Outgoing> out;
  out.reserve(batch.size());
  const auto begin = std::chrono::steady_clock::now();
  service_->Handle(from, batch, &out);
  const std::chrono::nanoseconds elapsed = std::chrono::steady_clock::now() - begin;
  latency_.Count(static_cast<uint64_t>(elapsed.count()));
  for (const engine::Outgoing& outgoing : out) {
    if (outgoing.link == from) {
      own->push_back(outgoing.message);
    } else {
      Deliver({&outgoing, 1});
    }
  }
}

void Switchboard::Deliver(std::span<const engine::Outgoing> outgoing) {
  // What follows each other on one link goes there at once: a batch of answers that became durable.
  std::vector<protocol::Message> together;
  for (size_t i = 0; i < outgoing.size(); ++i) {
    const engine::LinkIndex link = outgoing[i].link;
    together.push_back(outgoing[i].message);
    if (i + 1 < outgoing.size() && outgoing[i + 1].link == link) {
      continue;
    }
    if (link < links_.size()) {
      links_[link]->Send(together);
    }
    together.clear();
  }
}

}  // namespace pheromone::links
