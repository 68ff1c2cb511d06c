#include "client_fw/swarm/lab_outputs.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <numbers>
#include <system_error>
#include <utility>
#include <vector>

#include "client_fw/lab/scenario/run.h"
#include "server/base/format.h"
#include "server/formats/foxglove/messages.h"
#include "server/formats/foxglove/scene.h"
#include "server/formats/foxglove/schema.h"
#include "server/formats/maps/field_raster.h"
#include "server/formats/maps/npy.h"
#include "server/formats/maps/png_picture.h"

namespace pheromone::swarm {
namespace {

constexpr int32_t kFramePixels = 500;  // at least, along the longer side
constexpr double kRobotM = 0.25;       // of the line in viewers

Status MakeFolder(const std::string& path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  return error ? Status(Error{path + ": " + error.message()}) : Ok();
}

std::string GridOf(const maps::Raster& raster, const std::string& name, double maximum,
                   uint64_t now_ms) {
  std::string cells;
  for (const double value : raster.values) {
    const double share = std::ceil(254 * value / maximum);
    cells += static_cast<char>(std::isnan(value) ? 255 : static_cast<int>(std::min(share, 254.0)));
  }
  return foxglove::EncodeGrid(now_ms * 1'000'000,
                              {.corner = {static_cast<double>(raster.origin.x) / 1e6,
                                          static_cast<double>(raster.origin.y) / 1e6},
                               .columns = static_cast<uint32_t>(raster.columns),
                               .cell_m = static_cast<double>(raster.cell_um) / 1e6,
                               .names = {name}},
                              cells);
}

maps::Raster WithRobots(maps::Raster raster, const lab::Robots& robots) {
  for (size_t i = 0; i < robots.count; ++i) {
    const auto cell = [&](double m, int64_t origin_um, int32_t cells) {
      const double at =
          (m * 1e6 - static_cast<double>(origin_um)) / static_cast<double>(raster.cell_um);
      return static_cast<int32_t>(std::clamp(at, 0.0, static_cast<double>(cells - 1)));
    };
    raster.At(cell(robots.x_m[i], raster.origin.x, raster.columns),
              cell(robots.y_m[i], raster.origin.y, raster.rows)) =
        std::numeric_limits<double>::infinity();
  }
  return raster;
}

}  // namespace

Result<LabOutputs::File> LabOutputs::Make(const std::string& path) {
  Descriptor descriptor(open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666));
  return descriptor.valid() ? Result(File{path, std::move(descriptor)}) : SystemError(path);
}

Status LabOutputs::Write(const File& file, std::string_view text) {
  return WriteAll(file.descriptor.get(), text) ? Ok() : Status(SystemError(file.path));
}

// The values first, so that the header never promises more than there is.
Status LabOutputs::Append(const maps::Raster& raster, File* stack) {
  const std::string header = maps::NpyStackHeader(stack->rasters + 1, raster);
  const std::string values = maps::NpyValues(raster);
  const auto end = static_cast<off_t>(header.size() + stack->rasters * values.size());
  for (const auto& [at, bytes] : {std::pair(end, &values), std::pair(off_t{0}, &header)}) {
    if (lseek(stack->descriptor.get(), at, SEEK_SET) != at) {
      return SystemError(stack->path);
    }
    PHEROMONE_TRY_STATUS(Write(*stack, *bytes));
  }
  ++stack->rasters;
  return Ok();
}

Result<LabOutputs> LabOutputs::Open(LabOutputOptions options) {
  LabOutputs outputs(std::move(options));
  for (const auto& [path, file] : {std::pair(&outputs.options_.series, &outputs.series_),
                                   std::pair(&outputs.options_.tracks, &outputs.tracks_)}) {
    if (!path->empty()) {
      PHEROMONE_TRY(*file, Make(*path));
    }
  }
  if (!outputs.options_.mcap.empty()) {
    PHEROMONE_TRY(File file, Make(outputs.options_.mcap));
    outputs.mcap_ = std::make_unique<Mcap>(std::move(file));
  }
  for (const std::string& folder : {outputs.options_.maps, outputs.options_.frames}) {
    if (!folder.empty()) {
      PHEROMONE_TRY_STATUS(MakeFolder(folder));
    }
  }
  return outputs;
}

Status LabOutputs::Look(const lab::World& world) {
  const auto now_ms = static_cast<int64_t>(world.time().now_ms());
  if (now_ms < next_ms_) {
    return Ok();
  }
  next_ms_ = (now_ms / options_.every_ms + 1) * options_.every_ms;
  const bool is_first = moment_ == 0;
  if (series_.descriptor.valid()) {
    PHEROMONE_TRY_STATUS(WriteSeries(world, is_first));
  }
  if (tracks_.descriptor.valid()) {
    PHEROMONE_TRY_STATUS(WriteTracks(world, is_first));
  }
  if (mcap_ != nullptr) {
    PHEROMONE_TRY_STATUS(WriteRobots(world));
  }
  if (mcap_ != nullptr || !options_.maps.empty() || !options_.frames.empty()) {
    PHEROMONE_TRY_STATUS(WritePictures(world));
  }
  ++moment_;
  return Ok();
}

Status LabOutputs::WriteSeries(const lab::World& world, bool is_first) {
  std::string names;
  std::string values;
  for (const auto& [name, value] : lab::MeasuresOf(lab::ResultOf(world))) {
    const std::string comma = names.empty() ? "" : ",";
    names += comma + name;
    values += comma + (value ? ShortestText(*value) : "");
  }
  return Write(series_, (is_first ? names + '\n' : "") + values + '\n');
}

Status LabOutputs::WriteTracks(const lab::World& world, bool is_first) {
  const lab::Robots& robots = world.robots();
  std::string rows = is_first ? "time_s,robot,x_m,y_m,heading_deg\n" : "";
  const std::string time_s = ShortestText(static_cast<double>(world.time().now_ms()) / 1000);
  for (size_t i = 0; i < robots.count; ++i) {
    fmt::format_to(std::back_inserter(rows), "{},{},{:.4f},{:.4f},{:.2f}\n", time_s, i,
                   robots.x_m[i], robots.y_m[i], robots.heading_rad[i] * 180 / std::numbers::pi);
  }
  return Write(tracks_, rows);
}

Status LabOutputs::WriteMcap(const std::string& topic, std::string_view schema, uint64_t now_ms,
                             std::string_view message) {
  auto channel = mcap_->channels.find(topic);
  if (channel == mcap_->channels.end()) {
    const uint16_t number = mcap_->writer.AddChannel({.topic = topic,
                                                      .encoding = "protobuf",
                                                      .schema_name = std::string(schema),
                                                      .schema_encoding = "protobuf",
                                                      .schema = foxglove::SchemaOf(schema)});
    channel = mcap_->channels.emplace(topic, number).first;
  }
  return mcap_->writer.Write(channel->second, now_ms * 1'000'000, message);
}

Status LabOutputs::WriteRobots(const lab::World& world) {
  const lab::Robots& robots = world.robots();
  std::vector<foxglove::Pose> poses;
  for (size_t i = 0; i < robots.count; ++i) {
    poses.push_back({{robots.x_m[i], robots.y_m[i], 0}, robots.heading_rad[i]});
  }
  const uint64_t now_ms = world.time().now_ms();
  foxglove::SceneUpdate update;
  foxglove::AddHeadings("robots", poses, kRobotM, now_ms * 1'000'000, &update);
  return WriteMcap("/robots", foxglove::kSceneUpdateSchema, now_ms, update.SerializeAsString());
}

Status LabOutputs::Finish() {
  return mcap_ != nullptr ? mcap_->writer.Finish() : Ok();
}

Status LabOutputs::WritePictures(const lab::World& world) {
  const field::Field& field = world.field();
  for (const field::PheromoneLaw& law : field.config().pheromones) {
    if (law.is_blend()) {
      continue;
    }
    PHEROMONE_TRY(maps::Raster raster, maps::RasterOf(field, law.type, world.time().now_ms()));
    if (!options_.maps.empty()) {
      File& stack = stacks_[law.type];
      if (!stack.descriptor.valid()) {
        PHEROMONE_TRY(stack, Make(options_.maps + '/' + law.name + ".npy"));
      }
      PHEROMONE_TRY_STATUS(Append(raster, &stack));
    }
    const double maximum = static_cast<double>(law.quantum_micro) * law.max_count / 1e6;
    if (mcap_ != nullptr) {
      PHEROMONE_TRY_STATUS(WriteMcap("/pheromone/" + law.name, foxglove::kGridSchema,
                                     world.time().now_ms(),
                                     GridOf(raster, law.name, maximum, world.time().now_ms())));
    }
    if (!options_.frames.empty()) {
      const maps::PictureStyle style = {
          .low = 0,
          .high = maximum,
          .unknown = {128, 128, 128},
          .infinite = maps::Rgb{255, 255, 255},
          .pixels_per_cell = (kFramePixels - 1) / std::max(raster.columns, raster.rows) + 1};
      PHEROMONE_TRY_STATUS(
          maps::SavePicture(fmt::format("{}/{}-{:05}.png", options_.frames, law.name, moment_),
                            WithRobots(std::move(raster), world.robots()), style));
    }
  }
  return Ok();
}

}  // namespace pheromone::swarm
