// Handles the daemon's signals on a thread of its own, so that a second SIGTERM works even if
// everything else is stuck.
//
//   SignalWatch signals({.stop = ..., .reload = ..., .save = ...});
//   signals.Start();
//   ...
//   signals.End();      // signals are ignored from here on: the process is about to end
//
// SIGINT and SIGTERM request a stop; another one at least a second later ends the process at once,
// with the status that a shell would report. SIGHUP: reload. SIGUSR1: save. No signal is lost after
// construction. One thread.
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <thread>

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>

namespace pheromone::daemon {

class SignalWatch {
 public:
  /// Called on the signal thread, which must not block: post long work.
  struct Handlers {
    std::function<void(int signal)> stop;  ///< once
    std::function<void()> reload;
    std::function<void()> save;
  };

  explicit SignalWatch(Handlers handlers);
  SignalWatch(const SignalWatch&) = delete;
  SignalWatch& operator=(const SignalWatch&) = delete;
  ~SignalWatch();

  void Start();
  void End();

 private:
  void Await();
  void TakeStop(int signal);

  const Handlers handlers_;
  boost::asio::io_context io_;
  boost::asio::signal_set signals_;
  std::optional<std::chrono::steady_clock::time_point> told_to_stop_at_;  // of the thread
  std::thread thread_;
};

}  // namespace pheromone::daemon
