// A simulated robot against a running daemon, in real time: the robot's radio medium is modelled as
// in virtual time, and at its other end sits a modem whose wires lead to the daemon's port.
//
//   robot core - board - [modelled radio, 9600 baud] - modem - pty - pheromoned
//
// If the port goes away (the daemon restarts), the modem keeps trying, and the robot stops by its
// own fail-safe and goes on when answers return.
#pragma once

#include <csignal>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "client_fw/sim/radio_medium.h"
#include "client_fw/swarm/track.h"
#include "server/base/result.h"
#include "server/field/path.h"

namespace pheromone::swarm {

/// A modem on the medium with a terminal device behind it. Bytes from the air go to the device at
/// once; bytes from the device go on the air.
class PortModem final : public sim::Station {
 public:
  /// `medium` outlives the modem, and the modem the medium's last event.
  PortModem(std::string device, sim::RadioMedium* medium);
  ~PortModem() override;
  PortModem(const PortModem&) = delete;
  PortModem& operator=(const PortModem&) = delete;

  /// Opens the device raw. Errors: what the system says of it.
  Status Open();
  /// Reads what has come and sends it; reopens a device that went away, at most twice a second.
  void Step(int64_t now_ns);
  bool connected() const { return descriptor_ >= 0; }
  uint64_t reconnects() const { return reconnects_; }
  int descriptor() const { return descriptor_; }

  void OnByte(uint8_t byte, int64_t time_ns) override;
  void OnTransmitted(int64_t /*time_ns*/) override {}

 private:
  void Close();

  std::string device_;
  sim::RadioMedium* medium_;
  int number_;
  int descriptor_ = -1;
  int64_t next_try_ns_ = 0;
  uint64_t reconnects_ = 0;
};

struct LiveConfig {
  std::string device;  ///< the daemon's end of the radio
  field::Path path;    ///< to be followed; its type is asked for
  sim::SimulatedRobotConfig robot;
  sim::RadioConfig radio;
  int64_t sample_ms = 200;
};

struct LiveStatus {
  Sample sample;
  client::Counters counters{};
  uint8_t flags = 0;  ///< client::StopFlag
  double seconds = 0;
  double exchanges_per_s = 0;  ///< over the last second
  double utilisation = 0;      ///< of the channel since the start
  bool connected = false;
};

struct LiveResult {
  std::vector<Sample> track;
  LiveStatus last;
  uint64_t reconnects = 0;
};

/// Runs until `seconds` have passed (0: for ever) or `*stop` is not 0 (a signal handler's doing),
/// calling `show` about five times a second. Errors: the device cannot be opened at the start.
Result<LiveResult> RunLive(const LiveConfig& config, double seconds,
                           const volatile std::sig_atomic_t* stop,
                           const std::function<void(const LiveStatus&)>& show);

}  // namespace pheromone::swarm
