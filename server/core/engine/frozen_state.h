// The state of an engine frozen at one moment and copied in portions while the engine continues:
// the bytes are exactly those that Engine::Save would have given then. Used for snapshots and
// recordings of a state that is too large to be copied at once.
//
//   std::unique_ptr<FrozenState> frozen = engine.Freeze(kMaxKeptBytes);  // null: there is another
//   while (frozen->CopySome(&bytes)) { ... }                              // events between them
//   if (frozen->failed()) ...                                             // try again
//
// The freeze encodes small parts and diffusing pheromones; the configuration is encoded when
// it is copied, and cells portion by portion, 100 us each (server/core/field/frozen_field.h).
//
// One owner. CopySome and LetGo are calls to the engine and need what those need (Service has them
// behind its lock); the others do not. Either may be destroyed first.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "server/core/engine/event.h"
#include "server/core/engine/part.h"
#include "server/core/field/frozen_field.h"

namespace pheromone::engine {

class FrozenState {
 public:
  /// The maximum size of the old values kept of data changed before it is copied.
  static constexpr uint64_t kMaxKeptBytes = uint64_t{64} << 20;

  /// The input from Engine::Freeze.
  struct Parts {
    uint64_t sequence = 0;
    Stamp stamp;
    uint64_t state_hash = 0;
    SharedConfig config;
    uint64_t config_bytes = 0;
    std::string before;  ///< the bytes between the configuration and the parts
    std::vector<std::unique_ptr<FrozenPart>> contents;  ///< of the parts
  };

  explicit FrozenState(Parts parts);
  FrozenState(const FrozenState&) = delete;
  FrozenState& operator=(const FrozenState&) = delete;

  /// The total number of bytes.
  uint64_t bytes() const { return bytes_; }
  /// Of the last event, as Engine has them.
  uint64_t sequence() const { return parts_.sequence; }
  const Stamp& stamp() const { return parts_.stamp; }
  uint64_t state_hash() const { return parts_.state_hash; }

  /// Appends the next portion, which may be empty. False when there is none: all was copied, or it
  /// has failed.
  bool CopySome(std::string* to, int tiles = field::FrozenField::kTilesAtOnce);

  /// Copies the first portion, the configuration, which takes the longest if it has many points. It
  /// no longer depends on the engine: call this before CopySome, without the engine's lock. False
  /// if it was already copied.
  bool CopyConfig(std::string* to);

  bool done() const { return stage_ == Stage::kDone; }
  /// Too much was changed meanwhile, or the engine was destroyed. The copied data is useless.
  bool failed() const;

  /// Detaches from the engine. If not everything was copied, the copy has failed.
  void LetGo();

 private:
  enum class Stage { kConfig, kParts, kDone };

  Parts parts_;
  uint64_t bytes_;
  Stage stage_ = Stage::kConfig;
  size_t part_ = 0;  // the next one
};

}  // namespace pheromone::engine
