#include "server/operators/web/stream/conversation.h"

#include <algorithm>
#include <variant>

#include <boost/json/array.hpp>
#include <boost/json/parse.hpp>

#include "server/base/bytes.h"
#include "server/operators/control/json_text.h"
#include "server/operators/web/api/request_parameters.h"
#include "server/operators/web/stream/services.h"

namespace pheromone::web {
namespace {

namespace json = boost::json;

constexpr std::string_view kGridRate = "stream.grid_hz";
constexpr std::string_view kPheromone = "/pheromone/";
constexpr std::string_view kTau = "/tau_s";  // of the law; the other constants are the file's
constexpr double kLeastHz = 0.1;
constexpr size_t kMaxWatched = 256;
constexpr uint8_t kPublishOp = 1;
constexpr uint8_t kCallOp = 2;
constexpr uint8_t kCallAnswerOp = 3;
enum class Level { kInfo, kWarning, kError };

StreamMessage TextMessage(const json::object& object) {
  return {ToText(object), false};
}

StreamMessage StatusMessage(Level level, const std::string& text) {
  return TextMessage(
      {{"op", "status"}, {"level", static_cast<int>(level)}, {"message", WellFormed(text)}});
}

void Complain(const std::string& text, Heard* heard) {
  if (++heard->complaints <= Conversation::kMaxComplaints) {
    heard->answers.push_back(StatusMessage(Level::kError, text));
  }
}

json::object ChannelToJson(const Channel& channel) {
  return {{"id", channel.id},
          {"topic", channel.topic},
          {"encoding", channel.encoding},
          {"schemaName", channel.schema_name},
          {"schema", channel.schema},
          {"schemaEncoding", channel.schema_encoding}};
}

json::object TimeToJson(uint64_t time_ns) {
  constexpr uint64_t kNsPerSecond = 1'000'000'000;
  return {{"sec", time_ns / kNsPerSecond}, {"nsec", time_ns % kNsPerSecond}};
}

std::optional<uint32_t> NumberOf(const json::value& value) {
  boost::system::error_code error;
  const auto number = value.to_number<uint32_t>(error);
  return error ? std::nullopt : std::optional(number);
}

std::optional<uint32_t> NumberOf(const json::object& object, std::string_view key) {
  const json::value* const value = object.if_contains(key);
  return value != nullptr ? NumberOf(*value) : std::nullopt;
}

// An empty list if it is none.
const json::array& ListOf(const json::object& object, std::string_view key) {
  static const json::array none;
  const json::value* const value = object.if_contains(key);
  const json::array* const list = value != nullptr ? value->if_array() : nullptr;
  return list != nullptr ? *list : none;
}

std::string TextOf(const json::object& object, std::string_view key) {
  const json::value* const value = object.if_contains(key);
  const json::string* const text = value != nullptr ? value->if_string() : nullptr;
  return text != nullptr ? std::string(*text) : std::string();
}

std::vector<std::string> NamesIn(const json::array& list) {
  std::vector<std::string> names;
  for (const json::value& item : list) {
    if (const json::string* name = item.if_string()) {
      names.emplace_back(*name);
    }
  }
  return names;
}

// {"error": {"what", "where", "expected"}} on one line for people.
std::string ErrorOf(const Response& response) {
  boost::system::error_code error;
  const json::value body = json::parse(response.body, error);
  const json::object* const object = error ? nullptr : body.if_object();
  const json::value* const inner = object != nullptr ? object->if_contains("error") : nullptr;
  if (inner == nullptr || !inner->is_object()) {
    return "status " + std::to_string(response.status);
  }
  std::string text = TextOf(inner->get_object(), "what");
  if (const std::string where = TextOf(inner->get_object(), "where"); !where.empty()) {
    text += " (" + where + ")";
  }
  if (const std::string expected = TextOf(inner->get_object(), "expected"); !expected.empty()) {
    text += "; expected " + expected;
  }
  return text;
}

}  // namespace

std::string_view ChooseSubprotocol(std::string_view header) {
  while (!header.empty()) {
    const size_t comma = std::min(header.find(','), header.size());
    std::string_view name = header.substr(0, comma);
    header.remove_prefix(std::min(comma + 1, header.size()));
    while (name.starts_with(' ') || name.starts_with('\t')) {
      name.remove_prefix(1);
    }
    while (name.ends_with(' ') || name.ends_with('\t')) {
      name.remove_suffix(1);
    }
    for (const std::string_view known : kSubprotocols) {
      if (name == known) {
        return known;
      }
    }
  }
  return {};
}

std::vector<StreamMessage> Conversation::Greet() const {
  json::object info{
      {"op", "serverInfo"},
      {"name", "pheromoned"},
      {"capabilities", {"clientPublish", "parameters", "parametersSubscribe", "services", "time"}},
      {"supportedEncodings", {"json"}},
      {"sessionId", catalogue_->session}};
  json::object metadata;
  if (!catalogue_->ros_distro.empty()) {
    metadata["ROS_DISTRO"] = catalogue_->ros_distro;
  }
  if (const auto& recording = catalogue_->recording) {
    info["capabilities"] = {"parameters", "parametersSubscribe", "time", "playbackControl"};
    info["dataStartTime"] = TimeToJson(recording->begin_ns);
    info["dataEndTime"] = TimeToJson(recording->end_ns);
    metadata["recording"] = WellFormed(recording->name);
  }
  info["metadata"] = std::move(metadata);
  json::array channels;
  for (const Channel& channel : catalogue_->channels) {
    channels.push_back(ChannelToJson(channel));
  }
  std::vector<StreamMessage> messages = {
      TextMessage(info), TextMessage({{"op", "advertise"}, {"channels", std::move(channels)}})};
  if (!catalogue_->recording) {
    messages.push_back(
        TextMessage({{"op", "advertiseServices"}, {"services", DescribeServices()}}));
  }
  return messages;
}

Heard Conversation::Change(std::shared_ptr<const Catalogue> catalogue) {
  Heard heard;
  const std::shared_ptr<const Catalogue> before = std::exchange(catalogue_, std::move(catalogue));
  json::array gone;
  for (const Channel& channel : before->channels) {
    const Channel* const present = FindChannel(channel.id);
    if (present == nullptr || *present != channel) {
      gone.emplace_back(channel.id);
      std::erase_if(subscriptions_, [&](const auto& it) {
        if (it.second == channel.id) {
          heard.unsubscribed.push_back(it.first);
        }
        return it.second == channel.id;
      });
    }
  }
  json::array added;
  for (const Channel& channel : catalogue_->channels) {
    if (std::find(before->channels.begin(), before->channels.end(), channel) ==
        before->channels.end()) {
      added.push_back(ChannelToJson(channel));
    }
  }
  if (!gone.empty()) {
    heard.answers.push_back(TextMessage({{"op", "unadvertise"}, {"channelIds", std::move(gone)}}));
  }
  if (!added.empty()) {
    heard.answers.push_back(TextMessage({{"op", "advertise"}, {"channels", std::move(added)}}));
  }
  std::vector<std::string> changed;
  for (const std::string& name : watched_) {
    const auto now = catalogue_->parameters.find(name);
    const auto then = before->parameters.find(name);
    const bool is_known = now != catalogue_->parameters.end();
    if (is_known && (then == before->parameters.end() || then->second != now->second)) {
      changed.push_back(name);
    }
  }
  if (!changed.empty()) {
    heard.answers.push_back(ParameterValues(changed, nullptr));
  }
  return heard;
}

const Channel* Conversation::FindChannel(uint32_t id) const {
  const auto& channels = catalogue_->channels;
  const auto found = std::find_if(channels.begin(), channels.end(),
                                  [id](const Channel& it) { return it.id == id; });
  return found != channels.end() ? &*found : nullptr;
}

Heard Conversation::Hear(std::string_view message, bool is_binary) {
  Heard heard;
  if (is_binary) {
    HearBinary(message, &heard);
  } else {
    HearText(message, &heard);
  }
  if (heard.changes.size() > kMaxChanges) {
    Complain("found " + std::to_string(heard.changes.size()) +
                 " changes in one message, expected at most " + std::to_string(kMaxChanges) +
                 ": none of them is made",
             &heard);
    heard.changes.clear();
  }
  if (heard.complaints > kMaxComplaints) {
    heard.answers.push_back(StatusMessage(
        Level::kError,
        std::to_string(heard.complaints - kMaxComplaints) + " more mistakes in the same message"));
  }
  return heard;
}

void Conversation::HearText(std::string_view text, Heard* heard) {
  const auto parsed = ParseBody(text);
  if (const Problem* problem = std::get_if<Problem>(&parsed)) {
    Complain("invalid message: " + problem->what + "; expected a JSON object", heard);
    return;
  }
  const json::object& message = std::get<json::object>(parsed);
  const std::string op = TextOf(message, "op");
  if (op == "subscribe") {
    Subscribe(message, heard);
  } else if (op == "unsubscribe") {
    Unsubscribe(message, heard);
  } else if (op == "advertise") {
    Advertise(message, heard);
  } else if (op == "unadvertise") {
    Unadvertise(message, heard);
  } else if (op == "getParameters") {
    GetParameters(message, heard);
  } else if (op == "setParameters") {
    SetParameters(message, heard);
  } else if (op == "subscribeParameterUpdates" || op == "unsubscribeParameterUpdates") {
    WatchParameters(message, op == "subscribeParameterUpdates", heard);
  } else {
    Complain("unknown op \"" + op.substr(0, 40) + "\"", heard);
  }
}

void Conversation::Subscribe(const json::object& message, Heard* heard) {
  for (const json::value& item : ListOf(message, "subscriptions")) {
    const json::object* const object = item.if_object();
    const auto id = object != nullptr ? NumberOf(*object, "id") : std::nullopt;
    const auto channel = object != nullptr ? NumberOf(*object, "channelId") : std::nullopt;
    if (!id || !channel) {
      Complain("subscribe: expected {\"id\": number, \"channelId\": number}", heard);
    } else if (FindChannel(*channel) == nullptr) {
      Complain("subscribe: there is no channel " + std::to_string(*channel), heard);
    } else if (subscriptions_.contains(*id)) {
      Complain("subscribe: subscription " + std::to_string(*id) + " exists already", heard);
    } else if (std::any_of(subscriptions_.begin(), subscriptions_.end(),
                           [&](const auto& it) { return it.second == *channel; })) {
      Complain("subscribe: channel " + std::to_string(*channel) + " is subscribed already", heard);
    } else if (subscriptions_.size() >= kMaxSubscriptions) {
      Complain("subscribe: more than " + std::to_string(kMaxSubscriptions) + " subscriptions",
               heard);
    } else {
      subscriptions_[*id] = *channel;
      heard->subscribed.emplace_back(*id, *channel);
    }
  }
}

void Conversation::Unsubscribe(const json::object& message, Heard* heard) {
  for (const json::value& item : ListOf(message, "subscriptionIds")) {
    const auto id = NumberOf(item);
    if (!id || subscriptions_.erase(*id) == 0) {
      Complain("unsubscribe: there is no such subscription", heard);
    } else {
      heard->unsubscribed.push_back(*id);
    }
  }
}

void Conversation::Advertise(const json::object& message, Heard* heard) {
  for (const json::value& item : ListOf(message, "channels")) {
    const json::object* const object = item.if_object();
    const auto id = object != nullptr ? NumberOf(*object, "id") : std::nullopt;
    const std::string topic = object != nullptr ? TextOf(*object, "topic") : "";
    const std::string encoding = object != nullptr ? TextOf(*object, "encoding") : "";
    if (!id) {
      Complain("advertise: expected {\"id\": number, \"topic\": string, ...}", heard);
    } else if (encoding != "json") {
      Complain("advertise: found encoding \"" + encoding.substr(0, 40) + "\", expected json",
               heard);
    } else if (client_topics_.size() >= kMaxClientChannels && !client_topics_.contains(*id)) {
      Complain("advertise: more than " + std::to_string(kMaxClientChannels) + " channels", heard);
    } else {
      // Viewers advertise topics before anything is published; others are refused when it is.
      client_topics_[*id] = topic.substr(0, 100);
    }
  }
}

void Conversation::Unadvertise(const json::object& message, Heard* heard) {
  for (const json::value& item : ListOf(message, "channelIds")) {
    const auto id = NumberOf(item);
    if (!id || client_topics_.erase(*id) == 0) {
      Complain("unadvertise: there is no such channel", heard);
    }
  }
}

std::optional<json::value> Conversation::ValueOf(const std::string& parameter) const {
  if (parameter == kGridRate) {
    return json::value(grid_hz_);
  }
  const auto found = catalogue_->parameters.find(parameter);
  return found != catalogue_->parameters.end() ? std::optional(found->second) : std::nullopt;
}

StreamMessage Conversation::ParameterValues(const std::vector<std::string>& names,
                                            const json::value* id) const {
  json::array parameters;
  for (const std::string& name : names) {
    if (const std::optional<json::value> value = ValueOf(name)) {
      json::object parameter{{"name", name}, {"value", *value}};
      if (value->is_number()) {
        parameter["type"] = "float64";
      }
      parameters.push_back(std::move(parameter));
    }
  }
  json::object message{{"op", "parameterValues"}, {"parameters", std::move(parameters)}};
  if (id != nullptr && id->is_string()) {
    message["id"] = *id;
  }
  return TextMessage(message);
}

void Conversation::GetParameters(const json::object& message, Heard* heard) const {
  std::vector<std::string> names = NamesIn(ListOf(message, "parameterNames"));
  if (names.empty()) {  // all
    names.emplace_back(kGridRate);
    for (const auto& [name, value] : catalogue_->parameters) {
      names.push_back(name);
    }
  }
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  heard->answers.push_back(ParameterValues(names, message.if_contains("id")));
}

void Conversation::SetParameters(const json::object& message, Heard* heard) {
  std::vector<std::string> names;
  for (const json::value& item : ListOf(message, "parameters")) {
    const json::object* const object = item.if_object();
    const std::string name = object != nullptr ? TextOf(*object, "name") : "";
    names.push_back(name);
    const json::value* const value = object != nullptr ? object->if_contains("value") : nullptr;
    if (name != kGridRate) {
      const bool is_tau = name.starts_with(kPheromone) && name.ends_with(kTau);
      if (!ValueOf(name)) {
        Complain("there is no parameter \"" + name.substr(0, 100) + "\"", heard);
      } else if (!is_tau) {
        Complain("parameter " + name +
                     " is read-only: change it in the file of the configuration, and reload",
                 heard);
      } else if (!refusal_.empty()) {
        Complain("parameter " + name + ": " + refusal_, heard);
      } else {
        const std::string pheromone =
            name.substr(kPheromone.size(), name.size() - kPheromone.size() - kTau.size());
        heard->changes.push_back(
            {.target = "/api/v1/laws",
             .body = ToText(json::object{{"pheromone", pheromone},
                                         {"tau_s", value != nullptr ? *value : json::value()}}),
             .name = "parameter " + name,
             .parameter = name,
             .request_id = TextOf(message, "id")});
        names.pop_back();  // its value is reported when it is known
      }
      continue;
    }
    boost::system::error_code error;
    const double hz = value != nullptr ? value->to_number<double>(error) : 0;
    if (error || !(hz >= kLeastHz && hz <= kDefaultGridHz)) {
      Complain("parameter stream.grid_hz: expected a number from 0.1 to 5", heard);
    } else {
      grid_hz_ = hz;
    }
  }
  // As the protocol has it, the values are reported if the request has an ID; to those who watch
  // them, always.
  const bool is_watched = std::any_of(
      names.begin(), names.end(), [&](const std::string& name) { return watched_.contains(name); });
  if (!names.empty() && (message.contains("id") || is_watched)) {
    heard->answers.push_back(ParameterValues(names, message.if_contains("id")));
  }
}

void Conversation::WatchParameters(const json::object& message, bool watch, Heard* heard) {
  const std::vector<std::string> names = NamesIn(ListOf(message, "parameterNames"));
  if (names.empty() && !watch) {
    watched_.clear();
  }
  for (const std::string& name : names) {
    if (!watch) {
      watched_.erase(name);
    } else if (watched_.size() >= kMaxWatched) {
      Complain("more than " + std::to_string(kMaxWatched) + " parameters are watched", heard);
      return;
    } else if (ValueOf(name)) {
      watched_.insert(name);
    }
  }
  if (watch && names.empty()) {
    for (const auto& [name, value] : catalogue_->parameters) {
      watched_.insert(name);
    }
  }
}

void Conversation::HearBinary(std::string_view bytes, Heard* heard) {
  ByteReader reader(bytes);
  const uint8_t op = reader.U8();
  if (op == kPublishOp) {
    const uint32_t channel = reader.U32();
    if (reader.ok()) {
      Publish(channel, bytes.substr(5), heard);
      return;
    }
  } else if (op == kCallOp) {
    Call(bytes.substr(1), heard);
    return;
  } else if (op == kPlaybackRequestOp && catalogue_->recording) {
    Play(bytes.substr(1), heard);
    return;
  }
  Complain("unknown binary message, op " + std::to_string(op), heard);
}

void Conversation::Publish(uint32_t channel, std::string_view payload, Heard* heard) {
  const auto found = client_topics_.find(channel);
  if (found == client_topics_.end()) {
    Complain("published on channel " + std::to_string(channel) + ", which is not advertised",
             heard);
    return;
  }
  const std::string& topic = found->second;
  if (!IsPublishTopic(topic)) {
    Complain(topic + ": expected /brush or /clicked_point", heard);
  } else if (!refusal_.empty()) {
    Complain(topic + ": " + refusal_, heard);
  } else if (PublishedRequest request = RequestOf(topic, payload, catalogue_->click_pheromone);
             !request.problem.empty()) {
    Complain(topic + ": " + request.problem, heard);
  } else {
    heard->changes.push_back(
        {.target = std::move(request.target), .body = std::move(request.body), .name = topic});
  }
}

void Conversation::Call(std::string_view bytes, Heard* heard) {
  ByteReader reader(bytes);
  const uint32_t service = reader.U32();
  const uint32_t call = reader.U32();
  const uint32_t length = reader.U32();
  constexpr size_t kHeader = 12;
  if (!reader.ok() || length > bytes.size() - kHeader) {
    Complain("truncated service call", heard);
    return;
  }
  const std::string_view encoding = bytes.substr(kHeader, length);
  const auto fail = [&](const std::string& why) {
    heard->answers.push_back(TextMessage({{"op", "serviceCallFailure"},
                                          {"serviceId", service},
                                          {"callId", call},
                                          {"message", WellFormed(why)}}));
  };
  const StreamService* const found = FindStreamService(service);
  if (found == nullptr) {
    fail("there is no service " + std::to_string(service));
  } else if (encoding != "json") {
    fail("found encoding \"" + std::string(encoding.substr(0, 40)) + "\", expected json");
  } else if (!refusal_.empty()) {
    fail(refusal_);
  } else {
    heard->changes.push_back({.target = std::string(found->target),
                              .body = std::string(bytes.substr(kHeader + length)),
                              .name = std::string(found->name),
                              .is_call = true,
                              .service = service,
                              .call = call});
  }
}

void Conversation::Play(std::string_view bytes, Heard* heard) const {
  auto parsed = ParsePlaybackRequest(bytes);
  if (const std::string* wrong = std::get_if<std::string>(&parsed)) {
    Complain(*wrong, heard);
  } else {
    heard->playback = std::get<PlaybackRequest>(std::move(parsed));
  }
}

// With an ID, the new value; all who watch the parameter are told by the next catalogue.
StreamMessage Conversation::ParameterChanged(const StreamChange& change, const Response& response) {
  boost::system::error_code error;
  const json::value body = json::parse(response.body, error);
  const json::object answer = !error && body.is_object() ? body.get_object() : json::object();
  const json::value* const value = answer.if_contains("tau_s");
  if (change.request_id.empty() || value == nullptr) {
    return StatusMessage(Level::kInfo, change.name + " is changed " + TextOf(answer, "note"));
  }
  return TextMessage(
      {{"op", "parameterValues"},
       {"parameters", json::array{json::object{
                          {"name", change.parameter}, {"value", *value}, {"type", "float64"}}}},
       {"id", change.request_id}});
}

StreamMessage Conversation::Answer(const StreamChange& change, const Response& response) const {
  if (!change.parameter.empty() && response.status == 200) {
    return ParameterChanged(change, response);
  }
  if (!change.is_call) {
    return StatusMessage(Level::kError, change.name + ": " + ErrorOf(response));
  }
  if (response.status != 200) {
    return TextMessage({{"op", "serviceCallFailure"},
                        {"serviceId", change.service},
                        {"callId", change.call},
                        {"message", WellFormed(ErrorOf(response))}});
  }
  ByteWriter writer;
  writer.U8(kCallAnswerOp);
  writer.U32(change.service);
  writer.U32(change.call);
  writer.Text("json");
  writer.Raw(response.body);
  return {writer.Take(), true};
}

}  // namespace pheromone::web
