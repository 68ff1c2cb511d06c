// An observer is notified of everything that passes through a Service, in order: for recordings
// that can be replayed, or for viewers.
//
//   service.Attach(&observer, [](const Engine& engine) { ... });
//   ...
//   service.Detach(&observer);   // it is not called after this
//
// Several observers may be attached; they do not affect each other. All functions are called under
// the service's lock, from any thread: they must be short and must not call the service. Long work
// belongs into a bounded queue of the observer, which reports what it drops: robots never wait for
// an observer.
//
// If one of these functions throws, the observer is detached and gets OnFailure; nothing else
// happens.
#pragma once

#include <cstdint>
#include <span>

#include "protocol/messages.h"
#include "server/core/engine/event.h"

namespace pheromone::engine {

class Observer {
 public:
  /// The outcome of a message.
  struct Outcome {
    uint64_t sequence = 0;  ///< in the log; 0: no change
    /// The reason of a refusal by the log: of a change, or of the answer to a repeated change that
    /// is not yet durable.
    protocol::Reason refused = protocol::Reason::kNone;
  };

  Observer() = default;
  Observer(const Observer&) = delete;
  Observer& operator=(const Observer&) = delete;
  virtual ~Observer() = default;

  /// The messages of one read were handled. `sent` are the engine's answers to them, before any of
  /// them waits for its change to become durable.
  virtual void OnBatch(const Stamp& stamp, LinkIndex link,
                       std::span<const protocol::Message> messages,
                       std::span<const Outcome> outcomes, std::span<const Outgoing> sent) = 0;

  /// An event that did not come from a robot was applied.
  virtual void OnEvent(uint64_t sequence, const Stamp& stamp, const Event& event,
                       std::span<const Outgoing> sent) = 0;

  /// An earlier answer is dropped, because its robot has sent another request meanwhile.
  /// `repeated`: the answer was given twice, and the other copy is sent.
  virtual void OnDropped(LinkIndex /*link*/, const protocol::Message& /*message*/,
                         bool /*repeated*/) {}

  /// The observer has thrown, and was detached. Called under the lock, too.
  virtual void OnFailure() noexcept {}
};

}  // namespace pheromone::engine
