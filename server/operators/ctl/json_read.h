// Reading the server's JSON. A member that is missing or of another type reads as empty, so that
// the data of an older or newer server is shown as far as it is understood.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <boost/json/string.hpp>
#include <boost/json/value.hpp>

namespace pheromone::ctl {

/// A member of an object; null if there is none.
inline const boost::json::value& At(const boost::json::value& value, std::string_view key) {
  static const boost::json::value nothing;
  const boost::json::object* object = value.if_object();
  const boost::json::value* member = object != nullptr ? object->if_contains(key) : nullptr;
  return member != nullptr ? *member : nothing;
}

inline double NumberAt(const boost::json::value& value, std::string_view key) {
  const boost::json::value& member = At(value, key);
  return member.is_number() ? member.to_number<double>() : 0;
}

inline uint64_t CountAt(const boost::json::value& value, std::string_view key) {
  const double number = NumberAt(value, key);
  return number > 0 && number < 1.8e19 ? static_cast<uint64_t>(number) : 0;
}

inline std::string TextAt(const boost::json::value& value, std::string_view key) {
  const boost::json::value& member = At(value, key);
  return member.is_string() ? std::string(member.get_string()) : std::string();
}

inline bool FlagAt(const boost::json::value& value, std::string_view key) {
  const boost::json::value& member = At(value, key);
  return member.is_bool() && member.get_bool();
}

/// The text of a string, valid as long as the value; empty for anything else.
inline std::string_view TextOf(const boost::json::value& value) {
  const boost::json::string* text = value.if_string();
  return text != nullptr ? std::string_view{text->data(), text->size()} : std::string_view{};
}

/// The items of an array; none if there is no array.
inline const boost::json::array& ItemsAt(const boost::json::value& value, std::string_view key) {
  static const boost::json::array none;
  const boost::json::array* items = At(value, key).if_array();
  return items != nullptr ? *items : none;
}

/// Whether a link's port is at other servers of the cluster only (`on` in [[link]]).
inline bool IsElsewhere(const boost::json::value& link) {
  return TextAt(link, "role") == "elsewhere";
}

/// How many lines of a tracker's datagrams were refused.
inline uint64_t RefusalsOf(const boost::json::value& tracker) {
  uint64_t refused = 0;
  for (const boost::json::value& it : ItemsAt(tracker, "refusals")) {
    refused += CountAt(it, "count");
  }
  return refused;
}

}  // namespace pheromone::ctl
