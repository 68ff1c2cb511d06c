// A field's state as it was at one moment, copied out in portions while the field goes on: the
// bytes altogether are exactly those that Field::Save would have given then.
//
//   std::unique_ptr<FrozenField> frozen = field.Freeze(64 << 20);   // null: there is one, or a
//                                                                 // change is under way
//   while (frozen->CopySome(&bytes)) { ... }                        // the field may change between
//   if (frozen->failed()) ...                                       // try again
//
// To freeze costs little: cells are only marked, and kept by whoever changes one before it was
// copied (frozen_cells.h). What diffuses changes all over with every step and is encoded at once,
// which costs less than a step. A portion is about kTilesAtOnce tiles, at most
// twice that, 100 us.
//
// The field's writer calls all of it but done and failed, which the owner may call at any time.
// Either may go first: a frozen state whose field is gone has failed.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "server/field/field.h"
#include "server/field/frozen_cells.h"

namespace pheromone::field {

class FrozenField {
 public:
  static constexpr int kTilesAtOnce = 256;
  static constexpr size_t kTextAtOnce = size_t{1} << 17;

  FrozenField(const FrozenField&) = delete;
  FrozenField& operator=(const FrozenField&) = delete;
  ~FrozenField() { LetGo(); }

  /// What is copied altogether.
  uint64_t bytes() const { return bytes_; }

  /// Appends the next portion, which may be empty. False when there is none: all was copied, or it
  /// has failed. A whole leaf of 256 tiles at least.
  bool CopySome(std::string* to, int tiles = kTilesAtOnce);

  bool done() const { return part_ == parts_.size(); }
  /// More was changed meanwhile than may be kept, or the field is gone. What was copied is of no
  /// use.
  bool failed() const { return kept_.failed; }
  /// What is kept at the moment, of what was changed before it was copied.
  uint64_t kept_bytes() const { return kept_.budget.used_bytes; }

  /// Leaves the field alone from now on: another one may be made. If not all was copied, it has
  /// failed.
  void LetGo();

 private:
  friend class Field;

  // What was encoded at once, then cells.
  struct Part {
    std::string text;
    std::unique_ptr<FrozenCells> cells;
  };

  FrozenField(const Field* field, uint64_t most_kept_bytes);

  const Field* field_;  // null: let go
  KeptBytes kept_;      // outlives the parts
  std::vector<Part> parts_;
  uint64_t bytes_ = 0;
  size_t part_ = 0;  // the present one
  size_t text_ = 0;  // of its text, what was copied
};

}  // namespace pheromone::field
