// The current configuration: applied at the start, reread while the server runs.
//
//   LiveConfig config(loaded, reload, &service, &captures);
//   Status taken = config.TakeAtStart(state_lost);
//   ...
//   const auto notes = config.ReadAgain();      // SIGHUP
//
// Changes of the map take effect if they are compatible with the present map, and so do another
// certificate and other keys of robots; the rest requires a restart. Changes and errors are logged.
// Get, Web, Keys and AsRead may be called from any thread; the other functions by one at a time.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "server/base/result.h"
#include "server/config/config.h"
#include "server/core/engine/service/service.h"
#include "server/daemon/captures.h"
#include "server/robots/signing/keys.h"

namespace pheromone::daemon {

class LiveConfig {
 public:
  using Reload = std::function<Result<config::Config>()>;

  /// `reload` reads the configuration again. `service` and `captures` outlive it.
  LiveConfig(config::Config config, Reload reload, engine::Service* service, Captures* captures);

  /// Configures the service. `state_lost`: acknowledged changes are missing from the state. Errors:
  /// the configuration is incompatible with the state.
  Status TakeAtStart(bool state_lost);

  /// Returns the settings that require a restart. Errors: the configuration is invalid, or not
  /// compatible with the map; then nothing is changed.
  Result<std::vector<std::string>> ReadAgain();

  /// Takes only the certificate and the robots' keys: the rest comes from another server of a
  /// cluster. Errors: the configuration is invalid; then nothing is changed.
  Status ReadSecretsAgain();

  /// Changes the law of a pheromone until the configuration is read again (Control::ChangeTau).
  Status ChangeTau(uint8_t type, int64_t tau_ms);

  /// The one in effect, copied as a whole. Not under the service's lock.
  config::Config Get() const;
  config::WebSettings Web() const {
    const std::lock_guard lock(mutex_);
    return config_.web;
  }
  /// Of the signed links, by their names, as read last.
  std::map<std::string, signing::Keys> Keys() const {
    const std::lock_guard lock(mutex_);
    return config_.keys;
  }
  /// The engine's part of what was read last.
  engine::SharedConfig AsRead() const {
    const std::lock_guard lock(mutex_);
    return engine_;
  }

  /// As at the start, since changes require a restart. Any thread.
  const std::vector<links::LinkConfig>& links() const { return config_.links; }
  const config::ControlSettings& control() const { return config_.control; }

 private:
  engine::SharedConfig InEffect() const;
  Result<engine::Service::Configured> Configure(const engine::SharedConfig& config,
                                                bool state_lost);
  Result<config::Config> Load() const;
  void TakeSecrets(const config::Config& read);
  void Tell(const std::vector<config::Warning>& warnings) const;

  const Reload reload_;
  engine::Service* const service_;
  Captures* const captures_;
  mutable std::mutex mutex_;  // of what others get
  config::Config config_;     // without the engine's part
  engine::SharedConfig engine_;
};

}  // namespace pheromone::daemon
