#include "server/operators/web/api/api.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <exception>
#include <optional>
#include <string_view>
#include <utility>
#include <variant>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>

#include "server/operators/control/json_text.h"
#include "server/operators/control/views.h"
#include "server/operators/web/api/capture_files.h"
#include "server/operators/web/api/metrics.h"
#include "server/operators/web/api/mutations.h"
#include "server/operators/web/api/nets.h"
#include "server/operators/web/api/openapi.h"
#include "server/operators/web/api/queries.h"
#include "server/operators/web/api/request_parameters.h"
#include "server/operators/web/api/tags.h"
#include "server/operators/web/api/ticket.h"
#include "server/operators/web/host.h"

namespace pheromone::web {
namespace {

namespace json = boost::json;

constexpr std::string_view kBearer = "Bearer ";

Response Json(const json::value& value) {
  return {.body = ToText(value)};
}

using Read = Response (*)(const control::Control&, Parameters*);
using Change = void (*)(control::Control*, Parameters*, Respond);

// A view without parameters.
template <typename View>
Response Plain(Parameters* fields, View&& view) {
  fields->AllowOnly({});
  return fields->problem() ? Refuse(400, *fields->problem()) : Json(view());
}

Response ReadStatus(const control::Control& control, Parameters* fields) {
  const auto hash = fields->Integer("hash", 0, 1, 0);
  fields->AllowOnly({"hash"});
  return fields->problem() ? Refuse(400, *fields->problem())
                           : Json(ToJson(control.GetStatus(*hash != 0)));
}

Response ReadLinks(const control::Control& control, Parameters* fields) {
  return Plain(fields, [&] { return ToJson(control.GetLinks()); });
}

Response ReadTrackers(const control::Control& control, Parameters* fields) {
  return Plain(fields, [&] { return ToJson(control.GetTrackers()); });
}

Response ReadClients(const control::Control& control, Parameters* fields) {
  return Plain(fields, [&] { return ToJson(control.GetClients()); });
}

Response ReadLaws(const control::Control& control, Parameters* fields) {
  return Plain(fields, [&] { return LawsToJson(control.GetField().config); });
}

Response ReadPaths(const control::Control& control, Parameters* fields) {
  return Plain(fields, [&] { return PathsToJson(control.GetPaths(), control.GetField().config); });
}

Response ReadCapture(const control::Control& control, Parameters* fields) {
  return Plain(fields, [&] { return ToJson(control.GetCapture()); });
}

Response ReadConfig(const control::Control& control, Parameters* fields) {
  return Plain(fields, [&] { return ToJson(control.GetConfig()); });
}

Response ReadMetrics(const control::Control& control, Parameters* /*fields*/) {
  return {.content_type = kMetricsType, .body = Metrics(control)};
}

Response ReadHealth(const control::Control& control, Parameters* /*fields*/) {
  const Status health = control.CheckHealth();
  return health.ok() ? Json(json::object{{"healthy", true}})
                     : Refuse(503, {health.error(), "",
                                    "a log that accepts changes and a disk that responds"});
}

Response ReadOpenApi(const control::Control& /*control*/, Parameters* fields) {
  fields->AllowOnly({});
  return fields->problem() ? Refuse(400, *fields->problem())
                           : Response{.body = std::string(OpenApiText())};
}

enum class Where {
  kAtOnce,       // on the thread that reads requests: short
  kLongWork,     // in that lane
  kPictures,     // Pictures does it
  kEvents,       // EventLog does it
  kFiles,        // in that lane
  kCaptureFile,  // in that lane, by SendCapture
  kTicket,       // a change that the API itself answers, at once
};

struct Route {
  std::string_view path;
  Where where = Where::kAtOnce;
  Read read = nullptr;
  Change change = nullptr;
};

constexpr std::string_view kHealth = "/healthz";
constexpr std::string_view kMetrics = "/metrics";
constexpr std::string_view kStatus = "/api/v1/status";
constexpr std::string_view kField = "/api/v1/field";
constexpr std::string_view kCommand = "/api/v1/command";
constexpr std::string_view kHalt = "/api/v1/halt";
constexpr std::string_view kUnlock = "/api/v1/unlock";
constexpr std::string_view kCaptureFile = "/api/v1/captures/";  // and the file's name

// Changes with a possibly long body are parsed on another thread; none waits for its completion.
constexpr auto kRoutes = std::to_array<Route>({
    {kHealth, Where::kAtOnce, ReadHealth},
    {kMetrics, Where::kLongWork, ReadMetrics},
    {kStatus, Where::kAtOnce, ReadStatus},
    {"/api/v1/links", Where::kAtOnce, ReadLinks},
    {"/api/v1/trackers", Where::kAtOnce, ReadTrackers},
    {"/api/v1/clients", Where::kLongWork, ReadClients},
    {"/api/v1/laws", Where::kAtOnce, ReadLaws, ChangeLaw},
    {"/api/v1/paths", Where::kLongWork, ReadPaths},
    {"/api/v1/config", Where::kLongWork, ReadConfig},
    {kField, Where::kPictures, nullptr},
    {"/api/v1/sense", Where::kAtOnce, ReadSense},
    {"/api/v1/capture", Where::kAtOnce, ReadCapture, Capture},
    {"/api/v1/captures", Where::kFiles, ListCaptures},
    {kCaptureFile, Where::kCaptureFile, nullptr},
    {"/api/v1/events", Where::kEvents, nullptr},
    {"/api/v1/obstacles", Where::kLongWork, ReadObstacles},
    {"/api/v1/openapi.json", Where::kAtOnce, ReadOpenApi},
    {"/api/v1/deposit", Where::kLongWork, nullptr, Deposit},
    {"/api/v1/erase", Where::kLongWork, nullptr, Erase},
    {"/api/v1/paint", Where::kLongWork, nullptr, Paint},
    {"/api/v1/undo", Where::kAtOnce, nullptr, Undo},
    {"/api/v1/redo", Where::kAtOnce, nullptr, Redo},
    {"/api/v1/tags", Where::kLongWork, ReadTags, ChangeTags},
    {"/api/v1/symbols", Where::kLongWork, ReadSymbols},
    {"/api/v1/nets", Where::kLongWork, ReadNets, ChangeNets},
    {kCommand, Where::kAtOnce, nullptr, Command},
    {"/api/v1/goto", Where::kAtOnce, nullptr, GoTo},
    {"/api/v1/revoke", Where::kLongWork, nullptr, RevokeKeys},
    {kHalt, Where::kAtOnce, nullptr, Halt},
    {kUnlock, Where::kAtOnce, nullptr, Unlock},
    {"/api/v1/ticket", Where::kTicket},
    {"/api/v1/reload", Where::kAtOnce, nullptr, Reload},
    {"/api/v1/snapshot", Where::kAtOnce, nullptr, Snapshot},
    {"/api/v1/step-down", Where::kAtOnce, nullptr, StepDown},
});

const Route* FindRoute(std::string_view path) {
  if (path.starts_with(kCaptureFile)) {
    path = kCaptureFile;
  }
  const auto* const found = std::find_if(kRoutes.begin(), kRoutes.end(),
                                         [path](const Route& it) { return it.path == path; });
  return found != kRoutes.end() ? found : nullptr;
}

// Empty if the request does not come from another server's web page. Without TLS a proxy may have
// ended it.
std::optional<Response> CheckOrigin(const Request& request) {
  const bool is_own = request.origin == "https://" + request.host ||
                      (!request.encrypted && request.origin == "http://" + request.host);
  if (!request.origin.empty() && !is_own) {
    return Refuse(403, {"the request comes from another web page, " + request.origin.substr(0, 100),
                        "Origin", "none, or that of this server"});
  }
  return std::nullopt;
}

// Empty if the answer may take the server long or be long: not for a page of somebody else, which
// could ask for many of them with a line of HTML each. A link that was followed is no such page.
std::optional<Response> CheckPage(const Request& request) {
  if (request.local) {
    return std::nullopt;
  }
  if (auto refused = CheckOrigin(request)) {
    return refused;
  }
  const bool is_foreign = request.fetch_site == "cross-site" || request.fetch_site == "same-site";
  return is_foreign && request.fetch_dest != "document"
             ? std::optional(Refuse(403, {"another web page has embedded this", "Sec-Fetch-Site",
                                          "none, or a page of this server"}))
             : std::nullopt;
}

// Empty if the request may make changes.
std::optional<Response> CheckAccess(const Request& request, const std::string& token) {
  if (request.local) {
    return std::nullopt;
  }
  if (auto refused = CheckOrigin(request)) {
    return refused;
  }
  if (token.empty()) {
    return Refuse(403, {"this server does not accept changes over the network", "web.token_file",
                        "its Unix socket, or token_file = \"web-token\" in [web], with which it "
                        "makes a token at its next start"});
  }
  const std::string_view found = request.authorization;
  if (!found.starts_with(kBearer) || !SameSecret(found.substr(kBearer.size()), token)) {
    Response refused = Refuse(401, {found.empty() ? "found no token" : "found an invalid token",
                                    "Authorization", "Bearer and the server's token"});
    refused.headers.emplace_back("WWW-Authenticate", "Bearer");
    return refused;
  }
  return std::nullopt;
}

bool CanChange(const Route& route) {
  return route.change != nullptr || route.where == Where::kTicket;
}

bool CanRead(const Route& route) {
  return route.read != nullptr || route.where == Where::kPictures ||
         route.where == Where::kEvents || route.where == Where::kCaptureFile;
}

// The hash of the state may have to read a whole layer.
bool IsShort(const Route& route, const Target& target) {
  return (route.where == Where::kAtOnce || route.where == Where::kEvents ||
          route.where == Where::kTicket) &&
         (route.path != kStatus || target.query.empty());
}

const Lane& LaneOf(const Route& route, const Lanes& lanes) {
  const bool is_file = route.where == Where::kFiles || route.where == Where::kCaptureFile;
  return is_file ? lanes.files : lanes.long_work;
}

// Commands have short bodies; a longer one is an error, which is reported by a thread that does not
// delay others.
constexpr size_t kMaxShortBody = 4096;

Response WrongMethod(const Request& request, const std::string& allowed) {
  Response refused =
      Refuse(405, {"found method " + request.method.substr(0, 20), "method", allowed});
  refused.headers.emplace_back("Allow", allowed);
  return refused;
}

std::string MethodsOf(const Route& route) {
  std::string allowed = CanRead(route) ? "GET, HEAD" : "";
  if (CanChange(route)) {
    allowed += allowed.empty() ? "POST" : ", POST";
  }
  return allowed;
}

// "web 192.0.2.7", "control socket uid 1000", "viewer 192.0.2.7".
std::string SourceOf(const Request& request) {
  const std::string door = request.of_viewer ? "viewer" : request.local ? "control socket" : "web";
  return request.client.empty() ? door : door + ' ' + request.client;
}

uint64_t UnixSeconds() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return static_cast<uint64_t>(std::chrono::duration_cast<std::chrono::seconds>(now).count());
}

uint64_t SteadyMs() {
  using std::chrono::milliseconds;
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  return static_cast<uint64_t>(std::chrono::duration_cast<milliseconds>(now).count());
}

// Of an error's body; if it is none, its status.
std::string WhyOf(const Response& response) {
  boost::system::error_code not_json;
  const json::value body = json::parse(response.body, not_json);
  const json::value* const what =
      not_json || !body.is_object() ? nullptr : body.as_object().if_contains("error");
  const json::value* const text =
      what == nullptr || !what->is_object() ? nullptr : what->as_object().if_contains("what");
  return text != nullptr && text->is_string() ? std::string(text->get_string())
                                              : "status " + std::to_string(response.status);
}

bool IsRead(const Request& request) {
  return request.method == "GET" || request.method == "HEAD";
}

}  // namespace

std::vector<Resource> Resources() {
  std::vector<Resource> all;
  all.reserve(std::size(kRoutes));
  for (const Route& route : kRoutes) {
    all.push_back({route.path, CanRead(route), CanChange(route)});
  }
  return all;
}

bool IsUrgent(const Request& request) {
  const std::string_view target = request.target;
  const std::string_view path = target.substr(0, target.find('?'));
  return path == kHealth || path == kHalt || path == kUnlock || path == kCommand;
}

Api::Api(control::Control* control, ApiOptions options, Lanes lanes)
    : control_(control),
      options_(std::move(options)),
      lanes_(std::move(lanes)),
      assets_(options_.web_root),
      pictures_(control_, &lanes_),
      events_(control_, lanes_.requests) {}

std::optional<Response> Api::CheckHost(const Request& request) const {
  if (request.local || MeansThisServer(request.host, options_.hosts)) {
    return std::nullopt;
  }
  return Refuse(421, {"unknown host name " + request.host.substr(0, 100), "Host",
                      "localhost, an IP address, or a name in web.hosts of the configuration"});
}

std::optional<Response> Api::CheckStream(const Request& request) const {
  if (auto refused = CheckHost(request)) {
    return refused;
  }
  return request.local || IsListed(request) ? std::nullopt : CheckOrigin(request);
}

bool Api::IsListed(const Request& request) const {
  return std::find(options_.origins.begin(), options_.origins.end(), request.origin) !=
         options_.origins.end();
}

Response Api::Ticket(Parameters* fields) const {
  fields->AllowOnly({});
  if (fields->problem()) {
    return Refuse(400, *fields->problem());
  }
  if (options_.token.empty()) {
    return Refuse(409, {"this server has no token to make tickets with", "web.token_file",
                        "token_file = \"web-token\" in [web]; the server makes the file"});
  }
  return Json(json::object{{"ticket", MakeTicket(options_.token, UnixSeconds())},
                           {"valid_s", kTicketSeconds}});
}

std::string Api::WhyReadOnly(const Request& request, const std::string& ticket) {
  if (IsTicket(ticket, options_.token, UnixSeconds())) {
    return {};
  }
  Request without_origin = request;
  without_origin.origin.clear();
  const auto refused = CheckAccess(without_origin, options_.token);
  if (!refused) {
    return {};
  }
  if (!ticket.empty() || !request.authorization.empty()) {  // otherwise it wants to see only
    TellRefusal(request.target, refused->status,
                ticket.empty() ? WhyOf(*refused) : "found an invalid ticket, or an old one",
                SourceOf(request));
  }
  return options_.token.empty()
             ? "this server does not accept changes over the network: with token_file in [web] it "
               "makes a token at its next start"
         : !ticket.empty()
             ? "found an invalid ticket, or an old one: this connection is read-only; "
               "pheromonectl ticket makes another one"
         : request.authorization.empty()
             ? "changes need a ticket: ws://HOST:PORT/?ticket=TICKET, made by pheromonectl ticket"
             : "found an invalid token: this connection is read-only";
}

void Api::ShowDashboard(const std::string& file, Request request, const Respond& respond) {
  if (!IsRead(request)) {
    respond(WrongMethod(request, "GET, HEAD"));
  } else if (!assets_.reads_disk()) {
    respond(assets_.Get(file, request));
  } else if (!RunIn(lanes_.long_work, [this, file, request = std::move(request), respond] {
               respond(assets_.Get(file, request));
             })) {
    respond(Busy());
  }
}

Respond Api::AndTell(std::string path, json::object body, std::string from, Respond respond) {
  return [this, path = std::move(path), body = std::move(body), from = std::move(from),
          respond = std::move(respond)](Response response) {
    if (response.status != 200) {
      TellRefusal(path, response.status, WhyOf(response), from);
      respond(std::move(response));
      return;
    }
    boost::system::error_code not_json;
    const json::value answer = json::parse(response.body, not_json);
    if (answer.is_object()) {
      if (const auto done = actions_.Note(path, body, answer.get_object(), from, SteadyMs())) {
        control_->Announce(*done);
      }
    }
    respond(std::move(response));
  };
}

void Api::TellRefusal(std::string_view path, int status, const std::string& why,
                      const std::string& from) {
  unauthorized_ += status == 401 || status == 403 ? 1 : 0;
  if (const auto refusal = actions_.NoteRefusal(path, status, why, from, SteadyMs())) {
    control_->Announce(*refusal);
  }
}

void Api::Handle(Request request, const Respond& respond) {
  if (auto refused = CheckHost(request)) {
    respond(*std::move(refused));
    return;
  }
  const auto target = ParseTarget(request.target);
  if (!target) {
    respond(Refuse(
        400, {"the request's target is not a path", "target", "a path such as /api/v1/status"}));
    return;
  }
  if (const auto file = Assets::FileOf(target->path)) {
    ShowDashboard(*file, std::move(request), respond);
    return;
  }
  const Route* route = FindRoute(target->path);
  if (route == nullptr) {
    respond(Refuse(404, {"there is no resource " + target->path.substr(0, 100), "target",
                         "a path such as /api/v1/status; see pheromoned(8)"}));
    return;
  }
  const bool reads = IsRead(request);
  if (reads ? !CanRead(*route) : request.method != "POST" || !CanChange(*route)) {
    respond(WrongMethod(request, MethodsOf(*route)));
    return;
  }
  auto refused = !reads ? CheckAccess(request, options_.token)
                 : IsShort(*route, *target) || IsListed(request) ? std::nullopt
                                                                 : CheckPage(request);
  if (refused) {
    if (!reads) {
      TellRefusal(target->path, refused->status, WhyOf(*refused), SourceOf(request));
    }
    respond(*std::move(refused));
    return;
  }
  const bool is_short = IsShort(*route, *target) && request.body.size() <= kMaxShortBody;
  auto serve = [this, route, reads, target = *target, request = std::move(request), respond] {
    auto input = reads ? ObjectOf(target.query) : ParseBody(request.body);
    if (const Problem* problem = std::get_if<Problem>(&input)) {
      if (!reads) {
        TellRefusal(target.path, 400, problem->what, SourceOf(request));
      }
      respond(Refuse(400, *problem));
      return;
    }
    json::object& object = std::get<json::object>(input);
    Parameters fields(object);
    if (route->where == Where::kTicket) {
      AndTell(target.path, object, SourceOf(request), respond)(Ticket(&fields));
    } else if (!reads) {
      route->change(control_, &fields, AndTell(target.path, object, SourceOf(request), respond));
    } else if (route->where == Where::kPictures) {
      pictures_.Show(request.target, std::move(object), respond);
    } else if (route->where == Where::kEvents) {
      respond(events_.Read(&fields));
    } else if (route->where == Where::kCaptureFile) {
      respond(
          SendCapture(*control_, target.path.substr(kCaptureFile.size()), request, lanes_.files));
    } else {
      Response response = route->read(*control_, &fields);
      if (route->path == kMetrics) {
        response.body += AccessMetrics(unauthorized_);
        response.body += options_.more_metrics ? options_.more_metrics() : "";
      }
      respond(std::move(response));
    }
  };
  if (is_short || route->where == Where::kPictures) {
    serve();
  } else if (!RunIn(LaneOf(*route, lanes_), std::move(serve))) {
    respond(Busy());
  }
}

}  // namespace pheromone::web
