// The HTTP front end for operators, browsers and Prometheus: server/operators/web over the control
// interface, with threads of its own. One thread reads all requests and answers the short ones,
// including a halt; one processes long requests; the others, of low priority, draw the map, read
// recordings that are downloaded, serve the stream for viewers, replay recordings for them, and
// speak HTTPS.
//
//   HttpFrontEnd front_end(&control, config.control, config.web);
//   if (!front_end.Open()) ...   // a server that nobody can command does not start
//   ...
//   front_end.Close();     // before anything that the control interface uses is destroyed
#pragma once

#include <memory>

#include "server/config/config.h"
#include "server/operators/control/control.h"

namespace pheromone::daemon {

class HttpFrontEnd {
 public:
  /// `control` outlives it.
  HttpFrontEnd(control::Control* control, const config::ControlSettings& control_settings,
               config::WebSettings web_settings);
  HttpFrontEnd(const HttpFrontEnd&) = delete;
  HttpFrontEnd& operator=(const HttpFrontEnd&) = delete;
  ~HttpFrontEnd();

  /// False, and the reason is logged, if the control socket or the port cannot be had.
  bool Open();

  /// For new connections, if the front end was opened with another one. Any thread.
  void SetCertificate(const Certificate& certificate);

  /// Finishes the answers in progress, and returns when all of its threads have ended. Call
  /// LiveControl::Stop first, to end the other waits of the control interface.
  void Close();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace pheromone::daemon
