#include "server/operators/web/http.h"

#include <algorithm>

#include <boost/json/object.hpp>
#include <boost/url/pct_string_view.hpp>

#include "server/operators/control/json_text.h"

namespace pheromone::web {
namespace {

// In a query, '+' is a blank (as in HTML forms); in a path it is a plus sign.
std::optional<std::string> Decode(std::string_view text, bool is_query) {
  const auto checked = boost::urls::make_pct_string_view({text.data(), text.size()});
  return checked ? std::optional(checked->decode({is_query})) : std::nullopt;
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
