// Shared by the engine's tests: a small configuration, a robot's messages, and an engine driven by
// hand.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "protocol/frame.h"
#include "protocol/messages.h"
#include "server/base/bytes.h"
#include "server/core/engine/engine.h"

namespace pheromone::engine::testing {

inline field::PheromoneLaw Law(uint8_t type, int64_t tau_ms) {
  field::PheromoneLaw law;
  law.type = type;
  law.name = "type " + std::to_string(type);
  law.core_um = 100'000;
  law.sigma_um = 400'000;
  law.tau_ms = tau_ms;
  law.quantum_micro = 125'000;
  law.max_count = 8;
  return law;
}

/// 10 m x 10 m, type 1 evaporates (tau = 30 s), type 2 does not; links "radio-a" and "radio-b".
inline EngineConfig SmallConfig() {
  EngineConfig config;
  config.field.map = {
      .origin = {0, 0}, .width_um = 10'000'000, .height_um = 10'000'000, .cell_um = 100'000};
  config.field.antennas.distance_um = 330'000;
  config.field.pheromones = {Law(1, 30'000), Law(2, 0)};
  config.field.memory_bytes = 16 << 20;
  config.links = {{"radio-a", 3, 40}, {"radio-b", 4, 50}};
  return config;
}

/// Its state, as a snapshot has it.
inline std::string Saved(const Engine& engine) {
  ByteWriter writer;
  engine.Save(&writer);
  return writer.Take();
}

template <typename T>
protocol::Message MessageOf(const T& from) {
  protocol::Message message;
  protocol::Encode(from, &message);
  return message;
}

inline protocol::Message Hello(uint8_t id, uint16_t nonce) {
  return MessageOf(protocol::HelloRequest{id, nonce, 1, 0});
}

inline protocol::Message Deposit(uint8_t id, uint8_t seq, int16_t x = 5000, int16_t y = 5000,
                                 uint8_t quanta = 1, uint8_t type = 1) {
  return MessageOf(protocol::DepositRequest{id, type, seq, x, y, quanta});
}

inline protocol::Message Sense(uint8_t id, int32_t x = 5000, int32_t y = 5000, uint16_t heading = 0,
                               uint8_t type = 1) {
  return MessageOf(protocol::SenseRequest{id, type, false, {x, y, heading}});
}

inline protocol::Message Trace(uint8_t id, uint8_t seq, int32_t x = 5000, int32_t y = 5000,
                               uint16_t heading = 0, uint8_t type = 1) {
  return MessageOf(protocol::TraceRequest{id, type, false, seq, {x, y, heading}});
}

inline bool SameMessage(const protocol::Message& a, const protocol::Message& b) {
  uint8_t wire_a[protocol::kMaxFrame];
  uint8_t wire_b[protocol::kMaxFrame];
  const size_t size_a = protocol::EncodeFrame(a, wire_a, sizeof wire_a);
  const size_t size_b = protocol::EncodeFrame(b, wire_b, sizeof wire_b);
  return std::vector<uint8_t>(wire_a, wire_a + size_a) ==
         std::vector<uint8_t>(wire_b, wire_b + size_b);
}

/// The reason of an ERROR, kNone for another message.
inline protocol::Reason ReasonOf(const protocol::Message& message) {
  protocol::ErrorAnswer error;
  return protocol::Decode(message, &error) ? error.reason : protocol::Reason::kNone;
}

/// An engine with a hand-driven clock and log, in which each message is handled as the service
/// does.
class Bench {
 public:
  explicit Bench(const EngineConfig& config = SmallConfig(), uint16_t epoch = 7) {
    Apply(ConfigChanged{config, epoch});
  }

  std::vector<Outgoing> Apply(const Event& event) {
    std::vector<Outgoing> out;
    engine.Apply(++sequence, {now_ms, 0}, event, &out);
    log.emplace_back(now_ms, event);
    return out;
  }

  /// The answer to the message, if there is one.
  std::optional<protocol::Message> Handle(const protocol::Message& message, LinkIndex link = 0) {
    std::vector<Outgoing> out;
    switch (engine.Classify(link, message)) {
      case Handling::kIgnore:
        return std::nullopt;
      case Handling::kAnswer:
        engine.Answer({now_ms, 0}, link, message, &out);
        break;
      case Handling::kChange:
        out = Apply(RequestReceived{link, message});
        break;
    }
    return out.empty() ? std::nullopt : std::optional(out.front().message);
  }

  protocol::Reason HandleForReason(const protocol::Message& message, LinkIndex link = 0) {
    const auto answer = Handle(message, link);
    return answer ? ReasonOf(*answer) : protocol::Reason::kNone;
  }

  Engine engine;
  uint64_t now_ms = 1'000;
  uint64_t sequence = 0;
  std::vector<std::pair<uint64_t, Event>> log;
};

}  // namespace pheromone::engine::testing
