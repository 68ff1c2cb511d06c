#include "server/operators/control/json_text.h"

#include <cmath>
#include <cstdint>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <boost/json/serialize.hpp>

#include "server/base/format.h"
#include "server/base/utf8.h"

namespace pheromone::web {
namespace {

namespace json = boost::json;

constexpr double kMaxWhole = 1e15;

// Whole numbers as such: the shortest of a million would be 1e+06.
void AppendDouble(double number, std::string* text) {
  if (!std::isfinite(number)) {
    *text += "null";
  } else if (number == std::trunc(number) && std::fabs(number) < kMaxWhole) {
    *text += ShortestText(static_cast<int64_t>(number));
  } else {
    *text += ShortestText(number);
  }
}

std::string Quoted(std::string_view text) {
  return json::serialize(json::string_view(WellFormed(text)));
}

// Our own answers are shallow; values in requests are nested at most 32 deep.
void Append(const json::value& value, std::string* text) {
  const char* before = "";
  switch (value.kind()) {
    case json::kind::object:
      *text += '{';
      for (const json::key_value_pair& member : value.get_object()) {
        text->append(before).append(Quoted(member.key())) += ':';
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
    case json::kind::string:
      *text += Quoted(value.get_string());
      break;
    case json::kind::int64:
      *text += ShortestText(value.get_int64());
      break;
    case json::kind::uint64:
      *text += ShortestText(value.get_uint64());
      break;
    case json::kind::double_:
      AppendDouble(value.get_double(), text);
      break;
    default:
      *text += json::serialize(value);
  }
}

}  // namespace

std::string WellFormed(std::string_view text) {
  std::string good;
  good.reserve(text.size());
  while (!text.empty()) {
    const Utf8Character it = FirstCharacter(text);
    if (it.state != Utf8Character::kValid) {
      good += "\xEF\xBF\xBD";
      text.remove_prefix(1);
    } else {
      good += text.substr(0, it.bytes);
      text.remove_prefix(it.bytes);
    }
  }
  return good;
}

std::string ToText(const json::value& value) {
  std::string text;
  Append(value, &text);
  text += '\n';
  return text;
}

std::string AuditLine(const control::Notice& notice, const std::string& time) {
  return ToText(boost::json::object{
      {"time", time}, {"who", notice.subject}, {"what", notice.text}, {"done", notice.is_on}});
}

}  // namespace pheromone::web
