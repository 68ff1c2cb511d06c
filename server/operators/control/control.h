// The control interface: what an operator can query and change in a running server. HTTP
// (server/operators/web) uses only this interface; the daemon implements it over the service and
// the links.
//
//   const StatusView status = control->GetStatus(false);
//   control->Edit(edit, [](const Result<EditOutcome>& outcome) { ... });
//
// Views are copies, taken under the service's lock; the field itself is read through a FieldReader,
// which blocks nobody. Changes go through the ordered log like those of robots, and no thread waits
// for them: the caller is called back.
//
// Subscribers are notified of changes, without polling (notices.h).
//
// A callback is called exactly once, from any thread, perhaps before the function that it was given
// to returns; it must not block. An error means that nothing was changed, unless it says otherwise:
// a change that is not durable within some seconds is reported as "applied; not yet durable".
//
// Thread-safe: every function may be called from any thread. Times are field time in milliseconds
// unless their names say otherwise.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/result.h"
#include "server/core/engine/service/latency.h"
#include "server/core/engine/service/service.h"
#include "server/core/field/field.h"
#include "server/core/petri/live_net.h"
#include "server/operators/control/condition.h"
#include "server/operators/control/notices.h"

namespace pheromone::control {

/// The present recording, or the last one.
struct CaptureView {
  bool recording = false;
  std::string folder;    ///< where its files are
  std::string file;      ///< the present file, or the last; empty if there was none
  std::string error;     ///< why it stopped by itself; empty if it did not
  uint64_t files = 0;    ///< begun
  uint64_t bytes = 0;    ///< written
  uint64_t records = 0;  ///< recorded
  uint64_t lost = 0;     ///< records dropped because the disk was too slow
};

/// What one of several servers with one log (server/cluster) knows of them.
struct ClusterView {
  struct Peer {
    std::string node;
    bool up = false;
    std::string state;  ///< as text: its version, or why there is no connection
  };
  std::string name;          ///< of the cluster
  std::string node;          ///< this server's
  std::string role;          ///< "leads", "follows", "takes the lead", "catches up"
  std::string leader;        ///< the node that leads; empty: none is known
  uint64_t term = 0;         ///< its
  uint64_t committed = 0;    ///< the last event that a majority has, as far as is known here
  uint64_t behind = 0;       ///< events that are not applied here yet, though a peer knows them
  double heard_s = 0;        ///< time since the log was heard: how stale this server may be
  uint64_t elections = 0;    ///< how often the leader changed
  uint64_t fenced = 0;       ///< changes of this server that were refused, since another one led
  uint64_t forwarded = 0;    ///< messages that were passed to the leader
  uint64_t divergences = 0;  ///< states that were not the leader's, here or at others
  std::string trouble;       ///< with the engine of the log; empty: it responds
  std::string gap;           ///< why this server cannot follow the log; empty: it can
  std::string transfer;      ///< of a state between servers, as text; empty: none
  std::vector<Peer> peers;
};

/// The server as a whole.
struct StatusView {
  std::string version;
  double uptime_s = 0;
  uint64_t field_time_ms = 0;
  uint16_t epoch = 0;
  uint64_t sequence = 0;               ///< of the last event of the log
  uint64_t durable_sequence = 0;       ///< of the last durable event
  bool is_kept = false;                ///< there is a journal: what is durable outlives the server
  std::optional<uint64_t> state_hash;  ///< if requested: it may require a pass over a layer
  size_t links = 0;
  size_t links_up = 0;
  size_t robots = 0;  ///< that have said HELLO
  size_t nodes = 0;   ///< remembered, of all types that do not diffuse
  size_t tiles = 0;
  uint64_t field_bytes = 0;
  uint64_t field_limit_bytes = 0;
  engine::ServiceCounters service;
  engine::RobotCounters engine;
  tags::Figures tags;
  tags::Counters tag_counters;
  std::array<uint64_t, 128> requests_by_opcode{};
  engine::LatencyCounts latency;  ///< of batches of requests: waiting for the engine, and in it
  uint64_t resident_bytes = 0;    ///< of the process
  uint64_t open_descriptors = 0;
  double cpu_s = 0;
  CaptureView capture;
  std::optional<ClusterView> cluster;  ///< if it is one of several
  std::string warning;  ///< why the server is not healthy, see CheckHealth; empty: it is
};

/// A monotonic counter, with its name in snake_case and its description.
struct NamedCount {
  std::string_view name;
  std::string_view help;
  uint64_t count = 0;
  bool is_trouble = false;  ///< a loss, or a sign of one
  bool is_loss = false;     ///< a frame, a message or a connection was damaged, lost or refused
};

struct LinkView {
  /// Whether this server is the one that sends there: "serves", "standby" or "elsewhere".
  std::string role = "serves";
  std::vector<std::string> nodes;  ///< of a cluster, that can; empty: each has a link of its own
  std::string owner;               ///< that does; empty: none, or it is not known
  std::string name;
  std::string kind;     ///< "pty", "serial", "tcp"
  std::string address;  ///< empty while it is not known
  /// The absolute path for programs in other folders that open it; empty: it has none, such as a
  /// serial port that is found by its USB adapter's numbers.
  std::string terminal;
  bool up = false;
  std::string state;                     ///< as text: its address, or why it is down
  double since_s = 0;                    ///< time since it came up or went down
  std::string last_error;                ///< why it was down last; empty if it never was
  uint64_t failed_attempts = 0;          ///< to open it since it was last up; 0 while up
  std::optional<double> next_attempt_s;  ///< time until the next attempt, while it is down
  std::optional<double> silent_s;        ///< since the last byte was received; empty if none was
  bool silent = false;                   ///< up, but silent for longer than configured
  std::optional<double> byte_rate;       ///< capacity of the line in bytes per second, if limited
  double bytes_per_s = 0;                ///< both ways, over about the last ten seconds
  std::vector<NamedCount> counters;
  std::vector<uint8_t> revoked;  ///< robots of which a key in its file is revoked
};

/// What was reported where cameras and other trackers report poses.
struct TrackerView {
  struct Refusal {
    std::string reason;
    uint64_t count = 0;  ///< of lines
  };
  std::string name;
  std::string address;  ///< empty while it does not listen
  bool up = false;
  std::string state;  ///< as text: its address, or why it is down
  uint64_t datagrams = 0;
  uint64_t poses = 0;  ///< accepted
  std::vector<Refusal> refusals;
  std::string last_refusal;  ///< the reason and the line; empty if there was none
};

/// The configuration in effect.
struct ConfigView {
  std::vector<std::string> lines;  ///< in words
  std::string file;                ///< absolute; empty: the default configuration
  std::string journal;             ///< the folder, absolute; empty: the state is not kept
};

enum class PoseSource { kNone, kRobot, kTracker };

struct ClientView {
  std::string link;
  uint8_t id = 0;
  bool known = false;  ///< it has said HELLO in this epoch; else `robot` is empty, or of before
  engine::RobotState robot;
  engine::RobotTraffic traffic;
  std::optional<uint64_t> silent_ms;  ///< since its last message; nothing: not heard since a start
  PoseSource pose_source = PoseSource::kNone;
  field::PoseUm pose;                      ///< on the map, unless the source is kNone
  std::string follows;                     ///< the pheromone that it asked for last; may be empty
  std::optional<uint64_t> halt_of_all_ms;  ///< when all robots of its link were last told to halt
  RobotCondition condition;
};

/// What is needed to read the field.
struct FieldView {
  const field::Field* field = nullptr;  ///< lives as long as the server; for a FieldReader only
  field::FieldConfig config;            ///< at present, without paths and initial rasters
  uint64_t now_ms = 0;
};

/// What an edit did.
struct EditOutcome {
  uint64_t nodes = 0;    ///< of the map in the edit's shape; blocked ones are not changed
  uint64_t changed = 0;  ///< of them: their level is another one now
  uint64_t edit = 0;     ///< its ID, for the next part of it; 0: there is nothing to undo
};

/// What was undone or redone.
using ReverseOutcome = engine::Service::Reversed;

/// A virtual RFID tag with what is written on it.
struct TagView {
  tags::NamedTag content{};
  std::optional<tags::Place> place{};  ///< empty: it is no longer configured
  std::vector<uint8_t> privileged{};   ///< slots with blocks that are never dropped
  std::vector<double> lease_s{};       ///< of each slot, what is left of its lease; 0: none
};

/// Some of the tags.
struct TagPage {
  std::vector<TagView> tags;     ///< by number
  std::optional<uint16_t> next;  ///< the first number of the next page; empty: there is none
};

/// Some rows of the tags' symbol tables.
struct SymbolPage {
  std::vector<tags::Row> rows;
  std::vector<tags::Maker> makers;  ///< of each row
  size_t total = 0;                 ///< of all rows
};

/// A Petri net that the server executes.
struct NetView {
  petri::LiveNet net;
  uint64_t now_ms = 0;
};

class Control {
 public:
  using Done = std::function<void(const Status&)>;
  template <typename T>
  using DoneWith = std::function<void(const Result<T>&)>;

  Control() = default;
  Control(const Control&) = delete;
  Control& operator=(const Control&) = delete;
  virtual ~Control() = default;

  virtual StatusView GetStatus(bool with_hash) const = 0;
  virtual std::vector<LinkView> GetLinks() const = 0;
  virtual std::vector<TrackerView> GetTrackers() const = 0;
  /// All robots that have said HELLO or were heard, by link and ID; those of a link at one moment.
  virtual std::vector<ClientView> GetClients() const = 0;
  virtual FieldView GetField() const = 0;
  /// The predefined paths, with curves as polylines.
  virtual std::vector<field::Path> GetPaths() const = 0;
  virtual CaptureView GetCapture() const = 0;
  /// The tags from a number on, at most kTagsAtOnce.
  virtual TagPage GetTags(uint16_t first) const = 0;
  static constexpr size_t kTagsAtOnce = 256;
  virtual std::optional<uint16_t> FindTag(std::string_view name) const = 0;
  /// The rows from an index on, at most kRowsAtOnce.
  virtual SymbolPage GetSymbols(size_t first) const = 0;
  static constexpr size_t kRowsAtOnce = 1024;
  /// All nets, by name.
  virtual std::vector<NetView> GetNets() const = 0;
  virtual ConfigView GetConfig() const = 0;
  /// Whether changes are accepted at present and become durable; if not, why. Takes no lock that is
  /// held for long.
  virtual Status CheckHealth() const = 0;

  /// Notifies a listener of what happens from now on, without blocking anybody. Ask for the present
  /// state after this, so that nothing is missed in between.
  virtual std::unique_ptr<Subscription> Subscribe(ListenerOptions options) = 0;
  /// Notifies them, as of a change that an operator has made.
  virtual void Announce(const Notice& notice) = 0;

  /// Changes the map. Errors: the shape contains no node of the map; refusals of the engine.
  virtual void Edit(const field::FieldEdit& edit, DoneWith<EditOutcome> done) = 0;
  /// Undoes the last edit that is not yet undone, or redoes the one that was undone last: exactly,
  /// also after deposits (server/core/field/edit_history.h). Errors: there is none.
  virtual void Reverse(bool redo, DoneWith<ReverseOutcome> done) = 0;
  /// Sends a command to a robot; its outcome is in its ClientView. Errors: no such link or
  /// robot.
  virtual void Issue(std::string_view link, uint8_t id, protocol::CommandCode code,
                     std::span<const uint8_t> arguments, Done done) = 0;
  /// Sends a robot to a point of the map, around the obstacles; its goal is in its ClientView until
  /// it is there, when it is halted and subscribers are notified. Errors: no such link or robot,
  /// its position is unknown, the point is off the map or blocked, there is no route.
  virtual void SetGoal(std::string_view link, uint8_t id, field::PointUm point,
                       uint32_t tolerance_um, Done done) = 0;
  /// Errors: no such link; the robot has no goal.
  virtual void CancelGoal(std::string_view link, uint8_t id, Done done) = 0;
  /// Writes or erases a block, or defines a symbol. Errors: the tags' refusals.
  virtual void ChangeTags(const engine::TagsChanged& change, Done done) = 0;
  /// Begins a net anew. Errors: there is no such net.
  virtual void ChangeNets(const engine::NetsChanged& change, Done done) = 0;
  /// Revokes the keys of robots (engine::KeysRevoked), for good if there is a journal: the sessions
  /// of their links end, and robots with other keys begin new ones. `done` gets the links with
  /// these keys. Errors: no link has a key of one of the robots.
  virtual void RevokeKeys(std::span<const uint8_t> robots,
                          DoneWith<std::vector<std::string>> done) = 0;
  /// Halts all robots on all links, even while the log does not accept changes or the disk does not
  /// respond; no other request delays it. `done` gets the names of the links that this server
  /// sends on once the halt was passed to them; GetLinks tells which are down, and GetClients who
  /// stands: no robot acknowledges it.
  virtual void HaltAll(DoneWith<std::vector<std::string>> done) = 0;
  /// Changes the time constant of a pheromone's evaporation (PheromoneLaw::tau_ms) until the
  /// configuration is reread or the server restarts: its file stays as it is. Present levels go on
  /// from where they are. Errors: no such pheromone, it is a blend, it diffuses, the value is out
  /// of the range of its law.
  virtual void ChangeTau(uint8_t type, int64_t tau_ms, Done done) = 0;
  /// Rereads the configuration. `done` gets the settings that require a restart, or an error if
  /// nothing was changed.
  virtual void Reload(DoneWith<std::vector<std::string>> done) = 0;
  /// Makes a durable snapshot. `done` gets its name, nothing if the server keeps no journal.
  virtual void Snapshot(DoneWith<std::optional<std::string>> done) = 0;
  /// Starts a recording; calls `done` when its first file exists. Errors: one is in progress; no
  /// file can be created.
  virtual void StartCapture(Done done) = 0;
  /// Stops the recording; calls `done` when its last file is complete. Errors: none is in progress;
  /// not everything could be written.
  virtual void StopCapture(Done done) = 0;
  /// Lets another server of the cluster order the changes; `successor` may be empty. Errors: this
  /// is no cluster, this server does not lead, no such node.
  virtual void StepDown(std::string_view successor, Done done) {
    (void)successor;
    done(Error{"this server is not one of a cluster"});
  }
};

}  // namespace pheromone::control
