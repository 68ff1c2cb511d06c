#include "server/web/http.h"

#include <algorithm>

#include <boost/json/object.hpp>

#include "server/web/json_text.h"

namespace pheromone::web {
namespace {

int HexDigit(char c) {
  if (c >= '0' && c <= '9') {
    return c - '0';
  }
  const char lower = static_cast<char>(c | 0x20);
  return lower >= 'a' && lower <= 'f' ? lower - 'a' + 10 : -1;
}

// In a query, '+' is a blank (as in HTML forms); in a path it is a plus sign.
std::optional<std::string> Decode(std::string_view text, bool is_query) {
  std::string decoded;
  for (size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '%') {
      const int high = i + 2 < text.size() ? HexDigit(text[i + 1]) : -1;
      const int low = i + 2 < text.size() ? HexDigit(text[i + 2]) : -1;
      if (high < 0 || low < 0) {
        return std::nullopt;
      }
      decoded += static_cast<char>(high * 16 + low);
      i += 2;
    } else {
      decoded += is_query && text[i] == '+' ? ' ' : text[i];
    }
  }
  return decoded;
}

}  // namespace

Response Refuse(int status, const Problem& problem) {
  const boost::json::object body{
      {"error",
       {{"what", problem.what}, {"where", problem.where}, {"expected", problem.expected}}}};
  return {.status = status, .body = ToText(body)};
}

std::optional<Target> ParseTarget(std::string_view target) {
  if (target.empty() || target.front() != '/') {
    return std::nullopt;
  }
  const size_t question = std::min(target.find('?'), target.size());
  const auto path = Decode(target.substr(0, question), false);
  if (!path) {
    return std::nullopt;
  }
  Target parsed{*path, {}};
  std::string_view rest = target.substr(std::min(question + 1, target.size()));
  while (!rest.empty()) {
    const size_t end = std::min(rest.find('&'), rest.size());
    const std::string_view pair = rest.substr(0, end);
    const size_t equals = std::min(pair.find('='), pair.size());
    const auto name = Decode(pair.substr(0, equals), true);
    const auto value = Decode(pair.substr(std::min(equals + 1, pair.size())), true);
    if (!name || !value) {
      return std::nullopt;
    }
    if (!pair.empty()) {
      parsed.query.emplace_back(*name, *value);
    }
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return parsed;
}

}  // namespace pheromone::web
