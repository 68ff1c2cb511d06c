#include "server/formats/maps/geojson.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <string>
#include <utility>

#include <boost/json.hpp>

#include "server/base/format.h"
#include "server/base/message.h"
#include "server/formats/maps/polyline_sink.h"

namespace pheromone::maps {
namespace {

namespace json = boost::json;

constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
constexpr double kMetresToUm = 1e6;
// The library's tree needs up to 70 bytes per value; values are counted by the characters before
// them.
constexpr std::ptrdiff_t kMaxValues = 4'000'000;
// Within the accepted 1000 km the ground is never that far below the plane, but the other side of
// the Earth is, whose x and y are small again.
constexpr double kDeepestM = -100'000;

// One step down from a JSON value: a member's name, or an element's index where the name is empty.
struct Step {
  std::string_view member;
  size_t index = 0;
};

size_t SkipSpace(std::string_view text, size_t at) {
  return std::min(text.find_first_not_of(" \t\r\n", at), text.size());
}

// The end of the value that begins at `at` in valid JSON.
size_t SkipValue(std::string_view text, size_t at) {
  for (size_t depth = 0; at < text.size(); ++at) {
    const char c = text[at];
    if (c == '"') {
      do {
        at += text[at] == '\\' ? 2u : 1u;
      } while (at < text.size() && text[at] != '"');
    } else if (c == '[' || c == '{') {
      ++depth;
    } else if (c == ']' || c == '}') {
      --depth;
    } else if (depth == 0) {
      return std::min(text.find_first_of(",]} \t\r\n", at), text.size());
    }
    if (depth == 0) {
      return at + 1;
    }
  }
  return text.size();
}

// The position in `text`, which is valid JSON, of the value at `steps`. The library does not store
// positions, so an error searches for it.
size_t OffsetOf(std::string_view text, const std::vector<Step>& steps) {
  size_t at = SkipSpace(text, text.starts_with(kByteOrderMark) ? kByteOrderMark.size() : 0);
  for (const Step& step : steps) {
    size_t found = at;
    size_t next = SkipSpace(text, at + 1);
    for (size_t i = 0; next < text.size() && text[next] != ']' && text[next] != '}'; ++i) {
      bool match = step.member.empty() && i == step.index;
      if (text[at] == '{') {
        const size_t end = SkipValue(text, next);
        match = text.substr(next + 1, end - next - 2) == step.member;
        next = SkipSpace(text, SkipSpace(text, end) + 1);  // behind the colon
      }
      if (match) {
        found = next;  // of a member given twice, the library keeps the last
      }
      next = SkipSpace(text, SkipValue(text, next));
      next = next < text.size() && text[next] == ',' ? SkipSpace(text, next + 1) : next;
    }
    at = found;
  }
  return at;
}

class GeoJsonReader {
 public:
  GeoJsonReader(const LocalFrame* frame, PolylineSink* sink) : frame_(frame), sink_(*sink) {}

  bool Read(const json::value& document) { return ReadObject(document, Kind::kAny); }

 private:
  enum class Kind { kAny, kFeature, kGeometry };
  using ReadValue = bool (GeoJsonReader::*)(const json::value&);

  bool Fail(const json::value& found, std::string_view expected) {
    return sink_.Fail(OffsetOf(sink_.text(), steps_), Describe(found), expected);
  }

  static std::string Describe(const json::value& value) {
    if (&value == &Missing()) {
      return "nothing";
    }
    switch (value.kind()) {
      case json::kind::string:
        return Quoted(value.get_string());
      case json::kind::array:
        return "an array of " + std::to_string(value.get_array().size());
      case json::kind::object:
        return "an object";
      case json::kind::null:
        return "null";
      case json::kind::bool_:
        return value.get_bool() ? "true" : "false";
      default:
        return FormatNumber(value.to_number<double>());
    }
  }

  static const json::value& Missing() {
    static const json::value missing;
    return missing;
  }

  // Reads a member of the object `of`; one that is missing counts as null.
  bool ReadMember(const json::object& of, std::string_view name, ReadValue read) {
    const json::value* value = of.if_contains(name);
    steps_.push_back({name});
    const bool done = (this->*read)(value != nullptr ? *value : Missing());
    steps_.pop_back();
    return done;
  }

  bool ReadEach(const json::value& value, ReadValue read, std::string_view expected) {
    const json::array* array = value.if_array();
    if (array == nullptr) {
      return Fail(value, expected);
    }
    for (size_t i = 0; i < array->size(); ++i) {
      steps_.push_back({{}, i});
      if (!(this->*read)((*array)[i])) {
        return false;
      }
      steps_.pop_back();
    }
    return true;
  }

  bool ReadObject(const json::value& value, Kind kind) {
    const json::object* object = value.if_object();
    const json::value* type = object != nullptr ? object->if_contains("type") : nullptr;
    if (type == nullptr || !type->is_string()) {
      return Fail(value, "a GeoJSON object with a \"type\"");
    }
    if (frame_ != nullptr && !CheckSystem(*object)) {
      return false;
    }
    const std::string_view name = type->get_string();
    if (kind == Kind::kAny && name == "FeatureCollection") {
      return ReadMember(*object, "features", &GeoJsonReader::ReadFeatures);
    }
    if (kind != Kind::kGeometry && name == "Feature") {
      return ReadMember(*object, "geometry", &GeoJsonReader::ReadGeometryOrNull);
    }
    if (kind != Kind::kFeature) {
      if (name == "GeometryCollection") {
        return ReadMember(*object, "geometries", &GeoJsonReader::ReadGeometries);
      }
      for (const Geometry& geometry : kGeometries) {
        if (name == geometry.type) {
          return ReadMember(*object, "coordinates", geometry.read);
        }
      }
    }
    steps_.push_back({"type"});
    return Fail(*type,
                kind == Kind::kFeature ? "\"Feature\""
                : kind == Kind::kGeometry
                    ? "the type of a geometry, such as \"LineString\""
                    : "\"FeatureCollection\", \"Feature\" or the type of a geometry, such as "
                      "\"LineString\"");
  }

  // The GeoJSON of 2008 permitted systems other than the one required by RFC 7946, section 4.
  bool CheckSystem(const json::object& object) {
    const json::value* system = object.if_contains("crs");
    if (system == nullptr || system->is_null()) {
      return true;
    }
    const std::string text = json::serialize(*system);
    if (text.find("CRS84") == std::string::npos && text.find("EPSG::4326") == std::string::npos) {
      steps_.push_back({"crs"});
      return sink_.Fail(OffsetOf(sink_.text(), steps_), Quoted(text),
                        "WGS-84 degrees (urn:ogc:def:crs:OGC:1.3:CRS84), or metres = true");
    }
    return true;
  }

  bool ReadFeatures(const json::value& value) {
    return ReadEach(value, &GeoJsonReader::ReadFeature, "an array of features");
  }
  bool ReadFeature(const json::value& value) { return ReadObject(value, Kind::kFeature); }
  bool ReadGeometries(const json::value& value) {
    return ReadEach(value, &GeoJsonReader::ReadGeometry, "an array of geometries");
  }
  bool ReadGeometry(const json::value& value) { return ReadObject(value, Kind::kGeometry); }
  bool ReadGeometryOrNull(const json::value& value) {
    return value.is_null() || ReadGeometry(value);
  }

  bool ReadPoint(const json::value& value) {
    const bool empty = value.is_array() && value.get_array().empty();
    if (!empty && !ReadPosition(value)) {
      return false;
    }
    sink_.End(/*closed=*/false);
    return true;
  }
  bool ReadMultiPoint(const json::value& value) {
    return ReadEach(value, &GeoJsonReader::ReadPoint, "an array of positions");
  }

  bool ReadPositions(const json::value& value) {
    return ReadEach(value, &GeoJsonReader::ReadPosition, "an array of positions");
  }
  bool ReadLineString(const json::value& value) {
    if (value.is_array() && value.get_array().size() == 1) {
      return Fail(value, "at least two positions");
    }
    if (!ReadPositions(value)) {
      return false;
    }
    sink_.End(/*closed=*/false);
    return true;
  }
  bool ReadLineStrings(const json::value& value) {
    return ReadEach(value, &GeoJsonReader::ReadLineString, "an array of lines");
  }

  // RFC 7946, section 3.1.6: four or more positions, the first and the last the same.
  bool ReadRing(const json::value& value) {
    if (const json::array* ring = value.if_array(); ring != nullptr && !ring->empty()) {
      if (ring->size() < 4) {
        return Fail(value, "a ring of at least four positions");
      }
      if (ring->front() != ring->back()) {
        return Fail(value, "a ring whose last position is its first");
      }
    }
    if (!ReadPositions(value)) {
      return false;
    }
    sink_.End(/*closed=*/true);
    return true;
  }
  bool ReadPolygon(const json::value& value) {
    return ReadEach(value, &GeoJsonReader::ReadRing, "an array of rings");
  }
  bool ReadPolygons(const json::value& value) {
    return ReadEach(value, &GeoJsonReader::ReadPolygon, "an array of polygons");
  }

  bool ReadPosition(const json::value& value) {
    const json::array* position = value.if_array();
    if (position == nullptr || position->size() < 2) {
      return Fail(value, frame_ != nullptr ? "a position [longitude, latitude]"
                                           : "a position [x, y] in metres");
    }
    for (size_t i = 0; i < position->size(); ++i) {
      if (!(*position)[i].is_number()) {
        steps_.push_back({{}, i});
        return Fail((*position)[i], "a number");
      }
    }
    const auto first = (*position)[0].to_number<double>();
    const auto second = (*position)[1].to_number<double>();
    if (frame_ == nullptr) {
      return Add(first, second);
    }
    if (!(std::abs(first) <= 180)) {
      steps_.push_back({{}, 0});
      return Fail((*position)[0], "a longitude of -180 to 180 degrees");
    }
    if (!(std::abs(second) <= 90)) {
      steps_.push_back({{}, 1});
      return Fail((*position)[1], "a latitude of -90 to 90 degrees, after the longitude");
    }
    const EastNorthUp local = frame_->ToLocal({second, first, frame_->datum().height_m});
    if (local.up_m < kDeepestM) {
      return Fail(value, "a position at most 1000 km from the datum");
    }
    return Add(local.east_m, local.north_m);
  }

  bool Add(double x_m, double y_m) {
    const double x_um = x_m * kMetresToUm;
    const double y_um = y_m * kMetresToUm;
    const size_t offset = sink_.Fits(x_um, y_um) ? 0 : OffsetOf(sink_.text(), steps_);
    return sink_.Add(x_um, y_um, offset);
  }

  struct Geometry {
    std::string_view type;
    ReadValue read;
  };
  static constexpr std::array<Geometry, 6> kGeometries = {{
      {"Point", &GeoJsonReader::ReadPoint},
      {"MultiPoint", &GeoJsonReader::ReadMultiPoint},
      {"LineString", &GeoJsonReader::ReadLineString},
      {"MultiLineString", &GeoJsonReader::ReadLineStrings},
      {"Polygon", &GeoJsonReader::ReadPolygon},
      {"MultiPolygon", &GeoJsonReader::ReadPolygons},
  }};

  const LocalFrame* frame_;  // null: coordinates are metres
  PolylineSink& sink_;
  std::vector<Step> steps_;
};

// The document, or null with the error in the sink.
json::value ParseDocument(PolylineSink* sink) {
  const std::string_view text = sink->text();
  if (std::count_if(text.begin(), text.end(),
                    [](char c) { return c == ',' || c == '[' || c == '{'; }) > kMaxValues) {
    sink->Fail(0, "more than " + std::to_string(kMaxValues) + " values", "a smaller file");
    return nullptr;
  }
  const size_t begin = text.starts_with(kByteOrderMark) ? kByteOrderMark.size() : 0;
  json::parser parser(json::make_shared_resource<json::monotonic_resource>());
  json::error_code error;
  const size_t used = parser.write(text.data() + begin, text.size() - begin, error);
  if (error) {
    const size_t at = begin + used;
    sink->Fail(at, sink->Found(at), "JSON (" + error.message() + ")");
    return nullptr;
  }
  return parser.release();
}

void Read(const LocalFrame* frame, PolylineSink* sink) {
  try {
    const json::value document = ParseDocument(sink);
    if (!sink->failed()) {
      GeoJsonReader(frame, sink).Read(document);
    }
  } catch (const std::exception& error) {  // such as no memory
    sink->Fail(0, error.what(), "valid JSON");
  }
}

}  // namespace

Result<std::vector<Polyline>> ParseGeoJsonLines(std::string_view text, std::string_view name,
                                                GeoJsonUnit unit,
                                                const std::optional<Wgs84>& datum) {
  PolylineSink sink(text, name);
  if (sink.failed()) {
    return std::move(sink).Take();
  }
  if (unit == GeoJsonUnit::kMetres) {
    Read(nullptr, &sink);
    return std::move(sink).Take();
  }
  if (!datum) {
    return Error{std::string(name) +
                 ": found no datum, expected the geographic position of the map's origin for "
                 "GeoJSON in degrees"};
  }
  const Result<LocalFrame> frame = LocalFrame::At(*datum);
  if (!frame.ok()) {
    return Error{std::string(name) + ": " + frame.error()};
  }
  Read(&frame.value(), &sink);
  return std::move(sink).Take();
}

}  // namespace pheromone::maps
