// The configuration that is in effect: taken at the start, read again while the server runs.
//
//   LiveConfig config(loaded, reload, &service, &captures);
//   Status taken = config.TakeAtStart(state_lost);
//   ...
//   const auto notes = config.ReadAgain();      // SIGHUP
//
// What concerns the map takes effect if the present map can follow; the rest waits for a restart.
// What is taken, and what is wrong, is told in the log. Get may be called from any thread; the
// others by one at a time.
#pragma once

#include <functional>
#include <mutex>
#include <string>
#include <vector>

#include "server/base/result.h"
#include "server/config/config.h"
#include "server/daemon/captures.h"
#include "server/engine/service.h"

namespace pheromone::daemon {

class LiveConfig {
 public:
  using Reload = std::function<Result<config::Config>()>;

  /// `reload` reads the configuration again. `service` and `captures` outlive it.
  LiveConfig(config::Config config, Reload reload, engine::Service* service, Captures* captures);

  /// Configures the service. `state_lost`: changes that clients were told of are missing from the
  /// state. Errors: the state that is there cannot follow.
  Status TakeAtStart(bool state_lost);

  /// Returns what waits for a restart. Errors: mistakes in the configuration, or what the map
  /// cannot follow; then all stays as it was.
  Result<std::vector<std::string>> ReadAgain();

  config::Config Get() const;

  /// As at the start: changed ones wait for a restart. Any thread.
  const std::vector<config::LinkConfig>& links() const { return config_.links; }

 private:
  Result<engine::Service::Configured> Configure(const engine::EngineConfig& config,
                                                bool state_lost);
  void Tell(const std::vector<std::string>& warnings) const;

  const Reload reload_;
  engine::Service* const service_;
  Captures* const captures_;
  mutable std::mutex mutex_;  // of what others get
  config::Config config_;
};

}  // namespace pheromone::daemon
