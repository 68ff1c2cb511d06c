// What can happen to the engine, and what it sends in return. The events are the ordered log: state
// changes only in Engine::Apply(sequence, stamp, event), so whoever has the events has the state.
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
#include "server/engine/robot_frame.h"
#include "server/field/config.h"
#include "server/field/edit.h"
#include "server/field/work.h"

namespace pheromone::engine {

/// When a batch of events happened, read once per batch under the engine's lock. Nothing inside the
/// engine reads a clock.
struct Stamp {
  uint64_t field_time_ms = 0;  ///< drives evaporation and deadlines; never decreases
  int64_t utc_ms = 0;          ///< for display only; may jump
};

/// The field's times end here, after 139 years (server/field/kernel.h).
constexpr uint64_t kMaxFieldTimeMs = (uint64_t{1} << 42) - 1;

/// A link as the engine knows it: its name is half of a robot's key, its medium-access figures go
/// into HELLO answers.
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

/// The configuration of one component beyond the field and the robots, as that component writes it.
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
  uint16_t robots_per_link = 254;  ///< beyond it, the robot idle for longest is forgotten
  std::vector<LinkSettings> links;
  std::vector<RobotFrame> frames;           ///< of robots whose coordinates are not the map's
  std::vector<ComponentConfig> components;  ///< ordered by name; of those that need any
  bool operator==(const EngineConfig&) const = default;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("field", it.field);
    visit("pose_unit_10um", it.pose_unit_10um, AtLeast(1));
    visit("robots_per_link", it.robots_per_link, AtLeast(1));
    visit("links", it.links);
    visit("frames", it.frames);
    visit("components", it.components, Since(3));
  }

  /// Null if that component needs none.
  const ComponentConfig* FindComponent(std::string_view name) const {
    for (const ComponentConfig& it : components) {
      if (it.component == name) {
        return &it;
      }
    }
    return nullptr;
  }
};

/// A configuration that events, the engine and whoever looks at it share, and never change.
class SharedConfig {
 public:
  SharedConfig() : SharedConfig(EngineConfig{}) {}
  SharedConfig(EngineConfig config)  // NOLINT(google-explicit-constructor): as good as the thing
      : config_(std::make_shared<const EngineConfig>(std::move(config))) {}

  const EngineConfig& operator*() const { return *config_; }
  const EngineConfig* operator->() const { return config_.get(); }
  /// The field's part, which keeps all of it alive.
  std::shared_ptr<const field::FieldConfig> field() const { return {config_, &config_->field}; }
  /// In no time where both share it.
  bool operator==(const SharedConfig& other) const {
    return config_ == other.config_ || *config_ == *other.config_;
  }

 private:
  std::shared_ptr<const EngineConfig> config_;
};

/// What takes a look at the whole configuration.
struct ConfigFigures {
  uint64_t hash = 0;
  uint64_t bytes = 0;  ///< when encoded
};
ConfigFigures FiguresOf(const EngineConfig& config);

/// What can be worked out of a configuration, and the one before it, without the state.
struct ConfigPlan {
  std::shared_ptr<const field::LayPlan> laying;
  ConfigFigures figures;
};

/// A link's place in EngineConfig::links.
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

/// Time has passed: what is due is done, in one bounded step. Retries are sent, pheromone that has
/// evaporated is swept, what diffuses makes a step.
struct Advance {
  template <typename Self, typename Visit>
  static void Fields(Self& /*it*/, Visit&& /*visit*/) {}
};

/// Where a log has the bytes of an event that it has not been given yet (OrderedLog::WriteAhead).
struct WrittenAhead {
  uint64_t segment = 0;  ///< the number of the file
  uint64_t bytes = 0;
  uint32_t checksum = 0;
};

/// The first event of a new state, and every change of the configuration after it. `new_epoch` is
/// used if this begins an epoch: the state is new, what HELLO tells the clients has changed, or
/// changes that clients were told of were lost.
///
/// `in_portions`: what it changes on the map is done by this and the Advances that follow, each in
/// bounded time; else all at once, as by programs that wrote version 1 of this event.
struct ConfigChanged {
  SharedConfig config;
  uint16_t new_epoch = 1;
  bool state_lost = false;
  bool in_portions = true;
  std::shared_ptr<const ConfigPlan> plan = nullptr;     ///< Engine::Prepare; no part of the event
  std::shared_ptr<const WrittenAhead> ahead = nullptr;  ///< the log's; no part of the event

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("new_epoch", it.new_epoch);
    visit("state_lost", it.state_lost);
    visit("in_portions", it.in_portions, Since(2));
    visit("config", it.config);
  }
};

/// The operator wants a robot to do something; id kBroadcastId: all robots of the link (halt only).
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

/// The operator changed the map by hand. `in_portions`: as above.
struct FieldEdited {
  field::FieldEdit edit;
  bool in_portions = true;
  std::shared_ptr<const field::Raster> raster = nullptr;  ///< Engine::Prepare; no part of the event

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("edit", it.edit);
    visit("in_portions", it.in_portions, Since(2));
  }
};

/// Somebody else than the robot, a camera above the floor or a satellite receiver, says where it
/// is. For `valid_ms` of field time this takes the place of what the robot reports of itself; 0
/// takes back what was said before.
struct PoseObserved {
  LinkIndex link = 0;
  uint8_t id = 0;
  field::PoseUm pose;  ///< on the map, whatever the robot's own frame is; may lie off it
  uint32_t valid_ms = 1000;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("link", it.link);
    visit("id", it.id);
    visit("pose", it.pose);
    visit("valid_ms", it.valid_ms);
  }
};

/// The numbers of the kinds of events, in bytes and in exports; never used again for another kind.
/// Those from kFirstOfComponents on are ComponentEvents, whose numbers their components name.
enum class EventKind : uint8_t {
  kRequestReceived = 1,
  kAdvance = 2,
  kConfigChanged = 3,
  kCommandIssued = 4,
  kFieldEdited = 5,
  kPoseObserved = 6,
  kFirstOfComponents = 16,
};

/// Something that happens to one component beyond the field and the robots. The engine does not
/// look into it.
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
                           PoseObserved, ComponentEvent>;
EventKind KindOf(const Event& event);

/// The event of a component from a struct that describes its fields (server/base/fields.h) and has
/// kKind and kVersion; and back. The reader fails for bytes of a later version.
template <typename T>
ComponentEvent ToEvent(const T& content) {
  ByteWriter writer;
  EncodeFields(content, &writer);
  return {T::kKind, T::kVersion, writer.Take()};
}
template <typename T>
Result<T> FromBytes(std::string_view what, uint8_t version, std::string_view bytes) {
  ByteReader reader(bytes);
  T content;
  if (version > T::kVersion) {
    reader.Fail("version " + std::to_string(version) + ", expected at most " +
                std::to_string(T::kVersion));
  }
  DecodeFields(&reader, version, &content);
  reader.ExpectEnd();
  reader.Check(CheckFields(content, ""));
  return reader.ok() ? Result<T>(std::move(content))
                     : Error{std::string(what) + ": " + reader.error()};
}

/// Who asked, and when: by this a link sends an answer back to where it was asked for, and not when
/// nobody waits for it any longer. Neither logged nor recorded; the engine does not look at it.
struct Asker {
  int64_t asked_ns = 0;     ///< when it was read, by the link's steady clock; 0: nobody asked
  uint32_t connection = 0;  ///< on a link with several
  uint32_t address_size = 0;
  std::array<uint8_t, 28> address{};  ///< on a link of datagrams: the socket address

  bool known() const { return asked_ns != 0; }
};

/// A message to be sent on a link, not before the change it speaks of is durable.
struct Outgoing {
  LinkIndex link = 0;
  uint64_t durable_at = 0;  ///< the log's sequence number that must be durable first
  protocol::Message message;
  Asker asker{};  ///< of an answer; of nothing else
};

}  // namespace pheromone::engine
