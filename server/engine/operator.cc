// What the operator does: commands to robots, and changes of the map by hand.

#include <algorithm>
#include <cassert>
#include <string>
#include <utility>

#include "server/engine/engine.h"

namespace pheromone::engine {
using protocol::Message;

Status Engine::CheckCommand(const CommandIssued& command) const {
  if (command.link >= config_->links.size()) {
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
  if (!broadcast && robots_.Find(command.link, command.id) == nullptr) {
    return Error{"no robot " + std::to_string(command.id) + " has said HELLO on link \"" +
                 config_->links[command.link].name + "\""};
  }
  return Ok();
}

// A newer command takes the place of one that is still pending: an operator who says halt means
// now.
void Engine::On(const CommandIssued& issued, std::vector<Outgoing>* out) {
  assert(CheckCommand(issued).ok());
  if (issued.id == protocol::kBroadcastId) {
    DropPendingResumes(issued.link);
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

// Repeated after a halt to all, they would undo it.
void Engine::DropPendingResumes(LinkIndex link) {
  std::vector<uint8_t> ids;
  robots_.ForEach([&](LinkIndex its_link, uint8_t id, const RobotState& robot) {
    if (its_link == link && robot.has_pending_command() &&
        robot.command.command.code == protocol::CommandCode::kResume) {
      ids.push_back(id);
    }
  });
  for (const uint8_t id : ids) {
    robots_.Update(link, id, [&](RobotState& robot) { GiveUp(&robot.command); });
  }
}

void Engine::GiveUp(CommandState* command) {
  command->outcome = CommandOutcome::kUnanswered;
  command->next_retry_ms = 0;
  ++counters_.commands_unanswered;
}

void Engine::SendCommand(LinkIndex link, uint8_t id, RobotState* robot,
                         std::vector<Outgoing>* out) {
  CommandState& state = robot->command;
  if (state.sent == kCommandTransmissions) {
    GiveUp(&state);
    return;
  }
  // A resume that overtook the last transmission of a halt to all would be undone by it.
  if (state.command.code == protocol::CommandCode::kResume) {
    const auto halt = std::find_if(broadcasts_.begin(), broadcasts_.end(),
                                   [&](const Broadcast& it) { return it.link == link; });
    if (halt != broadcasts_.end()) {
      state.next_retry_ms = halt->next_ms;
      return;
    }
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

Status Engine::CheckEdit(const field::FieldEdit& edit) const {
  const std::string type = "pheromone type " + std::to_string(edit.type);
  const field::PheromoneLaw* law = field_->FindLaw(edit.type);
  if (law == nullptr) {
    return Error{type + " is not configured"};
  }
  if (law->is_blend()) {
    return Error{type + " (\"" + law->name + "\") is a blend, which has no pheromone of its own"};
  }
  if (edit.action != field::FieldEdit::Action::kErase && edit.level > law->max_level()) {
    return Error{type + " (\"" + law->name + "\") holds at most " +
                 std::to_string(law->max_level()) + "/64 quanta, not " +
                 std::to_string(edit.level) + "/64"};
  }
  Status shape = field::CheckShape(edit);
  if (shape.ok() && !field_->accepts_work()) {
    return Error{"too many map edits are pending; try again in a moment"};
  }
  return shape;
}

void Engine::On(const FieldEdited& edited, std::vector<Outgoing>* /*out*/) {
  assert(CheckEdit(edited.edit).ok());
  if (edited.in_portions) {
    field_->BeginEdit(sequence_, edited.edit, edited.raster, field_time_ms_);
  } else {
    finished_.push_back({sequence_, field_->Edit(edited.edit, field_time_ms_)});
  }
}

}  // namespace pheromone::engine
