// The state of a running service as a StateSource: frozen at one sequence, and copied in portions
// between which robots are served.
//
//   auto state = ServiceState::Freeze(&service);
//   if (state == nullptr) ...                        // another one is being copied: try again
//   later auto written = SnapshotWriter::Write(state.get(), folder);
//
// One thread; the service outlives it.
#pragma once

#include <memory>
#include <string>

#include "server/core/engine/service/service.h"
#include "server/store/journal/snapshot_writer.h"

namespace pheromone::journal {

class ServiceState final : public StateSource {
 public:
  /// Null while another state of the service is frozen, for example for a recording.
  static std::unique_ptr<ServiceState> Freeze(engine::Service* service);

  SnapshotHeader header() const override;
  /// Errors: too much was changed meanwhile; a new attempt may succeed.
  Result<std::string> Next() override;
  bool ShouldTryAgain() const override { return frozen_->failed(); }

 private:
  ServiceState(engine::Service* service, engine::Service::Frozen frozen)
      : service_(service), frozen_(std::move(frozen)) {}

  engine::Service* service_;
  engine::Service::Frozen frozen_;
};

}  // namespace pheromone::journal
