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

std::vector<radio::RoundMember> LinkRouter::MembersOfRounds(engine::LinkIndex link,
                                                            Clock::time_point now) const {
  constexpr std::chrono::milliseconds kPresent{30'000};
  const bool has_just_begun = now - begin_ < kPresent;
  return service_->InspectTraffic(
      [&](const engine::Engine& engine, const engine::Traffic& traffic) {
        std::vector<radio::RoundMember> members;
        const uint64_t now_ms = service_->FieldTimeInside();
        engine.robots().ForEachOf(link, [&](uint8_t id, const engine::RobotState& robot) {
          const engine::RobotTraffic* const heard = traffic.Find(link, id);
          const bool is_present =
              heard != nullptr ? heard->last_ms + static_cast<uint64_t>(kPresent.count()) > now_ms
                               : has_just_begun;
          if (is_present && robot.hello.round_period != 0 && engine.SaidHello(link, id)) {
            members.push_back({id, robot.hello.round_period});
          }
        });
        return members;
      });
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
