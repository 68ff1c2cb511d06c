// All that lies on a map as one text file, to go on from later: a header, then a line for each node
// that holds something, then the sums by which a file that is not whole is noticed.
//
//   # pheromone-field 1
//   # map origin_um 0 0 size_um 10000000 10000000 cell_um 100000
//   # type 1 quantum_micro 125000 law counter:30000ms name "trail"
//   # nodes type,column,row,level
//   1,34,23,512
//   1,34,24,448
//   # end nodes 2 levels 960
//
// Levels are in 1/64 quantum, as they were at the moment of saving; a diffusing type's are rounded
// down to that. The lines are sorted by their numbers, so equal fields give equal files; for
// numpy.loadtxt(delimiter=',') the header is a comment. Blends hold nothing and are not named. What
// `law` says is for people.
//
//   SaveField("lab.field", TakeFieldSnapshot(field, now_ms));
//
//   Result<SavedField> saved = LoadField("lab.field");
//   Status laid = LayOnto(saved.value(), &config);   // before a Field is made of it
//
// A loaded level counts from the moment at which it is laid. What lies on a blocked node is not
// laid, and of a node where the configuration lays more by itself, the more stays.
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
#include "server/field/config.h"
#include "server/field/field.h"

namespace pheromone::maps {

/// More is neither saved nor read: such a file has at most 772 MB, and in memory 400 MB.
constexpr size_t kMaxSavedNodes = size_t{1} << 25;

struct SavedType {
  uint8_t type = 1;
  std::string name;  ///< printable; what is not was replaced by ?
  int64_t quantum_micro = 1;
  std::string law;  ///< in words without blanks
  bool operator==(const SavedType&) const = default;
};

struct SavedField {
  field::MapGeometry map;
  std::vector<SavedType> types;  ///< in the order of their numbers
  std::vector<field::InitialRaster>
      initial_rasters;  ///< of each type that holds something one, its nodes sorted
  bool operator==(const SavedField&) const = default;
};

/// What lies on a field at `now_ms`; for its writer.
SavedField TakeFieldSnapshot(const field::Field& field, uint64_t now_ms);

/// The same beside the writer, who is not held up: neighbouring nodes may be of slightly different
/// moments. The geometry and the laws are the field's.
SavedField TakeFieldSnapshot(const field::FieldReader& reader, const field::MapGeometry& map,
                             std::span<const field::PheromoneLaw> laws, uint64_t now_ms);

/// Of all types together.
size_t CountNodes(const SavedField& saved);

std::string EncodeField(const SavedField& saved);
/// Replaces the file as a whole (WriteFile). Fails too if there are more than kMaxSavedNodes.
Status SaveField(const std::string& path, const SavedField& saved);

/// `name` is what errors call the file.
Result<SavedField> ParseField(std::string_view text, std::string_view name);
Result<SavedField> LoadField(const std::string& path);

/// Why a configuration cannot take what was saved, if it cannot: another geometry; a type with
/// something on it that is missing, a blend, or has another name or quantum; a level above the
/// type's maximum, or between the whole quanta that it counts; not enough memory. Nothing is
/// rescaled.
Status CheckFits(const SavedField& saved, const field::FieldConfig& config);

/// Adds the prints, if they fit.
Status LayOnto(const SavedField& saved, field::FieldConfig* config);

}  // namespace pheromone::maps
