// The signals that rule the daemon, heard on a thread of their own: a second SIGTERM is heard even
// when everything else is stuck.
//
//   SignalWatch signals({.stop = ..., .reload = ..., .save = ...});
//   signals.Start();
//   ...
//   signals.End();      // from here on signals are ignored: the process is about to end
//
// SIGINT and SIGTERM ask to stop; another one a second later or more ends the process at once, with
// the status that a shell would give it. SIGHUP: reload. SIGUSR1: save. From its construction on,
// no signal is lost. One thread.
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
  /// Called on the thread that hears the signals, which must not wait: post what takes time.
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
