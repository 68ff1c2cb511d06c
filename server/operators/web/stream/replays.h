// Replays of the server's recordings for viewers: the same channels as the stream (stream.h), at
// ws://HOST:PORT/replay/NAME, with NAME as GET /api/v1/captures lists it.
//
//   Replays replays(&control, &api, options);
//   server.OnUpgrade("/replay/", replays.Handler());
//   std::thread thread([&] { replays.Run(); });   // of low priority
//   ...
//   replays.Stop();                               // then join
//
// Each viewer has a recording for itself, which it plays, pauses and seeks in with the messages of
// playback_messages.h; all times are those of the recording. It begins playing at once, for viewers
// that know no such messages. Nothing can be changed.
//
// All run on one thread of low priority, apart from the stream's, in portions of a few milliseconds
// each in turn. It takes no lock for which a robot may wait. Two things are not divided: restoring
// the recording's initial state and copying it, which takes time in proportion to the map's
// contents and holds up other replays.
//
// Memory: for each replay the recorded map, and copies of it to go back to
// (server/operators/playback). Access: as for the stream.
#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <string>

#include "server/operators/control/control.h"
#include "server/operators/control/stream_counters.h"
#include "server/operators/web/api/api.h"
#include "server/operators/web/upgrade.h"

namespace pheromone::web {

constexpr char kReplayFolder[] = "/replay/";

struct ReplayOptions {
  size_t max_replays = 4;  ///< at once; further ones are refused with 503
  std::string ros_distro = "humble";
  std::chrono::milliseconds write_patience{30'000};  ///< as of the stream
};

class Replays {
 public:
  /// `control` and `api` outlive it.
  Replays(control::Control* control, Api* api, ReplayOptions options);
  Replays(const Replays&) = delete;
  Replays& operator=(const Replays&) = delete;
  ~Replays();

  /// May be used as long as this exists.
  UpgradeHandler Handler();

  /// Returns after Stop.
  void Run();
  /// Closes all connections. Any thread.
  void Stop();

  const StreamCounters& counters() const;

 private:
  class Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace pheromone::web
