#include "server/journal/service_state.h"

#include <utility>

namespace pheromone::journal {

std::unique_ptr<ServiceState> ServiceState::Freeze(engine::Service* service) {
  engine::Service::Frozen frozen = service->Freeze();
  return frozen != nullptr
             ? std::unique_ptr<ServiceState>(new ServiceState(service, std::move(frozen)))
             : nullptr;
}

SnapshotHeader ServiceState::header() const {
  return {frozen_->sequence(), frozen_->stamp(), frozen_->state_hash()};
}

// What is copied at once is written at once: meanwhile whoever waits for the service has it. A
// portion of a map that is mostly empty may hold nothing, but only the end gives an empty one.
Result<std::string> ServiceState::Next() {
  std::string bytes;
  while (bytes.empty() && service_->CopySome(frozen_.get(), &bytes)) {
  }
  if (frozen_->failed()) {
    return Error{"the state changed too much while it was being copied"};
  }
  return bytes;
}

}  // namespace pheromone::journal
