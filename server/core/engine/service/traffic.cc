#include "server/core/engine/service/traffic.h"

#include <algorithm>

namespace pheromone::engine {
namespace {

struct Asked {
  protocol::WirePose pose;
  uint8_t type = 0;
};

// The pose and the pheromone in a message that asks for intensities.
std::optional<Asked> AskedIn(const protocol::Message& message) {
  protocol::SenseRequest sense;
  protocol::TraceRequest trace;
  if (protocol::Decode(message, &sense)) {
    return Asked{sense.pose, sense.type};
  }
  if (protocol::Decode(message, &trace)) {
    return Asked{trace.pose, trace.type};
  }
  return std::nullopt;
}

void NotePose(const protocol::WirePose& pose, uint64_t now_ms, RobotTraffic* robot) {
  if (!robot->pose) {
    robot->first_pose_ms = now_ms;
  } else if (pose.x != robot->pose->x || pose.y != robot->pose->y ||
             pose.heading != robot->pose->heading) {
    robot->moved_ms = now_ms;
  }
  robot->pose = pose;
}

// What the robot says of itself.
void NoteWords(const protocol::Message& message, uint64_t now_ms, RobotTraffic* robot) {
  protocol::EventReport event;
  protocol::CommandAck ack;
  protocol::HelloRequest hello;
  if (protocol::Decode(message, &event)) {
    if (!robot->event || robot->event->what.seq != event.seq) {
      robot->event = {event, now_ms};
    }
  } else if (protocol::Decode(message, &ack)) {
    const bool stops = ack.code == protocol::CommandCode::kHalt;
    if (ack.result == 0 && (stops || ack.code == protocol::CommandCode::kResume)) {
      robot->obeyed = {ack.code, now_ms};
    }
  } else if (protocol::Decode(message, &hello) &&
             (robot->hello_ms == 0 || robot->nonce != hello.nonce)) {
    robot->nonce = hello.nonce;
    robot->hello_ms = now_ms;
  }
}

}  // namespace

RobotTraffic& Traffic::At(LinkIndex link, uint8_t id) {
  if (link >= links_.size()) {
    links_.resize(size_t{link} + 1);
  }
  if (links_[link] == nullptr) {
    links_[link] = std::make_unique<Robots>();
  }
  return (*links_[link])[id];
}

void Traffic::Count(LinkIndex link, const protocol::Message& message, uint64_t now_ms, Fate fate,
                    protocol::Reason refusal) {
  ++by_opcode_[message.opcode & 0x7Fu];
  if (protocol::IsFromServer(message.opcode) || message.id == protocol::kBroadcastId) {
    return;  // an echo, or invalid ID
  }
  RobotTraffic& robot = At(link, message.id);
  ++robot.requests;
  robot.repeats += fate == Fate::kRepeated ? 1u : 0u;
  robot.refusals += fate == Fate::kRefused ? 1u : 0u;
  robot.last_ms = now_ms;
  robot.elsewhere = false;
  const bool is_hello = message.opcode == static_cast<uint8_t>(protocol::Opcode::kHello);
  robot.hellos = is_hello ? static_cast<uint8_t>(std::min(robot.hellos + 1, 255)) : uint8_t{0};
  const auto asked = AskedIn(message);
  if (refusal != robot.refusal && (asked || refusal != protocol::Reason::kNone)) {
    robot.refusal = refusal;
    robot.refused_ms = now_ms;
  }
  if (asked) {
    NotePose(asked->pose, now_ms, &robot);
    robot.sensed_type = asked->type;
  } else {
    NoteWords(message, now_ms, &robot);
  }
}

void Traffic::NoteElsewhere(const HeardPose& heard) {
  RobotTraffic& robot = At(heard.link, heard.id);
  if (heard.at_ms > robot.last_ms || (robot.elsewhere && heard.at_ms == robot.last_ms)) {
    NotePose(heard.pose, heard.at_ms, &robot);
    robot.last_ms = heard.at_ms;
    robot.elsewhere = true;
    robot.hellos = 0;
  }
}

void Traffic::NoteHaltOfAll(LinkIndex link, uint64_t now_ms) {
  halts_.resize(std::max(halts_.size(), size_t{link} + 1));
  halts_[link] = now_ms;
}

void Traffic::NoteArrival(LinkIndex link, uint8_t id, uint64_t now_ms) {
  At(link, id).arrived_ms = now_ms;
}

std::optional<uint64_t> Traffic::HaltOfAll(LinkIndex link) const {
  return link < halts_.size() ? halts_[link] : std::nullopt;
}

const RobotTraffic* Traffic::Find(LinkIndex link, uint8_t id) const {
  if (link >= links_.size() || links_[link] == nullptr) {
    return nullptr;
  }
  const RobotTraffic& robot = (*links_[link])[id];
  return robot.requests != 0 || robot.elsewhere ? &robot : nullptr;
}

}  // namespace pheromone::engine
