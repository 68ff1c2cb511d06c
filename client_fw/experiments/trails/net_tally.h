// What robots and the readers of a net tell each other by records on tags (protocol/net_record.h),
// as anybody hears it who listens to the channel: for robots that cannot be asked, such as an
// image, and as a count that depends on neither the robots' nor the server's.
//
//   NetTally tally([&](const NetTold& told) { ... });
//   medium.AddStation(&tally);
//
// Something is told once the robot has received the outcome of its record. One channel each; one
// thread.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <utility>

#include "client_fw/sim/radio_medium.h"
#include "protocol/decoder.h"
#include "protocol/net_record.h"

namespace pheromone::swarm {

struct NetTold {
  int64_t time_ms = 0;
  uint8_t id = 0;    ///< CLIENT_ID
  uint16_t tag = 0;  ///< the tag's number
  protocol::RobotRecord record{};
  bool accepted = false;
  uint16_t granted = 0;  ///< to `take`
};

class NetTally final : public sim::Station {
 public:
  /// `is_signed`: the channel's frames have signatures, which are not verified.
  explicit NetTally(std::function<void(const NetTold&)> tell, bool is_signed = false)
      : tell_(std::move(tell)), is_signed_(is_signed) {}

  void OnByte(uint8_t byte, int64_t time_ns) override;
  void OnTransmitted(int64_t /*time_ns*/) override {}
  /// A message that is not on the air, and not signed.
  void Hear(const protocol::Message& message, int64_t time_ms);

 private:
  struct Robot {
    int32_t number = 0;  // as an author; 0: not heard
    uint16_t tag = 0;
    std::optional<protocol::RobotRecord> written{};  // and not answered yet
    std::optional<uint8_t> answered{};               // the last seq
  };

  static constexpr uint16_t kGapTimeoutMs = 20;

  std::function<void(const NetTold&)> tell_;
  bool is_signed_;
  protocol::FrameDecoder decoder_{kGapTimeoutMs};
  std::map<uint8_t, Robot> robots_;
};

}  // namespace pheromone::swarm
