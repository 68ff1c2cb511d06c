// A modem on a radio medium with a terminal device behind it, a serial port's or a pty: bytes from
// the air go to the device as they end, bytes from the device go on the air at the medium's rate.
//
//   PortModem modem("radio-a.pty", &medium);
//   if (const Status opened = modem.Open(); !opened.ok()) { ... }
//   modem.AdvanceTo(now_ns);                              // every millisecond; advances the medium
//
// If the device disappears, for example when a daemon restarts, the modem tries to open it again,
// at most twice a second, and counts its successes. Bytes that cannot be written are lost, as on
// the air. Nothing blocks. One thread.
//
// The modem may be behind a USB adapter, which holds received bytes back: until its latency timer
// has run from the first of them, or there are 62.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "client_fw/sim/radio_medium.h"
#include "server/base/result.h"

namespace pheromone::swarm {

class PortModem final : public sim::Station {
 public:
  /// Joins `medium` as its next station. The medium outlives the modem, and the modem the medium's
  /// last event. `adapter_ns`: the adapter's latency timer; 0: there is none.
  PortModem(std::string device, sim::RadioMedium* medium, int64_t adapter_ns = 0);
  ~PortModem() override;
  PortModem(const PortModem&) = delete;
  PortModem& operator=(const PortModem&) = delete;

  /// Opens the device, raw and at the medium's bit rate if serial ports know it. Errors: those of
  /// the system, and which other program has it.
  Status Open();
  /// Advances the medium to `time_ns`, then reads bytes from the device and sends them.
  void AdvanceTo(int64_t time_ns);

  bool connected() const { return descriptor_ >= 0; }
  uint64_t reconnects() const { return reconnects_; }
  /// For poll(2); -1 while not connected.
  int descriptor() const { return descriptor_; }

  void OnByte(uint8_t byte, int64_t time_ns) override;
  void OnTransmitted(int64_t /*time_ns*/) override {}

 private:
  void Close();
  void Give();

  std::string device_;
  sim::RadioMedium* medium_;
  int64_t adapter_ns_;
  int number_;
  int descriptor_ = -1;
  int64_t next_try_ns_ = 0;
  uint64_t reconnects_ = 0;
  std::vector<uint8_t> held_;  // by the adapter
  int64_t give_at_ns_ = sim::RadioMedium::kNever;
};

}  // namespace pheromone::swarm
