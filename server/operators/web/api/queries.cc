#include "server/operators/web/api/queries.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>

#include "server/core/field/extent.h"
#include "server/formats/maps/csv_grid.h"
#include "server/formats/maps/field_raster.h"
#include "server/formats/maps/npy.h"
#include "server/formats/maps/png_picture.h"
#include "server/formats/maps/ros_map.h"
#include "server/operators/control/json_text.h"
#include "server/operators/control/views.h"

namespace pheromone::web {
namespace {

namespace json = boost::json;

constexpr int64_t kUsualSide = 1000;  // cells, unless the request says how many
constexpr double kPerUnit = 4096;     // Intensities count in 1/4096 unit
constexpr maps::Rgb kObstacleGray = {128, 128, 128};

// For a header: ASCII, on one line.
std::string LineOf(const json::object& object) {
  std::string line;
  for (const char c : ToText(object)) {
    const auto byte = static_cast<unsigned char>(c);
    line += byte >= 0x20 && byte < 0x7F ? c : '?';
  }
  line.pop_back();  // the end of line
  return line;
}

// `facts` describe the raster.
Response Encode(const maps::Raster& raster, const Format& format, double high, json::object facts) {
  if (format.name == "csv") {
    return {.content_type = "text/csv", .body = maps::EncodeCsvGrid(raster)};
  }
  if (format.name == "png") {
    const Result<std::string> png =
        maps::EncodePicture(raster, {.low = 0,
                                     .high = high,
                                     .unknown = kObstacleGray,
                                     .pixels_per_cell = format.pixels_per_cell});
    return png.ok() ? Response{.content_type = "image/png", .body = png.value()}
                    : Refuse(500, {png.error(), "", ""});
  }
  if (format.name == "npy") {  // has no room for the facts
    return {.content_type = "application/octet-stream",
            .body = maps::EncodeNpy(raster),
            .headers = {{"X-Raster", LineOf(facts)}}};
  }
  facts["values"] = RowsOf(raster);
  return {.body = ToText(facts)};
}

// The parameters that all rasters have. Nothing, with the problem noted, if one of them is invalid.
std::optional<std::pair<Format, maps::RasterExtent>> ReadRaster(const field::MapGeometry& map,
                                                                Parameters* fields) {
  const auto format = fields->String("format", "json");
  if (format && *format != "json" && *format != "csv" && *format != "npy" && *format != "png") {
    fields->Expected("format", "one of json, csv, npy, png");
  }
  maps::NodeArea area{{0, 0}, {map.columns() - 1, map.rows() - 1}};
  if (fields->Has("area_m")) {
    const auto corners = fields->Corners("area_m");
    const auto found =
        corners ? maps::NodesBetween(map, (*corners)[0], (*corners)[1]) : std::nullopt;
    if (corners && !found) {
      fields->Note({"the area contains no node of the map", "area_m", "an area of the map"});
    }
    area = found.value_or(area);
  }
  const int64_t columns = area.last.column - area.first.column + 1;
  const int64_t rows = area.last.row - area.first.row + 1;
  const int64_t usual = (std::max(columns, rows) + kUsualSide - 1) / kUsualSide;
  const auto nodes = fields->Integer("nodes_per_cell", 1, maps::kMaxSide, usual);
  const auto pixels = fields->Integer("pixels_per_cell", 1, 100, 1);
  if (fields->problem() || !format || !nodes || !pixels) {
    return std::nullopt;
  }
  const auto cells = [&](int64_t n) { return (n + *nodes - 1) / *nodes; };
  const int64_t scale = *format == "png" ? *pixels : 1;
  if (cells(columns) * cells(rows) * scale * scale > kMaxCells) {
    fields->Note({"a raster of " + std::to_string(cells(columns) * scale) + " x " +
                      std::to_string(cells(rows) * scale),
                  "nodes_per_cell",
                  "at most " + std::to_string(kMaxCells) +
                      " cells or pixels: use a smaller area or more nodes per cell"});
    return std::nullopt;
  }
  return std::pair(Format{*format, static_cast<int>(*pixels)},
                   maps::RasterExtent{area, static_cast<int32_t>(*nodes)});
}

Response TooMany() {
  return Refuse(503, {"too many readers of the field", "", "fewer viewers; try again"});
}

}  // namespace

const field::PheromoneLaw* ReadLaw(const field::FieldConfig& config, bool blends,
                                   Parameters* fields) {
  std::string known;
  const field::PheromoneLaw* found = nullptr;
  for (const field::PheromoneLaw& law : config.pheromones) {
    if (!blends && law.is_blend()) {
      continue;
    }
    known += (known.empty() ? "one of " : ", ") + std::to_string(law.type) + " (" + law.name + ")";
    if (fields->Names("pheromone", law.type, law.name)) {
      found = &law;
    }
  }
  if (found == nullptr) {
    fields->Expected("pheromone", known);
  }
  return found;
}

std::optional<Picture> ReadPicture(control::FieldView view, Parameters* fields) {
  const field::FieldConfig& config = view.config;
  const field::PheromoneLaw* law = ReadLaw(config, false, fields);
  const auto raster = ReadRaster(config.map, fields);
  fields->AllowOnly({"pheromone", "format", "area_m", "nodes_per_cell", "pixels_per_cell"});
  if (fields->problem() || law == nullptr || !raster) {
    return std::nullopt;
  }
  Picture picture;
  picture.law = *law;
  picture.format = raster->first;
  picture.extent = raster->second;
  picture.view = std::move(view);
  return picture;
}

Response DrawPicture(const Picture& picture) {
  const field::FieldReader reader(*picture.view.field);
  if (!reader.ok()) {
    return TooMany();
  }
  const Result<maps::Raster> raster = maps::RasterOf(reader, picture.view.config, picture.law.type,
                                                     picture.view.now_ms, picture.extent);
  return raster.ok() ? Encode(raster.value(), picture.format, MaximumOf(picture.law),
                              DescribeRaster(raster.value(), picture.law, picture.view.now_ms))
                     : Refuse(400, {raster.error(), "", ""});
}

Response ReadObstacles(const control::Control& control, Parameters* fields) {
  const field::FieldConfig config = control.GetField().config;
  const auto wanted = ReadRaster(config.map, fields);
  fields->AllowOnly({"format", "area_m", "nodes_per_cell", "pixels_per_cell"});
  if (fields->problem() || !wanted) {
    return Refuse(400, *fields->problem());
  }
  Result<maps::Raster> found = maps::ObstaclesOf(config, wanted->second);
  if (!found.ok()) {
    return Refuse(400, {found.error(), "", ""});
  }
  maps::Raster raster = std::move(found).value();
  for (double& value : raster.values) {
    value = value == maps::kOccupied ? 1 : 0;
  }
  return Encode(raster, wanted->first, 1, DescribeRaster(raster));
}

Response ReadSense(const control::Control& control, Parameters* fields) {
  const control::FieldView view = control.GetField();
  const field::PheromoneLaw* law = ReadLaw(view.config, true, fields);
  const auto x = fields->Metres("x_m", -1e6);
  const auto y = fields->Metres("y_m", -1e6);
  const auto heading = fields->Number("heading_deg", -360, 360, 0);
  fields->AllowOnly({"pheromone", "x_m", "y_m", "heading_deg"});
  if (fields->problem() || law == nullptr) {
    return Refuse(400, *fields->problem());
  }
  const field::FieldReader reader(*view.field);
  if (!reader.ok()) {
    return TooMany();
  }
  const auto angle = static_cast<uint16_t>(std::llround(*heading / 360 * 65536) & 0xFFFF);
  const field::PoseUm pose{{*x, *y}, angle};
  const auto sensed = reader.Sense(law->type, pose, view.now_ms);
  if (!sensed) {
    return Refuse(409, {"the pose is off the map", "x_m, y_m",
                        "a position on " + field::DescribeExtent(view.config.map)});
  }
  const field::Antennas antennas = field::AntennasOf(pose, view.config.antennas);
  const auto side = [](int64_t intensity, field::PointUm place) {
    return json::object{{"intensity", static_cast<double>(intensity) / kPerUnit},
                        {"x_m", Metres(place.x)},
                        {"y_m", Metres(place.y)}};
  };
  return {.body = ToText(json::object{{"pheromone", law->name},
                                      {"type", law->type},
                                      {"left", side(sensed->left, antennas.left)},
                                      {"right", side(sensed->right, antennas.right)}})};
}

}  // namespace pheromone::web
