#include "server/formats/maps/polyline_file.h"

#include "server/base/file.h"
#include "server/base/message.h"
#include "server/base/text.h"
#include "server/formats/maps/csv_polyline.h"
#include "server/formats/maps/geojson.h"
#include "server/formats/maps/svg/svg_file.h"

namespace pheromone::maps {
namespace {

std::optional<PolylineFormat> FormatOf(std::string_view extension) {
  if (extension == ".csv") {
    return PolylineFormat::kCsv;
  }
  if (extension == ".geojson" || extension == ".json") {
    return PolylineFormat::kGeoJson;
  }
  if (extension == ".svg") {
    return PolylineFormat::kSvg;
  }
  return std::nullopt;
}

}  // namespace

Result<std::vector<Polyline>> ParsePolylines(PolylineFormat format, std::string_view text,
                                             std::string_view name,
                                             const PolylineOptions& options) {
  switch (format) {
    case PolylineFormat::kCsv:
      return ParseCsvLines(text, name);
    case PolylineFormat::kGeoJson:
      return ParseGeoJsonLines(text, name, options.geojson_unit, options.datum);
    case PolylineFormat::kSvg:
      break;
  }
  const SvgOptions svg{options.metres_per_unit, options.svg_id, options.tolerance_um};
  return ParseSvgLines(text, name, svg);
}

Result<std::vector<Polyline>> LoadPolylines(const std::filesystem::path& path,
                                            const PolylineOptions& options) {
  const std::string extension = path.extension().string();
  const auto format = FormatOf(ToLower(extension));
  if (!format) {
    return Error{path.string() + ": found the extension " + Quoted(extension) +
                 ", expected .csv, .geojson, .json or .svg"};
  }
  PHEROMONE_TRY(const std::string text, ReadFile(path.string(), kMaxPolylineFileBytes));
  return ParsePolylines(*format, text, path.string(), options);
}

}  // namespace pheromone::maps
