// Collects the results of the readers of polylines: points, or the first error.
//
//   PolylineSink sink(text, "course.csv");
//   sink.Add(1e6, 2e6, offset) && sink.Add(...);  // false: stop reading
//   sink.End(/*closed=*/false);
//   return std::move(sink).Take();
//
// The sink has the text, so that readers give positions as byte offsets. It enforces the rules of
// polyline_file.h about points and limits. Internal to server/formats/maps.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/result.h"
#include "server/formats/maps/polyline_file.h"

namespace pheromone::maps {

class PolylineSink {
 public:
  /// `text` and `name` outlive the sink. A text that is too long has failed already.
  PolylineSink(std::string_view text, std::string_view name);

  /// Reports an error at byte `offset` of the text; only the first error is kept. Always false.
  bool Fail(size_t offset, std::string_view found, std::string_view expected);
  bool failed() const { return error_.has_value(); }

  /// The text at `offset` for an error message: a character in quotation marks, or the end.
  std::string Found(size_t offset) const;

  /// Whether Add would accept this point.
  bool Fits(double x_um, double y_um) const;

  /// Adds a point to the present polyline; false, with an error reported, if it is refused.
  bool Add(double x_um, double y_um, size_t offset);

  /// Ends the present polyline, if it has begun. One with fewer points than `least` is dropped.
  void End(bool closed, size_t least = 1);

  /// The number of points that may still be added.
  size_t room() const { return kMaxPolylinePoints - added_; }
  /// Reports an error: more than `room` points. Always false.
  bool FailTooMany(size_t offset);

  /// All lines, or the error.
  Result<std::vector<Polyline>> Take() &&;

  std::string_view text() const { return text_; }

 private:
  std::string_view text_;
  std::string_view name_;
  std::optional<Error> error_;
  std::vector<Polyline> lines_;
  Polyline line_;
  size_t added_ = 0;
};

}  // namespace pheromone::maps
