#include "server/web/api.h"

#include <algorithm>
#include <array>
#include <exception>
#include <optional>
#include <string_view>
#include <utility>
#include <variant>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>

#include "server/web/changing.h"
#include "server/web/fields.h"
#include "server/web/host.h"
#include "server/web/json_text.h"
#include "server/web/metrics.h"
#include "server/web/reading.h"
#include "server/web/views.h"

namespace pheromone::web {
namespace {

namespace json = boost::json;

constexpr std::string_view kBearer = "Bearer ";

Response Json(const json::value& value) {
  return {.body = ToText(value)};
}

using Read = Response (*)(const engine::Control&, Fields*);
using Change = Response (*)(engine::Control*, Fields*);

// A view without parameters.
template <typename View>
Response Plain(Fields* fields, View&& view) {
  fields->AllowOnly({});
  return fields->problem() ? Refuse(400, *fields->problem()) : Json(view());
}

Response ReadStatus(const engine::Control& control, Fields* fields) {
  const auto hash = fields->Integer("hash", 0, 1, 0);
  fields->AllowOnly({"hash"});
  return fields->problem() ? Refuse(400, *fields->problem())
                           : Json(ToJson(control.GetStatus(*hash != 0)));
}

Response ReadLinks(const engine::Control& control, Fields* fields) {
  return Plain(fields, [&] { return ToJson(control.GetLinks()); });
}

Response ReadClients(const engine::Control& control, Fields* fields) {
  return Plain(fields, [&] { return ToJson(control.GetClients()); });
}

Response ReadLaws(const engine::Control& control, Fields* fields) {
  return Plain(fields, [&] { return LawsToJson(control.GetField().config); });
}

Response ReadCapture(const engine::Control& control, Fields* fields) {
  return Plain(fields, [&] { return ToJson(control.GetCapture()); });
}

Response ReadConfig(const engine::Control& control, Fields* fields) {
  return Plain(fields, [&] {
    const std::vector<std::string> lines = control.GetConfig();
    return json::value(json::object{{"lines", json::array(lines.begin(), lines.end())}});
  });
}

Response ReadMetrics(const engine::Control& control, Fields* /*fields*/) {
  return {.content_type = kMetricsType, .body = Metrics(control)};
}

Response ReadHealth(const engine::Control& control, Fields* /*fields*/) {
  const Status health = control.CheckHealth();
  return health.ok() ? Json(json::object{{"healthy", true}})
                     : Refuse(503, {health.error(), "", "a log that takes changes"});
}

struct Route {
  std::string_view path;
  Read read = nullptr;
  Change change = nullptr;
};

constexpr std::array<Route, 17> kRoutes = {{
    {"/healthz", ReadHealth},
    {"/metrics", ReadMetrics},
    {"/api/v1/status", ReadStatus},
    {"/api/v1/links", ReadLinks},
    {"/api/v1/clients", ReadClients},
    {"/api/v1/laws", ReadLaws},
    {"/api/v1/config", ReadConfig},
    {"/api/v1/field", ReadField},
    {"/api/v1/sense", ReadSense},
    {"/api/v1/capture", ReadCapture, Capture},
    {"/api/v1/deposit", nullptr, Deposit},
    {"/api/v1/erase", nullptr, Erase},
    {"/api/v1/paint", nullptr, Paint},
    {"/api/v1/command", nullptr, Command},
    {"/api/v1/halt", nullptr, Halt},
    {"/api/v1/reload", nullptr, Reload},
    {"/api/v1/snapshot", nullptr, Snapshot},
}};

const Route* FindRoute(std::string_view path) {
  const auto* const found = std::find_if(kRoutes.begin(), kRoutes.end(),
                                         [path](const Route& it) { return it.path == path; });
  return found != kRoutes.end() ? found : nullptr;
}

// Takes as long for a wrong token as for the right one, wherever they differ.
bool SameSecret(std::string_view found, std::string_view secret) {
  unsigned difference = found.size() == secret.size() ? 0 : 1;
  for (size_t i = 0; i < secret.size(); ++i) {
    const char c = i < found.size() ? found[i] : '\0';
    difference |= static_cast<unsigned>(static_cast<unsigned char>(c ^ secret[i]));
  }
  return difference == 0;
}

// Nothing if the request may change things.
std::optional<Response> CheckAccess(const Request& request, const std::string& token) {
  if (request.local) {
    return std::nullopt;
  }
  if (!request.origin.empty() && request.origin != "http://" + request.host &&
      request.origin != "https://" + request.host) {
    return Refuse(403, {"the request comes from another web page, " + request.origin, "Origin",
                        "none, or that of this server"});
  }
  if (token.empty()) {
    return Refuse(403, {"this server takes no changes over the network", "web.token_file",
                        "the Unix socket, or a token in the configuration"});
  }
  const std::string_view found = request.authorization;
  if (!found.starts_with(kBearer) || !SameSecret(found.substr(kBearer.size()), token)) {
    Response refused = Refuse(401, {found.empty() ? "found no token" : "found a wrong token",
                                    "Authorization", "Bearer and the server's token"});
    refused.headers.emplace_back("WWW-Authenticate", "Bearer");
    return refused;
  }
  return std::nullopt;
}

Response WrongMethod(const Request& request, const Route& route) {
  std::string allowed = route.read != nullptr ? "GET, HEAD" : "";
  if (route.change != nullptr) {
    allowed += allowed.empty() ? "POST" : ", POST";
  }
  Response refused =
      Refuse(405, {"found method " + request.method.substr(0, 20), "method", allowed});
  refused.headers.emplace_back("Allow", allowed);
  return refused;
}

}  // namespace

Response Api::Handle(const Request& request) const {
  if (!request.local && !MeansThisServer(request.host, options_.hosts)) {
    return Refuse(421, {"this server is not known as " + request.host.substr(0, 100), "Host",
                        "localhost, an address, or a name from web.hosts in the configuration"});
  }
  const auto target = ParseTarget(request.target);
  if (!target) {
    return Refuse(400, {"the request's target is not a path", "target", "such as /api/v1/status"});
  }
  const Route* route = FindRoute(target->path);
  if (route == nullptr) {
    return Refuse(404, {"there is nothing at " + target->path.substr(0, 100), "target",
                        "such as /api/v1/status; pheromoned(8) has the list"});
  }
  const bool reads = request.method == "GET" || request.method == "HEAD";
  if (reads ? route->read == nullptr : request.method != "POST" || route->change == nullptr) {
    return WrongMethod(request, *route);
  }
  if (!reads) {
    if (auto refused = CheckAccess(request, options_.token)) {
      return *std::move(refused);
    }
  }
  const auto input = reads ? ObjectOf(target->query) : ParseBody(request.body);
  if (const Problem* problem = std::get_if<Problem>(&input)) {
    return Refuse(400, *problem);
  }
  Fields fields(std::get<json::object>(input));
  return reads ? route->read(*control_, &fields) : route->change(control_, &fields);
}

}  // namespace pheromone::web
