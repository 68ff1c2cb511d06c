// [[frame]] and [[tracker]]: positions of robots in addition to their own reports.
#include <algorithm>
#include <optional>

#include "server/config/points.h"
#include "server/config/sections.h"

namespace pheromone::config {
namespace {

constexpr int64_t kMaxValidMs = 3'600'000;

// One of the configured links.
std::optional<std::string> ReadLinkName(const TableReader& table,
                                        const engine::EngineConfig& engine) {
  auto name = table.String("link");
  const auto has_name = [&](const engine::LinkSettings& link) { return link.name == name; };
  if (name && std::none_of(engine.links.begin(), engine.links.end(), has_name)) {
    std::string list;
    for (const engine::LinkSettings& link : engine.links) {
      list += (list.empty() ? "\"" : ", \"") + link.name + '"';
    }
    table.Expected("link", *table.Find("link"),
                   list.empty() ? "a [[link]] of that name" : "one of the links " + list);
    return std::nullopt;
  }
  return name;
}

void ReadFrame(const TableReader& table, engine::EngineConfig* engine) {
  table.AllowOnly({"link", "id", "x_m", "y_m", "heading_deg"});
  const auto link = ReadLinkName(table, *engine);
  const auto id = table.Integer("id", 1, 254);
  const auto x_um = table.Scaled("x_m", kMetresToUm, -kMaxCoordinateUm, kMaxCoordinateUm, 0);
  const auto y_um = table.Scaled("y_m", kMetresToUm, -kMaxCoordinateUm, kMaxCoordinateUm, 0);
  const auto heading = table.Number("heading_deg", -360, 360, 0);
  if (!link || !id || !x_um || !y_um || !heading) {
    return;
  }
  for (const engine::RobotFrame& other : engine->frames) {
    if (other.link == *link && other.id == *id) {
      table.Report("id", "found " + std::to_string(*id) + " again, expected one frame for robot " +
                             std::to_string(*id) + " on link \"" + *link + '"');
      return;
    }
  }
  engine->frames.push_back(
      engine::MakeFrame(*link, static_cast<uint8_t>(*id), {*x_um, *y_um}, *heading));
}

void ReadTracker(const TableReader& table, std::vector<links::TrackerConfig>* trackers) {
  table.AllowOnly({"name", "listen", "valid_s"});
  const auto name = ReadName(table);
  const auto endpoint = ReadEndpoint(table, "listen");
  const auto valid_ms = table.Scaled("valid_s", kSecondsToMs, 1, kMaxValidMs, 1'000);
  if (!name || !endpoint || !valid_ms) {
    return;
  }
  for (const links::TrackerConfig& other : *trackers) {
    if (other.name == *name) {
      table.Report("name", "found " + table.Find("name")->Describe() +
                               " again, expected a value not used by tracker \"" + other.name +
                               '"');
      return;
    }
  }
  trackers->push_back({*name, *endpoint, static_cast<uint32_t>(*valid_ms)});
}

}  // namespace

void ReadFrames(const Value& root, Notes* notes, engine::EngineConfig* engine) {
  const std::vector<const Value*> tables = TablesOf(root, "frame", notes);
  for (size_t i = 0; i < tables.size(); ++i) {
    ReadFrame(TableReader(*tables[i], PathOf("frame", i), &notes->problems), engine);
  }
}

void ReadTrackers(const Value& root, Notes* notes, Config* config) {
  const std::vector<const Value*> tables = TablesOf(root, "tracker", notes, kMaxTables);
  for (size_t i = 0; i < tables.size(); ++i) {
    ReadTracker(TableReader(*tables[i], PathOf("tracker", i), &notes->problems), &config->trackers);
  }
}

}  // namespace pheromone::config
