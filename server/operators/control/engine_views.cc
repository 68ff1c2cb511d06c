#include "server/operators/control/engine_views.h"

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

TagView ViewOf(const tags::Store& store, const tags::NamedTag& tag, uint64_t now_ms) {
  TagView view{.content = tag};
  if (const tags::Place* const place = store.PlaceOf(tag.number)) {
    view.place = *place;
  }
  for (size_t i = 0; i < tag.tag.slots().size(); ++i) {
    const tags::Slot& slot = tag.tag.slots()[i];
    if (store.IsPrivileged(slot.block.author)) {
      view.privileged.push_back(static_cast<uint8_t>(i));
    }
    const uint64_t left_ms = slot.lease_end_ms - std::min(slot.lease_end_ms, now_ms);
    view.lease_s.push_back(static_cast<double>(left_ms) / 1e3);
  }
  return view;
}

}  // namespace

void AddClients(const engine::Engine& engine, const engine::Traffic& traffic,
                engine::LinkIndex link, uint64_t now_ms, std::vector<ClientView>* views) {
  if (link >= engine.config().links.size()) {
    return;
  }
  std::map<uint8_t, ClientView> clients;
  engine.robots().ForEachOf(link, [&](uint8_t id, const engine::RobotState& robot) {
    ClientView& client = clients[id];
    client.robot = robot;
    client.known = robot.epoch == engine.epoch();
  });
  traffic.ForEachOf(link, [&](uint8_t id, const engine::RobotTraffic& heard) {
    ClientView& client = clients[id];
    client.traffic = heard;
    client.silent_ms = now_ms - std::min(now_ms, heard.last_ms);
  });
  for (auto& [id, client] : clients) {
    client.link = engine.config().links[link].name;
    client.id = id;
    AddPose(engine, link, now_ms, &client);
    const field::PheromoneLaw* const law =
        engine.config().field.FindLaw(client.traffic.sensed_type);
    client.follows = law != nullptr ? law->name : "";
    client.halt_of_all_ms = traffic.HaltOfAll(link);
    client.condition = ConditionOf(client, now_ms);
    views->push_back(std::move(client));
  }
}

std::vector<ClientView> ClientsOf(const engine::Engine& engine, const engine::Traffic& traffic,
                                  uint64_t now_ms) {
  std::vector<ClientView> views;
  for (size_t link = 0; link < engine.config().links.size(); ++link) {
    AddClients(engine, traffic, static_cast<engine::LinkIndex>(link), now_ms, &views);
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

TagPage TagsOf(const engine::Engine& engine, uint16_t first, uint64_t now_ms) {
  const tags::Store& store = engine.tags();
  TagPage page;
  size_t number = std::max<size_t>(first, 1);
  for (; number <= store.last_number() && page.tags.size() < Control::kTagsAtOnce; ++number) {
    if (const tags::NamedTag* const tag = store.Find(static_cast<uint16_t>(number))) {
      page.tags.push_back(ViewOf(store, *tag, now_ms));
    }
  }
  if (number <= store.last_number()) {
    page.next = static_cast<uint16_t>(number);
  }
  return page;
}

std::vector<NetView> NetsOf(const engine::Engine& engine, uint64_t now_ms) {
  std::vector<NetView> views;
  for (const auto& [name, it] : engine.nets().nets()) {
    views.push_back({it.net, now_ms});
  }
  return views;
}

void AddEngine(const engine::Engine& engine, const engine::Traffic& traffic, StatusView* status) {
  status->epoch = engine.epoch();
  status->sequence = engine.sequence();
  engine.robots().ForEach([&](auto&&...) { ++status->robots; });
  status->nodes = engine.field().node_count();
  status->tiles = engine.field().tile_count();
  status->field_bytes = engine.field().used_bytes();
  status->field_limit_bytes = engine.field().limit_bytes();
  status->engine = engine.counters();
  status->tags = engine.tags().figures();
  status->tag_counters = engine.tags().counters();
  status->requests_by_opcode = traffic.by_opcode();
}

}  // namespace pheromone::control
