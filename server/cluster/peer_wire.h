// What the daemons of a cluster tell each other: the messages, and their bytes. Nothing that safety
// rests on (replicated_log.h): a message may be lost with its connection, and none is repeated by
// this layer.
//
// A connection (peers.h) is encrypted and authenticated by TLS; inside of it, each direction is a
// sequence of frames:
//
//   u32 length     of what follows, 1 to kMaxPeerBytes
//   u8 type        the position in PeerMessage, from 0
//   the fields     in the order in which the message describes them (server/base/fields.h)
//
// Numbers are little-endian; texts and lists begin with their length, u32. Each message has exactly
// one encoding, and a frame is exactly as long as its message. A frame with another length, of an
// unknown type or with values that no message has ends the connection.
//
// The first frame of each direction is a Greeting, and no other frame is one. Its versions come
// first and will always be encoded like this; the rest may differ from version to version, and is
// not read if kPeerVersion differs. Two daemons talk if CheckGreeting finds nothing wrong, each
// with the other's greeting.
//
//   const std::string frame = EncodePeerMessage(Heartbeat{.term = 7, .leads = true}).value();
//   PeerFrames frames;
//   frames.Add(bytes);                                  // as they were received
//   Result<std::optional<PeerMessage>> next = frames.Next();   // until there is none
//
// What is about the state is in the engine's own structs: whether it may be applied is for the one
// who applies it. Pure; any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "protocol/messages.h"
#include "server/base/fields.h"
#include "server/base/result.h"
#include "server/cluster/heartbeat.h"
#include "server/core/engine/event.h"
#include "server/core/engine/event_codec.h"
#include "server/core/field/edit.h"
#include "server/core/field/edit_history.h"
#include "server/core/field/geometry.h"

namespace pheromone::cluster {

/// Of what this file describes, except the versions themselves.
constexpr uint8_t kPeerVersion = 3;
/// Of a frame, without its length. Longer messages are split by who makes them: PosesHeard,
/// StatePortion.
constexpr size_t kMaxPeerBytes = size_t{128} << 10;
/// Of what a message may hold a great many.
constexpr size_t kMaxPosesAtOnce = 2048;
constexpr size_t kMaxPortionBytes = size_t{64} << 10;

struct PeerVersions {
  uint8_t peers = kPeerVersion;
  uint8_t events = engine::kCodecVersion;
  std::string program{};  ///< "0.1.0"; told, not compared
  bool operator==(const PeerVersions&) const = default;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("peers", it.peers);
    visit("events", it.events);
    visit("program", it.program);
  }
};

/// Who is there.
struct Greeting {
  PeerVersions versions{};
  std::string cluster{};    ///< its configured name
  std::string node{};       ///< the sender's
  std::string id{};         ///< of the cluster (Page::id); empty: not yet known
  uint64_t links_hash = 0;  ///< config::LinksHash
  uint64_t instance = 0;    ///< of the process, random: tells a restart from a second node
  bool operator==(const Greeting&) const = default;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("versions", it.versions);
    visit("cluster", it.cluster);
    visit("node", it.node);
    visit("id", it.id);
    visit("links_hash", it.links_hash);
    visit("instance", it.instance);
  }
};

/// A robot's change, to the leader.
struct ForwardedRequest {
  engine::LinkIndex link = 0;
  protocol::Message message;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("link", it.link);
    visit("message", it.message);
  }
};

/// The answer to a forwarded request that has not become an event: a refusal, or the stored answer
/// to a repetition. All others follow from the log.
struct DirectAnswer {
  engine::LinkIndex link = 0;
  protocol::Message message;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("link", it.link);
    visit("message", it.message);
  }
};

/// What a follower has noticed, to the leader: a tracker's pose, a robot at its goal. Without an
/// answer.
struct ForwardedEvent {
  std::variant<engine::PoseObserved, engine::GoalEnded> event;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("event", it.event);
  }
};

/// Sends a robot to a point of the map (Service::SetGoal).
struct GoalRequest {
  engine::LinkIndex link = 0;
  uint8_t id = 0;
  field::PointUm point;
  uint32_t tolerance_um = 0;
  bool operator==(const GoalRequest&) const = default;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("link", it.link);
    visit("id", it.id);
    visit("point", it.point);
    visit("tolerance_um", it.tolerance_um);
  }
};

/// Cancels its goal (Service::CancelGoal).
struct GoalCancellation {
  engine::LinkIndex link = 0;
  uint8_t id = 0;
  bool operator==(const GoalCancellation&) const = default;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("link", it.link);
    visit("id", it.id);
  }
};

/// Control::ChangeTau.
struct TauChange {
  uint8_t type = 0;
  int64_t tau_ms = 0;
  bool operator==(const TauChange&) const = default;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("type", it.type);
    visit("tau_ms", it.tau_ms);
  }
};

/// Control::Reload: the leader rereads its own configuration.
struct ReloadRequest {
  template <typename Self, typename Visit>
  static void Fields(Self& /*it*/, Visit&& /*visit*/) {}
};

/// An operator's change, to the leader: what control::Control makes of the state.
struct OperatorChange {
  uint64_t number = 0;  ///< the sender's; comes back in the OperatorResult
  std::variant<engine::FieldEdited, engine::EditReversed, engine::CommandIssued, GoalRequest,
               GoalCancellation, engine::TagsChanged, engine::NetsChanged, engine::KeysRevoked,
               TauChange, ReloadRequest>
      change;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("number", it.number);
    visit("change", it.change);
  }
};

/// What became of it at the leader. Numbers that a kind of change has not are 0.
struct OperatorResult {
  uint64_t number = 0;
  bool ok = false;
  std::string text{};                ///< why not; of what was reversed, the pheromone's name
  int64_t nodes = 0;                 ///< Service::Applied
  uint64_t changed = 0;              ///< likewise
  uint64_t edit = 0;                 ///< likewise
  field::EditInfo info{};            ///< of what was reversed
  std::vector<std::string> notes{};  ///< of a reload: what requires a restart

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("number", it.number);
    visit("ok", it.ok);
    visit("text", it.text);
    visit("nodes", it.nodes);
    visit("changed", it.changed);
    visit("edit", it.edit);
    visit("info", it.info);
    visit("notes", it.notes);
  }
};

/// Halts all robots that are connected to the receiver, at once, without the log. Without an
/// answer.
struct HaltAll {
  template <typename Self, typename Visit>
  static void Fields(Self& /*it*/, Visit&& /*visit*/) {}
};

/// A pose in a query that the sender has answered by itself.
struct PoseHeard {
  engine::LinkIndex link = 0;
  uint8_t id = 0;
  protocol::WirePose pose;  ///< in the robot's own frame and units
  uint32_t age_ms = 0;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("link", it.link);
    visit("id", it.id);
    visit("x", it.pose.x);
    visit("y", it.pose.y);
    visit("heading", it.pose.heading);
    visit("age_ms", it.age_ms);
  }
};

/// Those since the last one, for all.
struct PosesHeard {
  std::vector<PoseHeard> poses;  ///< at most kMaxPosesAtOnce

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("poses", it.poses);
  }
};

/// Asks for a state, or for its next portion: one StatePortion answers. So a joiner is sent no more
/// than it can take, and a transfer ends when nobody asks for more.
struct StateRequest {
  uint64_t number = 0;  ///< of the transfer, the sender's
  uint64_t offset = 0;  ///< 0 begins one
  bool operator==(const StateRequest&) const = default;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("number", it.number);
    visit("offset", it.offset);
  }
};

struct StatePortion {
  uint64_t number = 0;
  uint64_t offset = 0;
  bool is_last = false;
  std::string bytes{};  ///< at most kMaxPortionBytes
  std::string error{};  ///< why there is no state to be had; empty: there is
  bool operator==(const StatePortion&) const = default;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("number", it.number);
    visit("offset", it.offset);
    visit("is_last", it.is_last);
    visit("bytes", it.bytes);
    visit("error", it.error);
  }
};

/// The order is that of the types' numbers.
using PeerMessage =
    std::variant<Greeting, Heartbeat, ForwardedRequest, DirectAnswer, ForwardedEvent,
                 OperatorChange, OperatorResult, HaltAll, PosesHeard, StateRequest, StatePortion>;

/// A whole frame. Errors: it would be longer than kMaxPeerBytes.
Result<std::string> EncodePeerMessage(const PeerMessage& message);

/// What a frame holds, after its length. Of a greeting with another kPeerVersion, only the versions
/// are read.
Result<PeerMessage> DecodePeerMessage(std::string_view frame);

/// What a stream of bytes holds. Its buffer is never larger than a frame and what one Add brings.
class PeerFrames {
 public:
  void Add(std::string_view bytes);
  /// The next message, or nothing until more bytes come. After an error, there is nothing more to
  /// be had from this stream.
  Result<std::optional<PeerMessage>> Next();

 private:
  std::string bytes_;
  size_t begin_ = 0;  // what is before was returned
};

/// Whether the sender of a greeting is one to talk to: a node of the same cluster with the same
/// links that speaks the same versions. Errors name both values, and of versions what to do.
Status CheckGreeting(const Greeting& own, const Greeting& theirs);

}  // namespace pheromone::cluster
