// A frozen snapshot of a field's state, copied in portions while the field changes: together, the
// bytes are exactly those that Field::Save would have written when it was frozen.
//
//   std::unique_ptr<FrozenField> frozen = field.Freeze(64 << 20);   // null: there is one, or a
//                                                                 // large configuration is laid
//   while (frozen->CopySome(&bytes)) { ... }                        // the field may change between
//   if (frozen->failed()) ...                                       // try again
//
// Freezing is cheap: cells are only marked, and a write to one that is not yet copied saves its old
// contents (frozen_cells.h). Diffusing types change everywhere with every step and are encoded at
// once, which costs less than a step. A portion is about kTilesAtOnce tiles, at most twice that,
// 100 us.
//
// Only the field's writer may call its functions, except done and failed, which the owner may call
// at any time. Either object may be destroyed first: a frozen state whose field is gone has failed.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "server/core/field/field.h"
#include "server/core/field/frozen_cells.h"

namespace pheromone::field {

class FrozenField {
 public:
  static constexpr int kTilesAtOnce = 256;
  static constexpr size_t kTextAtOnce = size_t{1} << 17;

  FrozenField(const FrozenField&) = delete;
  FrozenField& operator=(const FrozenField&) = delete;
  ~FrozenField() { LetGo(); }

  /// The total work.
  uint64_t bytes() const { return bytes_; }

  /// Appends the next portion, which may be empty, and otherwise has at least one leaf of 256
  /// tiles. False if there is none: everything was copied, or the copy has failed.
  bool CopySome(std::string* to, int tiles = kTilesAtOnce);

  bool done() const { return part_ == parts_.size(); }
  /// Whether more was changed than may be kept, or the field is gone. The bytes copied so far are
  /// then useless.
  bool failed() const { return kept_.failed; }
  /// The memory used at present for the old contents of changed tiles.
  uint64_t kept_bytes() const { return kept_.budget.used_bytes; }

  /// Detaches from the field, so that it can be frozen again. If not everything was copied, the
  /// copy has failed.
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
