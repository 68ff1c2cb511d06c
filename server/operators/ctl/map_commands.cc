#include "server/operators/ctl/map_commands.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <memory>
#include <utility>

#include "server/base/file.h"
#include "server/base/units.h"
#include "server/config/config.h"
#include "server/core/field/field.h"
#include "server/formats/maps/field_file.h"
#include "server/formats/maps/field_raster.h"
#include "server/formats/maps/png_picture.h"
#include "server/formats/maps/resample.h"
#include "server/operators/ctl/map_svg.h"
#include "server/operators/ctl/pdf.h"
#include "server/operators/ctl/raster_files.h"

namespace pheromone::ctl {
namespace {

constexpr double kUmPerM = 1e6;
constexpr double kFarthestM = 1e6;
constexpr int kUsualPixels = 1000;
constexpr maps::Rgb kObstacleGray = {128, 128, 128};

// A map with the contents given by its configuration and a saved field.
struct Scene {
  std::unique_ptr<field::Field> field;
  maps::RasterExtent extent;
  int status = 0;  // not 0: it was told what is wrong
};

Scene Failed(int status, const std::string& words) {
  Scene scene;
  scene.status = Fail(status, words);
  return scene;
}

Scene MakeScene(const MapSource& source) {
  Result<config::Config> loaded = config::LoadConfigOrDefault(source.config);
  if (!loaded.ok()) {
    return Failed(kUsage, loaded.error());
  }
  field::FieldConfig& config = loaded.value().engine.field;
  if (!source.field.empty()) {
    const Result<maps::SavedField> saved = maps::LoadField(source.field);
    if (!saved.ok()) {
      return Failed(kFailed, saved.error());
    }
    const Status laid = maps::LayOnto(saved.value(), &config);
    if (!laid.ok()) {
      return Failed(kUsage, source.field + " does not match the configuration: " + laid.error());
    }
  }
  Scene scene;
  scene.extent.nodes_per_cell = source.nodes_per_cell;
  if (!source.area_m.empty()) {
    std::vector<int64_t> um;
    for (const double metres : source.area_m) {
      um.push_back(std::llround(std::clamp(metres, -kFarthestM, kFarthestM) * kUmPerM));
    }
    scene.extent.area = maps::NodesBetween(config.map, {um[0], um[1]}, {um[2], um[3]});
    if (!scene.extent.area) {
      return Failed(kUsage, "--area: the area contains no node of the map");
    }
  }
  scene.field = std::make_unique<field::Field>(std::move(config));
  return scene;
}

bool HoldsSomething(const field::Field& field, uint8_t type) {
  bool something = false;
  field.VisitLevels(type, 0, [&](field::NodeIndex, uint32_t) { something = true; });
  return something;
}

// The type named by --type. Null, with an error reported, if there is none.
const field::PheromoneLaw* ChooseType(const field::Field& field, const std::string& wanted) {
  const std::vector<field::PheromoneLaw>& laws = field.config().pheromones;
  const auto found = std::find_if(laws.begin(), laws.end(), [&](const field::PheromoneLaw& law) {
    return wanted.empty() ? HoldsSomething(field, law.type)
                          : law.name == wanted || std::to_string(law.type) == wanted;
  });
  if (found != laws.end()) {
    return &*found;
  }
  if (wanted.empty() && !laws.empty()) {
    return &laws.front();
  }
  std::string known;
  for (const field::PheromoneLaw& law : laws) {
    known += fmt::format("{}{} (\"{}\")", known.empty() ? "" : ", ", law.type, law.name);
  }
  Fail(kUsage, fmt::format("--type: found \"{}\", expected one of {}", wanted, known));
  return nullptr;
}

struct Drawn {
  maps::Raster raster;
  double maximum = 1;
  std::string name;  // of the pheromone
  std::string what;
  int status = 0;
};

Drawn DrawPheromone(const MapSource& source) {
  Drawn drawn;
  const Scene scene = MakeScene(source);
  const field::PheromoneLaw* law =
      scene.status == 0 ? ChooseType(*scene.field, source.type) : nullptr;
  if (law == nullptr) {
    drawn.status = scene.status != 0 ? scene.status : kUsage;
    return drawn;
  }
  Result<maps::Raster> raster = maps::RasterOf(*scene.field, law->type, 0, scene.extent);
  if (!raster.ok()) {
    drawn.status = Fail(kUsage, raster.error());
    return drawn;
  }
  drawn.raster = std::move(raster).value();
  drawn.maximum = static_cast<double>(law->quantum_micro) * law->max_count / kUmPerM;
  drawn.name = law->name;
  drawn.what = fmt::format("pheromone {} \"{}\", {} x {} cells", law->type, law->name,
                           drawn.raster.columns, drawn.raster.rows);
  return drawn;
}

int Report(const Status& written, const std::string& out, const std::string& what) {
  if (!written.ok()) {
    return Fail(kFailed, written.error());
  }
  std::cout << out << ": " << what << '\n';
  return 0;
}

void DescribeSaved(const maps::SavedField& saved) {
  const field::MapGeometry& map = saved.map;
  fmt::print("saved field: {} x {} m from ({}, {}), cells of {} m, {} x {} nodes\n",
             Metres(map.width_um), Metres(map.height_um), Metres(map.origin.x),
             Metres(map.origin.y), Metres(map.cell_um), map.columns(), map.rows());
  for (const maps::SavedType& type : saved.types) {
    size_t nodes = 0;
    uint32_t most = 0;
    for (const field::InitialRaster& print : saved.initial_rasters) {
      for (size_t i = 0; print.type == type.type && i < print.nodes->size(); ++i) {
        most = std::max(most, (*print.nodes)[i].level);
        ++nodes;
      }
    }
    const double unit = static_cast<double>(type.quantum_micro) / 1e6 / field::kLevelsPerQuantum;
    fmt::print("pheromone {} \"{}\", {}: {} nodes, at most {}\n", type.type, type.name, type.law,
               nodes, most * unit);
  }
}

// Keeps only these types in `saved`.
Status KeepTypes(const std::vector<std::string>& wanted, maps::SavedField* saved) {
  if (wanted.empty()) {
    return Ok();
  }
  std::vector<maps::SavedType> kept;
  for (const std::string& name : wanted) {
    const auto found =
        std::find_if(saved->types.begin(), saved->types.end(), [&](const maps::SavedType& it) {
          return it.name == name || std::to_string(it.type) == name;
        });
    if (found == saved->types.end()) {
      return Error{"the field has no pheromone \"" + name + "\""};
    }
    kept.push_back(*found);
  }
  const auto is_kept = [&](uint8_t type) {
    return std::any_of(kept.begin(), kept.end(),
                       [&](const maps::SavedType& it) { return it.type == type; });
  };
  std::erase_if(saved->types, [&](const maps::SavedType& it) { return !is_kept(it.type); });
  std::erase_if(saved->initial_rasters,
                [&](const field::InitialRaster& it) { return !is_kept(it.type); });
  return Ok();
}

}  // namespace

int DrawMap(const MapSource& source, int pixels_per_cell, const std::string& out) {
  const bool is_pdf = out.ends_with(".pdf");
  if (!is_pdf && !out.ends_with(".svg") && !out.ends_with(".png")) {
    return Fail(kUsage, out + ": unknown ending, expected .pdf, .svg or .png");
  }
  const Drawn drawn = DrawPheromone(source);
  if (drawn.status != 0) {
    return drawn.status;
  }
  const int32_t side = std::max(drawn.raster.columns, drawn.raster.rows);
  maps::PictureStyle style{.low = 0, .high = drawn.maximum, .unknown = kObstacleGray};
  style.pixels_per_cell = pixels_per_cell != 0 ? pixels_per_cell : std::max(1, kUsualPixels / side);
  Status saved = Ok();
  if (out.ends_with(".png")) {
    saved = maps::SavePicture(out, drawn.raster, style);
  } else {
    Result<std::string> figure =
        MapToSvg(drawn.raster, {.title = "Pheromone \"" + drawn.name + "\"",
                                .scale_label = "content of a node in units",
                                .maximum = drawn.maximum,
                                .obstacle = kObstacleGray,
                                .pixels_per_cell = style.pixels_per_cell});
    if (figure.ok() && is_pdf) {
      figure = SvgToPdf(figure.value());
    }
    saved = figure.ok() ? WriteFile(out, figure.value()) : Status(figure.error());
  }
  return Report(saved, out,
                fmt::format("{} of {} pixels, from 0 to {}", drawn.what, style.pixels_per_cell,
                            drawn.maximum));
}

int ExportMap(const MapSource& source, const std::string& out) {
  if (out.ends_with(".npy") || out.ends_with(".csv")) {
    const Drawn drawn = DrawPheromone(source);
    return drawn.status != 0 ? drawn.status
                             : Report(SaveRaster(out, drawn.raster, {}), out, drawn.what);
  }
  if (!out.ends_with(".yaml")) {
    return Fail(kUsage, out + ": unknown ending, expected .npy, .csv or .yaml (the obstacles)");
  }
  if (!source.type.empty() || !source.field.empty()) {
    return Fail(kUsage, out + ": a ROS map contains only obstacles, expected no --type or --field");
  }
  const Scene scene = MakeScene(source);
  if (scene.status != 0) {
    return scene.status;
  }
  const Result<maps::Raster> obstacles = maps::ObstaclesOf(scene.field->config(), scene.extent);
  if (!obstacles.ok()) {
    return Fail(kUsage, obstacles.error());
  }
  return Report(
      SaveRaster(out, obstacles.value(), {}), out,
      fmt::format("obstacles, {} x {} cells", obstacles.value().columns, obstacles.value().rows));
}

int ConvertRaster(const std::string& in, const std::string& out, std::optional<double> white,
                  std::optional<double> cell_m) {
  for (const std::string& path : {in, out}) {
    if (const Status known = CheckRasterEnding(path); !known.ok()) {
      return Fail(kUsage, known.error());
    }
  }
  if (const Status other = CheckOutput(out, {in}); !other.ok()) {
    return Fail(kUsage, other.error());
  }
  Result<maps::Raster> raster = LoadRaster(in, white);
  if (!raster.ok()) {
    return Fail(kFailed, raster.error());
  }
  RasterStyle style{.white = white, .cell_um = {}};
  if (cell_m) {
    style.cell_um = std::llround(*cell_m * kUmPerM);
  }
  const std::string what =
      fmt::format("{} x {} cells", raster.value().columns, raster.value().rows);
  return Report(SaveRaster(out, std::move(raster).value(), style), out, what);
}

int ResampleField(const std::string& config, const std::vector<std::string>& types,
                  const std::string& in, const std::string& out) {
  if (const Status other = CheckOutput(out, {in, config}); !other.ok()) {
    return Fail(kUsage, other.error());
  }
  const Result<config::Config> loaded = config::LoadConfig(config);
  if (!loaded.ok()) {
    return Fail(kUsage, loaded.error());
  }
  Result<maps::SavedField> saved = maps::LoadField(in);
  if (!saved.ok()) {
    return Fail(kFailed, saved.error());
  }
  const Status kept = KeepTypes(types, &saved.value());
  if (!kept.ok()) {
    return Fail(kUsage, in + ": " + kept.error());
  }
  const Result<maps::Resampled> moved = maps::Resample(saved.value(), loaded.value().engine.field);
  if (!moved.ok()) {
    return Fail(kUsage, in + " does not match the configuration: " + moved.error());
  }
  return Report(maps::SaveField(out, moved.value().field), out, maps::InWords(moved.value()));
}

int DescribeFile(const std::string& path) {
  if (!CheckRasterEnding(path).ok()) {
    const Result<maps::SavedField> saved = maps::LoadField(path);
    if (!saved.ok()) {
      return Fail(kFailed, saved.error());
    }
    DescribeSaved(saved.value());
    return 0;
  }
  const Result<maps::Raster> loaded = LoadRaster(path, std::nullopt);
  if (!loaded.ok()) {
    return Fail(kFailed, loaded.error());
  }
  const maps::Raster& raster = loaded.value();
  std::vector<double> known;
  std::copy_if(raster.values.begin(), raster.values.end(), std::back_inserter(known),
               [](double value) { return !std::isnan(value); });
  fmt::print("raster: {} x {} cells", raster.columns, raster.rows);
  if (raster.cell_um != 0) {
    fmt::print(" of {} m from ({}, {})", Metres(raster.cell_um), Metres(raster.origin.x),
               Metres(raster.origin.y));
  }
  if (!known.empty()) {
    const auto [least, most] = std::minmax_element(known.begin(), known.end());
    fmt::print(", values from {} to {}", *least, *most);
  }
  fmt::print(", {} unknown\n", raster.values.size() - known.size());
  return 0;
}

}  // namespace pheromone::ctl
