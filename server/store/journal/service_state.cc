#include "server/store/journal/service_state.h"

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

// A portion is returned once it has content, and others can use the service in between. A portion
// of a mostly empty map may be empty, but an empty one may only be returned at the end.
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
