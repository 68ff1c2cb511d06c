// A random but repeatable environment of a robot's core: a channel that loses, damages and delays
// frames, a server that answers, sends errors and commands and loses its state, other stations, and
// a Pioneer.
//
//   RandomWorld world(seed);
//   for (;;) {
//     const Bytes request = world.NextTurn();         // of core_turn.h
//     world.Take(core.Run(request));
//   }
//
// It follows only one rule of the protocol: frames of the server are well formed before they are
// damaged. It is determined by the seed and by the core's output. One thread.
#pragma once

#include <cstdint>
#include <deque>
#include <random>
#include <span>
#include <vector>

#include "client_fw/sim/pioneer/pioneer_robot.h"
#include "protocol/decoder.h"
#include "protocol/messages.h"

namespace pheromone::core_boundary {

class RandomWorld {
 public:
  using Bytes = std::vector<uint8_t>;

  explicit RandomWorld(uint64_t seed);

  /// A request to start, once, before the first turn; `keep`: as after a warm reset.
  Bytes Start(bool keep);
  /// One to eight milliseconds later, rarely more.
  Bytes NextTurn();
  /// The reply to that turn.
  void Take(const Bytes& reply);

  /// Requests that the core sent, and the undamaged answers to them.
  uint64_t requests() const { return requests_; }
  uint64_t answered() const { return answered_; }
  uint64_t commands() const { return commands_; }

 private:
  struct OnAir {
    int64_t end_ms;
    uint8_t byte;
  };

  bool OneIn(uint32_t n) { return random_() % n == 0; }
  uint32_t Below(uint32_t n) { return static_cast<uint32_t>(random_() % n); }
  int16_t Intensity();

  void ToServer(std::span<const uint8_t> bytes);
  void OnRequest(const protocol::Message& request);
  bool Answer(const protocol::Message& request, protocol::Message* answer);
  /// Whether it arrives undamaged.
  bool SendFromServer(const protocol::Message& message, int64_t begin_ms);
  void SendCommand();
  void SendForeign();

  std::mt19937_64 random_;
  sim::PioneerRobot pioneer_;
  protocol::FrameDecoder server_{protocol::kNoGapTimeout};
  int64_t now_ms_ = 0;
  uint32_t clock_offset_ms_;
  int64_t idle_at_ms_ = 0;    // what the core has sent has left
  int64_t free_at_ms_ = 0;    // what was put on the air has passed
  std::deque<OnAir> on_air_;  // to the core
  uint8_t id_;
  uint16_t boot_counter_;
  uint16_t epoch_ = 1;
  uint8_t command_seq_ = 0;
  uint64_t requests_ = 0;
  uint64_t answered_ = 0;
  uint64_t commands_ = 0;
};

}  // namespace pheromone::core_boundary
