// The HTTP API: routing and access control.
//
//   Api api(&control, {.token = "..."}, lanes);
//   api.Handle(request, [](Response response) { ... });
//
//   GET  /  /dashboard/...        the dashboard (assets.h)
//   GET  /healthz                 200 or 503
//   GET  /metrics                 Prometheus, text format 0.0.4
//   GET  /api/v1/status           hash = 1 adds the state hash
//   GET  /api/v1/links  trackers  clients  laws  paths  config  capture
//   GET  /api/v1/openapi.json     the description of all of them (openapi.json)
//   GET  /api/v1/field            a raster as JSON, CSV, .npy or PNG (pictures.h)
//   GET  /api/v1/obstacles
//   GET  /api/v1/sense            what a robot would sense at a position
//   GET  /api/v1/events           what has happened (event_log.h)
//   GET  /api/v1/captures         and captures/NAME: the recordings (capture_files.h)
//   POST /api/v1/ticket           for a viewer that makes changes (ticket.h)
//   POST /api/v1/deposit  erase  paint  undo  redo  command  halt  reload  snapshot  step-down
//                capture          (mutations.h)
//
// A GET is permitted to anyone who can connect, provided that its Host names this server (host.h).
// A POST must come over the Unix socket, or have "Authorization: Bearer TOKEN" and no Origin other
// than the server's own, so that no other web page can make a browser send it. Errors are {"error":
// {"what", "where", "expected"}}.
//
// Short requests are answered in Handle: a halt, a command, health and status wait only for other
// short requests. Longer ones go to one of the lanes, and are refused with 503 if that is full.
//
// Thread-safe: Handle may be called from any thread, and answers from any. Invalid input only ever
// gives an error response.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/operators/control/control.h"
#include "server/operators/web/api/event_log.h"
#include "server/operators/web/api/operator_actions.h"
#include "server/operators/web/api/pictures.h"
#include "server/operators/web/assets.h"
#include "server/operators/web/http.h"
#include "server/operators/web/lanes.h"

namespace pheromone::web {

struct ApiOptions {
  std::string token;                    ///< required for changes over TCP; empty: none permitted
  std::vector<std::string> hosts = {};  ///< further names of the server, in lower case
  /// Web pages of other servers that may open streams: "https://app.foxglove.dev".
  std::vector<std::string> origins = {};
  /// A folder with the dashboard; empty: the embedded one.
  std::string web_root = {};
  /// Further text for /metrics; empty: none.
  std::function<std::string()> more_metrics = {};
};

struct Resource {
  std::string_view path;  ///< if it ends with '/', a name follows
  bool can_get = false;
  bool can_post = false;
};

/// All that the API has.
std::vector<Resource> Resources();

/// Whether a request must be answered at once, however busy the server is: /healthz, halt,
/// command, and unlock, without which a browser can do neither.
bool IsUrgent(const Request& request);

class Api {
 public:
  /// `control` outlives the API, and the API whatever runs in the lanes.
  Api(control::Control* control, ApiOptions options, Lanes lanes = {});

  /// `respond` is called once, at once or later.
  void Handle(Request request, const Respond& respond);

  /// Why a stream that only tells may not be opened, or nothing: as for a GET, and no page of
  /// another server may unless it is listed, since browsers let those open WebSockets and read
  /// them.
  std::optional<Response> CheckStream(const Request& request) const;

  /// Why a viewer's connection may not make changes; empty: it may, by the request's token or by
  /// its ticket (ticket.h). Its Origin was checked before.
  std::string WhyReadOnly(const Request& request, const std::string& ticket);

 private:
  std::optional<Response> CheckHost(const Request& request) const;
  void ShowDashboard(const std::string& file, Request request, const Respond& respond);
  Response Ticket(Parameters* fields) const;
  bool IsListed(const Request& request) const;  // among the origins that may read
  /// Responds, and tells what has been done, or that it was refused.
  Respond AndTell(std::string path, boost::json::object body, std::string from, Respond respond);
  void TellRefusal(std::string_view path, int status, const std::string& why,
                   const std::string& from);

  control::Control* const control_;
  const ApiOptions options_;
  const Lanes lanes_;
  const Assets assets_;
  Pictures pictures_;
  EventLog events_;
  OperatorActions actions_;
  std::atomic<uint64_t> unauthorized_{0};
};

}  // namespace pheromone::web
