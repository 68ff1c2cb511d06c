// Reads the members of a JSON object one by one. The first invalid one is kept as the request's
// problem, with its place and what was expected; reading continues with empty values.
//
//   Parameters fields(object);
//   const auto x_m = fields.Number("x_m", -1e6, 1e6);
//   fields.AllowOnly({"x_m"});
//   if (Refused(fields, respond)) { return; }
//
// The query of a GET is read in the same way: ObjectOf makes an object of it.
#pragma once

#include <cstdint>
#include <functional>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <boost/json/object.hpp>
#include <boost/json/value.hpp>

#include "server/base/result.h"
#include "server/formats/maps/raster.h"
#include "server/operators/web/http.h"

namespace pheromone::web {

class Parameters {
 public:
  /// `object` outlives the reader.
  explicit Parameters(const boost::json::object& object) : object_(object) {}

  bool Has(std::string_view key) const { return object_.contains(key); }
  /// Whether the value of the key is this number or this name.
  bool Names(std::string_view key, int64_t number, std::string_view name) const;

  /// Each of these is nothing if the key has another value, or is missing without a fallback.
  std::optional<double> Number(std::string_view key, double least, double most,
                               std::optional<double> fallback = std::nullopt);
  std::optional<int64_t> Integer(std::string_view key, int64_t least, int64_t most,
                                 std::optional<int64_t> fallback = std::nullopt);
  std::optional<std::string> String(std::string_view key,
                                    std::optional<std::string> fallback = std::nullopt);
  std::optional<bool> Boolean(std::string_view key, bool fallback);
  /// At most `most` whole numbers; missing means none.
  std::optional<std::vector<int64_t>> Integers(std::string_view key, size_t most);
  /// Metres within 1000 km of the origin, rounded to micrometres.
  std::optional<int64_t> Metres(std::string_view key, double least_m,
                                std::optional<double> fallback = std::nullopt);
  /// [[x, y], ...] in metres, 1 to `most` of them.
  std::optional<std::vector<field::PointUm>> Points(std::string_view key, size_t most);
  /// [x, y, x, y] in metres: two opposite corners.
  std::optional<std::vector<field::PointUm>> Corners(std::string_view key);

  /// Reports each key that is not one of `known` as a problem.
  void AllowOnly(std::initializer_list<std::string_view> known);

  /// Notes a problem, unless there is one already.
  void Expected(std::string_view key, std::string_view expected);
  void Note(Problem problem);
  const std::optional<Problem>& problem() const { return problem_; }

 private:
  const boost::json::object& object_;
  std::optional<Problem> problem_;
};

/// Whether a problem was found; the request is refused then, with 400.
bool Refused(const Parameters& fields, const Respond& respond);

/// Answers with what became of a change: {"done": true}, or 409 and the error.
std::function<void(const Status&)> Report(Respond respond);
Response Done(boost::json::object what = {});

/// A query as an object: a value that parses as a number becomes one, numbers separated by commas
/// become an array, everything else is a string. A repeated name is a problem.
std::variant<boost::json::object, Problem> ObjectOf(
    const std::vector<std::pair<std::string, std::string>>& query);

/// A body as an object; an empty body has no members. A repeated key, at any depth, is a problem.
std::variant<boost::json::object, Problem> ParseBody(std::string_view body);

}  // namespace pheromone::web
