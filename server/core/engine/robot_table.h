// The engine's state of each robot: the data that makes changes happen exactly once, its last
// command, its tracked pose and its goal. A robot's key is (link name, client ID) and does not
// include the source of its last message, so a robot that reconnects stays the same robot.
//
// All of it is logged state and counts into the state hash.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "protocol/fields.h"
#include "protocol/messages.h"
#include "server/base/bytes.h"
#include "server/core/engine/event.h"

namespace pheromone::engine {

/// How a mutating request's seq compares with the last accepted one (modulo 256).
enum class SeqVerdict {
  kNew,     ///< 1 to 128 ahead
  kRepeat,  ///< the same seq and the same content: the answer was lost
  kReused,  ///< the same seq, other content
  kStale,   ///< 1 to 127 behind: a late duplicate
};

/// The outcome of a robot's last command.
enum class CommandOutcome : uint8_t { kNone, kPending, kAccepted, kRefused, kUnanswered, kUnknown };

struct CommandState {
  CommandOutcome outcome = CommandOutcome::kNone;
  protocol::Command command;
  int16_t result = 0;          ///< the robot's reason, if it refused
  uint8_t sent = 0;            ///< number of transmissions
  uint64_t next_retry_ms = 0;  ///< field time, while pending
};

/// Where a tracker saw a robot, in the map's coordinates; believed while field time < until_ms.
struct ObservedPose {
  field::PoseUm pose;
  uint64_t until_ms = 0;
};

struct RobotState {
  uint16_t epoch = 0;            ///< in which it last said HELLO
  protocol::HelloRequest hello;  ///< the last one
  std::optional<uint16_t> previous_nonce;

  uint8_t last_opcode = 0;  ///< of its last change; 0: none
  uint8_t last_seq = 0;     ///< of its last change, or taken by a HELLO after that
  uint16_t last_crc = 0;    ///< of the request that has this number, as are the next two
  protocol::Message last_answer;
  uint64_t last_change = 0;    ///< the log's sequence number of that request
  uint64_t last_activity = 0;  ///< and of the robot's last event of any kind

  uint8_t next_command_seq = 0;
  CommandState command;
  std::optional<protocol::EventReport> last_event;
  std::optional<ObservedPose> observed;
  std::optional<Goal> goal;

  bool has_pending_command() const { return command.outcome == CommandOutcome::kPending; }

  /// `request` has been answered and has taken the number last_seq.
  void StoreAnswer(const protocol::Message& request, const protocol::Message& answer,
                   uint64_t sequence);
};

/// Where in HELLO's DATA begins what is saved and hashed behind the previous nonce.
constexpr uint8_t kBehindNonce = protocol::OffsetOf(&protocol::HelloRequest::nonce) + 2;

SeqVerdict CompareSeq(const RobotState& robot, uint8_t seq, uint16_t crc);

class RobotTable {
 public:
  RobotTable() = default;
  RobotTable(const RobotTable& other);
  RobotTable(RobotTable&&) noexcept = default;
  RobotTable& operator=(const RobotTable& other) { return *this = RobotTable(other); }
  RobotTable& operator=(RobotTable&&) noexcept = default;
  ~RobotTable() = default;

  /// Links, frames and the pose unit. Robots of links that are no longer configured are kept, since
  /// the link may return.
  void Configure(const EngineConfig& config);

  /// Null for a robot that never said HELLO.
  const RobotState* Find(LinkIndex link, uint8_t id) const;

  /// Whether it has said HELLO in that epoch.
  bool SaidHello(LinkIndex link, uint8_t id, uint16_t epoch) const {
    const RobotState* robot = Find(link, id);
    return robot != nullptr && robot->epoch == epoch;
  }

  /// The pose on the map of a robot that reports `reported`: the tracker's if it is still valid,
  /// else the reported one, converted from the robot's frame to the map's.
  field::PoseUm PoseOf(LinkIndex link, uint8_t id, const protocol::WirePose& reported,
                       uint64_t now_ms) const;

  /// A difference of two positions on the map, in micrometres, in the robot's frame.
  field::PointUm DifferenceFor(LinkIndex link, uint8_t id, const field::PointUm& difference) const;

  /// Calls `change(RobotState&)` for a robot, new or not, and updates the hash.
  template <typename Change>
  void Update(LinkIndex link, uint8_t id, Change&& change) {
    Robots& robots = *by_index_[link];
    const auto [entry, is_new] = robots.robots.try_emplace(id);
    if (!is_new) {
      Discount(robots, id, entry->second);
    }
    change(entry->second);
    hash_ += Hash(robots.name, id, entry->second);
    pending_commands_ += entry->second.has_pending_command() ? 1u : 0u;
  }

  /// Forgets a robot, which no server does: for the mutants of checkers (client_fw/verify).
  void ForgetAsMutant(LinkIndex link, uint8_t id);

  /// Calls `visit(LinkIndex, id, const RobotState&)` for each robot of the present links.
  template <typename Visit>
  void ForEach(Visit&& visit) const {
    for (size_t link = 0; link < by_index_.size(); ++link) {
      ForEachOf(static_cast<LinkIndex>(link), [&](uint8_t id, const RobotState& robot) {
        visit(static_cast<LinkIndex>(link), id, robot);
      });
    }
  }

  /// Calls `visit(id, const RobotState&)` for each robot of a link, by ID; none if there is no such
  /// link.
  template <typename Visit>
  void ForEachOf(LinkIndex link, Visit&& visit) const {
    if (link < by_index_.size()) {
      for (const auto& [id, robot] : by_index_[link]->robots) {
        visit(id, robot);
      }
    }
  }

  /// All robots, including those of removed links. Restore needs an empty table and comes before
  /// Configure; invalid bytes fail the reader.
  void Save(ByteWriter* writer) const;
  void Restore(ByteReader* reader);

  uint64_t hash() const { return hash_; }

  /// Robots with a pending command, including those of removed links.
  size_t pending_commands() const { return pending_commands_; }

  /// Hash64 over kind 'R', the link's name, the ID and every field, in the order of RobotState; the
  /// goal only if there is one.
  static uint64_t Hash(const std::string& link_name, uint8_t id, const RobotState& robot);

 private:
  struct Robots {
    std::string name;
    std::map<uint8_t, RobotState> robots;
  };

  void Discount(const Robots& robots, uint8_t id, const RobotState& robot);

  std::map<std::string, Robots> by_name_;
  std::vector<Robots*> by_index_;
  std::map<std::pair<LinkIndex, uint8_t>, RobotFrame> frames_;
  uint16_t pose_unit_10um_ = 1;
  uint64_t hash_ = 0;
  size_t pending_commands_ = 0;
};

}  // namespace pheromone::engine
