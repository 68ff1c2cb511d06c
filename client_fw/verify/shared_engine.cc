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
  if (successor.server == nullptr) {
    engine::Engine copy = engine_;
    if (mutation_ != nullptr) {
      mutation_(request, &copy);
    }
    copy.Apply(copy.sequence() + 1, {1, 0}, received, &successor.out);
    successor.server = Of(std::move(copy), mutation_);
  }
  out->insert(out->end(), successor.out.begin(), successor.out.end());
  return successor.server;
}

}  // namespace pheromone::verify
