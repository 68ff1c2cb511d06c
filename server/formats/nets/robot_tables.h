// The net that a robot carries, as tables of bit masks: for the firmware, which gets them as a C++
// header, and for the daemon, which puts the numbers of its transitions on tags.
//
//   Result<RobotTables> robot = MakeRobotTables(net);    // of deploy/examples/nets/robot.toml
//   std::vector<uint8_t> at_source = robot.value().CandidatesOf("Src");   // {5, 12}
//   WriteFile("robot_net.h", HeaderOf(robot.value(), "robot.toml"));
//
// `does` of a place is "follow T", "wait T" or "choose", with T the type of the pheromone that
// marks the line (1 to 15), or empty; of a transition "present", "leave", "leave A", "leave B",
// "store A", "store B", "take" or empty. What that is for is in protocol/README.md, "Records of
// nets", and so are the bytes of the hash. Plain values; any thread.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/robot_net.h"
#include "server/base/result.h"
#include "server/core/petri/net.h"

namespace pheromone::nets {

/// Places, and transitions, of a robot's net.
inline constexpr size_t kMaxRobotNodes = 32;

struct RobotPlace {
  std::string id;
  protocol::PlaceDoes does = protocol::PlaceDoes::kNothing;
  uint8_t type = 0;  ///< of the line to follow

  bool operator==(const RobotPlace&) const = default;
};

/// Places as bits: place p is 1 << p.
struct RobotTransition {
  std::string id;
  std::string tag;
  uint32_t takes = 0;  ///< with what it reads
  uint32_t gives = 0;  ///< the same
  uint32_t inhibited_by = 0;
  protocol::TransitionDoes does = protocol::TransitionDoes::kNothing;

  bool operator==(const RobotTransition&) const = default;
};

struct RobotTables {
  std::string name;
  uint32_t marking = 0;
  uint32_t hash = 0;
  std::vector<RobotPlace> places{};
  std::vector<RobotTransition> transitions{};

  bool operator==(const RobotTables&) const = default;

  /// The trigger vector of a tag: its transitions, ascending, counted from 1.
  std::vector<uint8_t> CandidatesOf(std::string_view tag) const;
};

/// Errors: what CheckNet says; more than 32 places or transitions, or 11 of a tag; weights and
/// initial tokens above 1; an unknown `does`; a transition without a tag. The robot has to know
/// what to do: exactly one marked place does something, which each transition preserves. It gets to
/// a place that waits by `present` only; to one that chooses by a transition that does nothing, and
/// away from it by `leave A` and `leave B`.
Result<RobotTables> MakeRobotTables(const petri::Net& net);

/// A header for firmware (client_fw/core/tasks/net_tables.h); `source` is the file named in its
/// comment.
std::string HeaderOf(const RobotTables& robot, std::string_view source);

}  // namespace pheromone::nets
