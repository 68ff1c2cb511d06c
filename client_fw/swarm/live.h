// A swarm against a running daemon, in real time. Robots and radio channels are simulated as in
// virtual time; at the other end of each channel is a modem that is connected to a port of the
// daemon.
//
//   robots - [modelled radio, 9600 baud, half-duplex] - modem - pty or serial port - pheromoned
//
//   LiveSwarm live(config, {"radio-a.pty"});
//   if (const Status opened = live.Open(); !opened.ok()) { ... }
//   live.Run(60'000, &stop_requested, [&] { live.swarm().robot(0).true_pose(); });
//
// Every millisecond of the robots' time is simulated, late if necessary, never skipped. If a port
// disappears (the daemon restarts), its modem keeps trying, and the robots stop by their own
// fail-safe and continue when answers return. One thread.
#pragma once

#include <csignal>
#include <cstdint>
#include <deque>
#include <functional>
#include <string>
#include <vector>

#include "client_fw/keys/robots_keys.h"
#include "client_fw/swarm/port_modem.h"
#include "client_fw/swarm/swarm.h"
#include "server/base/result.h"

namespace pheromone::swarm {

/// The gap timeout of robots on a port: the system may delay bytes.
constexpr uint8_t kBufferedGapMs = 50;

/// Has robots sign with the keys of their IDs in this file, as the server has it; empty: they do
/// not. Their IDs differ, as a start is counted once for all. What it returns outlives them.
/// Errors: those of keys::TakeKeys.
Result<keys::RobotsKeys> SignWith(const std::string& keys_file, SwarmConfig* config);

class LiveSwarm {
 public:
  /// One port for each of the channels, behind adapters with that latency (PortModem). Throws as
  /// Swarm does.
  LiveSwarm(const SwarmConfig& config, const std::vector<std::string>& ports,
            int64_t adapter_ns = 0);
  LiveSwarm(const LiveSwarm&) = delete;
  LiveSwarm& operator=(const LiveSwarm&) = delete;

  /// Opens all ports. Errors: the first that cannot be opened.
  Status Open();

  /// Runs until the swarm's time is `duration_ms` (0: for ever) or `*stop` is not 0 (a signal
  /// handler's doing), calling `each_ms` at the start and after every millisecond.
  void Run(int64_t duration_ms, const volatile std::sig_atomic_t* stop,
           const std::function<void()>& each_ms);

  const Swarm& swarm() const { return swarm_; }
  const PortModem& modem(size_t channel) const { return modems_[channel]; }

 private:
  void Wait() const;

  std::deque<PortModem> modems_;  // a deque, because media point at them
  Swarm swarm_;
};

}  // namespace pheromone::swarm
