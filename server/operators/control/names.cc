#include "server/operators/control/names.h"

#include <algorithm>

namespace pheromone::web {
namespace {

using protocol::CommandCode;
using protocol::EventCode;
using protocol::Reason;

}  // namespace

std::span<const CommandSpec> Commands() {
  static const std::vector<CommandSpec> commands = {
      {"halt", CommandCode::kHalt, {}},
      {"resume", CommandCode::kResume, {}},
      {"speed", CommandCode::kSpeed, {{"mm_per_s", 0, 1000, 2}}},
      {"go-to",
       CommandCode::kGoTo,
       {{"x", INT16_MIN, INT16_MAX, 2}, {"y", INT16_MIN, INT16_MAX, 2}}},
      {"follow", CommandCode::kFollowType, {{"type", 1, 15, 1}}},
      {"pick", CommandCode::kPickLoad, {}},
      {"drop", CommandCode::kDropLoad, {}},
      {"set",
       CommandCode::kSetParameter,
       {{"parameter", 0, UINT8_MAX, 1}, {"value", INT32_MIN, INT32_MAX, 4}}},
      {"get", CommandCode::kGetParameter, {{"parameter", 0, UINT8_MAX, 1}}},
  };
  return commands;
}

const CommandSpec* FindCommand(std::string_view name) {
  const auto commands = Commands();
  const auto found = std::find_if(commands.begin(), commands.end(),
                                  [name](const CommandSpec& it) { return it.name == name; });
  return found != commands.end() ? &*found : nullptr;
}

std::string ListOfCommands() {
  std::string list;
  for (const CommandSpec& command : Commands()) {
    list.append(list.empty() ? "" : ", ").append(command.name);
    for (const CommandSpec::Argument& argument : command.arguments) {
      list.append(&argument == &command.arguments.front() ? " (" : ", ").append(argument.name);
    }
    list += command.arguments.empty() ? "" : ")";
  }
  return list;
}

std::vector<uint8_t> EncodeArguments(const CommandSpec& command, std::span<const int64_t> values) {
  std::vector<uint8_t> bytes;
  for (size_t i = 0; i < command.arguments.size(); ++i) {
    auto rest = static_cast<uint64_t>(values[i]);
    for (uint8_t n = 0; n < command.arguments[i].bytes; ++n, rest >>= 8) {
      bytes.push_back(static_cast<uint8_t>(rest));
    }
  }
  return bytes;
}

std::string_view NameOf(CommandCode code) {
  for (const CommandSpec& command : Commands()) {
    if (command.code == code) {
      return command.name;
    }
  }
  return "unknown";
}

std::string_view NameOf(EventCode code) {
  switch (code) {
    case EventCode::kLoadPicked:
      return "load picked";
    case EventCode::kLoadDropped:
      return "load dropped";
    case EventCode::kObstacle:
      return "obstacle";
    case EventCode::kOffTheMap:
      return "off the map";
    case EventCode::kTrailLost:
      return "trail lost";
    case EventCode::kFailSafeStop:
      return "fail-safe stop";
    case EventCode::kGoalReached:
      return "goal reached";
    case EventCode::kParameterValue:
      return "parameter value";
    case EventCode::kBatteryLow:
      return "battery low";
    case EventCode::kStoppedByHand:
      return "stopped by hand";
    case EventCode::kPoseLost:
      return "pose lost";
    case EventCode::kNetException:
      return "net exception";
  }
  return "unknown";
}

std::string_view NameOf(Reason reason) {
  switch (reason) {
    case Reason::kNone:
      return "none";
    case Reason::kUnknownOpcode:
      return "unknown opcode";
    case Reason::kBadLength:
      return "bad length";
    case Reason::kOffTheMap:
      return "off the map";
    case Reason::kUnknownPheromone:
      return "unknown pheromone";
    case Reason::kSequenceReused:
      return "sequence reused";
    case Reason::kSayHello:
      return "say hello";
    case Reason::kBusy:
      return "busy";
    case Reason::kReadOnly:
      return "read-only";
    case Reason::kMapFull:
      return "map full";
    case Reason::kNotPermitted:
      return "not permitted";
    case Reason::kBadValue:
      return "bad value";
    case Reason::kBlockedByObstacle:
      return "blocked by obstacle";
    case Reason::kNoTagInRange:
      return "no tag in range";
    case Reason::kTagProtected:
      return "tag protected";
    case Reason::kTagFull:
      return "tag full";
    case Reason::kGenerationChanged:
      return "generation changed";
    case Reason::kUnknownSymbol:
      return "unknown symbol";
  }
  return "unknown";
}

std::string NameOf(const field::EditInfo& edit, std::string_view pheromone) {
  if (edit.is_configuration) {
    return "paths and rasters of the configuration";
  }
  constexpr std::array<std::string_view, 3> kPainted = {"area of ", "stroke of ", "whole map of "};
  constexpr std::array<std::string_view, 3> kErased = {" in an area", " along a line",
                                                       " on the whole map"};
  const std::string quoted = '"' + std::string(pheromone) + '"';
  const auto shape = static_cast<size_t>(edit.shape);
  return edit.action == field::FieldEdit::Action::kErase
             ? "erasure of " + quoted + std::string(kErased[shape])
             : std::string(kPainted[shape]) + quoted;
}

std::string_view NameOf(engine::CommandOutcome outcome) {
  switch (outcome) {
    case engine::CommandOutcome::kNone:
      return "none";
    case engine::CommandOutcome::kPending:
      return "pending";
    case engine::CommandOutcome::kAccepted:
      return "accepted";
    case engine::CommandOutcome::kRefused:
      return "refused";
    case engine::CommandOutcome::kUnanswered:
      return "unanswered";
    case engine::CommandOutcome::kUnknown:
      return "unknown";
  }
  return "unknown";
}

std::string_view NameOf(control::Notice::Topic topic) {
  switch (topic) {
    case control::Notice::Topic::kConfiguration:
      return "configuration";
    case control::Notice::Topic::kCapture:
      return "capture";
    case control::Notice::Topic::kLink:
      return "link";
    case control::Notice::Topic::kHealth:
      return "health";
    case control::Notice::Topic::kArrival:
      return "arrival";
    case control::Notice::Topic::kNet:
      return "net";
    case control::Notice::Topic::kOperator:
      break;
  }
  return "operator";
}

std::string_view NameOf(control::PoseSource source) {
  switch (source) {
    case control::PoseSource::kNone:
      return "none";
    case control::PoseSource::kRobot:
      return "robot";
    case control::PoseSource::kTracker:
      return "tracker";
  }
  return "none";
}

std::string_view NameOfRequest(uint8_t opcode) {
  switch (opcode) {
    case protocol::kScan:
      return "scan";
    case protocol::kTagRead:
      return "tag_read";
    case protocol::kTagWrite:
      return "tag_write";
    case protocol::kTagErase:
      return "tag_erase";
    case protocol::kSymbol:
      return "symbol";
    case protocol::kResolve:
      return "resolve";
    case protocol::kCommandAck:
      return "command_ack";
    case protocol::kEvent:
      return "event";
    case protocol::kHello:
      return "hello";
    case protocol::kPing:
      return "ping";
    default:
      break;
  }
  if (!protocol::TakesType(opcode) || protocol::TypeOf(opcode) == 0) {
    return "unknown";
  }
  switch (protocol::ServiceOf(opcode)) {
    case protocol::kSense:
      return "sense";
    case protocol::kSenseWide:
      return "sense_wide";
    case protocol::kDeposit:
      return "deposit";
    case protocol::kTrace:
      return "trace";
    default:
      return "trace_wide";
  }
}

}  // namespace pheromone::web
