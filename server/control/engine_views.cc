#include "server/control/engine_views.h"

#include <algorithm>
#include <map>
#include <utility>

namespace pheromone::control {
namespace {

void AddPose(const engine::Engine& engine, engine::LinkIndex link, uint64_t now_ms,
             ClientView* client) {
  const auto& observed = client->robot.observed;
  if (observed && now_ms < observed->until_ms) {
    client->pose_source = PoseSource::kTracker;
    client->pose = observed->pose;
  } else if (client->traffic.pose) {
    client->pose_source = PoseSource::kRobot;
    client->pose = engine.robots().PoseOf(link, client->id, *client->traffic.pose, now_ms);
  }
}

}  // namespace

std::vector<ClientView> ClientsOf(const engine::Engine& engine, const engine::Traffic& traffic,
                                  uint64_t now_ms) {
  std::map<std::pair<engine::LinkIndex, uint8_t>, ClientView> clients;
  engine.robots().ForEach([&](engine::LinkIndex link, uint8_t id, const engine::RobotState& robot) {
    ClientView& client = clients[{link, id}];
    client.robot = robot;
    client.known = robot.epoch == engine.epoch();
  });
  traffic.ForEach([&](engine::LinkIndex link, uint8_t id, const engine::RobotTraffic& heard) {
    ClientView& client = clients[{link, id}];
    client.traffic = heard;
    client.silent_ms = now_ms - std::min(now_ms, heard.last_ms);
  });
  std::vector<ClientView> views;
  views.reserve(clients.size());
  for (auto& [key, client] : clients) {
    client.link = engine.config().links[key.first].name;
    client.id = key.second;
    AddPose(engine, key.first, now_ms, &client);
    views.push_back(std::move(client));
  }
  return views;
}

FieldView FieldOf(const engine::Engine& engine, uint64_t now_ms) {
  const field::FieldConfig& present = engine.config().field;
  FieldView view;
  view.field = &engine.field();
  view.config.map = present.map;
  view.config.antennas = present.antennas;
  view.config.pheromones = present.pheromones;
  view.config.obstacles = present.obstacles;
  view.now_ms = now_ms;
  return view;
}

}  // namespace pheromone::control
