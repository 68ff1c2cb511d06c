#include "server/engine/engine.h"

#include <algorithm>
#include <cassert>
#include <string>
#include <utility>

#include "server/base/hash.h"
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

uint16_t TypeMask(const field::FieldConfig& config) {
  uint16_t mask = 0;
  for (const field::PheromoneLaw& law : config.pheromones) {
    mask = static_cast<uint16_t>(mask | (1u << law.type));
  }
  return mask;
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
    case field::DepositResult::kDone:
      break;
  }
  return Reason::kNone;
}

// What HELLO tells a client of the configuration: if it changes, clients must ask again.
bool SameHello(const EngineConfig& a, const EngineConfig& b) {
  return a.pose_unit_10um == b.pose_unit_10um &&
         a.field.antenna_distance_um == b.field.antenna_distance_um &&
         TypeMask(a.field) == TypeMask(b.field) && a.links == b.links;
}

uint64_t HashConfig(const EngineConfig& config) {
  const field::MapGeometry& map = config.field.map;
  const auto u = [](int64_t value) { return static_cast<uint64_t>(value); };
  uint64_t hash =
      Hash64({'C', u(map.origin.x), u(map.origin.y), u(map.width_um), u(map.height_um),
              u(map.cell_um), u(config.field.antenna_distance_um), config.field.memory_bytes,
              config.pose_unit_10um, config.robots_per_link});
  for (const field::PheromoneLaw& law : config.field.pheromones) {
    hash = HashStep(
        hash, Hash64({law.type, HashText(law.name), u(law.core_um), u(law.sigma_um), u(law.tau_ms),
                      u(law.quantum_micro), law.max_count, law.directional ? 1u : 0u}));
  }
  for (const field::Path& path : config.field.paths) {
    hash = HashStep(hash, Hash64({path.type, path.count, path.closed ? 1u : 0u}));
    for (const field::PointUm point : path.points) {
      hash = HashStep(hash, Hash64({u(point.x), u(point.y)}));
    }
  }
  for (const LinkSettings& link : config.links) {
    hash = HashStep(hash, Hash64({HashText(link.name), link.slot_ms, link.response_window_ms}));
  }
  return hash;
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
      link >= config_.links.size()) {
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
  if (!protocol::IsMutating(message.opcode) || robot == nullptr || robot->epoch != epoch_) {
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
    out->push_back({link, 0, AnswerSense(message, now_ms)});
  } else if (protocol::Decode(message, &ping)) {
    ping.answer = true;
    out->push_back({link, 0, {}});
    protocol::Encode(ping, &out->back().message);
  } else if (protocol::IsMutating(message.opcode)) {
    const RobotState* robot = robots_.Find(link, message.id);
    if (robot == nullptr || robot->epoch != epoch_) {
      out->push_back({link, 0, ErrorMessage(message, Reason::kSayHello)});
    } else if (CompareSeq(*robot, message.data[0], protocol::MessageCrc(message)) ==
               SeqVerdict::kRepeat) {
      out->push_back({link, robot->last_change, robot->last_answer});
    } else {
      out->push_back({link, 0, ErrorMessage(message, Reason::kSequenceReused)});
    }
  }
}

Message Engine::AnswerSense(const Message& message, uint64_t now_ms) const {
  protocol::SenseRequest request;
  protocol::Decode(message, &request);
  field::SenseError error = field::SenseError::kNone;
  const auto p =
      field_->Sense(request.type, ToField(request.pose, config_.pose_unit_10um), now_ms, &error);
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

void Engine::Apply(uint64_t sequence, const Stamp& stamp, const Event& event,
                   std::vector<Outgoing>* out) {
  sequence_ = sequence;
  field_time_ms_ = std::max(stamp.field_time_ms, field_time_ms_);
  std::visit([&](const auto& it) { On(it, out); }, event);
}

void Engine::Send(LinkIndex link, const Message& message, std::vector<Outgoing>* out) const {
  out->push_back({link, sequence_, message});
}

void Engine::On(const RequestReceived& request, std::vector<Outgoing>* out) {
  assert(Classify(request.link, request.message) == Handling::kChange);
  const Message& message = request.message;
  protocol::HelloRequest hello;
  protocol::CommandAck ack;
  if (protocol::Decode(message, &hello)) {
    Send(request.link, TakeHello(request.link, hello), out);
  } else if (protocol::Decode(message, &ack)) {
    TakeCommandAck(request.link, ack);
  } else {
    const Message answer = TakeChange(message);
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
  if (robots_.Find(link, hello.id) == nullptr && robots_.CountOn(link) >= config_.robots_per_link) {
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
  answer.pose_unit_10um = config_.pose_unit_10um;
  answer.antenna_distance_mm =
      static_cast<uint16_t>(field::RoundDiv(config_.field.antenna_distance_um, 1000));
  answer.type_mask = TypeMask(config_.field);
  answer.slot_ms = config_.links[link].slot_ms;
  answer.response_window_ms = config_.links[link].response_window_ms;
  Message message;
  protocol::Encode(answer, &message);
  return message;
}

Message Engine::TakeChange(const Message& request) {
  protocol::DepositRequest deposit;
  protocol::TraceRequest trace;
  protocol::EventReport event;
  if (protocol::Decode(request, &deposit)) {
    return TakeDeposit(request);
  }
  if (protocol::Decode(request, &trace)) {
    return TakeTrace(request);
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

Message Engine::TakeDeposit(const Message& message) {
  protocol::DepositRequest request;
  protocol::Decode(message, &request);
  const field::PointUm point{ToMicrometres(request.x, config_.pose_unit_10um),
                             ToMicrometres(request.y, config_.pose_unit_10um)};
  const bool has_place =
      field_->FindLaw(request.type) != nullptr && config_.field.map.Contains(point);
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

// Senses first, so that a robot does not smell the quantum it is about to leave.
Message Engine::TakeTrace(const Message& message) {
  protocol::TraceRequest request;
  protocol::Decode(message, &request);
  const field::PoseUm pose = ToField(request.pose, config_.pose_unit_10um);
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

Status Engine::CheckConfig(const EngineConfig& next) const {
  return configured() ? field_->CheckReconfigure(next.field, field_time_ms_) : Ok();
}

void Engine::On(const ConfigChanged& change, std::vector<Outgoing>* /*out*/) {
  const bool is_new = !configured();
  if (is_new || !SameHello(config_, change.config)) {
    epoch_ = change.new_epoch;
  }
  if (is_new) {
    field_ = std::make_unique<field::Field>(change.config.field);
  } else {
    field_->Reconfigure(change.config.field, field_time_ms_);
  }
  if (!is_new && config_.links != change.config.links) {
    broadcasts_.clear();  // their links may have other places now
  }
  config_ = change.config;
  robots_.SetLinks(config_.links);
}

Status Engine::CheckCommand(const CommandIssued& command) const {
  if (command.link >= config_.links.size()) {
    return Error{"there is no link " + std::to_string(command.link)};
  }
  const auto code = static_cast<uint8_t>(command.code);
  if (protocol::CommandArgumentLength(code) > protocol::kMaxCommandArguments) {
    return Error{"there is no command " + std::to_string(code)};
  }
  const bool broadcast = command.id == protocol::kBroadcastId;
  if (broadcast && command.code != protocol::CommandCode::kHalt) {
    return Error{"only halt can be sent to all robots"};
  }
  if (!broadcast && robots_.Find(command.link, command.id) == nullptr) {
    return Error{"no robot " + std::to_string(command.id) + " has said HELLO on link \"" +
                 config_.links[command.link].name + "\""};
  }
  return Ok();
}

// A newer command takes the place of one that is still pending: an operator who says halt means
// now.
void Engine::On(const CommandIssued& issued, std::vector<Outgoing>* out) {
  assert(CheckCommand(issued).ok());
  if (issued.id == protocol::kBroadcastId) {
    broadcasts_.push_back({issued.link, next_broadcast_seq_++, kBroadcastTransmissions, 0});
    SendBroadcast(&broadcasts_.back(), out);
    return;
  }
  robots_.Update(issued.link, issued.id, [&](RobotState& robot) {
    robot.command = CommandState{};
    robot.command.outcome = CommandOutcome::kPending;
    robot.command.command.id = issued.id;
    robot.command.command.seq = robot.next_command_seq++;
    robot.command.command.code = issued.code;
    std::copy(issued.arguments.begin(), issued.arguments.end(), robot.command.command.arguments);
    SendCommand(issued.link, issued.id, &robot, out);
  });
}

void Engine::SendCommand(LinkIndex link, uint8_t id, RobotState* robot,
                         std::vector<Outgoing>* out) {
  CommandState& state = robot->command;
  if (state.sent == kCommandTransmissions) {
    state.outcome = CommandOutcome::kUnanswered;
    state.next_retry_ms = 0;
    ++counters_.commands_unanswered;
    return;
  }
  state.next_retry_ms = field_time_ms_ + std::min(kFirstRetryMs << state.sent, kLongestRetryMs);
  ++state.sent;
  Message message;
  protocol::Encode(state.command, &message);
  message.id = id;
  Send(link, message, out);
}

void Engine::SendBroadcast(Broadcast* broadcast, std::vector<Outgoing>* out) {
  protocol::Command halt;
  halt.id = protocol::kBroadcastId;
  halt.seq = broadcast->seq;
  halt.code = protocol::CommandCode::kHalt;
  Message message;
  protocol::Encode(halt, &message);
  Send(broadcast->link, message, out);
  --broadcast->left;
  broadcast->next_ms = field_time_ms_ + kBroadcastIntervalMs;
}

// A long gap is one step: a command that has missed several retries is sent once.
void Engine::On(const Advance& /*advance*/, std::vector<Outgoing>* out) {
  std::vector<std::pair<LinkIndex, uint8_t>> due;
  robots_.ForEach([&](LinkIndex link, uint8_t id, const RobotState& robot) {
    if (robot.command.outcome == CommandOutcome::kPending &&
        robot.command.next_retry_ms <= field_time_ms_) {
      due.emplace_back(link, id);
    }
  });
  for (const auto& [link, id] : due) {
    robots_.Update(link, id, [&, link = link, id = id](RobotState& robot) {
      SendCommand(link, id, &robot, out);
    });
  }
  for (Broadcast& broadcast : broadcasts_) {
    if (broadcast.next_ms <= field_time_ms_) {
      SendBroadcast(&broadcast, out);
    }
  }
  std::erase_if(broadcasts_, [](const Broadcast& broadcast) { return broadcast.left == 0; });
}

std::optional<uint64_t> Engine::NextDeadline() const {
  std::optional<uint64_t> next;
  const auto consider = [&next](uint64_t at) { next = next ? std::min(*next, at) : at; };
  robots_.ForEach([&](LinkIndex, uint8_t, const RobotState& robot) {
    if (robot.command.outcome == CommandOutcome::kPending) {
      consider(robot.command.next_retry_ms);
    }
  });
  for (const Broadcast& broadcast : broadcasts_) {
    consider(broadcast.next_ms);
  }
  return next;
}

uint64_t Engine::StateHash() const {
  uint64_t hash = Hash64({'E', epoch_, next_broadcast_seq_}) + robots_.hash();
  for (const Broadcast& broadcast : broadcasts_) {
    hash += Hash64({'B', broadcast.link, broadcast.seq, broadcast.left, broadcast.next_ms});
  }
  if (configured()) {
    hash += HashConfig(config_) + field_->hash();
  }
  return hash;
}

}  // namespace pheromone::engine
