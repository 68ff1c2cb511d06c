// How requests of robots are answered, with and without a change.

#include <algorithm>
#include <cassert>

#include "server/engine/config_hash.h"
#include "server/engine/engine.h"
#include "server/engine/wire_units.h"

namespace pheromone::engine {
namespace {

using protocol::Message;
using protocol::Reason;

// What is wrong with the form of a client's message, if anything.
Reason FaultOf(const Message& message) {
  const protocol::LengthRule rule = protocol::LengthOf(message.opcode);
  if (!rule.known) {
    return Reason::kUnknownOpcode;
  }
  const bool fits = message.length >= rule.least && message.length <= rule.most;
  return fits ? Reason::kNone : Reason::kBadLength;
}

Reason ToReason(field::SenseError error) {
  return error == field::SenseError::kOffTheMap ? Reason::kOffTheMap : Reason::kUnknownPheromone;
}

Reason ToReason(field::DepositResult result) {
  switch (result) {
    case field::DepositResult::kOffTheMap:
      return Reason::kOffTheMap;
    case field::DepositResult::kUnknownPheromone:
      return Reason::kUnknownPheromone;
    case field::DepositResult::kMapFull:
      return Reason::kMapFull;
    case field::DepositResult::kBlocked:
      return Reason::kBlockedByObstacle;
    case field::DepositResult::kNotPermitted:
      return Reason::kNotPermitted;
    case field::DepositResult::kDone:
      break;
  }
  return Reason::kNone;
}

}  // namespace

Message ErrorMessage(const Message& message, Reason reason) {
  const bool has_seq = protocol::IsMutating(message.opcode) && message.length > 0;
  const uint8_t seq = has_seq ? message.data[0] : uint8_t{0};
  Message error;
  protocol::Encode(protocol::ErrorAnswer{message.id, message.opcode, reason, seq}, &error);
  return error;
}

Handling Engine::Classify(LinkIndex link, const Message& message) const {
  const bool nobody = message.id == 0 || message.id == protocol::kBroadcastId;
  if (nobody || message.opcode == 0 || protocol::IsFromServer(message.opcode) ||
      link >= config_->links.size()) {
    return Handling::kIgnore;
  }
  const RobotState* robot = robots_.Find(link, message.id);
  if (message.opcode == protocol::kCommandAck) {
    protocol::CommandAck ack;
    const bool awaited = robot != nullptr && protocol::Decode(message, &ack) &&
                         robot->command.outcome == CommandOutcome::kPending &&
                         robot->command.command.seq == ack.seq &&
                         robot->command.command.code == ack.code;
    return awaited ? Handling::kChange : Handling::kIgnore;
  }
  if (FaultOf(message) != Reason::kNone) {
    return Handling::kAnswer;
  }
  if (message.opcode == protocol::kHello) {
    return Handling::kChange;
  }
  if (!protocol::IsMutating(message.opcode) || !SaidHello(link, message.id)) {
    return Handling::kAnswer;
  }
  switch (CompareSeq(*robot, message.data[0], protocol::MessageCrc(message))) {
    case SeqVerdict::kNew:
      return Handling::kChange;
    case SeqVerdict::kStale:
      return Handling::kIgnore;
    case SeqVerdict::kRepeat:
    case SeqVerdict::kReused:
      break;
  }
  return Handling::kAnswer;
}

void Engine::Answer(const Stamp& stamp, LinkIndex link, const Message& message,
                    std::vector<Outgoing>* out) const {
  const uint64_t now_ms = std::max(stamp.field_time_ms, field_time_ms_);
  const Reason fault = FaultOf(message);
  protocol::SenseRequest sense;
  protocol::Ping ping;
  if (fault != Reason::kNone) {
    out->push_back({link, 0, ErrorMessage(message, fault)});
  } else if (protocol::Decode(message, &sense)) {
    out->push_back({link, 0, AnswerSense(link, message, now_ms)});
  } else if (protocol::Decode(message, &ping)) {
    ping.answer = true;
    out->push_back({link, 0, {}});
    protocol::Encode(ping, &out->back().message);
  } else if (protocol::IsMutating(message.opcode)) {
    const RobotState* robot = robots_.Find(link, message.id);
    if (!SaidHello(link, message.id)) {
      out->push_back({link, 0, ErrorMessage(message, Reason::kSayHello)});
    } else if (CompareSeq(*robot, message.data[0], protocol::MessageCrc(message)) ==
               SeqVerdict::kRepeat) {
      out->push_back({link, robot->last_change, robot->last_answer});
    } else {
      out->push_back({link, 0, ErrorMessage(message, Reason::kSequenceReused)});
    }
  }
}

bool Engine::SaidHello(LinkIndex link, uint8_t id) const {
  const RobotState* robot = robots_.Find(link, id);
  return robot != nullptr && robot->epoch == epoch_;
}

field::PoseUm Engine::PoseOf(LinkIndex link, uint8_t id, const protocol::WirePose& reported,
                             uint64_t now_ms) const {
  const RobotState* robot = robots_.Find(link, id);
  if (robot != nullptr && robot->observed && now_ms < robot->observed->until_ms) {
    return robot->observed->pose;
  }
  const field::PoseUm pose = ToField(reported, config_->pose_unit_10um);
  const auto frame = frames_.find({link, id});
  return frame != frames_.end() ? ToMap(frame->second, pose) : pose;
}

Message Engine::AnswerSense(LinkIndex link, const Message& message, uint64_t now_ms) const {
  protocol::SenseRequest request;
  protocol::Decode(message, &request);
  field::SenseError error = field::SenseError::kNone;
  const auto p =
      field_->Sense(request.type, PoseOf(link, request.id, request.pose, now_ms), now_ms, &error);
  if (!p) {
    return ErrorMessage(message, ToReason(error));
  }
  const WireIntensities wire = ToWire(*p);
  Message answer;
  protocol::Encode(
      protocol::SenseAnswer{request.id, request.type, request.wide, wire.left, wire.right},
      &answer);
  return answer;
}

void Engine::On(const RequestReceived& request, std::vector<Outgoing>* out) {
  const Message& message = request.message;
  protocol::HelloRequest hello;
  protocol::CommandAck ack;
  if (protocol::Decode(message, &hello)) {
    Send(request.link, TakeHello(request.link, hello), out);
  } else if (protocol::Decode(message, &ack)) {
    TakeCommandAck(request.link, ack);
  } else {
    const Message answer = TakeChange(request.link, message);
    robots_.Update(request.link, message.id, [&](RobotState& robot) {
      robot.has_last = true;
      robot.last_opcode = message.opcode;
      robot.last_seq = message.data[0];
      robot.last_crc = protocol::MessageCrc(message);
      robot.last_answer = answer;
      robot.last_change = sequence_;
      robot.last_activity = sequence_;
      protocol::EventReport report;
      if (protocol::Decode(message, &report) && answer.opcode == protocol::kEventAck) {
        robot.last_event = report;
      }
    });
    Send(request.link, answer, out);
  }
}

// A new nonce means that the robot has booted: what it was told last is reported and then
// forgotten. The same nonce is a warm restart, or a HELLO whose answer was lost.
Message Engine::TakeHello(LinkIndex link, const protocol::HelloRequest& hello) {
  if (robots_.Find(link, hello.id) == nullptr &&
      robots_.CountOn(link) >= config_->robots_per_link) {
    robots_.ForgetIdlest(link);
    ++counters_.robots_forgotten;
  }
  protocol::HelloAnswer answer;
  robots_.Update(link, hello.id, [&](RobotState& robot) {
    answer.last_opcode = robot.last_opcode;
    answer.last_seq = robot.last_seq;
    const bool is_new = robot.last_activity == 0;
    if (!is_new && robot.nonce != hello.nonce) {
      counters_.id_conflicts += robot.previous_nonce == hello.nonce ? 1u : 0u;
      RobotState booted;
      booted.previous_nonce = robot.nonce;
      booted.next_command_seq = robot.next_command_seq;
      booted.command = robot.command;
      booted.last_event = robot.last_event;
      booted.observed = robot.observed;  // it stands where it stood
      if (booted.command.outcome == CommandOutcome::kPending) {
        booted.command.outcome = CommandOutcome::kUnknown;
        ++counters_.commands_unknown;
      }
      robot = booted;
    }
    robot.epoch = epoch_;
    robot.nonce = hello.nonce;
    robot.firmware_version = hello.firmware_version;
    robot.capabilities = hello.capabilities;
    robot.last_activity = sequence_;
  });
  answer.id = hello.id;
  answer.nonce = hello.nonce;
  answer.protocol_version = protocol::kProtocolVersion;
  answer.epoch = epoch_;
  answer.pose_unit_10um = config_->pose_unit_10um;
  answer.antenna_distance_mm =
      static_cast<uint16_t>(field::RoundDiv(config_->field.antennas.distance_um, 1000));
  answer.type_mask = TypeMaskOf(config_->field);
  answer.slot_ms = config_->links[link].slot_ms;
  answer.response_window_ms = config_->links[link].response_window_ms;
  Message message;
  protocol::Encode(answer, &message);
  return message;
}

Message Engine::TakeChange(LinkIndex link, const Message& request) {
  protocol::DepositRequest deposit;
  protocol::TraceRequest trace;
  protocol::EventReport event;
  if (protocol::Decode(request, &deposit)) {
    return TakeDeposit(link, request);
  }
  if (protocol::Decode(request, &trace)) {
    return TakeTrace(link, request);
  }
  const bool is_event = protocol::Decode(request, &event);
  assert(is_event);
  (void)is_event;
  if (event.code < protocol::EventCode::kLoadPicked ||
      event.code > protocol::EventCode::kBatteryLow) {
    return ErrorMessage(request, Reason::kBadValue);
  }
  Message answer;
  protocol::Encode(protocol::EventAck{event.id, event.seq}, &answer);
  return answer;
}

Message Engine::TakeDeposit(LinkIndex link, const Message& message) {
  protocol::DepositRequest request;
  protocol::Decode(message, &request);
  const field::PointUm point =
      PoseOf(link, request.id, {request.x, request.y, 0}, field_time_ms_).position;
  const field::PheromoneLaw* law = field_->FindLaw(request.type);
  const bool has_place = law != nullptr && !law->is_blend() && config_->field.map.Contains(point);
  const Reason reason =
      has_place && request.quanta == 0
          ? Reason::kBadValue
          : ToReason(field_->Deposit(request.type, point, request.quanta, field_time_ms_));
  if (reason != Reason::kNone) {
    return ErrorMessage(message, reason);
  }
  Message answer;
  protocol::Encode(protocol::DepositAnswer{request.id, request.type, request.seq}, &answer);
  return answer;
}

// Senses first, so that a robot does not sense the quantum that it is about to deposit. If that
// cannot be left, neither is an intensity told: a robot that lays a trail must learn that there is
// none.
Message Engine::TakeTrace(LinkIndex link, const Message& message) {
  protocol::TraceRequest request;
  protocol::Decode(message, &request);
  const field::PheromoneLaw* law = field_->FindLaw(request.type);
  if (law != nullptr && law->is_blend()) {
    return ErrorMessage(message, Reason::kNotPermitted);  // before the position, as for DEPOSIT
  }
  const field::PoseUm pose = PoseOf(link, request.id, request.pose, field_time_ms_);
  field::SenseError error = field::SenseError::kNone;
  const auto p = field_->Sense(request.type, pose, field_time_ms_, &error);
  const Reason reason =
      p ? ToReason(field_->Deposit(request.type, pose.position, 1, field_time_ms_))
        : ToReason(error);
  if (reason != Reason::kNone) {
    return ErrorMessage(message, reason);
  }
  const WireIntensities wire = ToWire(*p);
  Message answer;
  protocol::Encode(protocol::TraceAnswer{request.id, request.type, request.wide, request.seq,
                                         wire.left, wire.right},
                   &answer);
  return answer;
}

void Engine::TakeCommandAck(LinkIndex link, const protocol::CommandAck& ack) {
  robots_.Update(link, ack.id, [&](RobotState& robot) {
    robot.command.outcome = ack.result == 0 ? CommandOutcome::kAccepted : CommandOutcome::kRefused;
    robot.command.result = ack.result;
    robot.command.next_retry_ms = 0;
    robot.last_activity = sequence_;
  });
}

}  // namespace pheromone::engine
