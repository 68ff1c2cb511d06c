// Who hears of everything that goes through a Service, in its order: for a recording from which the
// same can happen again.
//
//   service.Attach(&witness, [](const Engine& engine) { ... });
//
// Called under the service's lock, from any thread: be quick, and do not call back.
#pragma once

#include <cstdint>
#include <span>

#include "protocol/messages.h"
#include "server/engine/event.h"

namespace pheromone::engine {

class Witness {
 public:
  /// What became of a message.
  struct Outcome {
    uint64_t sequence = 0;  ///< in the log; 0: it changed nothing
    /// By the log: a change, or the answer to a repeated one that is not durable yet.
    protocol::Reason refused = protocol::Reason::kNone;
  };

  Witness() = default;
  Witness(const Witness&) = delete;
  Witness& operator=(const Witness&) = delete;
  virtual ~Witness() = default;

  /// The messages of one read were handled. `sent` is what the engine gives for them, before
  /// anything waits for its change to become durable.
  virtual void OnBatch(const Stamp& stamp, LinkIndex link,
                       std::span<const protocol::Message> messages,
                       std::span<const Outcome> outcomes, std::span<const Outgoing> sent) = 0;

  /// An event that came from elsewhere was applied.
  virtual void OnEvent(uint64_t sequence, const Stamp& stamp, const Event& event,
                       std::span<const Outgoing> sent) = 0;

  /// Of what was sent before, this goes nowhere: its robot asks for something else by now.
  /// `repeated`: it was sent twice, and one of the two goes out.
  virtual void OnDropped(LinkIndex /*link*/, const protocol::Message& /*message*/,
                         bool /*repeated*/) {}
};

}  // namespace pheromone::engine
