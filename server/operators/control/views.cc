#include "server/operators/control/views.h"

#include <cmath>
#include <optional>
#include <utility>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>

#include "server/base/format.h"
#include "server/operators/control/names.h"

namespace pheromone::web {
namespace {

namespace json = boost::json;

json::value OrNull(const std::optional<double>& number) {
  return number ? json::value(*number) : json::value(nullptr);
}

json::value TextOrNull(const std::string& text) {
  return text.empty() ? json::value(nullptr) : json::value(text);
}

json::object ToJson(const engine::ServiceCounters& counters) {
  json::object errors;
  for (size_t reason = 1; reason < counters.errors.size(); ++reason) {
    if (counters.errors[reason] != 0) {
      errors[NameOf(static_cast<protocol::Reason>(reason))] = counters.errors[reason];
    }
  }
  return {{"requests", counters.requests},
          {"ignored", counters.ignored},
          {"answers", counters.answers},
          {"repeats", counters.repeats},
          {"changes", counters.changes},
          {"observations", counters.observations},
          {"observations_refused", counters.observations_refused},
          {"errors", std::move(errors)}};
}

json::value CommandToJson(const engine::CommandState& state) {
  if (state.outcome == engine::CommandOutcome::kNone) {
    return nullptr;
  }
  return json::object{{"command", NameOf(state.command.code)},
                      {"seq", state.command.seq},
                      {"outcome", NameOf(state.outcome)},
                      {"reason", state.outcome == engine::CommandOutcome::kRefused
                                     ? json::value(NameOf(static_cast<protocol::Reason>(
                                           static_cast<uint16_t>(state.result) & 0xFFu)))
                                     : json::value(nullptr)},
                      {"sent", state.sent}};
}

json::value EventToJson(const std::optional<protocol::EventReport>& event) {
  if (!event) {
    return nullptr;
  }
  return json::object{
      {"event", NameOf(event->code)}, {"seq", event->seq}, {"argument", event->argument}};
}

json::value PoseToJson(const control::ClientView& client) {
  if (client.pose_source == control::PoseSource::kNone) {
    return nullptr;
  }
  return json::object{{"x_m", Metres(client.pose.position.x)},
                      {"y_m", Metres(client.pose.position.y)},
                      {"heading_deg", Degrees(client.pose.heading)},
                      {"source", NameOf(client.pose_source)}};
}

json::value GoalToJson(const std::optional<engine::Goal>& goal) {
  if (!goal) {
    return nullptr;
  }
  return json::object{{"x_m", Metres(goal->point().x)},
                      {"y_m", Metres(goal->point().y)},
                      {"tolerance_m", Metres(goal->tolerance_um)}};
}

json::value StateToJson(const control::ClientView& client) {
  const control::RobotCondition& it = client.condition;
  const uint64_t now_ms = client.traffic.last_ms + client.silent_ms.value_or(0);
  return json::object{
      {"is", control::NameOf(it.state)},
      {"reason", it.reason.empty() ? json::value(nullptr) : json::value(it.reason)},
      {"since_s", it.since_ms == 0 ? json::value(nullptr)
                                   : json::value(static_cast<double>(now_ms - it.since_ms) / 1e3)},
      {"told_by", it.told ? "robot" : "server"},
      {"moves", it.moves},
      {"held", control::IsHeld(it.state)}};
}

json::object ToJson(const control::ClientView& client) {
  const engine::RobotState& robot = client.robot;
  return {{"link", client.link},
          {"id", client.id},
          {"known", client.known},
          {"state", StateToJson(client)},
          {"silent_s", client.silent_ms ? json::value(static_cast<double>(*client.silent_ms) / 1e3)
                                        : json::value(nullptr)},
          {"requests", client.traffic.requests},
          {"repeats", client.traffic.repeats},
          {"refusals", client.traffic.refusals},
          {"pose", PoseToJson(client)},
          {"goal", GoalToJson(robot.goal)},
          {"follows", client.follows.empty() ? json::value(nullptr) : json::value(client.follows)},
          {"nonce", robot.hello.nonce},
          {"previous_nonce",
           robot.previous_nonce ? json::value(*robot.previous_nonce) : json::value(nullptr)},
          {"firmware_version", robot.hello.firmware_version},
          {"round_period_ms", robot.hello.round_period * protocol::kRoundPeriodMs},
          {"last_event", EventToJson(robot.last_event)},
          {"last_command", CommandToJson(robot.command)}};
}

std::string_view NameOf(field::Evaporation evaporation) {
  switch (evaporation) {
    case field::Evaporation::kCounter:
      return "counter";
    case field::Evaporation::kLinear:
      return "linear";
    case field::Evaporation::kExponential:
      break;
  }
  return "exponential";
}

json::object ToJson(const field::PheromoneLaw& law) {
  json::object object{{"type", law.type}, {"name", law.name}};
  if (law.is_blend()) {
    json::array parts;
    for (const field::BlendPart& part : law.blend) {
      parts.push_back({{"type", part.type}, {"weight", part.weight_milli / 1e3}});
    }
    object["blend"] = std::move(parts);
    return object;
  }
  object["quantum"] = static_cast<double>(law.quantum_micro) / 1e6;
  object["maximum"] = MaximumOf(law);
  object["weight"] = law.weight_milli / 1e3;
  object["evaporation"] = law.tau_ms == 0 ? "permanent" : NameOf(law.evaporation);
  object["tau_s"] = static_cast<double>(law.tau_ms) / 1e3;
  object["profile"] = law.profile == field::Profile::kGaussian ? "gaussian" : "z-shape";
  object["core_m"] = Metres(law.core_um);
  object["sigma_m"] = Metres(law.sigma_um);
  object["reach_m"] = Metres(law.reach_um());
  object["directional"] = law.directional;
  object["diffuses"] = law.diffuses();
  return object;
}

}  // namespace

double MaximumOf(const field::PheromoneLaw& law) {
  return static_cast<double>(law.quantum_micro) * law.max_count / 1e6;
}

json::value ToJson(const control::CaptureView& capture) {
  return json::object{{"recording", capture.recording},   {"folder", capture.folder},
                      {"file", TextOrNull(capture.file)}, {"error", TextOrNull(capture.error)},
                      {"files", capture.files},           {"bytes", capture.bytes},
                      {"records", capture.records},       {"lost", capture.lost}};
}

json::value ToJson(const control::ClusterView& cluster) {
  json::array peers;
  for (const control::ClusterView::Peer& peer : cluster.peers) {
    peers.push_back({{"node", peer.node}, {"up", peer.up}, {"state", peer.state}});
  }
  return json::object{{"name", cluster.name},
                      {"node", cluster.node},
                      {"role", cluster.role},
                      {"leader", TextOrNull(cluster.leader)},
                      {"term", cluster.term},
                      {"committed_sequence", cluster.committed},
                      {"behind", cluster.behind},
                      {"heard_s", cluster.heard_s},
                      {"elections", cluster.elections},
                      {"fenced", cluster.fenced},
                      {"forwarded", cluster.forwarded},
                      {"divergences", cluster.divergences},
                      {"trouble", TextOrNull(cluster.trouble)},
                      {"gap", TextOrNull(cluster.gap)},
                      {"transfer", TextOrNull(cluster.transfer)},
                      {"peers", peers}};
}

json::value ToJson(const control::StatusView& status) {
  return json::object{
      {"version", status.version},
      {"uptime_s", status.uptime_s},
      {"field_time_s", static_cast<double>(status.field_time_ms) / 1e3},
      {"epoch", status.epoch},
      {"sequence", status.sequence},
      {"durable_sequence",
       status.is_kept ? json::value(status.durable_sequence) : json::value(nullptr)},
      {"state_hash",
       status.state_hash ? json::value(HexText(*status.state_hash)) : json::value(nullptr)},
      {"links", status.links},
      {"links_up", status.links_up},
      {"robots", status.robots},
      {"field",
       {{"nodes", status.nodes},
        {"tiles", status.tiles},
        {"used_bytes", status.field_bytes},
        {"limit_bytes", status.field_limit_bytes}}},
      {"counters", ToJson(status.service)},
      {"trouble",
       {{"id_conflicts", status.engine.id_conflicts},
        {"commands_unanswered", status.engine.commands_unanswered},
        {"commands_unknown", status.engine.commands_unknown}}},
      {"capture", ToJson(status.capture)},
      {"cluster", status.cluster ? ToJson(*status.cluster) : json::value(nullptr)},
      {"warning", status.warning.empty() ? json::value(nullptr) : json::value(status.warning)},
      {"process",
       {{"resident_bytes", status.resident_bytes},
        {"open_descriptors", status.open_descriptors},
        {"cpu_s", status.cpu_s}}}};
}

json::value ToJson(const std::vector<control::LinkView>& links) {
  json::array array;
  for (const control::LinkView& link : links) {
    json::object counters;
    json::object losses;
    uint64_t errors = 0;
    for (const control::NamedCount& counter : link.counters) {
      counters[counter.name] = counter.count;
      if (counter.is_trouble && counter.count != 0) {
        losses[counter.name] = counter.count;
      }
      errors += counter.is_loss ? counter.count : 0;
    }
    array.push_back(
        {{"name", link.name},
         {"kind", link.kind},
         {"address", link.address},
         {"terminal", TextOrNull(link.terminal)},
         {"role", link.role},
         {"nodes", json::array(link.nodes.begin(), link.nodes.end())},
         {"owner", TextOrNull(link.owner)},
         {"up", link.up},
         {"state", link.state},
         {"since_s", link.since_s},
         {"last_error",
          link.last_error.empty() ? json::value(nullptr) : json::value(link.last_error)},
         {"failed_attempts", link.failed_attempts},
         {"next_attempt_s", OrNull(link.next_attempt_s)},
         {"silent_s", OrNull(link.silent_s)},
         {"silent", link.silent},
         {"bytes_per_s", link.bytes_per_s},
         {"utilisation",
          link.byte_rate ? json::value(link.bytes_per_s / *link.byte_rate) : json::value(nullptr)},
         {"counters", std::move(counters)},
         {"losses", std::move(losses)},
         {"errors", errors},
         {"revoked", json::array(link.revoked.begin(), link.revoked.end())}});
  }
  return json::object{{"links", std::move(array)}};
}

json::value ToJson(const std::vector<control::TrackerView>& trackers) {
  json::array array;
  for (const control::TrackerView& tracker : trackers) {
    json::array refusals;
    for (const control::TrackerView::Refusal& refusal : tracker.refusals) {
      refusals.push_back({{"reason", refusal.reason}, {"count", refusal.count}});
    }
    array.push_back({{"name", tracker.name},
                     {"address", tracker.address},
                     {"up", tracker.up},
                     {"state", tracker.state},
                     {"datagrams", tracker.datagrams},
                     {"poses", tracker.poses},
                     {"refusals", std::move(refusals)},
                     {"last_refusal", TextOrNull(tracker.last_refusal)}});
  }
  return json::object{{"trackers", std::move(array)}};
}

json::value ToJson(const control::ConfigView& config) {
  return json::object{{"lines", json::array(config.lines.begin(), config.lines.end())},
                      {"file", TextOrNull(config.file)},
                      {"journal", TextOrNull(config.journal)}};
}

json::value ToJson(const std::vector<control::ClientView>& clients) {
  json::array array;
  for (const control::ClientView& client : clients) {
    array.emplace_back(ToJson(client));
  }
  return json::object{{"clients", std::move(array)}};
}

json::value LawsToJson(const field::FieldConfig& config) {
  json::array laws;
  for (const field::PheromoneLaw& law : config.pheromones) {
    laws.emplace_back(ToJson(law));
  }
  return json::object{{"map",
                       {{"origin_m", {Metres(config.map.origin.x), Metres(config.map.origin.y)}},
                        {"width_m", Metres(config.map.width_um)},
                        {"height_m", Metres(config.map.height_um)},
                        {"cell_m", Metres(config.map.cell_um)},
                        {"columns", config.map.columns()},
                        {"rows", config.map.rows()}}},
                      {"antennas",
                       {{"distance_m", Metres(config.antennas.distance_um)},
                        {"forward_m", Metres(config.antennas.forward_um)},
                        {"angle_deg", Degrees(config.antennas.angle)}}},
                      {"pheromones", std::move(laws)}};
}

json::value PathsToJson(const std::vector<field::Path>& paths, const field::FieldConfig& config) {
  json::array array;
  for (const field::Path& path : paths) {
    json::array points;
    for (const field::PointUm point : path.points) {
      points.push_back({Metres(point.x), Metres(point.y)});
    }
    const field::PheromoneLaw* const law = config.FindLaw(path.type);
    array.push_back({{"pheromone", law != nullptr ? json::value(law->name) : json::value(nullptr)},
                     {"closed", path.closed},
                     {"points_m", std::move(points)}});
  }
  return json::object{{"paths", std::move(array)}};
}

json::object DescribeRaster(const maps::Raster& raster) {
  return {{"columns", raster.columns},
          {"rows", raster.rows},
          {"origin_m", {Metres(raster.origin.x), Metres(raster.origin.y)}},
          {"cell_m", Metres(raster.cell_um)}};
}

json::object DescribeRaster(const maps::Raster& raster, const field::PheromoneLaw& law,
                            uint64_t field_time_ms) {
  json::object object{{"pheromone", law.name},
                      {"type", law.type},
                      {"maximum", MaximumOf(law)},
                      {"field_time_s", static_cast<double>(field_time_ms) / 1e3}};
  for (const auto& [key, value] : DescribeRaster(raster)) {
    object[key] = value;
  }
  return object;
}

json::array RowsOf(const maps::Raster& raster) {
  json::array rows;
  rows.reserve(static_cast<size_t>(raster.rows));
  for (int32_t row = raster.rows; row-- > 0;) {
    json::array values;
    values.reserve(static_cast<size_t>(raster.columns));
    for (int32_t column = 0; column < raster.columns; ++column) {
      const double value = raster.At(column, row);
      values.emplace_back(std::isnan(value) ? json::value(nullptr) : json::value(value));
    }
    rows.emplace_back(std::move(values));
  }
  return rows;
}

}  // namespace pheromone::web
