// The interface of the ordered log, in which events get their sequence number and become durable.
// The journal (server/store/journal) keeps them on disk; VolatileLog keeps nothing.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

#include "protocol/opcodes.h"
#include "server/base/result.h"
#include "server/core/engine/event.h"

namespace pheromone::engine {

class OrderedLog {
 public:
  OrderedLog() = default;
  OrderedLog(const OrderedLog&) = delete;
  OrderedLog& operator=(const OrderedLog&) = delete;
  virtual ~OrderedLog() = default;

  /// Asked before a change is applied: kNone if it can be logged; kBusy or kReadOnly, with which
  /// the client is refused and nothing changes, if not.
  virtual protocol::Reason Admit() = 0;

  /// Writes the bytes of a large event in advance, in fragments between which other events are
  /// appended, so that nobody waits for all of it when it is appended. Only a configuration can be
  /// that large; has no effect for small events. Until the event is appended, or drops its `ahead`,
  /// the log begins no other segment. Called without the service's lock, by one thread at a time,
  /// which waits for the disk. Errors: the log does not accept changes, or has not responded for
  /// some seconds.
  virtual Status WriteAhead(Event* /*event*/) { return Ok(); }

  /// Takes an event and gives it the next sequence number, counting from 1. Called under the
  /// service's lock, right before the event is applied.
  virtual uint64_t Append(const Stamp& stamp, const Event& event) = 0;

  /// What it took to apply that event (Engine::cost), which a replay repeats: the log makes a
  /// snapshot before too much has come together. Under the service's lock, right after it was
  /// applied.
  virtual void Account(uint64_t /*cost*/) {}

  /// Whether the log wants to begin another segment before the next event; if so, Rotate gets the
  /// hash of the state after the last event, so that a reader of the log can verify its state.
  /// Under the service's lock.
  virtual bool IsRotationDue() const { return false; }
  virtual void Rotate(uint64_t /*state_hash*/) {}

  /// All events up to this sequence number will survive a crash. Never decreases.
  virtual uint64_t DurableSequence() const = 0;

  /// How many callbacks may wait for the disk at a time.
  static constexpr size_t kMaxDurableWaiters = 1024;

  /// Calls `done`, once, when all events up to `sequence` are durable: inside this call if they
  /// already are, else later from a thread of the log, without any lock held, so that `done` may
  /// call the log. A log whose disk is stuck does not call; a caller that gives up must tolerate a
  /// late call. `done` must not block, since the log waits for it.
  ///
  /// Returns false, without ever calling, if kMaxDurableWaiters wait already. Any thread.
  ///
  ///   if (!log->WhenDurable(sequence, [answer] { answer->Send(); })) Refuse("too many wait");
  virtual bool WhenDurable(uint64_t sequence, std::function<void()> done) = 0;

  /// Empty while changes are accepted and become durable; otherwise a message that says what is
  /// wrong and for how long, such as "no response from the disk for 2.1 s", once changes have
  /// waited for a second. Never waits for the disk. Any thread.
  virtual std::string Trouble() const { return {}; }
};

/// Stores nothing: the state is lost when the process ends, and each event counts as durable at
/// once.
class VolatileLog final : public OrderedLog {
 public:
  protocol::Reason Admit() override { return protocol::Reason::kNone; }
  uint64_t Append(const Stamp& /*stamp*/, const Event& /*event*/) override { return ++sequence_; }
  uint64_t DurableSequence() const override { return sequence_; }
  /// Future sequences count as durable too, so that nothing ever waits.
  bool WhenDurable(uint64_t /*sequence*/, std::function<void()> done) override {
    done();
    return true;
  }

 private:
  uint64_t sequence_ = 0;
};

}  // namespace pheromone::engine
