// The description of the HTTP API, in OpenAPI 3.1 as JSON: openapi.json, which the program
// contains.
#pragma once

#include <string_view>

namespace pheromone::web {

std::string_view OpenApiText();

}  // namespace pheromone::web
