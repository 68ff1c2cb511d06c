#include "client_fw/experiments/trails/bench.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "server/base/bytes.h"
#include "server/base/fields.h"

namespace pheromone::swarm {
namespace {

constexpr double kUmInMetre = 1e6;
constexpr double kBeforeN1M = 0.6;  // where the first robot waits at first

constexpr std::array<std::string_view, 12> kTags = {"N1", "N2", "N3", "N4", "N5", "N6",
                                                    "S1", "S2", "S3", "S4", "P",  "Src"};

std::vector<BenchTag> TagsOf(const engine::EngineConfig& config) {
  std::vector<BenchTag> tags;
  for (const tags::TagSettings& tag : config.tags.tags) {
    tags.push_back({tag.name, static_cast<double>(tag.x_um) / kUmInMetre,
                    static_cast<double>(tag.y_um) / kUmInMetre,
                    static_cast<double>(tag.range_um) / kUmInMetre});
  }
  return tags;
}

Result<TrailsBench> BenchOf(Result<config::Config> loaded, std::string_view name,
                            const std::filesystem::path& folder) {
  if (!loaded.ok()) {
    return loaded.error();
  }
  TrailsBench bench;
  bench.name = name;
  bench.folder = folder;
  bench.config = std::move(loaded.value());
  const field::FieldConfig& field = bench.config.engine.field;
  bench.tags = TagsOf(bench.config.engine);
  for (const field::Path& path : field.paths) {
    if (bench.lines.contains(path.type)) {
      return Error{fmt::format("{}: pheromone {} has two [[path]], expected one for each line",
                               name, path.type)};
    }
    bench.lines[path.type].path = path;
  }
  for (const field::PheromoneLaw& law : field.pheromones) {
    if (const auto line = bench.lines.find(law.type); line != bench.lines.end()) {
      line->second.name = law.name;
    }
  }
  for (int line = kNestLine; line <= kHomeLine; ++line) {
    if (!bench.lines.contains(line)) {
      return Error{fmt::format(
          "{}: no [[path]] of pheromone {}, expected a line for each of 1 to 6", name, line)};
    }
  }
  for (const std::string_view tag : kTags) {
    if (bench.FindTag(tag) == nullptr) {
      return Error{
          fmt::format("{}: no [[tag]] {}, expected N1 to N6, S1 to S4, P and Src", name, tag)};
    }
  }
  return bench;
}

}  // namespace

const BenchTag* TrailsBench::FindTag(std::string_view tag_name) const {
  for (const BenchTag& tag : tags) {
    if (tag.name == tag_name) {
      return &tag;
    }
  }
  return nullptr;
}

double TrailsBench::AlongOf(int line, const BenchTag& tag) const {
  return field::Locate(lines.at(line).path, tag.x_m * kUmInMetre, tag.y_m * kUmInMetre).along_um /
         kUmInMetre;
}

double TrailsBench::DistanceFrom(int line, const BenchTag& tag) const {
  return field::Locate(lines.at(line).path, tag.x_m * kUmInMetre, tag.y_m * kUmInMetre)
             .distance_um /
         kUmInMetre;
}

double TrailsBench::LengthBetween(int line, std::string_view from, std::string_view to) const {
  return AlongOf(line, *FindTag(to)) - AlongOf(line, *FindTag(from));
}

sim::PlanePose TrailsBench::PlaceOn(int line, double along_m) const {
  const std::vector<field::PointUm>& points = lines.at(line).path.points;
  double left_um = along_m * kUmInMetre;
  for (size_t i = 0; i + 1 < points.size(); ++i) {
    const auto dx = static_cast<double>(points[i + 1].x - points[i].x);
    const auto dy = static_cast<double>(points[i + 1].y - points[i].y);
    const double side_um = std::hypot(dx, dy);
    if (left_um <= side_um || i + 2 == points.size()) {
      const double share = side_um > 0 ? left_um / side_um : 0;
      return {(static_cast<double>(points[i].x) + share * dx) / kUmInMetre,
              (static_cast<double>(points[i].y) + share * dy) / kUmInMetre, std::atan2(dy, dx)};
    }
    left_um -= side_um;
  }
  return {};
}

std::vector<sim::PlanePose> TrailsBench::PlacesOn(int line, double from_m, double to_m,
                                                  double step_m) const {
  const int steps = std::max(1, static_cast<int>(std::ceil((to_m - from_m) / step_m)));
  std::vector<sim::PlanePose> places;
  for (int i = 0; i <= steps; ++i) {
    places.push_back(PlaceOn(line, from_m + (to_m - from_m) * i / steps));
  }
  return places;
}

sim::PlanePose TrailsBench::QueuePlace(int number, double spacing_m) const {
  return PlaceOn(kNestLine, AlongOf(kNestLine, *FindTag("N1")) - kBeforeN1M - number * spacing_m);
}

int TrailsBench::QueuePlaces(double spacing_m) const {
  const double room_m = LengthBetween(kNestLine, "N4", "N1") - kBeforeN1M;
  return room_m < 0 ? 0 : 1 + static_cast<int>(room_m / spacing_m);
}

Result<TrailsBench> LoadBench(const std::string& file) {
  return BenchOf(config::LoadConfig(file), file, std::filesystem::path(file).parent_path());
}

Result<TrailsBench> ParseBench(std::string_view text, std::string_view name,
                               const std::optional<std::filesystem::path>& folder) {
  return BenchOf(config::ParseConfig(text, name, folder), name, folder.value_or(""));
}

}  // namespace pheromone::swarm
