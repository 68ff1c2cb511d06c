// Traffic of each robot, for operators: the numbers of requests and repetitions, the last pose, and
// what it has told of itself. Not part of the state: nothing here is logged, and a restart resets
// it.
//
//   traffic.Count(link, message, now_ms, Traffic::Fate::kAnswered);
//   traffic.NoteHaltOfAll(link, now_ms);
//   const RobotTraffic* robot = traffic.Find(link, 7);
//
// Not thread-safe: the service keeps it behind its lock. Memory: 32 KiB for each link on which a
// robot was heard, independent of the number of robots.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "protocol/messages.h"
#include "server/core/engine/event.h"

namespace pheromone::engine {

/// What a robot told or was told, and when, in field time.
template <typename T>
struct Told {
  T what{};
  uint64_t at_ms = 0;
};

struct RobotTraffic {
  uint64_t requests = 0;  ///< messages from it, including those that are not answered
  uint64_t repeats = 0;   ///< of them: the same change again, because the answer was lost
  uint64_t refusals = 0;  ///< answered with ERROR
  uint64_t last_ms = 0;   ///< field time of the last one
  std::optional<protocol::WirePose> pose;  ///< the last one, in the robot's own frame and units
  uint64_t first_pose_ms = 0;              ///< field time of the first one
  uint64_t moved_ms = 0;                   ///< and of the last one that was not as the one before
  uint64_t hello_ms = 0;                   ///< of its last HELLO with another nonce
  uint16_t nonce = 0;
  protocol::Reason refusal = protocol::Reason::kNone;  ///< of its last pose; kNone: it was answered
  uint64_t refused_ms = 0;                             ///< since when, for that reason
  std::optional<Told<protocol::EventReport>> event;    ///< the last EVENT
  std::optional<Told<protocol::CommandCode>> obeyed;   ///< halt or resume, acknowledged last
  uint64_t arrived_ms = 0;                             ///< at a goal; 0: not yet
  uint8_t sensed_type = 0;  ///< what its last SENSE or TRACE asked for; 0: it has not asked
  uint8_t hellos = 0;       ///< since the last message that was none, 255 for more
  bool elsewhere = false;   ///< another server of a cluster has heard it last
};

/// A pose that another server is to know, or knows.
struct HeardPose {
  LinkIndex link = 0;
  uint8_t id = 0;
  protocol::WirePose pose;
  uint64_t at_ms = 0;  ///< field time
};

class Traffic {
 public:
  enum class Fate { kAnswered, kRepeated, kRefused, kIgnored };

  Traffic() = default;
  Traffic(const Traffic& other) : halts_(other.halts_), by_opcode_(other.by_opcode_) {
    for (const auto& link : other.links_) {
      links_.push_back(link != nullptr ? std::make_unique<Robots>(*link) : nullptr);
    }
  }
  Traffic(Traffic&&) = default;
  Traffic& operator=(const Traffic& other) { return *this = Traffic(other); }
  Traffic& operator=(Traffic&&) = default;
  ~Traffic() = default;

  /// Counts a message from a client. `refusal`: of the ERROR that answers it.
  void Count(LinkIndex link, const protocol::Message& message, uint64_t now_ms, Fate fate,
             protocol::Reason refusal = protocol::Reason::kNone);
  /// What another server has heard, or has passed on, unless the robot was heard here since.
  void NoteElsewhere(const HeardPose& heard);
  void NoteForwarded(LinkIndex link, uint8_t id) { At(link, id).elsewhere = true; }
  /// Calls `visit(const HeardPose&)` for each robot that was heard here after `since_ms`.
  template <typename Visit>
  void ForEachHeard(uint64_t since_ms, Visit&& visit) const {
    for (size_t link = 0; link < links_.size(); ++link) {
      ForEachOf(static_cast<LinkIndex>(link), [&](uint8_t id, const RobotTraffic& robot) {
        if (!robot.elsewhere && robot.pose && robot.last_ms > since_ms) {
          visit(HeardPose{static_cast<LinkIndex>(link), id, *robot.pose, robot.last_ms});
        }
      });
    }
  }
  /// The halt of all robots is sent on a link.
  void NoteHaltOfAll(LinkIndex link, uint64_t now_ms);
  void NoteArrival(LinkIndex link, uint8_t id, uint64_t now_ms);
  /// Field time of the last one; nothing since the start.
  std::optional<uint64_t> HaltOfAll(LinkIndex link) const;

  /// Null if that robot was not heard.
  const RobotTraffic* Find(LinkIndex link, uint8_t id) const;

  /// Calls `visit(id, const RobotTraffic&)` for each robot of a link that was heard, by ID.
  template <typename Visit>
  void ForEachOf(LinkIndex link, Visit&& visit) const {
    if (link >= links_.size() || links_[link] == nullptr) {
      return;
    }
    for (size_t id = 0; id < links_[link]->size(); ++id) {
      if (const RobotTraffic& robot = (*links_[link])[id]; robot.requests != 0 || robot.elsewhere) {
        visit(static_cast<uint8_t>(id), robot);
      }
    }
  }

  /// Messages by opcode; those with the server's bit, which are echoes, under the same opcode.
  const std::array<uint64_t, 128>& by_opcode() const { return by_opcode_; }

 private:
  using Robots = std::array<RobotTraffic, 256>;  // by ID

  RobotTraffic& At(LinkIndex link, uint8_t id);

  std::vector<std::unique_ptr<Robots>> links_;
  std::vector<std::optional<uint64_t>> halts_;  // by link
  std::array<uint64_t, 128> by_opcode_{};
};

}  // namespace pheromone::engine
