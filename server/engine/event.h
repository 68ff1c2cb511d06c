// The engine's events, and the messages that it sends. The events form the ordered log: state
// changes only in Engine::Apply(sequence, stamp, event), so the events determine the state.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "protocol/messages.h"
#include "server/base/bytes.h"
#include "server/base/fields.h"
#include "server/base/result.h"
#include "server/engine/goal.h"
#include "server/engine/robot_frame.h"
#include "server/field/config.h"
#include "server/field/edit.h"
#include "server/field/work.h"
#include "server/tags/plan.h"

namespace pheromone::engine {

/// When a batch of events happened, read once per batch under the engine's lock. Nothing inside the
/// engine reads a clock.
struct Stamp {
  uint64_t field_time_ms = 0;  ///< drives evaporation and deadlines; never decreases
  int64_t utc_ms = 0;          ///< for display only; may jump
};

/// The largest field time, 139 years (server/field/kernel.h).
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

/// The configuration of one component beyond the field and the robots, as that component encodes
/// it.
struct ComponentConfig {
  std::string component;  ///< Component::name
  uint8_t version = 1;    ///< of its bytes; the component's own
  std::string bytes;
  bool operator==(const ComponentConfig&) const = default;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("component", it.component);
    visit("version", it.version);
    visit("bytes", it.bytes);
  }
};

/// The part of the configuration that the state depends on, in integers.
struct EngineConfig {
  field::FieldConfig field;
  uint16_t pose_unit_10um = 100;
  std::vector<LinkSettings> links;
  std::vector<RobotFrame> frames;           ///< of robots whose coordinates are not the map's
  std::vector<ComponentConfig> components;  ///< ordered by name; only of those that have any
  bool operator==(const EngineConfig&) const = default;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("field", it.field);
    visit("pose_unit_10um", it.pose_unit_10um, AtLeast(1));
    visit("links", it.links);
    visit("frames", it.frames);
    visit("components", it.components);
  }

  /// Null if that component has none.
  const ComponentConfig* FindComponent(std::string_view name) const {
    for (const ComponentConfig& it : components) {
      if (it.component == name) {
        return &it;
      }
    }
    return nullptr;
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

/// The numbers of event kinds, in encoded events and exports; never reused for another kind. Those
/// from kFirstOfComponents on are ComponentEvents; their components define the numbers.
enum class EventKind : uint8_t {
  kRequestReceived = 1,
  kAdvance = 2,
  kConfigChanged = 3,
  kCommandIssued = 4,
  kFieldEdited = 5,
  kPoseObserved = 6,
  kGoalSet = 7,
  kGoalEnded = 8,
  kFirstOfComponents = 16,
};

/// An event of one component other than the field and the robots. Opaque to the engine.
struct ComponentEvent {
  EventKind kind = EventKind::kFirstOfComponents;
  uint8_t version = 1;  ///< of its bytes; the component's own
  std::string bytes;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("version", it.version);
    visit("bytes", it.bytes);
  }
};

using Event = std::variant<RequestReceived, Advance, ConfigChanged, CommandIssued, FieldEdited,
                           PoseObserved, GoalSet, GoalEnded, ComponentEvent>;
EventKind KindOf(const Event& event);

/// Encodes and decodes a component's event: a struct that describes its fields
/// (server/base/fields.h) and has kKind and kVersion. Errors: a later version, invalid bytes.
template <typename T>
ComponentEvent ToEvent(const T& content) {
  static_assert(T::kKind >= EventKind::kFirstOfComponents);
  ByteWriter writer;
  EncodeFields(content, &writer);
  return {T::kKind, T::kVersion, writer.Take()};
}
template <typename T>
Result<T> FromBytes(std::string_view what, uint8_t version, std::string_view bytes) {
  ByteReader reader(bytes);
  T content;
  if (version != T::kVersion) {
    reader.Fail("version " + std::to_string(version) + ", expected " + std::to_string(T::kVersion));
  }
  DecodeFields(&reader, &content);
  reader.ExpectEnd();
  reader.Check(CheckFields(content, ""));
  return reader.ok() ? Result<T>(std::move(content))
                     : Error{std::string(what) + ": " + reader.error()};
}

/// The source of a request, and its time: with this a link returns the answer to the source, unless
/// it comes too late. Neither logged nor recorded; opaque to the engine.
struct Asker {
  int64_t asked_ns = 0;     ///< when it was read, by the link's steady clock; 0: unknown
  uint32_t connection = 0;  ///< on a link with several
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
