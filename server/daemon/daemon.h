// The running server: engine, links, threads and signals.
//
//   Daemon daemon(std::move(config), std::move(keeper), reload, "lab.field");
//   return daemon.Run();        // until SIGINT or SIGTERM
//
// SIGINT, SIGTERM: an orderly stop (signal_watch.h). SIGHUP: the configuration is read again
// (live_config.h). SIGUSR1: the field is saved at once, beside the robots (field_saver.h).
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
  /// The exit status after a start that fails in the same way each time it is tried.
  static constexpr int kMisconfigured = 2;

  /// `keeper` has the state to go on from. `reload` reads the configuration again. The field is
  /// saved to `save_field` at an orderly stop; empty: it is not saved.
  Daemon(config::Config config, std::unique_ptr<StateKeeper> keeper, Reload reload,
         std::string save_field);
  Daemon(const Daemon&) = delete;
  Daemon& operator=(const Daemon&) = delete;
  ~Daemon();

  /// Returns the exit status: 0 after an orderly stop, kMisconfigured if the configuration does not
  /// fit the state or nothing can be recorded where it says, 1 if a required link did not come up,
  /// or field or journal could not be written to the end.
  int Run();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace pheromone::daemon
