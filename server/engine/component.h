// A part of the engine's state with the code that changes it: the robots, the field, the nets, the
// tags.
//
//   class Visits final : public Component { ... };
//   ComponentList components = StandardComponents();
//   components.emplace_back(std::make_unique<Visits>());
//   Engine engine(std::move(components));
//
// The engine keeps a list of components (components.h). It passes each request to the component of
// its opcode, each event to that of its kind, configurations and time to all of them in list order,
// and sums their hashes. A component is a value: it can be copied, and two with equal bytes (Save)
// behave alike. It has no clock, thread, socket or log; whatever else it may depend on is passed to
// each call.
//
// CONTRIBUTING.md, "A component", lists what else a new one needs.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/messages.h"
#include "server/base/bytes.h"
#include "server/base/polymorphic.h"
#include "server/base/result.h"
#include "server/engine/event.h"
#include "server/engine/robot_table.h"

namespace pheromone::engine {

/// A client message that a component answers.
struct MessageRule {
  enum class Effect : uint8_t {
    kReads,    ///< leaves the state as it is
    kChanges,  ///< DATA begins with a seq; done exactly once
    kHello,    ///< the robots' HELLO, which has rules of its own
    kAck,      ///< and the ACK of a command, which is not answered
  };

  uint8_t opcode = 0;
  protocol::LengthRule length{};  ///< of DATA
  Effect effect = Effect::kReads;

  /// Whether it is about the robot itself: only RobotsComponent has such messages.
  bool is_session() const { return effect == Effect::kHello || effect == Effect::kAck; }
};

/// What a message from a client asks for.
enum class Handling {
  kIgnore,  ///< never answered: an echo, an invalid robot ID, an old duplicate
  kAnswer,  ///< answered from the present state, which stays as it is
  kChange,  ///< must go through the log
};

/// As the protocol defines it. protocol::LengthOf must know `opcode`.
MessageRule MessageRuleOf(uint8_t opcode);

class Component;
using ComponentList = std::vector<Polymorphic<Component>>;

/// What a component may read besides itself.
struct Context {
  const SharedConfig& config;
  const RobotTable& robots;
  const ComponentList& components;  ///< FindIn
  uint16_t epoch = 0;
  uint64_t sequence = 0;  ///< of the event that is being applied
  uint64_t now_ms = 0;    ///< field time
  int64_t utc_ms = 0;     ///< for display only; may jump
};

/// Changes of other components that follow from an event.
class Consequences {
 public:
  virtual ~Consequences() = default;
  virtual Status Raise(const ComponentEvent& event) = 0;
};

/// Where the effects of an event go.
struct Output {
  std::vector<Outgoing>* messages = nullptr;
  std::vector<field::FinishedWork>* finished = nullptr;
  Consequences* consequences = nullptr;

  /// Makes a change of another component at once, as part of this event: it is not logged, since
  /// whoever applies the event makes it again. Errors: what that component's Check says; then
  /// nothing was changed.
  Status Raise(const ComponentEvent& event) const { return consequences->Raise(event); }

  void Send(const Context& context, LinkIndex link, const protocol::Message& message) const {
    messages->push_back({link, context.sequence, message});
  }
};

/// A change of the configuration; Context::config is the new one.
struct Reconfiguration {
  const EngineConfig* before = nullptr;  ///< null: this is the first one
  const ConfigPlan* plan = nullptr;      ///< Engine::Prepare; null at the first one
  /// Large changes are split between this and later Advances, in bounded time each.
  bool in_portions = false;
};

/// A component's bytes at one moment, copied in portions while it changes.
class FrozenPart {
 public:
  virtual ~FrozenPart() = default;
  virtual uint64_t bytes() const = 0;
  /// Appends the next portion of about `tiles` tiles, which may be empty. False if none is left:
  /// all was copied, or it has failed.
  virtual bool CopySome(std::string* to, int tiles) = 0;
  /// Too much was changed meanwhile. The copied data is useless.
  virtual bool failed() const { return false; }
  /// Detaches from the component.
  virtual void LetGo() {}
};

class Component {
 public:
  virtual ~Component() = default;
  virtual std::unique_ptr<Component> Clone() const = 0;

  /// Its key in the configuration.
  virtual std::string_view name() const = 0;

  /// What the engine routes here; called once.
  virtual std::vector<MessageRule> messages() const { return {}; }
  virtual std::vector<EventKind> event_kinds() const { return {}; }

  /// Whether it can continue with `next`. `plan` may be null.
  virtual Status CheckConfig(const Context& /*context*/, const EngineConfig& /*next*/,
                             const ConfigPlan* /*plan*/) const {
    return Ok();
  }
  virtual void Configure(const Context& /*context*/, const Reconfiguration& /*change*/,
                         const Output& /*out*/) {}

  /// The answer to a request that changes nothing, and to one that does. The engine has checked
  /// opcode and length, and for a change that the robot said HELLO and that it is new.
  virtual protocol::Message Answer(const Context& /*context*/, LinkIndex /*link*/,
                                   const protocol::Message& /*request*/) const {
    return {};
  }
  virtual protocol::Message Change(const Context& /*context*/, LinkIndex /*link*/,
                                   const protocol::Message& /*request*/) {
    return {};
  }

  /// For its event kinds: whether Apply may be called now. After Engine::Prepare, in time that does
  /// not depend on the event's size.
  virtual Status Check(const Context& /*context*/, const Event& /*event*/) const { return Ok(); }
  virtual void Apply(const Context& /*context*/, const Event& /*event*/, const Output& /*out*/) {}

  /// Does a bounded portion of what is due; if more is, NextDeadline is in the past.
  virtual void Advance(const Context& /*context*/, const Output& /*out*/) {}
  virtual std::optional<uint64_t> NextDeadline() const { return std::nullopt; }
  /// After each event, of whatever component: sees what it has changed elsewhere. Short.
  virtual void Notice(const Context& /*context*/) {}
  /// Whether a large change is in progress; Advance continues it.
  virtual bool busy() const { return false; }

  /// The sum over its objects of the hash of kind, key and canonical value.
  virtual uint64_t Hash() const = 0;
  /// Canonical bytes: equal if and only if the states are.
  virtual void Save(ByteWriter* writer) const = 0;
  /// Into a new component. Invalid bytes fail the reader; the configuration was checked.
  virtual void Restore(const Context& context, ByteReader* reader) = 0;
  /// Save in portions; null if that cannot begin now. By default, in one portion.
  virtual std::unique_ptr<FrozenPart> Freeze(uint64_t most_kept_bytes) const;
};

/// The component of that class; null if it is not in the list.
template <typename T>
const T* FindIn(const ComponentList& components) {
  for (const Polymorphic<Component>& it : components) {
    if (const auto* const found = dynamic_cast<const T*>(&*it)) {
      return found;
    }
  }
  return nullptr;
}

}  // namespace pheromone::engine
