#include "server/operators/web/api/operator_actions.h"

#include <algorithm>
#include <utility>

#include <boost/json/array.hpp>
#include <boost/json/value.hpp>

#include "server/operators/control/json_text.h"

namespace pheromone::web {
namespace {

namespace json = boost::json;

constexpr std::string_view kApi = "/api/v1/";

// A string without quotes, anything else as JSON.
std::string TextOf(const json::value& value) {
  if (const json::string* const text = value.if_string()) {
    return std::string(*text);
  }
  std::string text = ToText(value);
  text.pop_back();  // the end of the line
  return text;
}

// Nothing if there is no such member.
std::string TextOf(const json::object& object, std::string_view name) {
  const json::value* const found = object.if_contains(name);
  return found != nullptr ? TextOf(*found) : "";
}

std::string Quoted(const json::object& object, std::string_view name) {
  return '"' + TextOf(object, name) + '"';
}

std::string At(const std::string& x_m, const std::string& y_m) {
  return " at (" + x_m + ", " + y_m + ')';
}

// Where an edit begins: a point, the first one of a stroke, the lower left corner of an area.
std::string PlaceOf(const json::object& body) {
  if (body.contains("x_m")) {
    return At(TextOf(body, "x_m"), TextOf(body, "y_m"));
  }
  const json::value* at = body.if_contains("points_m");
  at = at != nullptr && at->is_array() && !at->get_array().empty() ? &at->get_array().front()
                                                                   : body.if_contains("area_m");
  if (at == nullptr || !at->is_array() || at->get_array().size() < 2) {
    return "";
  }
  return At(TextOf(at->get_array()[0]), TextOf(at->get_array()[1]));
}

std::string RobotOf(const json::object& body) {
  return "robot " + TextOf(body, "link") + ' ' + TextOf(body, "id") + ": ";
}

bool IsZero(const json::object& object, std::string_view name, bool if_missing) {
  const json::value* const found = object.if_contains(name);
  return found != nullptr ? *found == json::value(0) : if_missing;
}

struct Words {
  std::string what;
  std::string place;
};

Words WordsOf(std::string_view name, const json::object& body, const json::object& answer) {
  if (name == "paint" || name == "deposit") {
    return {(name == "paint" ? "painted " : "deposited ") + Quoted(body, "pheromone"),
            PlaceOf(body)};
  }
  if (name == "erase") {
    return {"erased " + Quoted(body, "pheromone") + (body.contains("all") ? " everywhere" : ""),
            PlaceOf(body)};
  }
  if (name == "halt") {
    static const json::array none;
    const json::value* const links = answer.if_contains("links");
    const json::value* const down = answer.if_contains("down");
    const size_t told = links != nullptr && links->is_array() ? links->get_array().size() : 0;
    size_t here = told;
    size_t others = 0;
    for (const json::value& link : down != nullptr && down->is_array() ? down->get_array() : none) {
      const std::string role = link.is_object() ? TextOf(link.get_object(), "role") : "";
      ++(role == "standby" || role == "elsewhere" ? others : here);
    }
    return {"halted all robots, on " + std::to_string(told) + " of " + std::to_string(here) +
                " links" + (others == 0 ? "" : "; other nodes send on " + std::to_string(others)),
            ""};
  }
  if (name == "command") {
    const std::string arguments = body.contains("arguments") ? TextOf(body, "arguments") : "[]";
    return {RobotOf(body) + TextOf(body, "command") + (arguments == "[]" ? "" : ' ' + arguments),
            ""};
  }
  if (name == "goto") {
    const json::value* const cancel = body.if_contains("cancel");  // it may be false
    return cancel != nullptr && *cancel == true
               ? Words{RobotOf(body) + "goal cancelled", ""}
               : Words{RobotOf(body) + "sent to a goal", PlaceOf(body)};
  }
  if (name == "laws") {
    return {"changed " + Quoted(body, "pheromone") + ": tau " + TextOf(body, "tau_s") + " s", ""};
  }
  if (name == "revoke") {
    return {"revoked the keys of robots " + TextOf(body, "ids"), ""};
  }
  if (name == "undo" || name == "redo") {
    return {(name == "undo" ? "undid: " : "redid: ") + TextOf(answer, "what"), ""};
  }
  if (name == "ticket") {
    return {"made a ticket for a viewer", ""};
  }
  if (name == "step-down") {
    return {"handed the lead of the cluster over", ""};
  }
  if (name == "snapshot") {
    return {"snapshot " + TextOf(answer, "snapshot"), ""};
  }
  if (name == "tags" || name == "nets") {
    const std::string subject = name == "tags" ? TextOf(body, "tag") : TextOf(body, "net");
    return {std::string(name) + ": " + TextOf(body, "action") +
                (subject.empty() ? "" : " \"" + subject + '"'),
            ""};
  }
  if (name == "unlock" || name == "reload" || name == "capture") {
    return {};
  }
  return {std::string(name), PlaceOf(body)};
}

std::string_view RequestOf(std::string_view path) {
  return path.starts_with(kApi) ? path.substr(kApi.size()) : path;
}

}  // namespace

std::optional<control::Notice> OperatorActions::NoteRefusal(std::string_view path, int status,
                                                            const std::string& why,
                                                            const std::string& from,
                                                            uint64_t now_ms) {
  const std::lock_guard lock(mutex_);
  if (now_ms >= refusals_since_ms_ + kRefusalMs) {
    refusals_since_ms_ = now_ms;
    refusals_told_ = 0;
    std::erase_if(refused_,
                  [&](const auto& it) { return now_ms >= it.second.told_ms + kForgetMs; });
  }
  if (refused_.size() >= kMaxClients && !refused_.contains(from)) {
    refused_.erase(std::min_element(
        refused_.begin(), refused_.end(),
        [](const auto& a, const auto& b) { return a.second.told_ms < b.second.told_ms; }));
  }
  Refused& its = refused_[from];
  const bool is_recent = its.told_ms != 0 && now_ms < its.told_ms + kRefusalMs;
  if (is_recent || refusals_told_ == kMaxRefusals) {
    ++its.untold;
    return std::nullopt;
  }
  ++refusals_told_;
  std::string text = std::string(RequestOf(path)) + (status < 500 ? ": refused, " : ": failed, ") +
                     why.substr(0, kMaxReason);
  if (its.untold != 0) {
    text += "; " + std::to_string(its.untold) + " more before";
  }
  its = {now_ms, 0};
  return control::Notice{control::Notice::Topic::kOperator, false, from, std::move(text)};
}

std::optional<control::Notice> OperatorActions::Note(std::string_view path,
                                                     const json::object& body,
                                                     const json::object& answer, std::string from,
                                                     uint64_t now_ms) {
  if (!path.starts_with(kApi)) {
    return std::nullopt;
  }
  Words words = WordsOf(path.substr(kApi.size()), body, answer);
  if (words.what.empty()) {
    return std::nullopt;
  }
  const bool is_stroke = body.contains("points_m");
  // What changes nothing is no edit that the next part could continue.
  const bool is_part = !IsZero(body, "continues", true) || IsZero(answer, "changed", false);
  const std::lock_guard lock(mutex_);
  const bool goes_on = is_stroke && is_part && words.what == last_ && from == last_from_ &&
                       now_ms < last_ms_ + kPauseMs;
  last_ = is_stroke ? words.what : "";
  last_from_ = from;
  last_ms_ = now_ms;
  if (goes_on) {
    return std::nullopt;
  }
  return control::Notice{control::Notice::Topic::kOperator, true, std::move(from),
                         words.what + words.place};
}

}  // namespace pheromone::web
