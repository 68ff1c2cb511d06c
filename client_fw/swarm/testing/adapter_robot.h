// A robot behind a USB adapter that holds back what it received for 16 ms, such as
// pheromone-robot's. In virtual time.
#pragma once

#include <cstdint>
#include <deque>
#include <utility>

#include "client_fw/core/conversation.h"
#include "client_fw/sim/radio_medium.h"

namespace pheromone::swarm {

constexpr uint8_t kHoldsBackMs = 16;

/// As pheromone-robot's, with this ID.
inline client::Parameters AdapterRobotParameters(uint8_t id) {
  client::Parameters parameters;
  parameters.id = id;
  parameters.boot_counter = 11;
  parameters.type = 2;
  parameters.start_released = true;
  parameters.buffered_link = true;
  parameters.rounds = false;
  parameters.lay_trail = true;
  parameters.gap_timeout_ms = 50;
  parameters.adapter_ms = kHoldsBackMs;
  return parameters;
}

/// An FTDI looks every 16 ms whether it has something; others, 16 ms after the first byte.
enum class Adapter : uint8_t { kLooks, kWaits };

/// Stands at one place, and asks.
class AdapterRobot final : public sim::Station {
 public:
  AdapterRobot(const client::Parameters& parameters, Adapter adapter, sim::RadioMedium* medium)
      : medium_(medium), adapter_(adapter), conversation_(parameters, &memory_) {
    station_ = medium->AddStation(this);
  }

  void OnByte(uint8_t byte, int64_t time_ns) override {
    if (held_.empty()) {
      const int64_t ms = time_ns / 1'000'000 + 1;
      give_ms_ = adapter_ == Adapter::kWaits
                     ? ms + kHoldsBackMs
                     : (ms + kHoldsBackMs - 1) / kHoldsBackMs * kHoldsBackMs;
    }
    held_.push_back(byte);
  }
  void OnTransmitted(int64_t /*time_ns*/) override { sent_ = true; }

  /// To be called each millisecond.
  void Step(int64_t ms) {
    const auto now_ms = static_cast<uint32_t>(ms);
    if (std::exchange(sent_, false)) {
      conversation_.OnSent(now_ms);
    }
    for (; ms >= give_ms_ && !held_.empty(); held_.pop_front()) {
      conversation_.OnByte(held_.front(), now_ms);
    }
    const client::Odometry odometry{2000, 2500, 0};
    conversation_.Poll(now_ms, &odometry, false);
    if (conversation_.tx_size() != 0 && !medium_->Sending(station_) && !sent_) {
      medium_->Transmit(station_, {conversation_.tx(), conversation_.tx_size()});
    }
  }

  client::Counters counters() const { return conversation_.counters(); }

 private:
  sim::RadioMedium* medium_;
  const Adapter adapter_;
  client::RequestMemory memory_ = client::RequestMemory();
  client::Conversation conversation_;
  std::deque<uint8_t> held_;
  int64_t give_ms_ = 0;
  int station_ = 0;
  bool sent_ = false;
};

}  // namespace pheromone::swarm
