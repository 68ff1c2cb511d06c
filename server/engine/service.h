// The engine behind its lock, with its log and its clock: what links talk to. Entered once per
// batch of decoded frames; inside, every frame meets the same stamp and a total order.
//
//   service.Handle(link, messages, &out);      // then send each of `out` on its link
//
// Thread-safe: all functions may be called from any thread. `out` may name other links than the one
// the batch came from.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "protocol/messages.h"
#include "server/base/result.h"
#include "server/engine/engine.h"
#include "server/engine/field_clock.h"
#include "server/engine/ordered_log.h"

namespace pheromone::engine {

constexpr size_t kReasons = 21;

/// What was asked and answered, over all links, since the start.
struct ServiceCounters {
  uint64_t requests = 0;                    ///< messages handed in
  uint64_t ignored = 0;                     ///< of them: never answered
  uint64_t answers = 0;                     ///< other than errors
  uint64_t repeats = 0;                     ///< of the answers: given again, to a repeated request
  uint64_t changes = 0;                     ///< requests that went through the log
  std::array<uint64_t, kReasons> errors{};  ///< ERROR answers by reason
};

class Service {
 public:
  using ReadClock = std::function<ClockReading()>;

  /// `log` outlives the service. `read_clock` is called under the lock. `start_ms` is the field
  /// time to begin with (FieldClock::ResumeAt after a restart).
  Service(OrderedLog* log, ReadClock read_clock, uint64_t start_ms = 0);

  /// Logs and applies a configuration if it differs from the present one. Must succeed once before
  /// anything else is called. Errors: what the running state cannot follow.
  Status Configure(const EngineConfig& config, uint16_t new_epoch);

  /// Handles the messages read at once from a link.
  void Handle(LinkIndex link, std::span<const protocol::Message> messages,
              std::vector<Outgoing>* out);

  /// Logs and applies a command to a robot. Errors: no such robot, or the log takes no changes.
  Status Issue(const CommandIssued& command, std::vector<Outgoing>* out);

  /// Does what is due. Call it when MillisecondsToDeadline() have passed.
  void AdvanceIfDue(std::vector<Outgoing>* out);
  std::optional<uint64_t> MillisecondsToDeadline();

  /// Appends the answers that were waiting for their change to become durable and no longer are.
  void Release(std::vector<Outgoing>* out);

  ServiceCounters counters() const;
  uint64_t StateHash() const;

  /// Calls `look(const Engine&)` under the lock: for status and tests. Keep it short.
  template <typename Look>
  auto Inspect(Look&& look) const {
    const std::lock_guard lock(mutex_);
    return look(engine_);
  }

 private:
  void HandleOne(const Stamp& stamp, LinkIndex link, const protocol::Message& message,
                 std::vector<Outgoing>* out);
  protocol::Reason Change(const Stamp& stamp, const Event& event, std::vector<Outgoing>* out);
  void HoldBack(std::vector<Outgoing>* out, size_t from);

  mutable std::mutex mutex_;
  OrderedLog* log_;
  ReadClock read_clock_;
  FieldClock clock_;
  Engine engine_;
  std::vector<Outgoing> held_;
  ServiceCounters counters_;
};

}  // namespace pheromone::engine
