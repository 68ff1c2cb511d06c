// Where operators, browsers and Prometheus come in: HTTP (server/web) over the control interface,
// with threads of its own. One reads all requests and answers the short ones, a halt among them;
// one does what takes longer; one, which runs after all others, draws the map for viewers.
//
//   FrontDoor door(&control, config.control, config.web);
//   door.Open();      // what could not be opened is told in the log
//   ...
//   door.Close();     // before anything that the control interface speaks to goes
#pragma once

#include <memory>

#include "server/config/config.h"
#include "server/engine/control.h"

namespace pheromone::daemon {

class FrontDoor {
 public:
  /// `control` outlives it.
  FrontDoor(engine::Control* control, config::ControlSettings control_settings,
            config::WebSettings web_settings);
  FrontDoor(const FrontDoor&) = delete;
  FrontDoor& operator=(const FrontDoor&) = delete;
  ~FrontDoor();

  void Open();

  /// Answers what is being answered, and returns when all of its threads have ended. Before it,
  /// whatever else the control interface waits for has to end (LiveControl::Stop).
  void Close();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace pheromone::daemon
