#include "server/operators/web/stream/hub.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <set>
#include <utility>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>

#include "server/base/base64.h"
#include "server/formats/foxglove/messages.h"
#include "server/formats/foxglove/schema.h"
#include "server/operators/control/json_text.h"
#include "server/operators/control/names.h"
#include "server/operators/control/views.h"
#include "server/operators/web/api/nets.h"
#include "server/operators/web/api/tags.h"
#include "server/operators/web/stream/json_schemas.h"

namespace pheromone::web {
namespace {

constexpr uint64_t kPicturePeriodMs = 200;
constexpr uint64_t kConfigPeriodMs = 1000;
constexpr size_t kRecentEvents = 64;
constexpr uint64_t kNsPerMs = 1'000'000;
constexpr size_t kMaxTagPages = 32;
// Pictures of what only evaporates take at most this share of the thread's time.
constexpr uint64_t kRestPerCost = 9;

FramePtr MakeFrame(std::string payload, uint64_t unix_ns) {
  return std::make_shared<const Frame>(Frame{unix_ns, std::move(payload)});
}

bool SameMap(const field::FieldConfig& a, const field::FieldConfig& b) {
  return a.map == b.map && a.antennas == b.antennas && a.pheromones == b.pheromones &&
         a.obstacles == b.obstacles;
}

// What an operator may have to see to.
bool IsTrouble(protocol::EventCode code) {
  using protocol::EventCode;
  constexpr std::array kTrouble = {EventCode::kOffTheMap,     EventCode::kTrailLost,
                                   EventCode::kFailSafeStop,  EventCode::kBatteryLow,
                                   EventCode::kStoppedByHand, EventCode::kPoseLost,
                                   EventCode::kNetException};
  return std::find(kTrouble.begin(), kTrouble.end(), code) != kTrouble.end();
}

std::string NoticeText(const control::Notice& notice) {
  const std::string what = notice.text.empty() ? "" : ": " + notice.text;
  switch (notice.topic) {
    case control::Notice::Topic::kConfiguration:
      return "another configuration is in effect" + what;
    case control::Notice::Topic::kCapture:
      return (notice.is_on ? "recording started" : "recording stopped") + what;
    case control::Notice::Topic::kLink:
      return "link " + notice.subject + (notice.is_on ? " is up" : " is down") + what;
    case control::Notice::Topic::kHealth:
      return (notice.is_on ? "the log is durable again" : "the log is not durable") + what;
    case control::Notice::Topic::kArrival:
      return "robot " + notice.subject + " " + notice.text;
    case control::Notice::Topic::kNet:
      return "net " + notice.subject + what;
    case control::Notice::Topic::kOperator:
      break;
  }
  return notice.subject + what;
}

}  // namespace

struct Hub::State {
  Kind kind = Kind::kStatus;
  uint8_t type = 0;
  std::string subject;  // a link's name
  uint64_t period_ms = kConfigPeriodMs;
  bool only_changes = false;
  Needs needs;
  int subscribers = 0;
  bool is_new_to_some = false;
  uint64_t next_ms = 0;
  std::string last;  // what was sent, if only changes are
  Channel channel;

  bool IsDue(uint64_t now_ms) const {
    return subscribers > 0 && (is_new_to_some || now_ms >= next_ms);
  }
};

struct Hub::Picture {
  PheromoneRaster raster;
  bool has_changed = false;
  uint64_t rest_until_us = 0;
  std::map<uint64_t, FramePtr> encoded;  // of the present version, by what they begin with
};

Views TakeViews(const control::Control& control, const Needs& needs) {
  Views views;
  views.taken = needs;
  views.field = control.GetField();
  if (needs.clients) {
    views.clients = control.GetClients();
  }
  if (needs.links) {
    views.links = control.GetLinks();
  }
  if (needs.status) {
    views.status = control.GetStatus(false);
  }
  if (needs.nets) {
    views.nets = control.GetNets();
  }
  if (needs.paths) {
    views.paths = control.GetPaths();
  }
  std::optional<uint16_t> next = 1;
  for (size_t page = 0; needs.tags && next && page < kMaxTagPages; ++page) {
    control::TagPage tags = control.GetTags(*next);
    std::move(tags.tags.begin(), tags.tags.end(), std::back_inserter(views.tags));
    next = tags.next;
  }
  return views;
}

Hub::Hub(HubOptions options) : options_(std::move(options)) {}
Hub::~Hub() = default;

Hub::State* Hub::Find(uint32_t channel) {
  const auto found = states_.find(channel);
  return found != states_.end() ? found->second.get() : nullptr;
}

const Hub::State* Hub::Find(uint32_t channel) const {
  const auto found = states_.find(channel);
  return found != states_.end() ? found->second.get() : nullptr;
}

void Hub::AddSubscriber(uint32_t channel) {
  if (State* state = Find(channel)) {
    ++state->subscribers;
    state->is_new_to_some = true;
  }
}

void Hub::RemoveSubscriber(uint32_t channel) {
  if (State* state = Find(channel)) {
    --state->subscribers;
  }
}

Keeping Hub::KeepingOf(uint32_t channel) const {
  const State* const state = Find(channel);
  return state == nullptr               ? Keeping::kLatest
         : state->kind == Kind::kEvents ? Keeping::kAll
         : state->kind == Kind::kTiles  ? Keeping::kTiles
                                        : Keeping::kLatest;
}

bool Hub::IsPicture(uint32_t channel) const {
  const State* const state = Find(channel);
  return state != nullptr && (state->kind == Kind::kTiles || state->kind == Kind::kGrid);
}

Needs Hub::Due(uint64_t now_ms) const {
  Needs all;
  all.links = catalogue_ == nullptr;  // they stay the same
  all.field = catalogue_ == nullptr || now_ms >= configured_ms_ + kConfigPeriodMs;
  for (const auto& [id, state] : states_) {
    if (state->IsDue(now_ms)) {
      all.field = true;
      all.clients |= state->needs.clients;
      all.links |= state->needs.links;
      all.status |= state->needs.status;
      all.nets |= state->needs.nets;
      all.tags |= state->needs.tags;
      all.paths |= state->needs.paths;
    }
  }
  all.field |= !new_events_.empty();
  return all;
}

void Hub::AddChannel(Kind kind, const std::string& topic, uint8_t type,
                     const std::string& subject) {
  const auto [known, is_new] = ids_.try_emplace(topic, static_cast<uint32_t>(ids_.size() + 1));
  std::unique_ptr<State>& state = states_[known->second];
  if (state == nullptr) {
    state = std::make_unique<State>();
  }
  state->kind = kind;
  state->type = type;
  state->subject = subject;
  const auto set = [&](uint64_t period_ms, Needs needs, bool only_changes = false) {
    state->period_ms = period_ms;
    state->needs = needs;
    state->only_changes = only_changes;
  };
  std::string_view schema_name;  // of protobuf
  std::string_view component;    // whose schema it has, of JSON (json_schemas.h)
  switch (kind) {
    case Kind::kGrid:
      set(kPicturePeriodMs, {.field = true});
      schema_name = foxglove::kGridSchema;
      break;
    case Kind::kTiles:
      set(kPicturePeriodMs, {.field = true});
      schema_name = foxglove::kTilesSchema;
      break;
    case Kind::kRobots:
      set(100, {.clients = true});
      schema_name = foxglove::kSceneUpdateSchema;
      break;
    case Kind::kTrails:
      set(1000, {.clients = true});
      schema_name = foxglove::kSceneUpdateSchema;
      break;
    case Kind::kObstacles:
      set(1000, {.field = true}, true);
      schema_name = foxglove::kGridSchema;
      break;
    case Kind::kTags:
      set(2000, {.tags = true}, true);
      schema_name = foxglove::kSceneUpdateSchema;
      break;
    case Kind::kGoals:
      set(500, {.clients = true});
      schema_name = foxglove::kSceneUpdateSchema;
      break;
    case Kind::kTransforms:
      set(200, {.clients = true});
      schema_name = foxglove::kFrameTransformsSchema;
      break;
    case Kind::kEvents:
      set(200, {.clients = true});
      schema_name = foxglove::kLogSchema;
      break;
    case Kind::kEngine:
      set(1000, {.status = true});
      component = "Engine";
      break;
    case Kind::kLink:
      set(1000, {.links = true});
      component = "Link";
      break;
    case Kind::kClients:
      set(100, {.clients = true});
      component = "Clients";
      break;
    case Kind::kNets:
      set(500, {.nets = true}, true);
      component = "Nets";
      break;
    case Kind::kTagChanges:
      set(500, {.tags = true});
      component = "TagChanges";
      break;
    case Kind::kStatus:
      set(1000, {.status = true});
      component = "Status";
      break;
    case Kind::kLaws:
      set(1000, {.field = true}, true);
      component = "Laws";
      break;
    case Kind::kTagList:
      set(1000, {.tags = true}, true);
      component = "Tags";
      break;
    case Kind::kPaths:
      set(1000, {.field = true, .paths = true}, true);
      component = "Paths";
      break;
  }
  Channel& channel = state->channel;
  channel.id = known->second;
  channel.topic = topic;
  if (!schema_name.empty()) {
    channel.encoding = "protobuf";
    channel.schema_name = schema_name;
    channel.schema = ToBase64(foxglove::SchemaOf(schema_name));
    channel.schema_encoding = "protobuf";
  } else {
    channel.encoding = "json";
    channel.schema_name = "pheromone" + topic.substr(0, topic.find('/', 1));
    std::replace(channel.schema_name.begin(), channel.schema_name.end(), '/', '.');
    channel.schema = JsonSchemaOf(component, config_);
    channel.schema_encoding = "jsonschema";
  }
}

void Hub::ForgetPictures() {
  for (auto& [type, picture] : pictures_) {
    versions_[type] = picture->raster.version();
  }
  pictures_.clear();
}

void Hub::Forget() {
  ForgetPictures();
  robots_ = {};
  tags_ = {};
  rates_ = {};
  robot_events_.reset();
  for (auto& [id, state] : states_) {
    state->is_new_to_some = state->subscribers > 0;
  }
}

void Hub::Configure(const control::FieldView& view, const std::vector<control::LinkView>& links) {
  if (links_.empty()) {
    for (const control::LinkView& link : links) {
      links_.push_back(link.name);
    }
  }
  config_ = view.config;
  ForgetPictures();
  auto catalogue = std::make_shared<Catalogue>();
  catalogue->session = options_.session;
  catalogue->ros_distro = options_.ros_distro;
  catalogue->click_pheromone = options_.click_pheromone;
  catalogue->recording = recording_;
  std::set<uint32_t> before;
  for (const auto& [id, state] : states_) {
    before.insert(id);
  }
  const auto add = [&](Kind kind, const std::string& topic, uint8_t type = 0,
                       const std::string& subject = {}) {
    AddChannel(kind, topic, type, subject);
    before.erase(ids_[topic]);
    State& state = *Find(ids_[topic]);
    state.is_new_to_some = state.subscribers > 0;
    catalogue->channels.push_back(state.channel);
  };
  for (const field::PheromoneLaw& law : config_.pheromones) {
    if (law.is_blend()) {
      continue;  // has no content of its own
    }
    add(Kind::kGrid, "/pheromone/" + law.name, law.type);
    add(Kind::kTiles, "/pheromone_delta/" + law.name, law.type);
    const std::string name = "/pheromone/" + law.name;
    catalogue->parameters[name + "/tau_s"] = static_cast<double>(law.tau_ms) / 1e3;
    catalogue->parameters[name + "/quantum"] = static_cast<double>(law.quantum_micro) / 1e6;
    catalogue->parameters[name + "/maximum"] = MaximumOf(law);
    if (catalogue->click_pheromone.empty()) {
      catalogue->click_pheromone = law.name;
    }
  }
  add(Kind::kRobots, "/robots");
  add(Kind::kTrails, "/trails");
  add(Kind::kObstacles, "/obstacles");
  add(Kind::kTags, "/tags");
  add(Kind::kGoals, "/goals");
  add(Kind::kTransforms, "/tf");
  add(Kind::kEvents, "/events");
  add(Kind::kEngine, "/stats/engine");
  for (const std::string& link : links_) {
    add(Kind::kLink, "/link/" + link, 0, link);
  }
  add(Kind::kClients, "/clients");
  add(Kind::kNets, "/nets");
  add(Kind::kTagChanges, "/tag_changes");
  add(Kind::kStatus, "/status");
  add(Kind::kLaws, "/laws");
  add(Kind::kTagList, "/tag_list");
  add(Kind::kPaths, "/paths");
  for (const uint32_t gone : before) {
    states_.erase(gone);
  }
  catalogue_ = std::move(catalogue);
}

// Those with subscribers, and those alone.
void Hub::UpdatePictures(const control::FieldView& view, const StreamTime& now,
                         std::vector<Update>* updates) {
  std::set<uint8_t> wanted;
  std::set<uint8_t> due;
  for (const auto& [id, state] : states_) {
    if (IsPicture(id) && state->subscribers > 0) {
      wanted.insert(state->type);
      if (state->IsDue(now.steady_ms)) {
        due.insert(state->type);
      }
    }
  }
  std::erase_if(pictures_, [&](const auto& it) {
    if (!wanted.contains(it.first)) {
      versions_[it.first] = it.second->raster.version();
    }
    return !wanted.contains(it.first);
  });
  if (due.empty()) {
    return;
  }
  const field::FieldReader reader(*view.field);
  if (!reader.ok()) {
    return;  // another time
  }
  for (const uint8_t type : due) {
    std::unique_ptr<Picture>& picture = pictures_[type];
    if (picture == nullptr) {
      picture = std::make_unique<Picture>(
          Picture{.raster = PheromoneRaster(config_, type, versions_[type]),
                  .has_changed = false,
                  .rest_until_us = 0,
                  .encoded = {}});
    }
    const uint64_t begin_us = options_.now_us();
    const bool evaporates = begin_us >= picture->rest_until_us;
    picture->has_changed =
        picture->raster.Update(reader, view.now_ms, evaporates, options_.between_pieces);
    const uint64_t end_us = options_.now_us();
    if (evaporates) {
      picture->rest_until_us = end_us + kRestPerCost * (end_us - begin_us);
    }
    if (picture->has_changed) {
      picture->encoded.clear();
    }
  }
  for (auto& [id, state] : states_) {
    if (!IsPicture(id) || !state->IsDue(now.steady_ms)) {
      continue;
    }
    const Picture& picture = *pictures_[state->type];
    const bool is_wanted = picture.has_changed || state->is_new_to_some;
    state->is_new_to_some = false;
    state->next_ms = now.steady_ms + state->period_ms;
    if (!is_wanted) {
      continue;
    }
    if (state->kind == Kind::kTiles) {
      updates->push_back({id, nullptr});
      continue;
    }
    updates->push_back({id, MakeFrame(picture.raster.EncodeGrid(now.unix_ns), now.unix_ns)});
  }
}

Hub::Tiles Hub::TilesSince(uint32_t channel, uint64_t since, uint64_t unix_ns) {
  const State* const state = Find(channel);
  const auto found = state != nullptr ? pictures_.find(state->type) : pictures_.end();
  if (found == pictures_.end() || found->second->raster.version() == since) {
    return {nullptr, since};
  }
  FramePtr& frame = found->second->encoded[since];
  if (frame == nullptr) {
    frame = MakeFrame(found->second->raster.Encode(since), unix_ns);
  }
  return {frame, found->second->raster.version()};
}

std::optional<std::string> Hub::PayloadOf(const State& state, const Views& views,
                                          const StreamTime& now) {
  switch (state.kind) {
    case Kind::kRobots:
      return robots_.Robots(views.clients, config_, now.unix_ns);
    case Kind::kTrails:
      return robots_.Trails(views.clients, now.unix_ns);
    case Kind::kObstacles:
      return state.is_new_to_some ? std::optional(ObstacleGrid(config_, now.unix_ns))
                                  : std::nullopt;
    case Kind::kTags:
      return TagScenes::Places(views.tags, now.unix_ns);
    case Kind::kGoals:
      return RobotScenes::Goals(views.clients, now.unix_ns);
    case Kind::kTransforms:
      return RobotScenes::Transforms(views.clients, now.unix_ns);
    case Kind::kEngine:
      return ToText(rates_.Take(views.status, options_.counters,
                                recording_ ? now.unix_ns / kNsPerMs : now.steady_ms));
    case Kind::kLink:
      for (const control::LinkView& link : views.links) {
        if (link.name == state.subject) {
          return ToText(ToJson(std::vector{link}).as_object()["links"].as_array().front());
        }
      }
      return std::nullopt;
    case Kind::kClients:
      return ToText(ClientsWithAntennas(views.clients, views.field));
    case Kind::kNets:
      return ToText(NetsToJson(views.nets));
    case Kind::kTagChanges:
      return tags_.Changes(views.tags, state.is_new_to_some);
    case Kind::kStatus:
      return ToText(StatusWithHealth(views.status));
    case Kind::kLaws:
      return ToText(LawsToJson(views.field.config));
    case Kind::kTagList:
      return ToText(TagsToJson(views.tags));
    case Kind::kPaths:
      return ToText(PathsToJson(views.paths, views.field.config));
    default:
      return std::nullopt;  // pictures and events are made elsewhere
  }
}

std::vector<Update> Hub::Make(const Views& views, const StreamTime& now) {
  configured_ms_ = views.taken.field ? now.steady_ms : configured_ms_;
  if (catalogue_ == nullptr || !SameMap(config_, views.field.config)) {
    Configure(views.field, views.links);
  }
  std::vector<Update> updates;
  UpdatePictures(views.field, now, &updates);
  for (auto& [id, state] : states_) {
    // What a channel needs may have been asked for only after the views were taken.
    const Needs& needs = state->needs;
    const bool has_views =
        (!needs.clients || views.taken.clients) && (!needs.links || views.taken.links) &&
        (!needs.status || views.taken.status) && (!needs.nets || views.taken.nets) &&
        (!needs.tags || views.taken.tags) && (!needs.paths || views.taken.paths);
    if (IsPicture(id) || !state->IsDue(now.steady_ms) || !has_views) {
      continue;
    }
    if (state->kind == Kind::kEvents) {
      NoteRobotEvents(views.clients, now.unix_ns);
    }
    std::optional<std::string> payload = PayloadOf(*state, views, now);
    // The time does not count as a change.
    std::string key = !payload || !state->only_changes ? ""
                      : state->kind == Kind::kTags     ? TagScenes::Places(views.tags, 0)
                                                       : *payload;
    const bool is_wanted =
        payload && (!state->only_changes || state->is_new_to_some || key != state->last);
    state->is_new_to_some = false;
    state->next_ms = now.steady_ms + state->period_ms;
    if (is_wanted) {
      state->last = std::move(key);
      updates.push_back({id, MakeFrame(*std::move(payload), now.unix_ns)});
    }
  }
  const auto events = ids_.find("/events");
  for (FramePtr& event : new_events_) {
    updates.push_back({events->second, std::move(event)});
  }
  new_events_.clear();
  return updates;
}

void Hub::AddEvent(const std::string& name, const std::string& text, bool is_warning,
                   uint64_t unix_ns) {
  FramePtr frame =
      MakeFrame(foxglove::MakeLog(is_warning ? foxglove::Log::WARNING : foxglove::Log::INFO,
                                  WellFormed(name), WellFormed(text), unix_ns)
                    .SerializeAsString(),
                unix_ns);
  recent_events_.push_back(frame);
  if (recent_events_.size() > kRecentEvents) {
    recent_events_.erase(recent_events_.begin());
  }
  new_events_.push_back(std::move(frame));
}

void Hub::AddNotice(const control::Notice& notice, uint64_t unix_ns) {
  const bool is_warning = !notice.is_on && notice.topic != control::Notice::Topic::kCapture;
  AddEvent(std::string(NameOf(notice.topic)), NoticeText(notice), is_warning, unix_ns);
}

// The latest event of each robot: of two in quick succession, only the second is seen.
void Hub::NoteRobotEvents(const std::vector<control::ClientView>& clients, uint64_t unix_ns) {
  std::map<std::string, protocol::EventReport> present;
  for (const control::ClientView& client : clients) {
    if (!client.robot.last_event) {
      continue;
    }
    const protocol::EventReport& event = *client.robot.last_event;
    const std::string name = client.link + ' ' + std::to_string(client.id);
    present[name] = event;
    if (!robot_events_) {
      continue;  // it is from before
    }
    const auto before = robot_events_->find(name);
    if (before == robot_events_->end() ||
        (before->second.seq != event.seq || before->second.code != event.code ||
         before->second.argument != event.argument)) {
      AddEvent("robot",
               "robot " + name + ": " + std::string(NameOf(event.code)) +
                   (event.argument != 0 ? ' ' + std::to_string(event.argument) : ""),
               IsTrouble(event.code), unix_ns);
    }
  }
  robot_events_ = std::move(present);
}

}  // namespace pheromone::web
