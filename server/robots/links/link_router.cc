#include "server/robots/links/link_router.h"

#include <chrono>
#include <utility>

namespace pheromone::links {

void LinkRouter::Handle(engine::LinkIndex from, std::span<const protocol::Message> batch,
                        std::span<const engine::Asker> askers,
                        std::vector<engine::Outgoing>* answers) {
  answers->reserve(answers->size() + batch.size());
  const auto begin = std::chrono::steady_clock::now();
  service_->Handle(from, batch, answers, askers);
  const std::chrono::nanoseconds elapsed = std::chrono::steady_clock::now() - begin;
  latency_.Count(static_cast<uint64_t>(elapsed.count()));
}

void LinkRouter::Deliver(std::span<const engine::Outgoing> outgoing) {
  std::vector<std::vector<engine::Outgoing>> by_link(links_.size());
  for (const engine::Outgoing& it : outgoing) {
    if (it.link < by_link.size() && !it.asker.is_forwarded) {
      by_link[it.link].push_back(it);
    }
  }
  for (size_t link = 0; link < by_link.size(); ++link) {
    if (!by_link[link].empty()) {
      links_[link]->Send(std::move(by_link[link]));
    }
  }
}

}  // namespace pheromone::links
