// Base64 (RFC 4648, with padding), in which schemas are sent to viewers. Any thread.
#pragma once

#include <string>
#include <string_view>

namespace pheromone::foxglove {

std::string ToBase64(std::string_view bytes);

}  // namespace pheromone::foxglove
