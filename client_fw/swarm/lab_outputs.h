// What a run writes while it runs: at its beginning, and then at steps `every_ms` apart.
//
//   Result<LabOutputs> outputs = LabOutputs::Open({.series = "series.csv", .every_ms = 10'000});
//   RunLab(scenario, 2, [&](const lab::World& world) { return outputs.value().Look(world); });
//
// All files are complete up to the last moment, however the run ends, but the MCAP file: that needs
// Finish. One thread.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "client_fw/lab/world.h"
#include "server/base/descriptor.h"
#include "server/base/result.h"
#include "server/formats/maps/raster.h"
#include "server/formats/mcap/writer.h"

namespace pheromone::swarm {

struct LabOutputOptions {
  std::string series = {};  ///< CSV: a row a moment, what was measured until then (MeasuresOf)
  std::string tracks = {};  ///< CSV: a row a moment and robot, where it is
  /// A folder with PHEROMONE.npy for each that has content of its own: (moments, rows, columns) in
  /// pheromone units, the top row first, NaN where an obstacle is.
  std::string maps = {};
  /// A folder with PHEROMONE-00000.png and so on: viridis from 0 to the maximum, obstacles gray,
  /// robots white.
  std::string frames = {};
  /// An MCAP file for Foxglove and others: /pheromone/NAME, a byte a cell: its share of the maximum
  /// times 254, rounded up, 255 where an obstacle is; and /robots, a line ahead of each. Times
  /// begin at 0.
  std::string mcap = {};
  int64_t every_ms = 10'000;  ///< at least 1
};

class LabOutputs {
 public:
  /// Makes the files, in place of those that have their names, and the folders.
  static Result<LabOutputs> Open(LabOutputOptions options);

  /// Writes, if it is time.
  Status Look(const lab::World& world);
  /// At the end, once.
  Status Finish();

 private:
  struct File {
    std::string path = {};
    Descriptor descriptor = {};
    uint64_t rasters = 0;  // in it
  };

  struct Mcap {
    explicit Mcap(File to)
        : file(std::move(to)),
          writer([this](std::string_view bytes) { return LabOutputs::Write(file, bytes); },
                 "pheromone-swarm") {}

    File file;
    mcap::Writer writer;
    std::map<std::string, uint16_t> channels = {};
  };

  static Result<File> Make(const std::string& path);
  static Status Write(const File& file, std::string_view text);
  static Status Append(const maps::Raster& raster, File* stack);

  explicit LabOutputs(LabOutputOptions options) : options_(std::move(options)) {}

  Status WriteSeries(const lab::World& world, bool is_first);
  Status WriteTracks(const lab::World& world, bool is_first);
  Status WriteRobots(const lab::World& world);
  Status WritePictures(const lab::World& world);
  Status WriteMcap(const std::string& topic, std::string_view schema, uint64_t now_ms,
                   std::string_view message);

  LabOutputOptions options_;
  File series_;
  File tracks_;
  std::map<uint8_t, File> stacks_;  // by the pheromone's type
  std::unique_ptr<Mcap> mcap_;
  int64_t next_ms_ = 0;
  int moment_ = 0;
};

}  // namespace pheromone::swarm
