#include "server/maps/lines.h"

#include <algorithm>

#include "server/maps/csv_line.h"
#include "server/maps/file.h"
#include "server/maps/geojson.h"
#include "server/maps/svg_file.h"

namespace pheromone::maps {
namespace {

std::optional<LineFormat> FormatOf(std::string extension) {
  std::transform(extension.begin(), extension.end(), extension.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  if (extension == ".csv") {
    return LineFormat::kCsv;
  }
  if (extension == ".geojson" || extension == ".json") {
    return LineFormat::kGeoJson;
  }
  if (extension == ".svg") {
    return LineFormat::kSvg;
  }
  return std::nullopt;
}

}  // namespace

Result<std::vector<Line>> ParseLines(LineFormat format, std::string_view text,
                                     std::string_view name, const LineOptions& options) {
  switch (format) {
    case LineFormat::kCsv:
      return ParseCsvLines(text, name);
    case LineFormat::kGeoJson:
      return ParseGeoJsonLines(text, name, options.geojson_unit, options.datum);
    case LineFormat::kSvg:
      break;
  }
  const SvgOptions svg{options.metres_per_unit, options.svg_id, options.tolerance_um};
  return ParseSvgLines(text, name, svg);
}

Result<std::vector<Line>> LoadLines(const std::filesystem::path& path, const LineOptions& options) {
  const std::string extension = path.extension().string();
  const auto format = FormatOf(extension);
  if (!format) {
    return Error{path.string() + ": found the extension " + Quoted(extension) +
                 ", expected .csv, .geojson, .json or .svg"};
  }
  const Result<std::string> text = ReadFile(path.string(), kMaxLineFileBytes);
  if (!text.ok()) {
    return Error{text.error()};
  }
  return ParseLines(*format, text.value(), path.string(), options);
}

}  // namespace pheromone::maps
