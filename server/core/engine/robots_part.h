// The robots: which of them said HELLO, exactly-once execution of their changes, the operator's
// commands with their retries, goals, and keys that are revoked.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "server/core/engine/part.h"
#include "server/core/engine/robot_table.h"
#include "server/core/engine/routes.h"

namespace pheromone::engine {

/// Totals for the operator. Not part of the state.
struct RobotCounters {
  uint64_t id_conflicts = 0;  ///< two nonces alternating under one ID
  uint64_t commands_unanswered = 0;
  uint64_t commands_unknown = 0;  ///< the robot restarted before it acknowledged
};

class RobotsPart {
 public:
  /// The intervals between a command's transmissions double from the first to the longest; after
  /// the last one the command is reported unanswered.
  static constexpr uint64_t kFirstRetryMs = 250;
  static constexpr uint64_t kLongestRetryMs = 4000;
  static constexpr uint8_t kCommandTransmissions = 6;
  /// The transmissions of a broadcast halt, and their interval. A resume waits for the last.
  static constexpr uint8_t kBroadcastTransmissions = 3;
  static constexpr uint64_t kBroadcastIntervalMs = 100;

  const RobotTable& table() const { return table_; }
  void ForgetAsMutant(LinkIndex link, uint8_t id) { table_.ForgetAsMutant(link, id); }
  const RobotCounters& counters() const { return counters_; }
  const RevokedKeys& revoked_keys() const { return revoked_keys_; }

  /// Of a HELLO or an ACK.
  Handling Classify(LinkIndex link, const protocol::Message& message) const;
  /// Stores the answer to a robot's change, in case it repeats the request.
  void Remember(const Context& context, LinkIndex link, const protocol::Message& request,
                const protocol::Message& answer);
  /// HELLO is answered, ACK is not.
  void TakeSession(const Context& context, const RequestReceived& request, const Output& out);

  Status CheckConfig(const Context& context, const EngineConfig& next,
                     const ConfigPlan* plan) const;
  void Configure(const Context& context, const Reconfiguration& change, const Output& out);
  /// PING.
  protocol::Message Answer(const Context& context, LinkIndex link,
                           const protocol::Message& request) const;
  /// EVENT.
  protocol::Message Change(const Context& context, LinkIndex link,
                           const protocol::Message& request);
  Status Check(const Context& context, const CommandIssued& command) const;
  Status Check(const Context& context, const PoseObserved& seen) const;
  Status Check(const Context& context, const GoalSet& set) const;
  Status Check(const Context& context, const GoalEnded& ended) const;
  Status Check(const Context& /*context*/, const KeysRevoked& revoked) const {
    return revoked_keys_.Check(revoked.keys);
  }
  /// A newer command replaces one that is still pending: a halt takes effect now.
  void Apply(const Context& context, const CommandIssued& issued, const Output& out);
  void Apply(const Context& context, const PoseObserved& seen, const Output& out);
  void Apply(const Context& context, const GoalSet& set, const Output& out);
  void Apply(const Context& context, const GoalEnded& ended, const Output& out);
  void Apply(const Context& /*context*/, const KeysRevoked& revoked, const Output& /*out*/) {
    revoked_keys_.Add(revoked.keys);
  }
  void Advance(const Context& context, const Output& out);
  std::optional<uint64_t> NextDeadline() const;
  uint64_t Hash() const;
  void Save(ByteWriter* writer) const;
  void Restore(const Context& context, ByteReader* reader);
  std::unique_ptr<FrozenPart> Freeze(uint64_t /*most_kept_bytes*/) const {
    return std::make_unique<FrozenBytes>(*this);
  }

 private:
  struct Broadcast {
    LinkIndex link;
    uint8_t seq;
    uint8_t left;
    uint64_t next_ms;
  };

  protocol::Message TakeHello(const Context& context, LinkIndex link,
                              const protocol::Message& request,
                              const protocol::HelloRequest& hello);
  static protocol::HelloAnswer AnswerTo(const Context& context, LinkIndex link,
                                        const protocol::HelloRequest& hello,
                                        const RobotState& robot);
  void TakeCommandAck(const Context& context, LinkIndex link, const protocol::CommandAck& ack);
  void SendCommand(const Context& context, LinkIndex link, uint8_t id, RobotState* robot,
                   const Output& out);
  void GiveUp(CommandState* command);
  void DropPendingResumes(LinkIndex link);
  static void SendBroadcast(const Context& context, Broadcast* broadcast, const Output& out);

  RobotTable table_;
  std::vector<Broadcast> broadcasts_;
  uint8_t next_broadcast_seq_ = 0;
  RevokedKeys revoked_keys_;
  RobotCounters counters_;
};

static_assert(Part<RobotsPart>);

}  // namespace pheromone::engine
