// Any text as lines: it is understood or refused with words that name the file. What is understood
// keeps what lines.h promises, and comes back the same when it is written as CSV. The first byte,
// as a digit, chooses the format.

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>

#include "proto_tests/fuzz/require.h"
#include "server/formats/maps/polyline_file.h"
#include "server/formats/maps/svg/svg_path.h"

namespace {

using pheromone::Result;
using pheromone::field::PointUm;
using pheromone::fuzz::Require;
using pheromone::maps::Polyline;
using Lines = std::vector<Polyline>;

constexpr int64_t kToleranceUm = 10'000;  // coarse, so that a run takes little time

Result<Lines> Parse(uint8_t parser, std::string_view text) {
  using pheromone::maps::PolylineFormat;
  pheromone::maps::PolylineOptions options;
  options.tolerance_um = kToleranceUm;
  switch (parser) {
    case 0:
      return ParsePolylines(PolylineFormat::kCsv, text, "fuzz", options);
    case 1:
      options.geojson_unit = pheromone::maps::GeoJsonUnit::kMetres;
      return ParsePolylines(PolylineFormat::kGeoJson, text, "fuzz", options);
    case 2:
      options.datum = {47.3769, 8.5417, 408};
      return ParsePolylines(PolylineFormat::kGeoJson, text, "fuzz", options);
    case 3:
      return ParsePolylines(PolylineFormat::kSvg, text, "fuzz", options);
    case 4:
      options.svg_id = "a";
      return ParsePolylines(PolylineFormat::kSvg, text, "fuzz", options);
    default:
      return pheromone::maps::ParseSvgPath(text, "fuzz", {1e3, 0, 0, 1e3, 0, 0}, kToleranceUm);
  }
}

void CheckSound(const Lines& lines) {
  size_t points = 0;
  for (const Polyline& line : lines) {
    const size_t size = line.points.size();
    points += size;
    Require(size > (line.closed ? 1u : 0u));
    Require(size < 3 || line.points.front() != line.points.back());
    Require(std::adjacent_find(line.points.begin(), line.points.end()) == line.points.end());
    for (const PointUm point : line.points) {
      Require(static_cast<double>(std::abs(point.x)) <= pheromone::maps::kMaxCoordinateUm);
      Require(static_cast<double>(std::abs(point.y)) <= pheromone::maps::kMaxCoordinateUm);
    }
  }
  Require(!lines.empty() && points <= pheromone::maps::kMaxPolylinePoints);
}

std::string ToCsv(const Lines& lines) {
  std::string csv;
  const auto add = [&csv](PointUm point) {
    std::array<char, 64> row{};
    std::snprintf(row.data(), row.size(), "%.6f,%.6f\n", static_cast<double>(point.x) / 1e6,
                  static_cast<double>(point.y) / 1e6);
    csv += row.data();
  };
  for (const Polyline& line : lines) {
    std::for_each(line.points.begin(), line.points.end(), add);
    if (line.closed) {
      add(line.points.front());
    }
    csv += '\n';
  }
  return csv;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size == 0) {
    return 0;
  }
  const std::string_view text(reinterpret_cast<const char*>(data) + 1, size - 1);
  const Result<Lines> lines = Parse(static_cast<uint8_t>(data[0] - '0') % 6, text);
  if (!lines.ok()) {
    Require(lines.error().starts_with("fuzz:"));
    Require(lines.error().find(", expected ") != std::string::npos);
    return 0;
  }
  CheckSound(lines.value());
  const std::string csv = ToCsv(lines.value());
  if (csv.size() < 100'000) {  // not the same again and again
    Require(Parse(0, csv).value() == lines.value());
  }
  return 0;
}
