#include "server/core/engine/robots_part.h"

#include <algorithm>
#include <cassert>
#include <string>
#include <utility>

#include "server/base/hash.h"
#include "server/core/engine/config_hash.h"
#include "server/core/engine/event_codec.h"
#include "server/core/engine/refusal.h"
#include "server/core/engine/unknown_robot.h"

namespace pheromone::engine {

using protocol::Message;
using protocol::Reason;

// --- Configuration

Status RobotsPart::CheckConfig(const Context& /*context*/, const EngineConfig& next,
                               const ConfigPlan* /*plan*/) const {
  return CheckFrames(next.frames);
}

void RobotsPart::Configure(const Context& context, const Reconfiguration& change,
                           const Output& /*out*/) {
  if (change.before != nullptr && change.before->links != context.config->links) {
    broadcasts_.clear();  // their links may have other indices now
  }
  table_.Configure(*context.config);
}

// --- Requests

Handling RobotsPart::Classify(LinkIndex link, const Message& message) const {
  if (message.opcode == protocol::kHello) {
    return Handling::kChange;
  }
  const RobotState* robot = table_.Find(link, message.id);
  protocol::CommandAck ack;
  const bool awaited = robot != nullptr && protocol::Decode(message, &ack) &&
                       robot->command.outcome == CommandOutcome::kPending &&
                       robot->command.command.seq == ack.seq &&
                       robot->command.command.code == ack.code;
  return awaited ? Handling::kChange : Handling::kIgnore;
}

Message RobotsPart::Answer(const Context& /*context*/, LinkIndex /*link*/,
                           const Message& request) const {
  protocol::Ping ping;
  protocol::Decode(request, &ping);
  ping.answer = true;
  Message answer;
  protocol::Encode(ping, &answer);
  return answer;
}

Message RobotsPart::Change(const Context& /*context*/, LinkIndex /*link*/, const Message& request) {
  protocol::EventReport event;
  const bool is_event = protocol::Decode(request, &event);
  assert(is_event);
  (void)is_event;
  if (event.code < protocol::EventCode::kLoadPicked || event.code > protocol::kLastEvent) {
    return ErrorMessage(request, Reason::kBadValue);
  }
  Message answer;
  protocol::Encode(protocol::EventAck{event.id, event.seq}, &answer);
  return answer;
}

void RobotsPart::Remember(const Context& context, LinkIndex link, const Message& request,
                          const Message& answer) {
  table_.Update(link, request.id, [&](RobotState& robot) {
    robot.last_opcode = request.opcode;
    robot.last_seq = request.data[0];
    robot.StoreAnswer(request, answer, context.sequence);
    robot.last_activity = context.sequence;
    protocol::EventReport report;
    if (protocol::Decode(request, &report) && answer.opcode == protocol::kEventAck) {
      robot.last_event = report;
    }
  });
}

void RobotsPart::TakeSession(const Context& context, const RequestReceived& request,
                             const Output& out) {
  protocol::HelloRequest hello;
  protocol::CommandAck ack;
  if (protocol::Decode(request.message, &hello)) {
    out.Send(context, request.link, TakeHello(context, request.link, request.message, hello));
  } else if (protocol::Decode(request.message, &ack)) {
    TakeCommandAck(context, request.link, ack);
  }
}

// HELLO is answered with the number from which the robot goes on. A new nonce takes a number
// itself: a request that an earlier boot has sent, and that arrives later, then has that number or
// is behind. The same nonce is a warm restart, or a HELLO whose answer was lost; the one before it
// is a late HELLO of the previous boot, or another robot with the same ID. An unknown robot's HELLO
// has number 0.
Message RobotsPart::TakeHello(const Context& context, LinkIndex link, const Message& request,
                              const protocol::HelloRequest& hello) {
  Message message;
  table_.Update(link, hello.id, [&](RobotState& robot) {
    const bool is_known = robot.last_activity != 0;
    const bool has_booted = is_known && robot.hello.nonce != hello.nonce;
    const bool is_previous = has_booted && robot.previous_nonce == hello.nonce;
    const bool is_new = !is_known || (has_booted && !is_previous);
    if (is_known && is_new) {
      ++robot.last_seq;
    }
    protocol::Encode(AnswerTo(context, link, hello, robot), &message);
    if (is_new) {
      robot.StoreAnswer(request, message, context.sequence);
    }
    if (has_booted) {
      counters_.id_conflicts += is_previous ? 1u : 0u;
      robot.previous_nonce = robot.hello.nonce;
      if (robot.has_pending_command()) {
        robot.command.outcome = CommandOutcome::kUnknown;
        ++counters_.commands_unknown;
      }
    }
    robot.epoch = context.epoch;
    robot.hello = hello;
    robot.last_activity = context.sequence;
  });
  return message;
}

protocol::HelloAnswer RobotsPart::AnswerTo(const Context& context, LinkIndex link,
                                           const protocol::HelloRequest& hello,
                                           const RobotState& robot) {
  const EngineConfig& config = *context.config;
  protocol::HelloAnswer answer;
  answer.id = hello.id;
  answer.nonce = hello.nonce;
  answer.protocol_version = protocol::kProtocolVersion;
  answer.epoch = context.epoch;
  answer.pose_unit_10um = config.pose_unit_10um;
  answer.antenna_distance_mm =
      static_cast<uint16_t>(field::RoundDiv(config.field.antennas.distance_um, 1000));
  answer.type_mask = TypeMaskOf(config.field);
  answer.slot_ms = config.links[link].slot_ms;
  answer.response_window_ms = config.links[link].response_window_ms;
  answer.last_opcode = robot.last_opcode;
  answer.last_seq = robot.last_seq;
  return answer;
}

void RobotsPart::TakeCommandAck(const Context& context, LinkIndex link,
                                const protocol::CommandAck& ack) {
  table_.Update(link, ack.id, [&](RobotState& robot) {
    robot.command.outcome = ack.result == 0 ? CommandOutcome::kAccepted : CommandOutcome::kRefused;
    robot.command.result = ack.result;
    robot.command.next_retry_ms = 0;
    robot.last_activity = context.sequence;
  });
}

// --- Events

Status RobotsPart::Check(const Context& context, const PoseObserved& seen) const {
  return table_.SaidHello(seen.link, seen.id, context.epoch)
             ? Ok()
             : Error{"a pose of robot " + std::to_string(seen.id) + ", which has not said HELLO"};
}

Status RobotsPart::Check(const Context& context, const GoalSet& set) const {
  if (!table_.SaidHello(set.link, set.id, context.epoch)) {
    return Error{"a goal for robot " + std::to_string(set.id) + ", which has not said HELLO"};
  }
  return CheckGoal(set.goal, context.config->field);
}

Status RobotsPart::Check(const Context& /*context*/, const GoalEnded& ended) const {
  const RobotState* robot = table_.Find(ended.link, ended.id);
  if (robot == nullptr || !robot->goal) {
    return Error{"robot " + std::to_string(ended.id) + " has no goal"};
  }
  return Ok();
}

Status RobotsPart::Check(const Context& context, const CommandIssued& command) const {
  if (command.link >= context.config->links.size()) {
    return Error{"unknown link " + std::to_string(command.link)};
  }
  const auto code = static_cast<uint8_t>(command.code);
  if (protocol::CommandArgumentLength(code) > protocol::kMaxCommandArguments) {
    return Error{"unknown command " + std::to_string(code)};
  }
  const bool broadcast = command.id == protocol::kBroadcastId;
  if (broadcast && command.code != protocol::CommandCode::kHalt) {
    return Error{"only halt can be sent to all robots"};
  }
  if (!broadcast && table_.Find(command.link, command.id) == nullptr) {
    return UnknownRobot(table_, context.config->links, command.link, command.id);
  }
  return Ok();
}

void RobotsPart::Apply(const Context& context, const PoseObserved& seen, const Output& /*out*/) {
  table_.Update(seen.link, seen.id, [&](RobotState& robot) {
    robot.observed = ObservedPose{seen.pose, context.now_ms + seen.valid_ms};
  });
}

void RobotsPart::Apply(const Context& /*context*/, const GoalSet& set, const Output& /*out*/) {
  table_.Update(set.link, set.id, [&](RobotState& robot) { robot.goal = set.goal; });
}

void RobotsPart::Apply(const Context& context, const GoalEnded& ended, const Output& out) {
  table_.Update(ended.link, ended.id, [](RobotState& robot) { robot.goal.reset(); });
  if (ended.reached) {
    // Or else it would follow what is on the map.
    Apply(context, CommandIssued{ended.link, ended.id, protocol::CommandCode::kHalt, {}}, out);
  }
}

void RobotsPart::Apply(const Context& context, const CommandIssued& issued, const Output& out) {
  if (issued.id == protocol::kBroadcastId) {
    DropPendingResumes(issued.link);
    broadcasts_.push_back({issued.link, next_broadcast_seq_++, kBroadcastTransmissions, 0});
    SendBroadcast(context, &broadcasts_.back(), out);
    return;
  }
  table_.Update(issued.link, issued.id, [&](RobotState& robot) {
    robot.command = CommandState{};
    robot.command.outcome = CommandOutcome::kPending;
    robot.command.command.id = issued.id;
    robot.command.command.seq = robot.next_command_seq++;
    robot.command.command.code = issued.code;
    std::copy(issued.arguments.begin(), issued.arguments.end(), robot.command.command.arguments);
    SendCommand(context, issued.link, issued.id, &robot, out);
  });
}

// Retried after a broadcast halt, they would undo it.
void RobotsPart::DropPendingResumes(LinkIndex link) {
  std::vector<uint8_t> ids;
  table_.ForEach([&](LinkIndex its_link, uint8_t id, const RobotState& robot) {
    if (its_link == link && robot.has_pending_command() &&
        robot.command.command.code == protocol::CommandCode::kResume) {
      ids.push_back(id);
    }
  });
  for (const uint8_t id : ids) {
    table_.Update(link, id, [&](RobotState& robot) { GiveUp(&robot.command); });
  }
}

void RobotsPart::GiveUp(CommandState* command) {
  command->outcome = CommandOutcome::kUnanswered;
  command->next_retry_ms = 0;
  ++counters_.commands_unanswered;
}

void RobotsPart::SendCommand(const Context& context, LinkIndex link, uint8_t id, RobotState* robot,
                             const Output& out) {
  CommandState& state = robot->command;
  if (state.sent == kCommandTransmissions) {
    GiveUp(&state);
    return;
  }
  // A resume before the last transmission of a broadcast halt would be undone by it.
  if (state.command.code == protocol::CommandCode::kResume) {
    const auto halt = std::find_if(broadcasts_.begin(), broadcasts_.end(),
                                   [&](const Broadcast& it) { return it.link == link; });
    if (halt != broadcasts_.end()) {
      state.next_retry_ms = halt->next_ms;
      return;
    }
  }
  state.next_retry_ms = context.now_ms + std::min(kFirstRetryMs << state.sent, kLongestRetryMs);
  ++state.sent;
  Message message;
  protocol::Encode(state.command, &message);
  message.id = id;
  out.Send(context, link, message);
}

void RobotsPart::SendBroadcast(const Context& context, Broadcast* broadcast, const Output& out) {
  protocol::Command halt;
  halt.id = protocol::kBroadcastId;
  halt.seq = broadcast->seq;
  halt.code = protocol::CommandCode::kHalt;
  Message message;
  protocol::Encode(halt, &message);
  out.Send(context, broadcast->link, message);
  --broadcast->left;
  broadcast->next_ms = context.now_ms + kBroadcastIntervalMs;
}

// --- Time

// A long gap is one bounded step: a command that has missed several retries is sent once.
void RobotsPart::Advance(const Context& context, const Output& out) {
  // Before the commands: a resume waits for the last of them.
  for (Broadcast& broadcast : broadcasts_) {
    if (broadcast.next_ms <= context.now_ms) {
      SendBroadcast(context, &broadcast, out);
    }
  }
  std::erase_if(broadcasts_, [](const Broadcast& broadcast) { return broadcast.left == 0; });
  std::vector<std::pair<LinkIndex, uint8_t>> due;
  table_.ForEach([&](LinkIndex link, uint8_t id, const RobotState& robot) {
    if (robot.has_pending_command() && robot.command.next_retry_ms <= context.now_ms) {
      due.emplace_back(link, id);
    }
  });
  for (const auto& [link, id] : due) {
    table_.Update(link, id, [&, link = link, id = id](RobotState& robot) {
      SendCommand(context, link, id, &robot, out);
    });
  }
}

std::optional<uint64_t> RobotsPart::NextDeadline() const {
  std::optional<uint64_t> next;
  const auto consider = [&next](uint64_t at) { next = next ? std::min(*next, at) : at; };
  if (table_.pending_commands() != 0) {
    table_.ForEach([&](LinkIndex, uint8_t, const RobotState& robot) {
      if (robot.has_pending_command()) {
        consider(robot.command.next_retry_ms);
      }
    });
  }
  for (const Broadcast& broadcast : broadcasts_) {
    consider(broadcast.next_ms);
  }
  return next;
}

// --- State

uint64_t RobotsPart::Hash() const {
  uint64_t hash = table_.hash() + revoked_keys_.hash() + Hash64({'N', next_broadcast_seq_});
  for (const Broadcast& broadcast : broadcasts_) {
    hash += Hash64({'B', broadcast.link, broadcast.seq, broadcast.left, broadcast.next_ms});
  }
  return hash;
}

void RobotsPart::Save(ByteWriter* writer) const {
  writer->U8(next_broadcast_seq_);
  writer->Count(broadcasts_.size());
  for (const Broadcast& broadcast : broadcasts_) {
    writer->U16(broadcast.link);
    writer->U8(broadcast.seq);
    writer->U8(broadcast.left);
    writer->U64(broadcast.next_ms);
  }
  revoked_keys_.Save(writer);
  table_.Save(writer);
}

void RobotsPart::Restore(const Context& context, ByteReader* reader) {
  next_broadcast_seq_ = reader->U8();
  for (uint32_t left = reader->Count(); left > 0 && reader->ok(); --left) {
    Broadcast broadcast{};
    broadcast.link = reader->U16();
    broadcast.seq = reader->U8();
    broadcast.left = reader->U8UpTo(kBroadcastTransmissions, "a broadcast's transmissions");
    broadcast.next_ms = reader->U64();
    if (broadcast.link >= context.config->links.size() || broadcast.left == 0) {
      reader->Fail("a broadcast that has ended or has no link");
    }
    broadcasts_.push_back(broadcast);
  }
  revoked_keys_.Restore(reader);
  table_.Restore(reader);
  if (reader->ok()) {
    table_.Configure(*context.config);
  }
}

}  // namespace pheromone::engine
