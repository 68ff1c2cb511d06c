// The contents of a map as a text file, from which a later run can continue: a header, then a line
// for each node with content, then totals that reveal a truncated file.
//
//   # pheromone-field 1
//   # map origin_um 0 0 size_um 10000000 10000000 cell_um 100000
//   # type 1 quantum_micro 125000 law counter:30000ms name "trail"
//   # nodes type,column,row,level
//   1,34,23,512
//   1,34,24,448
//   # end nodes 2 levels 960
//
// Levels are in 1/64 quantum, as at the time of saving; those of a diffusing type are rounded down.
// The lines are sorted, so equal fields give equal files; for numpy.loadtxt(delimiter=',') the
// header is a comment. Blends have no content and are not listed. `law` is for information.
//
//   SaveField("lab.field", TakeFieldSnapshot(field, now_ms));
//
//   Result<SavedField> saved = LoadField("lab.field");
//   Status laid = LayOnto(saved.value(), &config);   // before the Field is constructed
//
// A loaded level evaporates from the time at which it is deposited. Nothing is deposited at blocked
// nodes, and where the configuration deposits more, that is kept.
//
// Any thread. Errors of readers are `FILE:LINE:COLUMN: found ..., expected ...`.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/result.h"
#include "server/core/field/config.h"
#include "server/core/field/field.h"

namespace pheromone::maps {

/// The maximum for saving and loading: such a file has at most 772 MB, and uses 400 MB of memory.
constexpr size_t kMaxSavedNodes = size_t{1} << 25;

/// The beginning of every such file.
constexpr std::string_view kFieldMagic = "# pheromone-field ";

struct SavedType {
  uint8_t type = 1;
  std::string name;  ///< printable; other characters are replaced by ?
  int64_t quantum_micro = 1;
  std::string law;  ///< as text without blanks
  bool operator==(const SavedType&) const = default;
};

struct SavedField {
  field::MapGeometry map;
  std::vector<SavedType> types;  ///< in the order of their numbers
  std::vector<field::InitialRaster>
      initial_rasters;  ///< one for each type with content, its nodes sorted
  bool operator==(const SavedField&) const = default;
};

/// The contents of a field at `now_ms`; for its writer.
SavedField TakeFieldSnapshot(const field::Field& field, uint64_t now_ms);

/// The same concurrently with the writer, which does not wait: neighbouring nodes may differ
/// slightly in time. The geometry and the laws are the field's.
SavedField TakeFieldSnapshot(const field::FieldReader& reader, const field::MapGeometry& map,
                             std::span<const field::PheromoneLaw> laws, uint64_t now_ms);

/// Of all types together.
size_t CountNodes(const SavedField& saved);

std::string EncodeField(const SavedField& saved);
/// Replaces the file atomically (WriteFile). Also fails if there are more than kMaxSavedNodes.
Status SaveField(const std::string& path, const SavedField& saved);

/// `name` is what errors call the file.
Result<SavedField> ParseField(std::string_view text, std::string_view name);
Result<SavedField> LoadField(const std::string& path);

/// Whether a configuration can accept a saved field. Errors: another geometry; a type with content
/// that is missing, a blend, or has another name or quantum; a level above the type's maximum, or
/// not a whole number of quanta if the type counts these; not enough memory. Nothing is rescaled.
Status CheckFits(const SavedField& saved, const field::FieldConfig& config);

/// Adds the saved contents as initial rasters, if they fit.
Status LayOnto(const SavedField& saved, field::FieldConfig* config);

}  // namespace pheromone::maps
