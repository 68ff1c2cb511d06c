#include "server/formats/maps/ros_map.h"

#include <yaml-cpp/depthguard.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "server/base/file.h"
#include "server/base/format.h"
#include "server/base/message.h"
#include "server/formats/maps/pgm.h"
#include "server/formats/maps/png_picture.h"

namespace pheromone::maps {

namespace {

constexpr size_t kMaxYamlBytes = 65536;
constexpr double kUmPerM = 1e6;
constexpr double kFarthestM = 1e6;
constexpr double kMaxResolutionM = 1000;
constexpr uint16_t kWhite = 255;

// The levels written by map_saver, and the thresholds to read them: p(205) is between these.
constexpr double kFreeLevel = 254;
constexpr double kOccupiedLevel = 0;
constexpr double kUnknownLevel = 205;

Error AtNode(const YAML::Mark& mark, std::string_view name, const std::string& what) {
  const auto count = [](int from_zero) {
    return from_zero < 0 ? 1 : static_cast<size_t>(from_zero) + 1;
  };
  return AtLine(name, count(mark.line), count(mark.column), what);
}

// Reads the values of the top-level keys; keeps the first error.
class Keys {
 public:
  Keys(const YAML::Node& root, std::string_view name) : root_(root), name_(name) {}

  std::string Text(const std::string& key) { return TextOf(Find(key), key, "a word"); }

  double Number(const std::string& key, double low, double high) {
    return NumberOf(Find(key), key, low, high);
  }

  std::array<double, 3> ThreeNumbers(const std::string& key, double low, double high) {
    std::array<double, 3> numbers{};
    const YAML::Node node = Find(key);
    if (!node.IsSequence() || node.size() != numbers.size()) {
      Report(node, key + ": expected [x, y, yaw]");
      return numbers;
    }
    for (size_t i = 0; i < numbers.size(); ++i) {
      numbers[i] = NumberOf(node[i], key, low, high);
    }
    return numbers;
  }

  bool Has(const std::string& key) { return FindOptional(key).has_value(); }

  void Report(const std::string& key, const std::string& what) {
    Report(Find(key), key + ": " + what);
  }

  const std::optional<Error>& problem() const { return problem_; }

 private:
  // Not root_[key], which silently uses one of two equal keys, and compares by YAML's rules.
  std::optional<YAML::Node> FindOptional(const std::string& key) {
    std::optional<YAML::Node> found;
    for (const auto& entry : root_) {
      if (entry.first.IsScalar() && entry.first.Scalar() == key) {
        if (found) {
          Report(entry.first, key + ": found again, expected it once");
        }
        found = entry.second;
      }
    }
    return found;
  }

  YAML::Node Find(const std::string& key) {
    const std::optional<YAML::Node> found = FindOptional(key);
    if (!found) {
      Report(root_, "the key \"" + key + "\" is missing");
    }
    return found.value_or(YAML::Node());
  }

  std::string TextOf(const YAML::Node& node, const std::string& key, const std::string& expected) {
    if (!node.IsScalar() || node.Scalar().empty()) {
      Report(node, key + ": expected " + expected);
      return {};
    }
    return node.Scalar();
  }

  double NumberOf(const YAML::Node& node, const std::string& key, double low, double high) {
    const std::string range = "a number from " + ShortestText(low) + " to " + ShortestText(high);
    const std::string text = TextOf(node, key, range);
    double number = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    const bool whole = error == std::errc() && end == text.data() + text.size();
    if (!whole || !(number >= low && number <= high)) {
      Report(node, key + ": found " + Quoted(text) + ", expected " + range);
      return 0;
    }
    return number;
  }

  void Report(const YAML::Node& node, const std::string& what) {
    if (!problem_) {
      problem_ = AtNode(node.Mark(), name_, what);
    }
  }

  const YAML::Node& root_;
  std::string_view name_;
  std::optional<Error> problem_;
};

// ROS keeps resolutions as float32: 0.05 may come back as 0.05000000074505806. A value within this
// precision of a whole number of micrometres is that number.
std::optional<int64_t> WholeUm(double metres) {
  const double um = metres * kUmPerM;
  const double nearest = std::round(um);
  const double tolerance = nearest * std::numeric_limits<float>::epsilon();
  return nearest >= 1 && std::abs(um - nearest) <= tolerance
             ? std::optional(static_cast<int64_t>(nearest))
             : std::nullopt;
}

RosMapInfo ReadKeys(Keys& keys) {
  RosMapInfo info;
  info.image = keys.Text("image");
  const std::optional<int64_t> resolution_um =
      WholeUm(keys.Number("resolution", 0, kMaxResolutionM));
  if (!resolution_um) {
    keys.Report("resolution", "expected a whole number of micrometres, 0.000001 m or more");
  }
  info.resolution_um = resolution_um.value_or(1);
  const std::array<double, 3> pose = keys.ThreeNumbers("origin", -kFarthestM, kFarthestM);
  if (pose[2] != 0) {
    keys.Report("origin", "found a yaw, expected 0: rotate the image instead");
  }
  info.origin = {std::llround(pose[0] * kUmPerM), std::llround(pose[1] * kUmPerM)};
  const std::string negate = keys.Text("negate");
  info.negate = negate == "1" || negate == "true";
  if (!info.negate && negate != "0" && negate != "false") {
    keys.Report("negate", "found " + Quoted(negate) + ", expected 0 or 1");
  }
  info.occupied_thresh = keys.Number("occupied_thresh", 0, 1);
  info.free_thresh = keys.Number("free_thresh", 0, 1);
  if (info.free_thresh >= info.occupied_thresh) {
    keys.Report("free_thresh", "expected less than occupied_thresh");
  }
  if (keys.Has("mode")) {
    const std::string mode = keys.Text("mode");
    info.mode = mode == "raw"     ? RosMapMode::kRaw
                : mode == "scale" ? RosMapMode::kScale
                                  : RosMapMode::kTrinary;
    if (info.mode == RosMapMode::kTrinary && mode != "trinary") {
      keys.Report("mode", "found " + Quoted(mode) + ", expected trinary, scale or raw");
    }
  }
  return info;
}

double OccupancyOfLevel(const RosMapInfo& info, double level, double maximum) {
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  if (std::isnan(level)) {
    return kUnknown;
  }
  if (info.mode == RosMapMode::kRaw) {
    const double percent = std::round(level * kWhite / maximum);
    return percent <= kOccupied ? percent : kUnknown;
  }
  const double p = (info.negate ? level : maximum - level) / maximum;
  if (p > info.occupied_thresh) {
    return kOccupied;
  }
  if (p < info.free_thresh) {
    return kFree;
  }
  return info.mode == RosMapMode::kTrinary
             ? kUnknown
             : std::floor(99 * (p - info.free_thresh) / (info.occupied_thresh - info.free_thresh));
}

// Exact to the micrometre.
std::string MetresText(int64_t um) {
  return FormatNumber(static_cast<double>(um) / kUmPerM);
}

void AddBlocking(const Raster& occupancy, int32_t row, const ObstacleOptions& options,
                 std::vector<uint8_t>* blocking) {
  for (int32_t column = 0; column < occupancy.columns; ++column) {
    const double value = occupancy.At(column, row);
    if (std::isnan(value) ? options.unknown_blocks : value >= options.occupied_from) {
      (*blocking)[static_cast<size_t>(column)] = 1;
    }
  }
}

// The nodes along one axis, numbered from `first` at coordinate 0, whose square overlaps the open
// interval from low_um to high_um: first <= node <= last. Doubled, so that a / 2 is whole.
struct Span {
  int64_t first;
  int64_t last;
};
Span NodesOver(int64_t low_um, int64_t high_um, int64_t cell_um, int32_t count) {
  const int64_t first = field::FloorDiv(2 * low_um - cell_um, 2 * cell_um) + 1;
  const int64_t last = -field::FloorDiv(-(2 * high_um + cell_um), 2 * cell_um) - 1;
  return {std::max<int64_t>(first, 0), std::min<int64_t>(last, count - 1)};
}

}  // namespace

Result<RosMapInfo> ParseRosMapInfo(std::string_view yaml, std::string_view name) {
  if (yaml.size() > kMaxYamlBytes) {
    return Error{std::string(name) + ": too long, expected at most " +
                 std::to_string(kMaxYamlBytes) + " bytes"};
  }
  try {
    const YAML::Node root = YAML::Load(std::string(yaml));
    if (!root.IsMap()) {
      return AtLine(name, 1, 1, "expected keys and values: image: lab.pgm");
    }
    Keys keys(root, name);
    RosMapInfo info = ReadKeys(keys);
    return keys.problem() ? Result<RosMapInfo>(*keys.problem()) : std::move(info);
  } catch (const YAML::DeepRecursion& error) {
    return AtNode(error.mark, name, "nested too deeply, expected keys and values");
  } catch (const YAML::Exception& error) {
    return AtNode(error.mark, name, error.msg);
  }
}

Raster OccupancyOf(const RosMapInfo& info, GrayImage image) {
  Raster occupancy = std::move(image.raster);
  occupancy.origin = info.origin;
  occupancy.cell_um = info.resolution_um;
  for (double& value : occupancy.values) {
    value = OccupancyOfLevel(info, value, image.maximum);
  }
  return occupancy;
}

Result<Raster> LoadRosMap(const std::string& yaml_path) {
  PHEROMONE_TRY(const std::string yaml, ReadFile(yaml_path, kMaxYamlBytes));
  PHEROMONE_TRY(const RosMapInfo info, ParseRosMapInfo(yaml, yaml_path));
  const std::string path = (std::filesystem::path(yaml_path).parent_path() / info.image).string();
  PHEROMONE_TRY(const std::string bytes, ReadFile(path));
  PHEROMONE_TRY(GrayImage image,
                bytes.starts_with('P') ? ParsePgm(bytes, path) : ParsePng(bytes, path));
  return OccupancyOf(info, std::move(image));
}

Status ForEachBlockedRun(
    const Raster& occupancy, const field::MapGeometry& map, const ObstacleOptions& options,
    const std::function<void(int32_t row, int32_t first_column, int32_t last_column)>& block) {
  const int64_t side_um = occupancy.cell_um;
  if (side_um <= 0) {
    return Error{"obstacles: the size of a cell of the raster is not known"};
  }
  const int64_t left_um = occupancy.origin.x - map.origin.x;
  const int64_t bottom_um = occupancy.origin.y - map.origin.y;
  const int64_t top_um = bottom_um + occupancy.rows * side_um;
  const Span rows = NodesOver(bottom_um, top_um, map.cell_um, map.rows());
  std::vector<uint8_t> blocking(static_cast<size_t>(occupancy.columns));
  for (int64_t row = rows.first; row <= rows.last; ++row) {
    // The raster's rows that the squares of this row of nodes overlap, combined.
    const int64_t low = 2 * (row * map.cell_um - bottom_um) - map.cell_um;
    const int64_t high = low + 2 * map.cell_um;
    const int64_t lowest = std::max<int64_t>(field::FloorDiv(low, 2 * side_um), 0);
    const int64_t highest =
        std::min<int64_t>(-field::FloorDiv(-high, 2 * side_um) - 1, occupancy.rows - 1);
    std::fill(blocking.begin(), blocking.end(), 0);
    for (int64_t i = lowest; i <= highest; ++i) {
      AddBlocking(occupancy, static_cast<int32_t>(i), options, &blocking);
    }
    Span run = {0, -1};
    const auto end_run = [&] {
      if (run.first <= run.last) {
        block(static_cast<int32_t>(row), static_cast<int32_t>(run.first),
              static_cast<int32_t>(run.last));
      }
    };
    for (size_t column = 0; column < blocking.size(); ++column) {
      if (blocking[column] == 0) {
        continue;
      }
      const int64_t from_um = left_um + static_cast<int64_t>(column) * side_um;
      const Span nodes = NodesOver(from_um, from_um + side_um, map.cell_um, map.columns());
      if (nodes.first > run.last + 1) {
        end_run();
        run = nodes;
      } else {
        run.last = std::max(run.last, nodes.last);
      }
    }
    end_run();
  }
  return Ok();
}

RosMapFiles EncodeRosMap(const Raster& occupancy, std::string_view image_name) {
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  GrayImage image{occupancy, kWhite};
  bool trinary = true;
  for (double& value : image.raster.values) {
    value = value >= kFree && value <= kOccupied ? std::round(value) : kUnknown;
    trinary &= value == kFree || value == kOccupied || std::isnan(value);
  }
  for (double& value : image.raster.values) {
    if (trinary) {
      value = std::isnan(value) ? kUnknownLevel : value == kFree ? kFreeLevel : kOccupiedLevel;
    } else {
      value = std::isnan(value) ? kWhite : value;
    }
  }
  YAML::Emitter yaml;
  yaml << YAML::BeginMap << YAML::Key << "image" << YAML::Value << std::string(image_name)
       << YAML::EndMap;
  return {std::string(yaml.c_str()) + "\nresolution: " + MetresText(occupancy.cell_um) +
              "\norigin: [" + MetresText(occupancy.origin.x) + ", " +
              MetresText(occupancy.origin.y) +
              ", 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\nmode: " +
              (trinary ? "trinary" : "raw") + "\n",
          EncodePgm(image)};
}

Status SaveRosMap(const std::string& yaml_path, const Raster& occupancy) {
  if (occupancy.cell_um <= 0) {
    return Error{yaml_path + ": cannot be written: the size of a cell is not known"};
  }
  std::filesystem::path image = yaml_path;
  image.replace_extension(".pgm");
  const RosMapFiles files = EncodeRosMap(occupancy, image.filename().string());
  const Status written = WriteFile(image.string(), files.pgm);
  return written.ok() ? WriteFile(yaml_path, files.yaml) : written;
}

}  // namespace pheromone::maps
