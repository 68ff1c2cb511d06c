// A log in memory, whose health and durability the test controls.
//
//   ScriptedLog log;
//   Service service(&log, read_clock);
//   log.admit = protocol::Reason::kReadOnly;  // accepts no changes
//   log.GetStuck();                           // accepts them, but nothing more becomes durable
//   log.Heal();                               // everything is, and waiting callbacks are called
//
// Any thread may call the functions and set atomic members; set the others only while no other
// thread uses the log.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "protocol/opcodes.h"
#include "server/core/engine/event.h"
#include "server/core/engine/service/ordered_log.h"

namespace pheromone::engine::testing {

class ScriptedLog : public OrderedLog {
 public:
  protocol::Reason Admit() override { return admit; }
  uint64_t Append(const Stamp& stamp, const Event& event) override {
    events.emplace_back(stamp, event);
    return ++sequence_;
  }
  bool IsRotationDue() const override { return rotation_due; }
  void Rotate(uint64_t state_hash) override {
    rotated.emplace_back(events.size(), state_hash);
    rotation_due = false;
  }
  uint64_t DurableSequence() const override { return std::min(durable_.load(), sequence_.load()); }
  /// Future sequences count as durable too while the log is healthy.
  bool WhenDurable(uint64_t sequence, std::function<void()> done) override {
    {
      const std::lock_guard lock(mutex_);
      if (sequence > durable_) {
        if (!full) {
          waiting_.emplace_back(sequence, std::move(done));
        }
        return !full;
      }
    }
    done();
    return true;
  }
  std::string Trouble() const override { return trouble; }

  void SetDurable(uint64_t durable) {
    std::vector<std::function<void()>> ready;
    {
      const std::lock_guard lock(mutex_);
      durable_ = durable;
      std::erase_if(waiting_, [&](auto& it) {
        const bool is_ready = it.first <= durable;
        if (is_ready) {
          ready.push_back(std::move(it.second));
        }
        return is_ready;
      });
    }
    for (const auto& done : ready) {
      done();
    }
  }
  void GetStuck() { SetDurable(sequence_); }
  void Heal() { SetDurable(UINT64_MAX); }

  /// Of the last event.
  uint64_t sequence() const { return sequence_; }

  std::atomic<protocol::Reason> admit{protocol::Reason::kNone};
  std::atomic<bool> full{false};  ///< of callbacks
  bool rotation_due = false;
  std::string trouble;
  std::vector<std::pair<size_t, uint64_t>> rotated;  ///< after so many events; the hash
  std::vector<std::pair<Stamp, Event>> events;

 private:
  std::atomic<uint64_t> sequence_{0};
  std::atomic<uint64_t> durable_{UINT64_MAX};
  std::mutex mutex_;
  std::vector<std::pair<uint64_t, std::function<void()>>> waiting_;
};

}  // namespace pheromone::engine::testing
