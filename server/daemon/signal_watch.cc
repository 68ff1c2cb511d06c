#include "server/daemon/signal_watch.h"

#include <csignal>
#include <cstdlib>
#include <utility>

namespace pheromone::daemon {
namespace {

// A stop signal often comes twice at once: timeout(1), for example, signals its child and its
// group.
constexpr std::chrono::seconds kImpatience{1};

}  // namespace

SignalWatch::SignalWatch(Handlers handlers)
    : handlers_(std::move(handlers)), signals_(io_, SIGINT, SIGTERM, SIGHUP) {
  signals_.add(SIGUSR1);
}

SignalWatch::~SignalWatch() {
  End();
}

void SignalWatch::Start() {
  Await();
  thread_ = std::thread([this] { io_.run(); });
}

// With signals_ goes its handler: a signal that comes between that and the end of the process would
// spoil the exit status.
void SignalWatch::End() {
  if (!thread_.joinable()) {
    return;
  }
  io_.stop();
  thread_.join();
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGUSR1}) {
    sigaddset(&signals, signal);
  }
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
}

void SignalWatch::Await() {
  signals_.async_wait([this](const boost::system::error_code& error, int signal) {
    if (error) {
      return;
    }
    if (signal == SIGHUP) {
      handlers_.reload();
    } else if (signal == SIGUSR1) {
      handlers_.save();
    } else {
      TakeStop(signal);
    }
    Await();
  });
}

void SignalWatch::TakeStop(int signal) {
  const auto now = std::chrono::steady_clock::now();
  if (!told_to_stop_at_) {
    told_to_stop_at_ = now;
    handlers_.stop(signal);
  } else if (now - *told_to_stop_at_ >= kImpatience) {
    std::_Exit(128 + signal);
  }
}

}  // namespace pheromone::daemon
