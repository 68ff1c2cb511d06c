#include "server/operators/control/scenes.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>
#include <utility>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>

#include "server/core/field/geometry.h"
#include "server/formats/foxglove/messages.h"
#include "server/formats/foxglove/pheromone_raster.h"
#include "server/formats/foxglove/scene.h"
#include "server/operators/control/json_text.h"
#include "server/operators/control/names.h"
#include "server/operators/control/views.h"

namespace pheromone::web {
namespace {

namespace json = boost::json;
using control::ClientView;

constexpr double kIntensityPerUnit = 4096;
constexpr foxglove::Colour kTagColour{0.80, 0.47, 0.65, 1};
constexpr foxglove::Colour kGoalColour{0.0, 0.62, 0.45, 1};

bool HasPose(const ClientView& client) {
  return client.pose_source != control::PoseSource::kNone;
}

foxglove::Point PointOf(field::PointUm point) {
  return {Metres(point.x), Metres(point.y), 0};
}

foxglove::Pose PlanePose(const field::PoseUm& pose) {
  return {PointOf(pose.position), Radians(pose.heading)};
}

json::object PlaceToJson(field::PointUm point) {
  return {{"x_m", Metres(point.x)}, {"y_m", Metres(point.y)}};
}

// The bucket's end below which a share of the events are, in microseconds; null: there were none.
json::value Quantile(const std::array<uint64_t, engine::kLatencyEndsUs.size() + 1>& counts,
                     double share) {
  uint64_t all = 0;
  for (const uint64_t count : counts) {
    all += count;
  }
  if (all == 0) {
    return nullptr;
  }
  uint64_t below = 0;
  for (size_t i = 0; i < engine::kLatencyEndsUs.size(); ++i) {
    below += counts[i];
    if (static_cast<double>(below) >= share * static_cast<double>(all)) {
      return engine::kLatencyEndsUs[i];
    }
  }
  return 2 * engine::kLatencyEndsUs.back();
}

uint64_t ErrorsOf(const engine::ServiceCounters& counters) {
  uint64_t all = 0;
  for (const uint64_t count : counters.errors) {
    all += count;
  }
  return all;
}

}  // namespace

json::value ClientsWithAntennas(const std::vector<ClientView>& clients,
                                const control::FieldView& view) {
  json::value value = ToJson(clients);
  json::array& array = value.as_object()["clients"].as_array();
  std::vector<field::PoseUm> poses;
  std::vector<json::object> sensed;
  for (const ClientView& client : clients) {
    if (HasPose(client)) {
      poses.push_back(client.pose);
    }
  }
  sensed.resize(poses.size());
  std::vector<std::optional<field::Intensities>> answers(poses.size());
  if (const field::FieldReader reader(*view.field); reader.ok() && !poses.empty()) {
    for (const field::PheromoneLaw& law : view.config.pheromones) {
      reader.SenseEach(law.type, poses, view.now_ms, answers);
      for (size_t i = 0; i < poses.size(); ++i) {
        if (answers[i]) {
          sensed[i][law.name] =
              json::object{{"left", static_cast<double>(answers[i]->left) / kIntensityPerUnit},
                           {"right", static_cast<double>(answers[i]->right) / kIntensityPerUnit}};
        }
      }
    }
  }
  size_t place = 0;
  for (size_t i = 0; i < clients.size(); ++i) {
    json::value antennas = nullptr;
    if (HasPose(clients[i])) {
      const field::Antennas both = field::AntennasOf(clients[i].pose, view.config.antennas);
      antennas = json::object{{"left", PlaceToJson(both.left)},
                              {"right", PlaceToJson(both.right)},
                              {"pheromones", std::move(sensed[place++])}};
    }
    array[i].as_object()["antennas"] = std::move(antennas);
  }
  value.as_object()["field_time_ms"] = view.now_ms;
  return value;
}

std::string RobotScenes::Robots(const std::vector<ClientView>& clients,
                                const field::FieldConfig& config, uint64_t unix_ns) {
  foxglove::SceneUpdate update;
  for (const ClientView& client : clients) {
    if (!HasPose(client)) {
      continue;
    }
    const field::Antennas antennas = field::AntennasOf(client.pose, config.antennas);
    foxglove::RobotLook robot{.link = client.link,
                              .id = client.id,
                              .pose = PlanePose(client.pose),
                              .left = PointOf(antennas.left),
                              .right = PointOf(antennas.right)};
    robot.facts = {{"pose_source", std::string(NameOf(client.pose_source))},
                   {"requests", std::to_string(client.traffic.requests)}};
    foxglove::AddRobot(robot, unix_ns, &update);
    seen_ns_[foxglove::RobotName(client.link, client.id)] = unix_ns;
  }
  // For as long as a viewer that missed the message would show it.
  constexpr uint64_t kLifetimeNs = foxglove::kRobotLifetimeS * 1'000'000'000;
  std::erase_if(seen_ns_, [&](const auto& it) { return it.second + kLifetimeNs < unix_ns; });
  for (const auto& [name, seen_ns] : seen_ns_) {
    if (seen_ns != unix_ns) {
      foxglove::AddDeletion(name, unix_ns, &update);
    }
  }
  return update.SerializeAsString();
}

std::string RobotScenes::Trails(const std::vector<ClientView>& clients, uint64_t unix_ns) {
  foxglove::SceneUpdate update;
  foxglove::AddDeletionOfAll(unix_ns, &update);
  std::set<std::string> present;
  for (const ClientView& client : clients) {
    if (!HasPose(client)) {
      continue;
    }
    const std::string name = foxglove::RobotName(client.link, client.id);
    present.insert(name);
    std::deque<field::PointUm>& trail = trails_[name];
    if (trail.empty() || trail.back() != client.pose.position) {
      trail.push_back(client.pose.position);
    }
    if (trail.size() > kMaxTrail) {
      trail.pop_front();
    }
    std::vector<foxglove::Point> points;
    points.reserve(trail.size());
    std::transform(trail.begin(), trail.end(), std::back_inserter(points), PointOf);
    foxglove::AddTrail(client.link, client.id, points, unix_ns, &update);
  }
  std::erase_if(trails_, [&](const auto& it) { return !present.contains(it.first); });
  return update.SerializeAsString();
}

std::string RobotScenes::Transforms(const std::vector<ClientView>& clients, uint64_t unix_ns) {
  foxglove::FrameTransforms transforms;
  // So that the map's frame is known while there is no robot.
  const std::string map(foxglove::kMapFrame);
  foxglove::AddTransform("world", map, {}, unix_ns, &transforms);
  for (const ClientView& client : clients) {
    if (HasPose(client)) {
      foxglove::AddTransform(map, foxglove::RobotFrame(client.link, client.id),
                             PlanePose(client.pose), unix_ns, &transforms);
    }
  }
  return transforms.SerializeAsString();
}

std::string RobotScenes::Goals(const std::vector<ClientView>& clients, uint64_t unix_ns) {
  foxglove::SceneUpdate update;
  foxglove::AddDeletionOfAll(unix_ns, &update);
  for (const ClientView& client : clients) {
    if (client.robot.goal) {
      foxglove::AddPlace({.id = foxglove::RobotName(client.link, client.id),
                          .label = std::to_string(client.id),
                          .centre = PointOf(client.robot.goal->point()),
                          .radius_m = Metres(client.robot.goal->tolerance_um),
                          .colour = kGoalColour},
                         unix_ns, &update);
    }
  }
  return update.SerializeAsString();
}

std::string TagScenes::Places(const std::vector<control::TagView>& tags, uint64_t unix_ns) {
  foxglove::SceneUpdate update;
  foxglove::AddDeletionOfAll(unix_ns, &update);
  for (const control::TagView& tag : tags) {
    if (tag.place) {
      foxglove::AddPlace({.id = tag.content.name,
                          .label = tag.content.name,
                          .centre = PointOf({tag.place->x_um, tag.place->y_um}),
                          .radius_m = Metres(tag.place->range_um),
                          .colour = kTagColour},
                         unix_ns, &update);
    }
  }
  return update.SerializeAsString();
}

std::optional<std::string> TagScenes::Changes(const std::vector<control::TagView>& tags, bool all) {
  json::array changed;
  std::map<uint16_t, uint64_t> hashes;
  for (const control::TagView& tag : tags) {
    const uint64_t hash = tag.content.hash;
    hashes[tag.content.number] = hash;
    const auto before = hashes_.find(tag.content.number);
    if (all || before == hashes_.end() || before->second != hash) {
      changed.emplace_back(tag.content.name);
    }
  }
  const bool differs = hashes != hashes_;
  hashes_ = std::move(hashes);
  version_ += differs ? 1 : 0;
  if (!differs && !all) {
    return std::nullopt;
  }
  return ToText(json::object{{"version", version_}, {"changed", std::move(changed)}});
}

ObstacleRaster ObstaclesOf(const field::FieldConfig& config) {
  const field::MapGeometry& map = config.map;
  const int32_t most = std::max(map.columns(), map.rows());
  const int32_t nodes = (most + PheromoneRaster::kMaxSide - 1) / PheromoneRaster::kMaxSide;
  const int32_t columns = (map.columns() + nodes - 1) / nodes;
  const int32_t rows = (map.rows() + nodes - 1) / nodes;
  std::string cells(static_cast<size_t>(columns) * static_cast<size_t>(rows), '\0');
  if (config.obstacles) {
    config.obstacles->ForEach([&](field::NodeIndex node) {
      cells[static_cast<size_t>(node.row / nodes) * static_cast<size_t>(columns) +
            static_cast<size_t>(node.column / nodes)] = 1;
    });
  }
  const double half_m = Metres(map.cell_um) / 2;
  return {.layout = {.corner = {Metres(map.origin.x) - half_m, Metres(map.origin.y) - half_m, 0},
                     .columns = static_cast<uint32_t>(columns),
                     .cell_m = Metres(map.cell_um) * nodes,
                     .names = {"blocked"}},
          .cells = std::move(cells)};
}

std::string ObstacleGrid(const field::FieldConfig& config, uint64_t unix_ns) {
  const ObstacleRaster obstacles = ObstaclesOf(config);
  return foxglove::EncodeGrid(unix_ns, obstacles.layout, obstacles.cells);
}

json::value EngineRates::Take(const control::StatusView& status, const StreamCounters* counters,
                              uint64_t now_ms) {
  const control::StatusView& before = last_ ? *last_ : status;
  const double passed_s = last_ ? static_cast<double>(now_ms - last_ms_) / 1e3 : 0;
  const auto rate = [&](uint64_t now, uint64_t then) {
    return passed_s > 0 && now >= then
               ? json::value(std::round(static_cast<double>(now - then) / passed_s * 10) / 10)
               : json::value(nullptr);
  };
  std::array<uint64_t, engine::kLatencyEndsUs.size() + 1> counts{};
  uint64_t batches = 0;
  for (size_t i = 0; i < counts.size(); ++i) {
    counts[i] = status.latency.by_class[i] - (last_ ? before.latency.by_class[i] : 0);
    batches += counts[i];
  }
  const uint64_t sum_ns = status.latency.sum_ns - (last_ ? before.latency.sum_ns : 0);
  const uint64_t mean_ns = batches != 0 ? sum_ns / batches : 0;
  json::object stats{
      {"uptime_s", status.uptime_s},
      {"field_time_ms", status.field_time_ms},
      {"requests_per_s", rate(status.service.requests, before.service.requests)},
      {"answers_per_s", rate(status.service.answers, before.service.answers)},
      {"changes_per_s", rate(status.service.changes, before.service.changes)},
      {"errors_per_s", rate(ErrorsOf(status.service), ErrorsOf(before.service))},
      {"latency_us",
       {{"mean",
         batches != 0 ? json::value(static_cast<double>(mean_ns) / 1e3) : json::value(nullptr)},
        {"p50", Quantile(counts, 0.5)},
        {"p90", Quantile(counts, 0.9)},
        {"p99", Quantile(counts, 0.99)}}},
      {"sequence", status.sequence},
      {"durable_sequence", status.durable_sequence},
      {"robots", status.robots},
      {"nodes", status.nodes},
      {"field_bytes", status.field_bytes},
      {"field_limit_bytes", status.field_limit_bytes},
      {"resident_bytes", status.resident_bytes},
      {"cpu", passed_s > 0
                  ? json::value(std::round((status.cpu_s - before.cpu_s) / passed_s * 1e3) / 1e3)
                  : json::value(nullptr)}};
  if (counters != nullptr) {
    stats["viewers"] = {{"connected", counters->viewers.load()},
                        {"sent_frames", counters->sent_frames.load()},
                        {"sent_bytes", counters->sent_bytes.load()},
                        {"dropped_frames", counters->dropped_frames.load()}};
  }
  last_ = status;
  last_ms_ = now_ms;
  return stats;
}

json::value StatusWithHealth(const control::StatusView& status) {
  json::value value = ToJson(status);
  value.as_object()["health"] = {
      {"healthy", status.warning.empty()},
      {"problem", status.warning.empty() ? json::value(nullptr) : json::value(status.warning)}};
  return value;
}

}  // namespace pheromone::web
