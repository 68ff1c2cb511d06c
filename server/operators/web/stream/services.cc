#include "server/operators/web/stream/services.h"

#include <algorithm>
#include <array>
#include <utility>
#include <variant>

#include <boost/json/object.hpp>

#include "server/operators/control/json_text.h"
#include "server/operators/web/api/request_parameters.h"

namespace pheromone::web {
namespace {

namespace json = boost::json;

// Foxglove Studio refuses arrays of arrays, so the schemas do not name points_m, which they permit.
constexpr std::string_view kNothingSchema = R"({"type":"object","properties":{}})";
constexpr std::string_view kShapeSchema =
    R"({"type":"object","properties":{)"
    R"("pheromone":{"type":"string"},"all":{"type":"boolean"},)"
    R"("area_m":{"type":"array","items":{"type":"number"}},)"
    R"("radius_m":{"type":"number"}},"required":["pheromone"]})";
constexpr std::string_view kPathSchema =
    R"({"type":"object","properties":{)"
    R"("pheromone":{"type":"string"},)"
    R"("radius_m":{"type":"number"},"units":{"type":"number"},"add":{"type":"boolean"}},)"
    R"("required":["pheromone"]})";
constexpr std::string_view kCommandSchema =
    R"({"type":"object","properties":{)"
    R"("link":{"type":"string"},"id":{"type":"integer"},"command":{"type":"string"},)"
    R"("arguments":{"type":"array","items":{"type":"integer"}}},)"
    R"("required":["link","id","command"]})";
constexpr std::string_view kGoToSchema =
    R"({"type":"object","properties":{)"
    R"("link":{"type":"string"},"id":{"type":"integer"},"x_m":{"type":"number"},)"
    R"("y_m":{"type":"number"},"tolerance_m":{"type":"number"},"cancel":{"type":"boolean"}},)"
    R"("required":["link","id"]})";
constexpr std::string_view kCaptureSchema =
    R"({"type":"object","properties":{"action":{"type":"string","enum":["start","stop"]}},)"
    R"("required":["action"]})";
constexpr std::string_view kAnswerSchema =
    R"({"type":"object","properties":{"done":{"type":"boolean"}}})";

constexpr std::array<StreamService, 7> kServices = {{
    {1, "/snapshot", "/api/v1/snapshot", kNothingSchema},
    {2, "/capture", "/api/v1/capture", kCaptureSchema},
    {3, "/erase", "/api/v1/erase", kShapeSchema},
    {4, "/deposit", "/api/v1/paint", kPathSchema},
    {5, "/command", "/api/v1/command", kCommandSchema},
    {6, "/goto", "/api/v1/goto", kGoToSchema},
    {7, "/halt", "/api/v1/halt", kNothingSchema},
}};

constexpr std::string_view kBrush = "/brush";
constexpr std::string_view kClickedPoint = "/clicked_point";

PublishedRequest BrushRequest(const json::object& brush) {
  Parameters fields(brush);
  const bool erase = fields.Boolean("erase", false).value_or(false);
  fields.AllowOnly({"pheromone", "x_m", "y_m", "radius_m", "units", "erase"});
  if (!fields.Has("x_m") || !fields.Has("y_m")) {
    fields.Expected("x_m, y_m", "the position in metres");
  }
  if (fields.problem()) {
    return {"", "", fields.problem()->where + ": " + fields.problem()->expected};
  }
  json::object body;
  for (const char* key : {"pheromone", "radius_m", "units"}) {
    if (brush.contains(key) && !(erase && std::string_view(key) == "units")) {
      body[key] = brush.at(key);
    }
  }
  json::array points;  // clang 14 takes an array in braces for a copy of that array
  points.push_back(json::array{brush.at("x_m"), brush.at("y_m")});
  body["points_m"] = std::move(points);
  return {erase ? "/api/v1/erase" : "/api/v1/paint", ToText(body), ""};
}

PublishedRequest ClickRequest(const json::object& click, std::string_view pheromone) {
  const json::value* const point = click.if_contains("point");
  const json::object* const place = point != nullptr ? point->if_object() : nullptr;
  if (place == nullptr || !place->contains("x") || !place->contains("y")) {
    return {"", "", "expected a geometry_msgs/PointStamped: {\"point\": {\"x\": , \"y\": }}"};
  }
  return {"/api/v1/deposit",
          ToText(json::object{
              {"pheromone", pheromone}, {"x_m", place->at("x")}, {"y_m", place->at("y")}}),
          ""};
}

}  // namespace

std::span<const StreamService> StreamServices() {
  return kServices;
}

const StreamService* FindStreamService(uint32_t id) {
  const auto* const found = std::find_if(kServices.begin(), kServices.end(),
                                         [id](const StreamService& it) { return it.id == id; });
  return found != kServices.end() ? found : nullptr;
}

json::array DescribeServices() {
  json::array services;
  for (const StreamService& service : kServices) {
    const std::string name(service.name.substr(1));
    const auto side = [&name](const char* what, std::string_view schema) {
      return json::object{{"encoding", "json"},
                          {"schemaName", "pheromone." + name + what},
                          {"schemaEncoding", "jsonschema"},
                          {"schema", schema}};
    };
    services.push_back(json::object{{"id", service.id},
                                    {"name", service.name},
                                    {"type", "pheromone." + name},
                                    {"request", side(".request", service.schema)},
                                    {"response", side(".response", kAnswerSchema)},
                                    {"requestSchema", service.schema},
                                    {"responseSchema", kAnswerSchema}});
  }
  return services;
}

bool IsPublishTopic(std::string_view topic) {
  return topic == kBrush || topic == kClickedPoint;
}

PublishedRequest RequestOf(std::string_view topic, std::string_view payload,
                           std::string_view click_pheromone) {
  const auto parsed = ParseBody(payload);
  if (const Problem* problem = std::get_if<Problem>(&parsed)) {
    return {"", "", problem->what + "; expected " + problem->expected};
  }
  const json::object& object = std::get<json::object>(parsed);
  return topic == kBrush ? BrushRequest(object) : ClickRequest(object, click_pheromone);
}

}  // namespace pheromone::web
