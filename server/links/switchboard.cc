#include "server/links/switchboard.h"

namespace pheromone::links {

void Switchboard::Handle(engine::LinkIndex from, std::span<const protocol::Message> batch,
                         std::vector<protocol::Message>* own) {
  std::vector<engine::Outgoing> out;
  out.reserve(batch.size());
  service_->Handle(from, batch, &out);
  for (const engine::Outgoing& outgoing : out) {
    if (outgoing.link == from) {
      own->push_back(outgoing.message);
    } else {
      Deliver({&outgoing, 1});
    }
  }
}

void Switchboard::Deliver(std::span<const engine::Outgoing> outgoing) {
  for (const engine::Outgoing& one : outgoing) {
    if (one.link < links_.size()) {
      links_[one.link]->Send({&one.message, 1});
    }
  }
}

}  // namespace pheromone::links
