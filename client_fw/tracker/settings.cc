#include "client_fw/tracker/settings.h"

#include <fmt/format.h>

#include <numbers>
#include <set>
#include <tuple>
#include <utility>

#include "client_fw/tracker/detector.h"
#include "server/base/file.h"
#include "server/config/sections.h"

namespace pheromone::tracker {
namespace {

using config::Notes;
using config::TableReader;
using config::Value;

constexpr double kRadians = std::numbers::pi / 180;
constexpr int kMaxSidePx = 8192;
constexpr double kMaxEdgeM = 2;
constexpr double kMaxCoordinateM = 1e6;
constexpr double kMaxHeightM = 10;
constexpr size_t kMinFloorTags = 3;
constexpr int kMaxRobot = 254;

void ReadServer(const Value& root, Notes* notes, Settings* settings) {
  const TableReader table(config::TableOf(root, "server", notes), "server", &notes->problems);
  table.AllowOnly({"tracker"});
  const auto endpoint = config::ReadEndpoint(table, "tracker");
  if (endpoint && endpoint->port == 0) {
    table.Expected("tracker", *table.Find("tracker"), "the port on which the [[tracker]] listens");
  }
  settings->server = endpoint.value_or(Endpoint());
}

void ReadCamera(const Value& root, Notes* notes, Settings* settings) {
  const TableReader table(config::TableOf(root, "camera", notes), "camera", &notes->problems);
  table.AllowOnly(
      {"device", "width_px", "height_px", "focal_px", "centre_x_px", "centre_y_px", "k1", "k2"});
  settings->device = table.String("device", "/dev/video0").value_or("");
  settings->width = static_cast<int>(table.Integer("width_px", 64, kMaxSidePx).value_or(0));
  settings->height = static_cast<int>(table.Integer("height_px", 64, kMaxSidePx).value_or(0));
  Lens& lens = settings->lens;
  lens.focal_px = table.Number("focal_px", 10, 100'000, 0).value_or(0);
  lens.centre_px.x() =
      table.Number("centre_x_px", 0, kMaxSidePx, settings->width / 2.0).value_or(0);
  lens.centre_px.y() =
      table.Number("centre_y_px", 0, kMaxSidePx, settings->height / 2.0).value_or(0);
  lens.k1 = table.Number("k1", -2, 2, 0).value_or(0);
  lens.k2 = table.Number("k2", -2, 2, 0).value_or(0);
}

// Its number, once among all tags.
int ReadTag(const TableReader& table, std::set<int>* tags) {
  const auto tag = table.Integer("tag", 0, kMaxTag);
  if (tag && !tags->insert(static_cast<int>(*tag)).second) {
    table.Report("tag", fmt::format("found {} again, expected each tag once", *tag));
  }
  return static_cast<int>(tag.value_or(0));
}

void ReadFloor(const Value& root, Notes* notes, std::set<int>* tags, Settings* settings) {
  const auto tables = config::TablesOf(root, "floor_tag", notes);
  for (size_t i = 0; i < tables.size(); ++i) {
    const TableReader table(*tables[i], config::PathOf("floor_tag", i), &notes->problems);
    table.AllowOnly({"tag", "x_m", "y_m", "heading_deg"});
    FloorTag floor;
    floor.tag = ReadTag(table, tags);
    floor.place.x() = table.Number("x_m", -kMaxCoordinateM, kMaxCoordinateM).value_or(0);
    floor.place.y() = table.Number("y_m", -kMaxCoordinateM, kMaxCoordinateM).value_or(0);
    floor.heading_rad = kRadians * table.Number("heading_deg", -360, 360).value_or(0);
    settings->floor.push_back(floor);
  }
  if (settings->floor.size() < kMinFloorTags) {
    notes->problems.Add(root.at, "floor_tag",
                        fmt::format("found {}, expected at least {} tables [[floor_tag]]",
                                    settings->floor.size(), kMinFloorTags));
  }
}

void ReadRobots(const Value& root, Notes* notes, std::set<int>* tags, Settings* settings) {
  std::set<std::pair<std::string, int>> robots;
  const auto tables = config::TablesOf(root, "robot", notes);
  for (size_t i = 0; i < tables.size(); ++i) {
    const TableReader table(*tables[i], config::PathOf("robot", i), &notes->problems);
    table.AllowOnly({"tag", "link", "id", "height_m", "forward_m", "left_m", "turn_deg"});
    RobotTag robot;
    robot.tag = ReadTag(table, tags);
    robot.link = table.String("link").value_or("");
    if (table.Find("link") != nullptr && !config::IsName(robot.link)) {
      table.Expected("link", *table.Find("link"), config::kNameExpected);
    }
    robot.id = static_cast<int>(table.Integer("id", 1, kMaxRobot, robot.tag).value_or(1));
    if (robot.id < 1 || robot.id > kMaxRobot) {
      table.Missing(
          "id", fmt::format("1 to {}: the tag's number, {}, is no robot's", kMaxRobot, robot.tag));
    }
    robot.height_m = table.Number("height_m", 0, kMaxHeightM).value_or(0);
    robot.forward_m = table.Number("forward_m", -kMaxEdgeM, kMaxEdgeM, 0).value_or(0);
    robot.left_m = table.Number("left_m", -kMaxEdgeM, kMaxEdgeM, 0).value_or(0);
    robot.turn_rad = kRadians * table.Number("turn_deg", -360, 360, 0).value_or(0);
    if (!robots.insert({robot.link, robot.id}).second) {
      table.Report("id", fmt::format("found robot {} of link \"{}\" again, expected each once",
                                     robot.id, robot.link));
    }
    settings->robots.push_back(robot);
  }
  if (settings->robots.empty()) {
    notes->problems.Add(root.at, "robot", "found none, expected tables [[robot]]");
  }
}

}  // namespace

Result<Settings> ParseSettings(std::string_view text, std::string_view name) {
  PHEROMONE_TRY(const Value root, config::ParseDocument(text, name));
  Notes notes{config::Problems(name), std::string(name), std::nullopt, {}, {}};
  TableReader(root, "", &notes.problems)
      .AllowOnly({"server", "camera", "tags", "floor_tag", "robot"});
  Settings settings;
  ReadServer(root, &notes, &settings);
  ReadCamera(root, &notes, &settings);
  const TableReader table(config::TableOf(root, "tags", &notes), "tags", &notes.problems);
  table.AllowOnly({"floor_edge_m", "robot_edge_m"});
  settings.floor_edge_m = table.Number("floor_edge_m", 0.01, kMaxEdgeM).value_or(0);
  settings.robot_edge_m = table.Number("robot_edge_m", 0.01, kMaxEdgeM).value_or(0);
  std::set<int> tags;
  ReadFloor(root, &notes, &tags, &settings);
  ReadRobots(root, &notes, &tags, &settings);
  if (!notes.problems.empty()) {
    return Error{notes.problems.Text()};
  }
  return settings;
}

Status CheckLens(const Settings& settings) {
  return settings.lens.focal_px > 0
             ? Ok()
             : Error{
                   "camera.focal_px is missing: expected what pheromone-tracker calibrate prints"};
}

Result<Settings> LoadSettings(const std::string& path) {
  PHEROMONE_TRY(const std::string text, ReadFile(path, config::kMaxText));
  return ParseSettings(text, path);
}

}  // namespace pheromone::tracker
