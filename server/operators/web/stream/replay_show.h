// What one viewer of a recording is shown: a player and a hub, without sockets, threads and clocks.
// Internal to this folder.
//
//   ReplayShow show({.folder = folder, .name = "lab.pcapng", ...});
//   while (show.Work(now_ms)) {}                        // or later, after others had their turn
//   for (const Update& update : show.Make(now_ms)) { offer it to the viewer }
//   for (StreamMessage& message : show.TakeNews()) { send it }
//
// It reads files; so not on a thread that requests or robots wait for.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/operators/playback/playback.h"
#include "server/operators/web/stream/conversation.h"
#include "server/operators/web/stream/hub.h"

namespace pheromone::web {

class ReplayShow {
 public:
  /// About so much of a file is replayed at once, in a millisecond or two.
  static constexpr uint64_t kPortionBytes = uint64_t{8} << 10;

  struct Options {
    std::string folder;
    std::string name;  ///< IsCaptureName
    /// The viewer knows PlaybackState; others are told of it once they have asked for something.
    bool knows_states = false;
  };
  ReplayShow(Options options, HubOptions hub);

  /// Does one portion of what is to be done; true: there is more.
  bool Work(uint64_t now_ms);

  /// What is due now. Nothing before the moment that is wanted is reached.
  std::vector<Update> Make(uint64_t now_ms);

  /// Null until it is known what the recording covers and how it begins.
  std::shared_ptr<const Catalogue> catalogue() const;
  /// The viewer has got the catalogue: it begins to play.
  void Begin();

  StreamMessage Take(const PlaybackRequest& request);
  /// What is to be told about it, once the viewer has the catalogue.
  std::vector<StreamMessage> TakeNews();

  /// Of the recording.
  uint64_t time_ns() const;
  Hub* hub() { return &hub_; }

 private:
  Views ViewsOf(const Needs& needs) const;

  const Options options_;
  Hub hub_;
  playback::Player player_;
  std::unique_ptr<playback::Playback> playback_;  // null during the survey
  std::shared_ptr<const Catalogue> empty_;        // if nothing of it can be replayed
  bool tells_states_;
  bool has_begun_ = false;
  std::optional<playback::State> first_state_;  // that is not yet told
  uint64_t generation_ = 0;
  std::string told_problem_;
};

}  // namespace pheromone::web
