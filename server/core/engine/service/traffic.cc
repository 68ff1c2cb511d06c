#include "server/core/engine/service/traffic.h"

namespace pheromone::engine {
namespace {

// The pose in a message, if there is one.
std::optional<protocol::WirePose> PoseIn(const protocol::Message& message) {
  protocol::SenseRequest sense;
  protocol::TraceRequest trace;
  if (protocol::Decode(message, &sense)) {
    return sense.pose;
  }
  if (protocol::Decode(message, &trace)) {
    return trace.pose;
  }
  return std::nullopt;
}

}  // namespace

void Traffic::Count(LinkIndex link, const protocol::Message& message, uint64_t now_ms, Fate fate) {
  ++by_opcode_[message.opcode & 0x7Fu];
  if (protocol::IsFromServer(message.opcode) || message.id == protocol::kBroadcastId) {
    return;  // an echo, or invalid ID
  }
  if (link >= links_.size()) {
    links_.resize(size_t{link} + 1);
  }
  if (links_[link] == nullptr) {
    links_[link] = std::make_unique<Robots>();
  }
  RobotTraffic& robot = (*links_[link])[message.id];
  ++robot.requests;
  robot.repeats += fate == Fate::kRepeated ? 1u : 0u;
  robot.refusals += fate == Fate::kRefused ? 1u : 0u;
  robot.last_ms = now_ms;
  if (const auto pose = PoseIn(message)) {
    robot.pose = pose;
  }
}

const RobotTraffic* Traffic::Find(LinkIndex link, uint8_t id) const {
  if (link >= links_.size() || links_[link] == nullptr) {
    return nullptr;
  }
  const RobotTraffic& robot = (*links_[link])[id];
  return robot.requests != 0 ? &robot : nullptr;
}

}  // namespace pheromone::engine
