// What the stream shows: decides what is due, and makes each message once for all viewers. Without
// sockets, threads or clocks.
//
//   Hub hub(options);
//   if (const Needs needs = hub.Due(now); needs.any()) {
//     Views views = TakeViews(control, needs);          // on a thread that may take locks
//     for (const Update& update : hub.Make(views, now)) { offer it to the viewers }
//   }
//
// Nothing is made for a channel without subscribers. The control interface's views are taken under
// the service's lock, so not on a thread of low priority; everything else takes no lock for which a
// robot may wait, and may run on one.
//
// One thread at a time.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/formats/foxglove/pheromone_raster.h"
#include "server/operators/control/control.h"
#include "server/operators/control/scenes.h"
#include "server/operators/control/stream_counters.h"
#include "server/operators/web/stream/catalogue.h"

namespace pheromone::web {

/// Which views are to be taken.
struct Needs {
  bool field = false;
  bool clients = false;
  bool links = false;
  bool status = false;
  bool nets = false;
  bool tags = false;
  bool paths = false;
  bool any() const { return field || clients || links || status || nets || tags || paths; }
};

/// Copies, as of one moment each.
struct Views {
  Needs taken;
  control::FieldView field;
  std::vector<control::ClientView> clients;
  std::vector<control::LinkView> links;
  control::StatusView status;
  std::vector<control::NetView> nets;
  std::vector<control::TagView> tags;
  std::vector<field::Path> paths;
};

Views TakeViews(const control::Control& control, const Needs& needs);

/// The time, as far as the hub needs it.
struct StreamTime {
  uint64_t steady_ms = 0;  ///< of a clock that is never set
  uint64_t unix_ns = 0;
};

/// How a viewer keeps what it was offered and did not get yet.
enum class Keeping : uint8_t {
  kLatest,  ///< the latest frame
  kAll,     ///< all frames, up to a limit
  kTiles,   ///< nothing: what it has not got is made when it is sent (Hub::TilesSince)
};

/// Something new for the subscribers of a channel.
struct Update {
  uint32_t channel = 0;
  FramePtr frame;  ///< null: of tiles
};

struct HubOptions {
  std::string session;
  std::string ros_distro;
  std::string click_pheromone;               ///< empty: the first one
  const StreamCounters* counters = nullptr;  ///< may be null
  std::function<uint64_t()> now_us;          ///< what making pictures costs is measured with it
  /// Called between small pieces of work on pictures. Pauses that it makes are no cost.
  std::function<void()> between_pieces = [] {};
};

class Hub {
 public:
  explicit Hub(HubOptions options);
  ~Hub();

  /// What is needed for what is due.
  Needs Due(uint64_t now_ms) const;
  /// Makes it.
  std::vector<Update> Make(const Views& views, const StreamTime& now);

  /// What is shown is of a recording. Before the first Make.
  void SetRecording(ReplayedRecording recording) { recording_ = std::move(recording); }

  /// What comes next is of another time or field: nothing that was shown is compared with it, and
  /// everything is sent anew.
  void Forget();

  /// Null until the first Make. Another one after each change of the configuration.
  std::shared_ptr<const Catalogue> catalogue() const { return catalogue_; }

  /// One more subscriber of a channel, to which everything is sent anew, or one less.
  void AddSubscriber(uint32_t channel);
  void RemoveSubscriber(uint32_t channel);
  Keeping KeepingOf(uint32_t channel) const;
  bool IsPicture(uint32_t channel) const;

  /// What changed since a version of the tiles, and the present version. The same frame for all
  /// that ask for the same.
  struct Tiles {
    FramePtr frame;  ///< null: nothing
    uint64_t version = 0;
  };
  Tiles TilesSince(uint32_t channel, uint64_t since, uint64_t unix_ns);

  /// Events of the server, to be part of the next Make. The latest of them are also sent to new
  /// subscribers.
  void AddNotice(const control::Notice& notice, uint64_t unix_ns);
  /// What happened lately.
  std::vector<FramePtr> RecentEvents() const { return recent_events_; }

 private:
  enum class Kind : uint8_t {
    kGrid,
    kTiles,
    kRobots,
    kTrails,
    kObstacles,
    kTags,
    kGoals,
    kTransforms,
    kEvents,
    kEngine,
    kLink,
    kClients,
    kNets,
    kTagChanges,
    kStatus,
    kLaws,
    kTagList,
    kPaths,
  };
  struct State;
  struct Picture;

  void ForgetPictures();
  void Configure(const control::FieldView& view, const std::vector<control::LinkView>& links);
  void AddChannel(Kind kind, const std::string& topic, uint8_t type, const std::string& subject);
  State* Find(uint32_t channel);
  const State* Find(uint32_t channel) const;
  void UpdatePictures(const control::FieldView& view, const StreamTime& now,
                      std::vector<Update>* updates);
  std::optional<std::string> PayloadOf(const State& state, const Views& views,
                                       const StreamTime& now);
  void NoteRobotEvents(const std::vector<control::ClientView>& clients, uint64_t unix_ns);
  void AddEvent(const std::string& name, const std::string& text, bool is_warning,
                uint64_t unix_ns);

  const HubOptions options_;
  std::optional<ReplayedRecording> recording_;
  std::shared_ptr<const Catalogue> catalogue_;
  field::FieldConfig config_;
  std::vector<std::string> links_;
  std::map<std::string, uint32_t> ids_;  // of all topics that there ever were
  std::map<uint32_t, std::unique_ptr<State>> states_;
  std::map<uint8_t, std::unique_ptr<Picture>> pictures_;  // of pheromones with subscribers
  std::map<uint8_t, uint64_t> versions_;                  // of the pictures there were
  RobotScenes robots_;
  TagScenes tags_;
  EngineRates rates_;
  // The last one of each robot that has reported any; nothing: not yet looked.
  std::optional<std::map<std::string, protocol::EventReport>> robot_events_;
  std::vector<FramePtr> new_events_;
  std::vector<FramePtr> recent_events_;
  uint64_t configured_ms_ = 0;
};

}  // namespace pheromone::web
