// A fuzzer's record of the events of a service, for comparison with a replay.
//
//   MoodyLog log;
//   Recorder recorder;
//   Service service(&log, read_clock);
//   service.Attach(&recorder, [](const Engine&) {});
//
// A condition that does not hold aborts, as a fuzzer wants it. One thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "proto_tests/fuzz/lasting.h"
#include "protocol/messages.h"
#include "server/core/engine/event.h"
#include "server/core/engine/service/observer.h"
#include "server/core/engine/service/ordered_log.h"

namespace pheromone::fuzz {

/// Records the events, and refuses, rotates and lags as configured.
class MoodyLog final : public engine::OrderedLog {
 public:
  struct Segment {
    size_t events;  ///< before it
    uint64_t hash;
  };

  protocol::Reason Admit() override { return refusal; }
  bool IsRotationDue() const override { return rotation_due; }
  void Rotate(uint64_t hash) override { segments.push_back({events.size(), hash}); }
  uint64_t Append(const engine::Stamp& stamp, const engine::Event& event) override {
    Require(events.empty() || events.back().first.field_time_ms <= stamp.field_time_ms);
    events.emplace_back(stamp, event);
    return events.size();
  }
  uint64_t DurableSequence() const override { return lags ? durable : events.size(); }
  bool WhenDurable(uint64_t /*sequence*/, std::function<void()> done) override {
    done();
    return true;
  }

  protocol::Reason refusal = protocol::Reason::kNone;
  bool rotation_due = false;
  bool lags = false;
  uint64_t durable = 0;
  std::vector<std::pair<engine::Stamp, engine::Event>> events;
  std::vector<Segment> segments;
};

/// Keeps what was sent because of an event of the log.
class Recorder final : public engine::Observer {
 public:
  void OnBatch(const engine::Stamp& /*stamp*/, engine::LinkIndex /*link*/,
               std::span<const protocol::Message> messages, std::span<const Outcome> outcomes,
               std::span<const engine::Outgoing> given) override {
    Require(messages.size() == 1 && outcomes.size() == 1);
    Require(given.size() <= 1);  // one answer at most
    if (outcomes[0].sequence != 0) {
      sent.insert(sent.end(), given.begin(), given.end());
    }
  }
  void OnEvent(uint64_t /*sequence*/, const engine::Stamp& /*stamp*/,
               const engine::Event& /*event*/, std::span<const engine::Outgoing> given) override {
    sent.insert(sent.end(), given.begin(), given.end());
  }

  std::vector<engine::Outgoing> sent;
};

}  // namespace pheromone::fuzz
