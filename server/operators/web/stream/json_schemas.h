// The JSON schemas of the stream's channels, for viewers to offer and plot what messages contain:
// those of the API's answers (openapi.json), in the little of JSON Schema that Foxglove reads: one
// type for each member, no references, no alternatives, and arrays of plain values or objects.
//
//   channel.schema = JsonSchemaOf("Clients", config);
//
// Any thread.
#pragma once

#include <string>
#include <string_view>

#include "server/core/field/config.h"

namespace pheromone::web {

/// `component` is that of the API, or "Link", "Engine", "TagChanges", which only the stream has;
/// the members of "Clients" that are named after pheromones are those of `config`.
std::string JsonSchemaOf(std::string_view component, const field::FieldConfig& config);

}  // namespace pheromone::web
