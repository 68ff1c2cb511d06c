// What the engine's four parts, robots, field, nets and tags (engine.h), have in common.
//
// A part is a value: it can be copied, and two with equal bytes (Save) behave alike. It has no
// clock, thread, socket or log; whatever else it may depend on is passed to each call. Its shape is
// the concept Part. For each of its events it has
//
//   Status Check(const Context&, const GoalSet&) const;            // whether Apply may be called
//   now void Apply(const Context&, const GoalSet&, const Output&);
//
// where Check takes, after Engine::Prepare, time that does not depend on the event's size. A part
// with messages (routes.h) has
//
//   Message Answer(const Context&, LinkIndex, const Message&) const;   // to one that changes
//   nothing Message Change(const Context&, LinkIndex, const Message&);         // and to one that
//   does
//
// for which the engine has checked opcode and length, and for a change that the robot said HELLO
// and that it is new.
#pragma once

#include <concepts>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "protocol/messages.h"
#include "server/base/bytes.h"
#include "server/base/result.h"
#include "server/core/engine/event.h"
#include "server/core/engine/robot_table.h"
#include "server/core/tags/store.h"

namespace pheromone::engine {

class TagEditor;

/// What a part may read besides itself.
struct Context {
  const SharedConfig& config;
  const RobotTable& robots;
  const tags::Store& tags;
  uint16_t epoch = 0;
  uint64_t sequence = 0;  ///< of the event that is being applied
  uint64_t now_ms = 0;    ///< field time
  int64_t utc_ms = 0;     ///< for display only; may jump
};

/// Where the effects of an event go.
struct Output {
  std::vector<Outgoing>* messages = nullptr;
  std::vector<field::FinishedWork>* finished = nullptr;
  TagEditor* tags = nullptr;  ///< for nets

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

/// A part's bytes at one moment, copied in portions while it changes.
class FrozenPart {
 public:
  virtual ~FrozenPart() = default;
  virtual uint64_t bytes() const = 0;
  /// Appends the next portion of about `tiles` tiles, which may be empty. False if none is left:
  /// all was copied, or it has failed.
  virtual bool CopySome(std::string* to, int tiles) = 0;
  /// Too much was changed meanwhile. The copied data is useless.
  virtual bool failed() const { return false; }
  /// Detaches from the part.
  virtual void LetGo() {}
};

/// All in one portion, for parts that are small.
class FrozenBytes final : public FrozenPart {
 public:
  template <typename T>
  explicit FrozenBytes(const T& part) {
    ByteWriter writer;
    part.Save(&writer);
    text_ = writer.Take();
    bytes_ = text_.size();
  }
  uint64_t bytes() const override { return bytes_; }
  bool CopySome(std::string* to, int /*tiles*/) override {
    *to += text_;
    return !std::exchange(text_, {}).empty();
  }

 private:
  std::string text_;
  uint64_t bytes_ = 0;
};

template <typename T>
concept Part = std::copyable<T> &&
    requires(T& part, const T& it, const Context& context, const EngineConfig& next,
             const ConfigPlan* plan, const Reconfiguration& change, const Output& out,
             uint64_t most_kept_bytes, ByteWriter* writer, ByteReader* reader) {
  // Whether it can continue with `next`. `plan` may be null.
  { it.CheckConfig(context, next, plan) } -> std::same_as<Status>;
  part.Configure(context, change, out);
  // Does a bounded portion of what is due; if more is, NextDeadline is in the past.
  part.Advance(context, out);
  { it.NextDeadline() } -> std::same_as<std::optional<uint64_t>>;
  // The sum over its objects of the hash of kind, key and canonical value.
  { it.Hash() } -> std::same_as<uint64_t>;
  // Canonical bytes: equal if and only if the states are.
  it.Save(writer);
  // Into a new part. Invalid bytes fail the reader; the configuration was checked.
  part.Restore(context, reader);
  // Save in portions; null if that cannot begin now.
  { it.Freeze(most_kept_bytes) } -> std::same_as<std::unique_ptr<FrozenPart>>;
};

}  // namespace pheromone::engine
