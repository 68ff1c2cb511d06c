#include "server/operators/control/json_text.h"

#include <cmath>
#include <cstdint>
#include <optional>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <boost/json/serialize.hpp>

#include "server/base/format.h"

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

// The number of continuation bytes after the first byte of a character; empty if no character
// begins with it.
std::optional<size_t> Following(unsigned char first) {
  if (first < 0x80) {
    return 0;
  }
  if (first >= 0xC2 && first <= 0xDF) {  // C0 and C1 would be longer than needed
    return 1;
  }
  if (first >= 0xE0 && first <= 0xEF) {
    return 2;
  }
  return first >= 0xF0 && first <= 0xF4 ? std::optional<size_t>(3) : std::nullopt;
}

// The number of bytes of the first character of `text`; 0 if it is invalid. RFC 3629: neither
// overlong, nor a surrogate, nor beyond U+10FFFF.
size_t CharacterSize(std::string_view text) {
  const auto byte = [text](size_t i) { return static_cast<unsigned char>(text[i]); };
  const std::optional<size_t> following = Following(byte(0));
  if (!following || *following >= text.size()) {
    return 0;
  }
  for (size_t i = 1; i <= *following; ++i) {
    if ((byte(i) & 0xC0u) != 0x80) {
      return 0;
    }
  }
  const bool good = *following == 0 ||
                    (!(byte(0) == 0xE0 && byte(1) < 0xA0) && !(byte(0) == 0xED && byte(1) > 0x9F) &&
                     !(byte(0) == 0xF0 && byte(1) < 0x90) && !(byte(0) == 0xF4 && byte(1) > 0x8F));
  return good ? *following + 1 : 0;
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
    const size_t size = CharacterSize(text);
    if (size == 0) {
      good += "\xEF\xBF\xBD";
      text.remove_prefix(1);
    } else {
      good += text.substr(0, size);
      text.remove_prefix(size);
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
