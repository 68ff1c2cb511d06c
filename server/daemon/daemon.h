// The running server: engine, links, threads and signals.
//
//   Daemon daemon(std::move(config), std::move(journal), reload, "lab.field");
//   return daemon.Run();        // until SIGINT or SIGTERM
//
// SIGINT, SIGTERM: an orderly stop (signal_watch.h). SIGHUP: reread the configuration
// (live_config.h). SIGUSR1: save the field while robots are served (field_saver.h).
//
// Traffic is recorded if configured (captures.h).
//
// This is the sole owner of threads and signals.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "server/base/result.h"
#include "server/config/config.h"
#include "server/daemon/journal_owner.h"

namespace pheromone::daemon {

class Daemon {
 public:
  using Reload = std::function<Result<config::Config>()>;
  /// The exit status for errors that a restart does not cure.
  static constexpr int kMisconfigured = 2;

  /// `journal` has the state to resume from. `reload` rereads the configuration. The field is saved
  /// to `save_field` at an orderly stop; empty: it is not saved.
  Daemon(config::Config config, std::unique_ptr<JournalOwner> journal, Reload reload,
         std::string save_field);
  Daemon(const Daemon&) = delete;
  Daemon& operator=(const Daemon&) = delete;
  ~Daemon();

  /// Returns the exit status: 0 after an orderly stop, kMisconfigured if the configuration does not
  /// match the state or its folder for recordings cannot be used, 1 if a required link could not be
  /// opened, or the field or the journal could not be written completely.
  int Run();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace pheromone::daemon
