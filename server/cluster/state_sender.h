// Sends this server's state to another one that asks for it, in portions: a snapshot file's header
// (server/store/journal/format.h) and then the state.
//
//   StateSender sender({.freeze = ..., .aside = ..., .send = ...});
//   sender.OnRequest("b", request, committed, now_ms);
//   sender.Continue(committed, now_ms);            // now and then
//
// One transfer at a time; others are told to ask again. The state is frozen and copied aside, so
// that neither robots nor heartbeats wait for it. A leader's state has events that are not
// committed yet: its last portion is sent when they are. A transfer for which nothing more is asked
// is given up, since a frozen state takes memory and is in the way of snapshots.
//
// Called, and calling back, on one executor, but for what it runs aside. What it is given outlives
// what is run aside.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "server/cluster/peer_wire.h"
#include "server/store/journal/snapshot_writer.h"

namespace pheromone::cluster {

/// Runs `work` in another thread, and then `done` on the executor, unless all has ended.
using RunAside = std::function<void(std::function<void()> work, std::function<void()> done)>;

class StateSender {
 public:
  static constexpr uint64_t kPatienceMs = 5'000;  ///< until a transfer is given up

  struct Parts {
    /// Aside. Null: there is no state yet, or another one is being copied.
    std::function<std::unique_ptr<journal::StateSource>()> freeze;
    RunAside aside;
    std::function<void(const std::string& to, StatePortion portion)> send;
  };
  explicit StateSender(Parts parts) : parts_(std::move(parts)) {}

  /// `committed`: the last event that is known as committed.
  void OnRequest(const std::string& from, const StateRequest& request, uint64_t committed,
                 uint64_t now_ms);
  void Continue(uint64_t committed, uint64_t now_ms);
  void OnDown(const std::string& node);
  void Stop() { End(); }

  /// To whom; empty: to nobody.
  const std::string& to() const { return to_; }

 private:
  struct Copy;

  void Fill();
  void Serve(uint64_t committed);
  void End();

  const Parts parts_;
  std::string to_;
  StateRequest request_;     // the last
  bool waits_ = false;       // it is not answered
  bool is_filling_ = false;  // aside
  uint64_t asked_ms_ = 0;    // the last request
  uint64_t offset_ = 0;      // of what was not sent yet
  std::shared_ptr<Copy> copy_;
};

}  // namespace pheromone::cluster
