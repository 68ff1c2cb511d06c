// The engine's events, and the messages that it sends. The events form the ordered log: state
// changes only in Engine::Apply(sequence, stamp, event), so the events determine the state.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "protocol/messages.h"
#include "server/base/bytes.h"
#include "server/base/fields.h"
#include "server/base/result.h"
#include "server/core/engine/goal.h"
#include "server/core/engine/revoked_keys.h"
#include "server/core/engine/robot_frame.h"
#include "server/core/field/config.h"
#include "server/core/field/edit.h"
#include "server/core/field/work.h"
#include "server/core/petri/live_rules.h"
#include "server/core/tags/plan.h"
#include "server/core/tags/settings.h"
#include "server/core/tags/symbols.h"

namespace pheromone::engine {

/// When a batch of events happened, read once per batch under the engine's lock. Nothing inside the
/// engine reads a clock.
struct Stamp {
  uint64_t field_time_ms = 0;  ///< drives evaporation and deadlines; never decreases
  int64_t utc_ms = 0;          ///< for display only; may jump
};

/// The largest field time, 139 years (server/core/field/kernel.h).
constexpr uint64_t kMaxFieldTimeMs = (uint64_t{1} << 42) - 1;

/// A link as the engine knows it: its name is half of a robot's key, its medium-access timing is
/// sent in HELLO answers.
struct LinkSettings {
  std::string name;
  uint8_t slot_ms = 1;
  uint8_t response_window_ms = 100;
  bool operator==(const LinkSettings&) const = default;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("name", it.name);
    visit("slot_ms", it.slot_ms);
    visit("response_window_ms", it.response_window_ms);
  }
};

/// The part of the configuration that the state depends on, in integers.
struct EngineConfig {
  field::FieldConfig field;
  uint16_t pose_unit_10um = 100;
  std::vector<LinkSettings> links;
  std::vector<RobotFrame> frames;  ///< of robots whose coordinates are not the map's
  tags::Settings tags;
  std::vector<petri::LiveSettings> nets;  ///< that are executed on the tags
  bool operator==(const EngineConfig&) const = default;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("field", it.field);
    visit("pose_unit_10um", it.pose_unit_10um, AtLeast(1));
    visit("links", it.links);
    visit("frames", it.frames);
    visit("tags", it.tags);
    visit("nets", it.nets);
  }
};

/// An immutable configuration that events, the engine and readers share.
class SharedConfig {
 public:
  SharedConfig() : SharedConfig(EngineConfig{}) {}
  SharedConfig(EngineConfig config)  // NOLINT(google-explicit-constructor): same meaning
      : config_(std::make_shared<const EngineConfig>(std::move(config))) {}

  const EngineConfig& operator*() const { return *config_; }
  const EngineConfig* operator->() const { return config_.get(); }
  /// The field's part; it keeps the whole configuration alive.
  std::shared_ptr<const field::FieldConfig> field() const { return {config_, &config_->field}; }
  /// Immediate if both share it.
  bool operator==(const SharedConfig& other) const {
    return config_ == other.config_ || *config_ == *other.config_;
  }

 private:
  std::shared_ptr<const EngineConfig> config_;
};

/// Computed from the whole configuration.
struct ConfigFigures {
  uint64_t hash = 0;
  uint64_t bytes = 0;  ///< when encoded
};
ConfigFigures FiguresOf(const EngineConfig& config);

/// What can be computed from a configuration and the previous one, without the state.
struct ConfigPlan {
  std::shared_ptr<const field::LayPlan> laying;
  /// Made for the state of a moment (Engine::Look), and useless in another one. Null: of none.
  std::shared_ptr<const tags::Plan> tags;
  ConfigFigures figures;
};

/// A link's index in EngineConfig::links.
using LinkIndex = uint16_t;

struct RequestReceived {
  LinkIndex link = 0;
  protocol::Message message;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("link", it.link);
    visit("message", it.message);
  }
};

/// Time has passed: work that is due is done, in one bounded step. Retries are sent, evaporated
/// pheromone is swept, diffusing pheromone makes a step.
struct Advance {
  template <typename Self, typename Visit>
  static void Fields(Self& /*it*/, Visit&& /*visit*/) {}
};

/// Where a log has the bytes of an event that is not yet appended (OrderedLog::WriteAhead).
struct WrittenAhead {
  uint64_t segment = 0;  ///< the number of the file
  uint64_t bytes = 0;
  uint32_t checksum = 0;
};

/// The first event of a new state, and every change of the configuration after it. `new_epoch` is
/// used if this begins an epoch: the state is new, what HELLO tells the clients has changed, or
/// acknowledged changes were lost. The map is changed by this and the Advances that follow, each in
/// bounded time.
struct ConfigChanged {
  SharedConfig config;
  uint16_t new_epoch = 1;
  bool state_lost = false;
  std::shared_ptr<const ConfigPlan> plan = nullptr;     ///< Engine::Prepare; not encoded
  std::shared_ptr<const WrittenAhead> ahead = nullptr;  ///< the log's; not encoded

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("new_epoch", it.new_epoch);
    visit("state_lost", it.state_lost);
    visit("config", it.config);
  }
};

/// An operator's command to a robot; id kBroadcastId: to all robots of the link (halt only).
struct CommandIssued {
  LinkIndex link = 0;
  uint8_t id = 0;
  protocol::CommandCode code = protocol::CommandCode::kHalt;
  std::array<uint8_t, protocol::kMaxCommandArguments> arguments{};

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("link", it.link);
    visit("id", it.id);
    visit("code", it.code);
    visit("arguments", it.arguments);
  }
};

/// An operator's edit of the map, made as above.
struct FieldEdited {
  field::FieldEdit edit;
  std::shared_ptr<const field::Raster> raster = nullptr;  ///< Engine::Prepare; not encoded

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("edit", it.edit);
  }
};

/// A tracker, such as a camera above the floor or a satellite receiver, reports where a robot is.
/// For `valid_ms` of field time this replaces the pose that the robot itself reports; 0 withdraws
/// the tracker's previous report.
struct PoseObserved {
  LinkIndex link = 0;
  uint8_t id = 0;
  field::PoseUm pose;  ///< in map coordinates, whatever the robot's own frame; may be off the map
  uint32_t valid_ms = 1000;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("link", it.link);
    visit("id", it.id);
    visit("pose", it.pose);
    visit("valid_ms", it.valid_ms);
  }
};

/// An operator sends a robot to a point of the map (goal.h). Replaces the goal that it had.
struct GoalSet {
  LinkIndex link = 0;
  uint8_t id = 0;
  Goal goal;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("link", it.link);
    visit("id", it.id);
    visit("goal", it.goal);
  }
};

/// The end of a robot's goal: it was seen there, and is halted; or an operator cancelled it.
struct GoalEnded {
  LinkIndex link = 0;
  uint8_t id = 0;
  bool reached = false;
  field::PointUm position;  ///< of the robot, if it was reached

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("link", it.link);
    visit("id", it.id);
    visit("reached", it.reached);
    visit("position", it.position);
  }
};

/// A block is written.
struct TagWrite {
  static constexpr std::string_view kName = "write";
  uint16_t tag = 0;
  std::optional<uint8_t> slot{};       ///< none: the drop policy chooses
  std::optional<uint16_t> expected{};  ///< the generation, as in tags::WriteRequest
  bool is_state = false;
  uint32_t lease_ms = 0;
  tags::Block block{};  ///< of any author; time 0: now

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("tag", it.tag);
    visit("slot", it.slot);
    visit("expected", it.expected);
    visit("is_state", it.is_state);
    visit("lease_ms", it.lease_ms, Within(0, tags::kMaxLeaseMs));
    visit("block", it.block);
  }
};

/// A block is erased, whoever wrote it.
struct TagErase {
  static constexpr std::string_view kName = "erase";
  uint16_t tag = 0;
  uint8_t slot = 0;
  std::optional<uint16_t> expected{};

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("tag", it.tag);
    visit("slot", it.slot);
    visit("expected", it.expected);
  }
};

/// A row of the symbol tables is added.
struct SymbolDefinition {
  static constexpr std::string_view kName = "define";
  tags::Row row{tags::RowKind::kRobot, 1, 1, {}};

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("row", it.row);
  }
};

/// What one maker has defined is removed from the symbol tables, except what is in use.
struct SymbolRemoval {
  static constexpr std::string_view kName = "forget";
  tags::Maker maker{};

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("maker", it.maker);
  }
};

/// An operator's change of the tags.
struct TagsChanged {
  using Write = TagWrite;
  using Erase = TagErase;
  using Define = SymbolDefinition;
  using Forget = SymbolRemoval;

  std::variant<Write, Erase, Define, Forget> change;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("change", it.change);
  }
};

/// An operator's change of a net: it begins anew, with all robots where they were at first. What
/// robots have left on its tags is erased.
struct NetsChanged {
  std::string net;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("net", it.net);
  }
};

/// An operator undoes the last edit of the map that is not yet undone, or redoes the one undone
/// last (server/core/field/edit_history.h). Made as above.
struct EditReversed {
  bool redo = false;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("redo", it.redo);
  }
};

/// An operator revokes keys of robots, such as a lost robot's: no link takes them from now on,
/// whatever the files with the keys have.
struct KeysRevoked {
  std::vector<RevokedKey> keys;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("keys", it.keys);
  }
};

using Event =
    std::variant<RequestReceived, Advance, ConfigChanged, CommandIssued, FieldEdited, PoseObserved,
                 GoalSet, GoalEnded, TagsChanged, NetsChanged, EditReversed, KeysRevoked>;

/// The numbers of event kinds, in encoded events and exports; never reused for another kind. The
/// order is that of Event.
enum class EventKind : uint8_t {
  kRequestReceived = 1,
  kAdvance = 2,
  kConfigChanged = 3,
  kCommandIssued = 4,
  kFieldEdited = 5,
  kPoseObserved = 6,
  kGoalSet = 7,
  kGoalEnded = 8,
  kTagsChanged = 9,
  kNetsChanged = 10,
  kEditReversed = 11,
  kKeysRevoked = 12,
};
EventKind KindOf(const Event& event);

/// The source of a request, and its time: with this a link returns the answer to the source, unless
/// it comes too late. Neither logged nor recorded; opaque to the engine.
struct Asker {
  int64_t asked_ns = 0;       ///< when it was read, by the link's steady clock; 0: unknown
  uint32_t connection = 0;    ///< on a link with several
  bool is_forwarded = false;  ///< another server has heard it, and answers it
  uint32_t address_size = 0;
  std::array<uint8_t, 28> address{};  ///< on a link of datagrams: the socket address

  bool known() const { return asked_ns != 0; }
};

/// A message to be sent on a link, not before the change that it depends on is durable.
struct Outgoing {
  LinkIndex link = 0;
  uint64_t durable_at = 0;  ///< the log's sequence number that must be durable first
  protocol::Message message;
  Asker asker{};  ///< of answers only
};

}  // namespace pheromone::engine
