#include "server/operators/web/api/request_parameters.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <boost/json/basic_parser_impl.hpp>
#include <boost/json/parse.hpp>

#include "server/operators/control/json_text.h"

namespace pheromone::web {
namespace {

namespace json = boost::json;

constexpr double kFarthestM = 1e6;
constexpr size_t kMaxShown = 60;

// Such as a point: shown as it is.
bool IsShortRow(const json::array& array) {
  constexpr size_t kMaxInRow = 4;
  return !array.empty() && array.size() <= kMaxInRow &&
         std::all_of(array.begin(), array.end(),
                     [](const json::value& item) { return item.is_number(); });
}

// A short description of the value found.
std::string Describe(const json::value* value) {
  if (value == nullptr) {
    return "nothing there";
  }
  switch (value->kind()) {
    case json::kind::array:
      if (!IsShortRow(value->get_array())) {
        return "found an array of " + std::to_string(value->get_array().size());
      }
      break;
    case json::kind::object:
      return "found an object";
    default:
      break;
  }
  std::string text = ToText(*value);
  text.pop_back();  // the end of line
  if (text.size() > kMaxShown) {
    text = text.substr(0, kMaxShown) + "...";
  }
  return "found " + text;
}

std::string Show(double number) {
  std::string text = ToText(number);
  text.pop_back();
  return text;
}

std::string Between(const std::string& least, const std::string& most) {
  return " from " + least + " to " + most;
}

std::optional<double> AsNumber(const json::value& value) {
  return value.is_number() ? std::optional(value.to_number<double>()) : std::nullopt;
}

// A whole number, even if it is written as 3.0.
std::optional<int64_t> AsInteger(const json::value& value) {
  if (value.is_int64()) {
    return value.get_int64();
  }
  const bool whole = value.is_double() && std::fabs(value.get_double()) < 1e15 &&
                     value.get_double() == std::trunc(value.get_double());
  return whole ? std::optional(static_cast<int64_t>(value.get_double())) : std::nullopt;
}

std::optional<int64_t> AsUm(const json::value& value) {
  const auto metres = AsNumber(value);
  return metres && std::fabs(*metres) <= kFarthestM
             ? std::optional(static_cast<int64_t>(std::llround(*metres * 1e6)))
             : std::nullopt;
}

// An array of `size` coordinates in metres as points.
std::optional<std::vector<field::PointUm>> AsPoints(const json::value& value, size_t size) {
  std::vector<int64_t> um;
  for (const json::value& item : value.is_array() ? value.get_array() : json::array()) {
    const auto one = AsUm(item);
    if (!one) {
      return std::nullopt;
    }
    um.push_back(*one);
  }
  if (um.size() != size) {
    return std::nullopt;
  }
  std::vector<field::PointUm> points;
  for (size_t i = 0; i < size; i += 2) {
    points.push_back({um[i], um[i + 1]});
  }
  return points;
}

std::optional<double> ParseNumber(std::string_view text) {
  double number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  const bool good = error == std::errc() && end == text.data() + text.size() && !text.empty();
  return good && std::isfinite(number) ? std::optional(number) : std::nullopt;
}

// Finds a key that an object has twice, at any depth; values are ignored.
class KeyCheck {
 public:
  static constexpr size_t max_object_size = SIZE_MAX;
  static constexpr size_t max_array_size = SIZE_MAX;
  static constexpr size_t max_key_size = SIZE_MAX;
  static constexpr size_t max_string_size = SIZE_MAX;

  using Code = json::error_code;
  static bool on_document_begin(Code& /*error*/) { return true; }
  static bool on_document_end(Code& /*error*/) { return true; }
  bool on_object_begin(Code& /*error*/) {
    keys_.emplace_back();
    return true;
  }
  bool on_object_end(size_t /*count*/, Code& /*error*/) {
    keys_.pop_back();
    return true;
  }
  static bool on_array_begin(Code& /*error*/) { return true; }
  static bool on_array_end(size_t /*count*/, Code& /*error*/) { return true; }
  bool on_key_part(json::string_view part, size_t /*size*/, Code& /*error*/) {
    key_ += part;
    return true;
  }
  bool on_key(json::string_view part, size_t /*size*/, Code& /*error*/) {
    key_ += part;
    if (!keys_.back().insert(key_).second && !twice) {
      twice = key_;
    }
    key_.clear();
    return true;
  }
  static bool on_string_part(json::string_view /*part*/, size_t /*size*/, Code& /*error*/) {
    return true;
  }
  static bool on_string(json::string_view /*part*/, size_t /*size*/, Code& /*error*/) {
    return true;
  }
  static bool on_number_part(json::string_view /*part*/, Code& /*error*/) { return true; }
  static bool on_int64(int64_t /*number*/, json::string_view /*text*/, Code& /*error*/) {
    return true;
  }
  static bool on_uint64(uint64_t /*number*/, json::string_view /*text*/, Code& /*error*/) {
    return true;
  }
  static bool on_double(double /*number*/, json::string_view /*text*/, Code& /*error*/) {
    return true;
  }
  static bool on_bool(bool /*value*/, Code& /*error*/) { return true; }
  static bool on_null(Code& /*error*/) { return true; }
  static bool on_comment_part(json::string_view /*part*/, Code& /*error*/) { return true; }
  static bool on_comment(json::string_view /*part*/, Code& /*error*/) { return true; }

  std::optional<std::string> twice;

 private:
  std::vector<std::set<std::string>> keys_;  // of the objects that are open
  std::string key_;
};

json::value ValueOf(std::string_view text) {
  json::array numbers;
  std::string_view rest = text;
  for (;;) {
    const size_t comma = std::min(rest.find(','), rest.size());
    const auto number = ParseNumber(rest.substr(0, comma));
    if (!number) {
      return json::string(text);
    }
    numbers.emplace_back(*number);
    if (comma == rest.size()) {
      break;
    }
    rest.remove_prefix(comma + 1);
  }
  return numbers.size() == 1 ? numbers.front() : json::value(std::move(numbers));
}

}  // namespace

bool Parameters::Names(std::string_view key, int64_t number, std::string_view name) const {
  const json::value* value = object_.if_contains(key);
  return value != nullptr &&
         (AsInteger(*value) == number || (value->is_string() && value->get_string() == name));
}

void Parameters::Note(Problem problem) {
  if (!problem_) {
    problem_ = std::move(problem);
  }
}

void Parameters::Expected(std::string_view key, std::string_view expected) {
  Note({Describe(object_.if_contains(key)), std::string(key), std::string(expected)});
}

std::optional<double> Parameters::Number(std::string_view key, double least, double most,
                                         std::optional<double> fallback) {
  const json::value* value = object_.if_contains(key);
  if (value == nullptr && fallback) {
    return fallback;
  }
  const auto number = value != nullptr ? AsNumber(*value) : std::nullopt;
  if (!number || *number < least || *number > most) {
    Expected(key, "a number" + Between(Show(least), Show(most)));
    return std::nullopt;
  }
  return number;
}

std::optional<int64_t> Parameters::Integer(std::string_view key, int64_t least, int64_t most,
                                           std::optional<int64_t> fallback) {
  const json::value* value = object_.if_contains(key);
  if (value == nullptr && fallback) {
    return fallback;
  }
  const auto number = value != nullptr ? AsInteger(*value) : std::nullopt;
  if (!number || *number < least || *number > most) {
    Expected(key, "a whole number" + Between(std::to_string(least), std::to_string(most)));
    return std::nullopt;
  }
  return number;
}

std::optional<std::string> Parameters::String(std::string_view key,
                                              std::optional<std::string> fallback) {
  const json::value* value = object_.if_contains(key);
  if (value == nullptr && fallback) {
    return fallback;
  }
  if (value == nullptr || !value->is_string()) {
    Expected(key, "a string");
    return std::nullopt;
  }
  return std::string(value->get_string());
}

std::optional<bool> Parameters::Boolean(std::string_view key, bool fallback) {
  const json::value* value = object_.if_contains(key);
  if (value == nullptr) {
    return fallback;
  }
  if (!value->is_bool()) {
    Expected(key, "true or false");
    return std::nullopt;
  }
  return value->get_bool();
}

std::optional<std::vector<int64_t>> Parameters::Integers(std::string_view key, size_t most) {
  const json::value* value = object_.if_contains(key);
  std::vector<int64_t> numbers;
  if (value == nullptr) {
    return numbers;
  }
  const std::string expected = "an array of at most " + std::to_string(most) + " whole numbers";
  if (!value->is_array() || value->get_array().size() > most) {
    Expected(key, expected);
    return std::nullopt;
  }
  for (const json::value& item : value->get_array()) {
    const auto number = AsInteger(item);
    if (!number) {
      Expected(key, expected);
      return std::nullopt;
    }
    numbers.push_back(*number);
  }
  return numbers;
}

std::optional<int64_t> Parameters::Metres(std::string_view key, double least_m,
                                          std::optional<double> fallback) {
  const auto metres = Number(key, least_m, kFarthestM, fallback);
  return metres ? std::optional(static_cast<int64_t>(std::llround(*metres * 1e6))) : std::nullopt;
}

std::optional<std::vector<field::PointUm>> Parameters::Points(std::string_view key, size_t most) {
  const json::value* value = object_.if_contains(key);
  std::vector<field::PointUm> points;
  bool good = value != nullptr && value->is_array() && !value->get_array().empty() &&
              value->get_array().size() <= most;
  for (size_t i = 0; good && i < value->get_array().size(); ++i) {
    const auto point = AsPoints(value->get_array()[i], 2);
    good = point.has_value();
    if (good) {
      points.push_back(point->front());
    }
  }
  if (!good) {
    Expected(key, "1 to " + std::to_string(most) + " points [x, y] in metres, within 1000 km");
    return std::nullopt;
  }
  return points;
}

std::optional<std::vector<field::PointUm>> Parameters::Corners(std::string_view key) {
  const json::value* value = object_.if_contains(key);
  auto points = value != nullptr ? AsPoints(*value, 4) : std::nullopt;
  if (!points) {
    Expected(key, "two opposite corners x, y, x, y in metres, within 1000 km");
  }
  return points;
}

void Parameters::AllowOnly(std::initializer_list<std::string_view> known) {
  for (const json::key_value_pair& member : object_) {
    const std::string_view name = member.key();
    if (std::find(known.begin(), known.end(), name) == known.end()) {
      std::string list;
      for (const std::string_view key : known) {
        list.append(list.empty() ? "one of " : ", ").append(key);
      }
      Note({"unknown key", std::string(name), list.empty() ? "no keys" : list});
    }
  }
}

std::variant<json::object, Problem> ObjectOf(
    const std::vector<std::pair<std::string, std::string>>& query) {
  json::object object;
  for (const auto& [name, value] : query) {
    if (object.contains(name)) {
      return Problem{"found twice", name, "each parameter once"};
    }
    object.emplace(name, ValueOf(value));
  }
  return object;
}

bool Refused(const Parameters& fields, const Respond& respond) {
  if (fields.problem()) {
    respond(Refuse(400, *fields.problem()));
  }
  return fields.problem().has_value();
}

std::function<void(const Status&)> Report(Respond respond) {
  return [respond = std::move(respond)](const Status& done) {
    respond(done.ok() ? Done() : Refuse(409, {done.error(), "", ""}));
  };
}

Response Done(json::object what) {
  what["done"] = true;
  return {.body = ToText(what)};
}

std::variant<json::object, Problem> ParseBody(std::string_view body) {
  if (body.empty()) {
    return json::object();
  }
  json::error_code error;
  json::value value = json::parse(body, error);
  if (error) {
    return Problem{"not JSON: " + error.message(), "body", "a JSON object"};
  }
  if (!value.is_object()) {
    return Problem{Describe(&value), "body", "a JSON object"};
  }
  // The parser uses the last of two values for a key, but it is unknown which one was meant.
  json::basic_parser<KeyCheck> keys{json::parse_options()};
  keys.write_some(false, body.data(), body.size(), error);
  if (keys.handler().twice) {
    return Problem{"found twice", *keys.handler().twice, "each key once"};
  }
  return std::move(value.get_object());
}

}  // namespace pheromone::web
