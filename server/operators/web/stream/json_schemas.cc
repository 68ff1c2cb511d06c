#include "server/operators/web/stream/json_schemas.h"

#include <algorithm>
#include <utility>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>
#include <boost/json/serialize.hpp>
#include <boost/json/value.hpp>

#include "server/operators/web/api/openapi.h"

namespace pheromone::web {
namespace {

namespace json = boost::json;

constexpr std::string_view kReference = "#/components/schemas/";
constexpr std::string_view kTagChanges =
    R"({"type":"object","properties":{"version":{"type":"integer"},)"
    R"("changed":{"type":"array","items":{"type":"string"}}}})";

const json::object& Components() {
  static const json::value description = json::parse(OpenApiText());
  return description.at("components").at("schemas").as_object();
}

// A schema that may be a reference to a component.
const json::object& Resolve(const json::object& schema) {
  const json::value* const reference = schema.if_contains("$ref");
  return reference == nullptr
             ? schema
             : Components()
                   .at(std::string_view(reference->as_string()).substr(kReference.size()))
                   .as_object();
}

// The first type that is not null; of an enumeration or a constant, that of its values.
std::string_view TypeOf(const json::object& schema) {
  const json::value* const type = schema.if_contains("type");
  if (type != nullptr && type->is_string()) {
    return type->get_string();
  }
  if (type != nullptr) {
    const json::array& types = type->as_array();
    const auto* const found = std::find_if(types.begin(), types.end(),
                                           [](const json::value& it) { return it != "null"; });
    return found != types.end() ? std::string_view(found->as_string()) : "";
  }
  const json::value* value = schema.if_contains("const");
  if (const json::value* const values = schema.if_contains("enum")) {
    value = &values->as_array().front();
  }
  return value == nullptr     ? ""
         : value->is_string() ? "string"
         : value->is_bool()   ? "boolean"
                              : "integer";
}

void AddMembers(const json::object& schema, json::object* members);

// Empty: viewers cannot read it.
json::object Simplify(const json::object& reference) {
  const json::object& schema = Resolve(reference);
  for (const char* const alternatives : {"anyOf", "oneOf"}) {
    if (const json::value* const found = schema.if_contains(alternatives)) {
      json::object members;  // of all of them
      for (const json::value& it : found->as_array()) {
        AddMembers(Resolve(it.as_object()), &members);
      }
      return members.empty() ? json::object{}
                             : json::object{{"type", "object"}, {"properties", std::move(members)}};
    }
  }
  const std::string_view type = TypeOf(schema);
  json::object simple{{"type", type}};
  if (const json::value* const description = schema.if_contains("description")) {
    simple["description"] = *description;
  }
  if (type == "object") {
    json::object members;
    AddMembers(schema, &members);
    simple["properties"] = std::move(members);
  } else if (type == "array") {
    const json::value* const items = schema.if_contains("items");
    json::object item = items != nullptr ? Simplify(items->as_object()) : json::object{};
    if (item.empty() || item.at("type") == "array") {
      return {};
    }
    simple["items"] = std::move(item);
  } else if (type.empty() || type == "null") {
    return {};
  }
  return simple;
}

void AddMembers(const json::object& schema, json::object* members) {
  const json::value* const properties = schema.if_contains("properties");
  if (properties == nullptr) {
    return;
  }
  for (const auto& [name, member] : properties->as_object()) {
    if (json::object simple = Simplify(member.as_object()); !simple.empty()) {
      members->insert_or_assign(name, std::move(simple));
    }
  }
}

json::object Numbers(std::initializer_list<const char*> names) {
  json::object members;
  for (const char* const name : names) {
    members[name] = json::object{{"type", "number"}};
  }
  return {{"type", "object"}, {"properties", std::move(members)}};
}

// The rates of EngineRates (server/operators/control/scenes.h).
json::object Engine() {
  json::object schema =
      Numbers({"uptime_s", "field_time_ms", "requests_per_s", "answers_per_s", "changes_per_s",
               "errors_per_s", "sequence", "durable_sequence", "robots", "nodes", "field_bytes",
               "field_limit_bytes", "resident_bytes", "cpu"});
  json::object& members = schema["properties"].as_object();
  members["latency_us"] = Numbers({"mean", "p50", "p90", "p99"});
  members["viewers"] = Numbers({"connected", "sent_frames", "sent_bytes", "dropped_frames"});
  return schema;
}

// What antennas sense is in the stream alone.
void AddAntennas(const field::FieldConfig& config, json::object* clients) {
  json::object pheromones;
  for (const field::PheromoneLaw& law : config.pheromones) {
    pheromones[law.name] = Numbers({"left", "right"});
  }
  json::object antennas{{"left", Numbers({"x_m", "y_m"})}, {"right", Numbers({"x_m", "y_m"})}};
  antennas["pheromones"] = json::object{{"type", "object"}, {"properties", std::move(pheromones)}};
  json::object& members = clients->at("properties").as_object();
  members.at("clients").at("items").at("properties").as_object()["antennas"] =
      json::object{{"type", "object"}, {"properties", std::move(antennas)}};
  members["field_time_ms"] = json::object{{"type", "integer"}};
}

}  // namespace

std::string JsonSchemaOf(std::string_view component, const field::FieldConfig& config) {
  if (component == "Engine") {
    return json::serialize(Engine());
  }
  if (component == "TagChanges") {
    return std::string(kTagChanges);
  }
  const bool is_link = component == "Link";  // one of Links
  json::object schema = Simplify(Components().at(is_link ? "Links" : component).as_object());
  if (is_link) {
    json::object link = schema.at("properties").at("links").at("items").as_object();
    schema = std::move(link);
  }
  if (component == "Clients") {
    AddAntennas(config, &schema);
  } else if (component == "Status") {  // and of /healthz
    schema.at("properties").as_object()["health"] =
        json::parse(R"({"type":"object","properties":{"healthy":{"type":"boolean"},)"
                    R"("problem":{"type":"string"}}})");
  }
  return json::serialize(schema);
}

}  // namespace pheromone::web
