#include "server/formats/maps/polyline_sink.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "server/base/format.h"
#include "server/base/message.h"

namespace pheromone::maps {

PolylineSink::PolylineSink(std::string_view text, std::string_view name)
    : text_(text), name_(name) {
  if (text.size() > kMaxPolylineFileBytes) {
    error_ = Error{std::string(name) + ": found more than 16 MiB, expected a smaller file"};
  }
}

bool PolylineSink::Fail(size_t offset, std::string_view found, std::string_view expected) {
  if (!error_) {
    const std::string_view before = text_.substr(0, offset);
    const auto line = 1 + std::count(before.begin(), before.end(), '\n');
    const size_t column = before.size() - (before.rfind('\n') + 1) + 1;  // npos + 1 is 0
    error_ = AtLine(name_, static_cast<size_t>(line), column,
                    "found " + std::string(found) + ", expected " + std::string(expected));
  }
  return false;
}

std::string PolylineSink::Found(size_t offset) const {
  return offset < text_.size() ? Quoted(text_.substr(offset, 1)) : "the end of the file";
}

bool PolylineSink::FailTooMany(size_t offset) {
  return Fail(offset, "more than " + std::to_string(kMaxPolylinePoints) + " points",
              "shorter lines or a coarser tolerance");
}

bool PolylineSink::Fits(double x_um, double y_um) const {
  // Written so that NaN is refused.
  return std::abs(x_um) <= kMaxCoordinateUm && std::abs(y_um) <= kMaxCoordinateUm && room() > 0;
}

bool PolylineSink::Add(double x_um, double y_um, size_t offset) {
  if (failed()) {
    return false;
  }
  if (room() == 0) {
    return FailTooMany(offset);
  }
  if (!Fits(x_um, y_um)) {
    return Fail(
        offset,
        "a point at x = " + FormatNumber(x_um / 1e6) + " m, y = " + FormatNumber(y_um / 1e6) + " m",
        "coordinates of at most 1000 km");
  }
  ++added_;
  const field::PointUm point{std::llround(x_um), std::llround(y_um)};
  if (line_.points.empty() || !(line_.points.back() == point)) {
    line_.points.push_back(point);
  }
  return true;
}

void PolylineSink::End(bool closed, size_t least) {
  Polyline line = std::exchange(line_, {});
  if (line.points.size() < std::max<size_t>(1, least)) {
    return;
  }
  line.closed = closed;
  if (line.points.size() > 2 && line.points.front() == line.points.back()) {
    line.points.pop_back();
    line.closed = true;
  }
  line.closed = line.closed && line.points.size() > 1;
  lines_.push_back(std::move(line));
}

Result<std::vector<Polyline>> PolylineSink::Take() && {
  if (!failed() && lines_.empty()) {
    Fail(0, "no line", "at least one");
  }
  if (failed()) {
    return *std::move(error_);
  }
  return std::move(lines_);
}

}  // namespace pheromone::maps
