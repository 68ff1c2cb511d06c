// The services of the stream, and what viewers may publish: each is a request to the HTTP API, with
// the same body where that is possible. Values; any thread.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <boost/json/array.hpp>

#include "server/operators/web/stream/catalogue.h"

namespace pheromone::web {

struct StreamService {
  uint32_t id = 0;
  std::string_view name;    ///< "/erase"
  std::string_view target;  ///< of the POST request
  std::string_view schema;  ///< of the body: JSON Schema
};

std::span<const StreamService> StreamServices();
/// Null if there is none.
const StreamService* FindStreamService(uint32_t id);

/// As the message advertiseServices has them.
boost::json::array DescribeServices();

/// A message that a viewer published, as a request.
struct PublishedRequest {
  std::string target;
  std::string body;
  std::string problem;  ///< not empty: it is none
};
/// Topics: /brush, a JSON object {pheromone, x_m, y_m, radius_m, units, erase}, and /clicked_point,
/// a geometry_msgs/PointStamped in JSON, which deposits a quantum of `click_pheromone`.
bool IsPublishTopic(std::string_view topic);
PublishedRequest RequestOf(std::string_view topic, std::string_view payload,
                           std::string_view click_pheromone);

}  // namespace pheromone::web
