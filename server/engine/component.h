// One part of the engine's state together with what changes it: the robots, the field, later tags
// and nets.
//
//   class Visits final : public Component { ... };
//   Engine engine(With(StandardComponents(), std::make_unique<Visits>()));
//
// The engine keeps a list of components (components.h). It hands each request to the one that has
// its opcode, each event to the one that has its kind, configurations and the passage of time to
// all in the order of the list, and adds up their hashes. A component is a value: it can be copied,
// and two of equal bytes (Save) go on alike. It has no clock, thread, socket or log; all that it
// may depend on besides itself comes with each call.
//
// CONTRIBUTING.md, "Adding a component", says what else a new one needs.
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

/// A message of clients that a component answers.
struct Endpoint {
  enum class Effect : uint8_t {
    kReads,    ///< leaves the state as it is
    kChanges,  ///< DATA begins with a seq; done exactly once
    kSession,  ///< of the robots themselves: HELLO and ACK, which have rules of their own
  };

  uint8_t opcode = 0;
  protocol::LengthRule length{};  ///< of DATA
  Effect effect = Effect::kReads;
};

/// As the protocol has it. `opcode` is one that protocol::LengthOf knows.
Endpoint EndpointOf(uint8_t opcode);

/// What a component may look at besides itself.
struct Context {
  const SharedConfig& config;
  const RobotTable& robots;
  uint16_t epoch = 0;
  uint64_t sequence = 0;  ///< of the event that is being applied
  uint64_t now_ms = 0;    ///< field time
};

/// Where what an event causes is appended.
struct Output {
  std::vector<Outgoing>* messages = nullptr;
  std::vector<field::FinishedWork>* finished = nullptr;

  void Send(const Context& context, LinkIndex link, const protocol::Message& message) const {
    messages->push_back({link, context.sequence, message});
  }
};

/// A change of the configuration, which Context::config already is.
struct Reconfiguration {
  const EngineConfig* before = nullptr;  ///< null: this is the first one
  const ConfigPlan* plan = nullptr;      ///< Engine::Prepare; null at the first one
  /// Large changes are made by this and by the Advances that follow, in bounded time each.
  bool in_portions = false;
};

/// A component's bytes as they are at one moment, copied in portions while it goes on.
class FrozenPart {
 public:
  virtual ~FrozenPart() = default;
  virtual uint64_t bytes() const = 0;
  /// Appends the next portion, which may be empty, of about `tiles` tiles. False when there is
  /// none: all was copied, or it has failed.
  virtual bool CopySome(std::string* to, int tiles) = 0;
  /// Too much was changed meanwhile. What was copied is of no use.
  virtual bool failed() const { return false; }
  /// Leaves the component alone from now on.
  virtual void LetGo() {}
};

class Component {
 public:
  virtual ~Component() = default;
  virtual std::unique_ptr<Component> Clone() const = 0;

  /// In saved states and, where it has one, of its section of the configuration.
  virtual std::string_view name() const = 0;
  /// Of Save. Restore reads this one and all that were ever written.
  virtual uint8_t version() const = 0;

  /// Where the engine sends what; asked for once.
  virtual std::vector<Endpoint> endpoints() const { return {}; }
  virtual std::vector<EventKind> event_kinds() const { return {}; }

  /// Whether it can go on under `next`. `plan` may be null.
  virtual Status CheckConfig(const Context& /*context*/, const EngineConfig& /*next*/,
                             const ConfigPlan* /*plan*/) const {
    return Ok();
  }
  virtual void Configure(const Context& /*context*/, const Reconfiguration& /*change*/,
                         const Output& /*out*/) {}

  /// What answers a request that changes nothing, and what answers one that does. The engine has
  /// checked opcode and length, and for a change that the robot said HELLO and that it is new.
  virtual protocol::Message Answer(const Context& /*context*/, LinkIndex /*link*/,
                                   const protocol::Message& /*request*/) const {
    return {};
  }
  virtual protocol::Message Change(const Context& /*context*/, LinkIndex /*link*/,
                                   const protocol::Message& /*request*/) {
    return {};
  }

  /// Of the kinds that it named: whether Apply may be called now, in time that does not grow with
  /// the event's size where Engine::Prepare has been at it.
  virtual Status Check(const Context& /*context*/, const Event& /*event*/) const { return Ok(); }
  virtual void Apply(const Context& /*context*/, const Event& /*event*/, const Output& /*out*/) {}

  /// Does what is due, in a bounded portion; if more is, NextDeadline is in the past.
  virtual void Advance(const Context& /*context*/, const Output& /*out*/) {}
  virtual std::optional<uint64_t> NextDeadline() const { return std::nullopt; }

  /// The sum over its objects of the hash of kind, key and canonical value.
  virtual uint64_t Hash() const = 0;
  /// Canonical bytes: equal if and only if the states are.
  virtual void Save(ByteWriter* writer) const = 0;
  /// Into a component in which nothing ever was. What cannot be is a failure of the reader.
  virtual void Restore(const Context& context, uint8_t version, ByteReader* reader) = 0;
  /// Save in portions; null while that cannot begin. Unless a component is large, at once.
  virtual std::unique_ptr<FrozenPart> Freeze(uint64_t most_kept_bytes) const;
};

using ComponentList = std::vector<Polymorphic<Component>>;

}  // namespace pheromone::engine
