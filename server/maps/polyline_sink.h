// Where the readers of lines leave what they find: points, or the first thing that is wrong.
//
//   PolylineSink sink(text, "course.csv");
//   sink.Add(1e6, 2e6, offset) && sink.Add(...);  // false: stop reading
//   sink.End(/*closed=*/false);
//   return std::move(sink).Take();
//
// The sink knows the text, so that readers say where they are by a byte offset alone. It is what
// keeps the promises of lines.h about points and limits. Internal to server/maps.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/result.h"
#include "server/maps/polyline_file.h"

namespace pheromone::maps {

class PolylineSink {
 public:
  /// `text` and `name` outlive the sink. A text that is too long has failed already.
  PolylineSink(std::string_view text, std::string_view name);

  /// Notes what is wrong at byte `offset` of the text, if nothing was wrong before. Always false.
  bool Fail(size_t offset, std::string_view found, std::string_view expected);
  bool failed() const { return error_.has_value(); }

  /// How an error calls what stands at `offset`: a character in quotation marks, or the end.
  std::string Found(size_t offset) const;

  /// Whether Add would take this point.
  bool Fits(double x_um, double y_um) const;

  /// One more point of the present line; false, having noted it, if it is not to be had.
  bool Add(double x_um, double y_um, size_t offset);

  /// Ends the present line, if it has begun. One with fewer points than `least` is forgotten.
  void End(bool closed, size_t least = 1);

  /// How many points may still come.
  size_t room() const { return kMaxPolylinePoints - added_; }
  /// Notes that more than `room` points would come. Always false.
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
