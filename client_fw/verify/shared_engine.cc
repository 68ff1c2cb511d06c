#include "client_fw/verify/shared_engine.h"

#include "server/base/bytes.h"
#include "server/core/engine/event_codec.h"

namespace pheromone::verify {

std::shared_ptr<const SharedEngine> SharedEngine::After(engine::LinkIndex link,
                                                        const protocol::Message& request,
                                                        std::vector<engine::Outgoing>* out) const {
  const engine::RequestReceived received{link, request};
  ByteWriter key;
  EncodeFields(received, &key);
  Successor& successor = successors_[key.Take()];
  std::shared_ptr<const SharedEngine> next = successor.server.lock();
  if (next == nullptr) {
    engine::Engine copy = engine_;
    if (mutation_ != nullptr) {
      mutation_(request, &copy);
    }
    successor.out.clear();
    copy.Apply(copy.sequence() + 1, {1, 0}, received, &successor.out);
    next = Of(std::move(copy), mutation_);
    successor.server = next;
  }
  out->insert(out->end(), successor.out.begin(), successor.out.end());
  return next;
}

}  // namespace pheromone::verify
