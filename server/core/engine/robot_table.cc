#include "server/core/engine/robot_table.h"

#include "server/base/hash.h"
#include "server/core/engine/wire_units.h"

namespace pheromone::engine {
namespace {

uint64_t HashMessage(const protocol::Message& message) {
  uint64_t hash = Hash64({message.id, message.opcode, message.length});
  for (uint8_t i = 0; i < message.length; ++i) {
    hash = HashStep(hash, message.data[i]);
  }
  return hash;
}

uint64_t HashObserved(const ObservedPose& observed) {
  return Hash64({1, static_cast<uint64_t>(observed.pose.position.x),
                 static_cast<uint64_t>(observed.pose.position.y), observed.pose.heading,
                 observed.until_ms});
}

uint64_t HashCommand(const CommandState& state) {
  protocol::Message message;
  protocol::Encode(state.command, &message);
  return Hash64({static_cast<uint64_t>(state.outcome), HashMessage(message),
                 static_cast<uint64_t>(state.result), state.sent, state.next_retry_ms});
}

}  // namespace

void RobotState::StoreAnswer(const protocol::Message& request, const protocol::Message& answer,
                             uint64_t sequence) {
  last_crc = protocol::MessageCrc(request);
  last_answer = answer;
  last_change = sequence;
}

SeqVerdict CompareSeq(const RobotState& robot, uint8_t seq, uint16_t crc) {
  const auto ahead = static_cast<uint8_t>(seq - robot.last_seq);
  if (ahead == 0) {
    return crc == robot.last_crc ? SeqVerdict::kRepeat : SeqVerdict::kReused;
  }
  return ahead <= 128 ? SeqVerdict::kNew : SeqVerdict::kStale;
}

RobotTable::RobotTable(const RobotTable& other)
    : by_name_(other.by_name_),
      frames_(other.frames_),
      pose_unit_10um_(other.pose_unit_10um_),
      hash_(other.hash_),
      pending_commands_(other.pending_commands_) {
  for (const Robots* const robots : other.by_index_) {
    by_index_.push_back(&by_name_.at(robots->name));
  }
}

void RobotTable::Configure(const EngineConfig& config) {
  pose_unit_10um_ = config.pose_unit_10um;
  by_index_.clear();
  frames_.clear();
  for (const LinkSettings& link : config.links) {
    const auto index = static_cast<LinkIndex>(by_index_.size());
    Robots& robots = by_name_[link.name];
    robots.name = link.name;
    by_index_.push_back(&robots);
    for (const RobotFrame& frame : config.frames) {
      if (frame.link == link.name) {
        frames_.emplace(std::pair(index, frame.id), frame);
      }
    }
  }
}

const RobotState* RobotTable::Find(LinkIndex link, uint8_t id) const {
  if (link >= by_index_.size()) {
    return nullptr;
  }
  const auto& robots = by_index_[link]->robots;
  const auto found = robots.find(id);
  return found == robots.end() ? nullptr : &found->second;
}

field::PoseUm RobotTable::PoseOf(LinkIndex link, uint8_t id, const protocol::WirePose& reported,
                                 uint64_t now_ms) const {
  const RobotState* robot = Find(link, id);
  if (robot != nullptr && robot->observed && now_ms < robot->observed->until_ms) {
    return robot->observed->pose;
  }
  const field::PoseUm pose = ToField(reported, pose_unit_10um_);
  const auto frame = frames_.find({link, id});
  return frame != frames_.end() ? ToMap(frame->second, pose) : pose;
}

field::PointUm RobotTable::DifferenceFor(LinkIndex link, uint8_t id,
                                         const field::PointUm& difference) const {
  const auto frame = frames_.find({link, id});
  return frame != frames_.end() ? DifferenceFromMap(frame->second, difference) : difference;
}

void RobotTable::ForgetAsMutant(LinkIndex link, uint8_t id) {
  Robots& robots = *by_index_[link];
  if (const auto found = robots.robots.find(id); found != robots.robots.end()) {
    Discount(robots, id, found->second);
    robots.robots.erase(found);
  }
}

void RobotTable::Discount(const Robots& robots, uint8_t id, const RobotState& robot) {
  hash_ -= Hash(robots.name, id, robot);
  pending_commands_ -= robot.has_pending_command() ? 1u : 0u;
}

uint64_t RobotTable::Hash(const std::string& link_name, uint8_t id, const RobotState& robot) {
  const uint64_t last_event =
      robot.last_event
          ? Hash64({1, robot.last_event->seq, static_cast<uint64_t>(robot.last_event->code),
                    static_cast<uint64_t>(robot.last_event->argument)})
          : 0;
  uint64_t hash = Hash64({'R', HashText(link_name), id, robot.epoch, robot.hello.nonce,
                          robot.previous_nonce ? uint64_t{*robot.previous_nonce} + 1 : 0});
  protocol::Message hello;
  protocol::Encode(robot.hello, &hello);
  for (uint8_t i = kBehindNonce; i < hello.length; ++i) {
    hash = HashStep(hash, hello.data[i]);
  }
  for (const uint64_t word :
       {uint64_t{robot.last_opcode}, uint64_t{robot.last_seq}, uint64_t{robot.last_crc},
        HashMessage(robot.last_answer), robot.last_change, robot.last_activity,
        uint64_t{robot.next_command_seq}, HashCommand(robot.command), last_event,
        robot.observed ? HashObserved(*robot.observed) : 0}) {
    hash = HashStep(hash, word);
  }
  return robot.goal ? HashStep(hash, HashOf(*robot.goal)) : hash;
}

}  // namespace pheromone::engine
