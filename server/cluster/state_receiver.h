// Takes another server's state (state_sender.h) and writes it as a snapshot into this one's journal
// folder, where it is the newest: a process that begins from that folder has the state.
//
//   StateReceiver receiver({.folder = folder, .aside = ..., .send = ..., .done = ...});
//   receiver.Begin("b", least, now_ms);
//   receiver.OnPortion("b", portion, now_ms);     // each answers a request
//   receiver.Continue(now_ms);                    // now and then
//
// The file gets its name when it is complete and was read again as a start reads it, hashes and
// all; what is incomplete is removed. Files are written aside, one portion after the other.
//
// Called, and calling back, on one executor, but for what it runs aside.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "server/base/result.h"
#include "server/cluster/peer_wire.h"
#include "server/cluster/state_sender.h"
#include "server/store/journal/folder.h"

namespace pheromone::cluster {

class StateReceiver {
 public:
  static constexpr uint64_t kPatienceMs = 10'000;  ///< until an answer is not awaited any more

  struct Parts {
    journal::Folder* folder = nullptr;
    RunAside aside;
    /// Aside, before a file is begun: returns when no other snapshot is made there any more. One of
    /// a state that has diverged may have the same name.
    std::function<void()> end_snapshots;
    std::function<void(const std::string& to, StateRequest request)> send;
    /// The sequence of the state's last event, when it is durable. Errors: why it is not; then
    /// Begin may be called again.
    std::function<void(const Result<uint64_t>&)> done;
  };
  explicit StateReceiver(Parts parts) : parts_(std::move(parts)) {}

  /// Asks `from` for its state, which has to have all events up to `least`.
  void Begin(const std::string& from, uint64_t least, uint64_t now_ms);
  void OnPortion(const std::string& from, const StatePortion& portion, uint64_t now_ms);
  void Continue(uint64_t now_ms);
  void OnDown(const std::string& node);
  /// Without calling `done`.
  void Stop();

  bool is_busy() const { return !from_.empty(); }
  const std::string& from() const { return from_; }
  uint64_t bytes() const { return offset_; }  ///< that were received

 private:
  struct File;

  void Ask(uint64_t now_ms);
  void Fail(const std::string& why);

  const Parts parts_;
  uint64_t number_ = 0;
  std::string from_;
  uint64_t offset_ = 0;
  bool waits_ = false;  // for a portion
  uint64_t asked_ms_ = 0;
  uint64_t now_ms_ = 0;
  std::shared_ptr<File> file_;
};

}  // namespace pheromone::cluster
