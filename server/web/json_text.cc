#include "server/web/json_text.h"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <boost/json/serialize.hpp>

namespace pheromone::web {
namespace {

namespace json = boost::json;

constexpr double kMostWhole = 1e15;

template <typename Number>
void AppendNumber(Number number, std::string* text) {
  std::array<char, 32> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr;
  text->append(digits.data(), end);
}

// Whole numbers as such: the shortest of a million would be 1e+06.
void AppendDouble(double number, std::string* text) {
  if (!std::isfinite(number)) {
    *text += "null";
  } else if (number == std::trunc(number) && std::fabs(number) < kMostWhole) {
    AppendNumber(static_cast<int64_t>(number), text);
  } else {
    AppendNumber(number, text);
  }
}

// Our own answers are shallow; what a request holds is nested 32 deep at the most.
void Append(const json::value& value, std::string* text) {
  const char* before = "";
  switch (value.kind()) {
    case json::kind::object:
      *text += '{';
      for (const json::key_value_pair& member : value.get_object()) {
        text->append(before).append(json::serialize(member.key())) += ':';
        Append(member.value(), text);
        before = ",";
      }
      *text += '}';
      break;
    case json::kind::array:
      *text += '[';
      for (const json::value& item : value.get_array()) {
        *text += before;
        Append(item, text);
        before = ",";
      }
      *text += ']';
      break;
    case json::kind::int64:
      AppendNumber(value.get_int64(), text);
      break;
    case json::kind::uint64:
      AppendNumber(value.get_uint64(), text);
      break;
    case json::kind::double_:
      AppendDouble(value.get_double(), text);
      break;
    default:
      *text += json::serialize(value);
  }
}

}  // namespace

std::string ToText(const json::value& value) {
  std::string text;
  Append(value, &text);
  text += '\n';
  return text;
}

}  // namespace pheromone::web
