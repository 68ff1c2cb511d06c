// The running server: engine, links, threads and signals.
//
//   Daemon daemon(std::move(config), std::move(keeper), reload, "lab.field");
//   return daemon.Run();        // until SIGINT or SIGTERM
//
// SIGINT, SIGTERM: an orderly stop; another one a second later or more ends the process at once,
// with the status that a shell would give it. SIGHUP: the configuration is read again. What
// concerns the map takes effect, if the present map can follow; changed links and daemon settings
// wait for a restart, and the log says so. SIGUSR1: the field is saved at once, beside the robots
// (field_saver.h).
//
// What passes is recorded if the configuration says so (captures.h).
//
// This is the sole owner of threads and signals.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "server/base/result.h"
#include "server/config/config.h"
#include "server/daemon/state_keeper.h"

namespace pheromone::daemon {

class Daemon {
 public:
  using Reload = std::function<Result<config::Config>()>;

  /// `keeper` has the state to go on from. `reload` reads the configuration again. The field is
  /// saved to `save_field` at an orderly stop; empty: it is not saved.
  Daemon(config::Config config, std::unique_ptr<StateKeeper> keeper, Reload reload,
         std::string save_field);
  Daemon(const Daemon&) = delete;
  Daemon& operator=(const Daemon&) = delete;
  ~Daemon();

  /// Returns the exit status: 0 after an orderly stop, 1 if a required link did not come up, the
  /// configuration does not fit the state, or field or journal could not be written to the end.
  int Run();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace pheromone::daemon
