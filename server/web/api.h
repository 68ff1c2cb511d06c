// The API: which request goes where, and who may ask for it.
//
//   Api api(&control, {.token = "..."}, lanes);
//   api.Handle(request, [](Response response) { ... });
//
//   GET  /healthz                 200 or 503
//   GET  /metrics                 Prometheus, text format 0.0.4
//   GET  /api/v1/status           hash = 1 adds the state hash
//   GET  /api/v1/links  clients  laws  config  capture
//   GET  /api/v1/field            a raster as JSON, CSV or PNG (pictures.h)
//   GET  /api/v1/sense            what a robot would smell somewhere
//   POST /api/v1/deposit  erase  paint  command  halt  reload  snapshot  capture   (changing.h)
//
// A GET is free to whoever can connect, and asks for this server and not for another that a name
// was borrowed of (host.h). A POST needs to come over the Unix socket, or to carry "Authorization:
// Bearer TOKEN" and no Origin but the server's own, so that no other web page can have the reader's
// browser send it. Errors are {"error": {"what", "where", "expected"}}.
//
// What is short is done in Handle: a halt, a command, health and status wait behind nothing but
// other short things. What takes longer goes to one of the lanes, and is refused with 503 where
// that is full.
//
// Thread-safe: Handle may be called from any thread, and answers from any. No input makes it fail
// otherwise than by an error response.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "server/engine/control.h"
#include "server/web/http.h"
#include "server/web/lanes.h"
#include "server/web/pictures.h"

namespace pheromone::web {

struct ApiOptions {
  std::string token;                    ///< what changes over TCP must carry; empty: there are none
  std::vector<std::string> hosts = {};  ///< further names of the server, in lower case
};

/// Whether a request is answered at once, and must be, however busy the server is: /healthz, halt
/// and command.
bool IsUrgent(const Request& request);

class Api {
 public:
  /// `control` outlives the API, and the API whatever runs in the lanes.
  Api(engine::Control* control, ApiOptions options, Lanes lanes = {});

  /// `respond` is called once, at once or later.
  void Handle(Request request, Respond respond);

 private:
  engine::Control* const control_;
  const ApiOptions options_;
  const Lanes lanes_;
  Pictures pictures_;
};

}  // namespace pheromone::web
