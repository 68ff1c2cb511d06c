// The names of the protocol's numbers, in JSON, in metrics and on the command line.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/operators/control/control.h"

namespace pheromone::web {

/// A command and its arguments, in the order and sizes of the wire.
struct CommandSpec {
  struct Argument {
    std::string_view name;
    int64_t least = 0;
    int64_t most = 0;
    uint8_t bytes = 1;
  };
  std::string_view name;
  protocol::CommandCode code = protocol::CommandCode::kHalt;
  std::vector<Argument> arguments;
};

std::span<const CommandSpec> Commands();

/// Null if there is none with that name.
const CommandSpec* FindCommand(std::string_view name);

/// "halt, resume, speed (mm_per_s), ..."
std::string ListOfCommands();

/// Little-endian, as on the wire. `values` are as many as the command has, each in its range.
std::vector<uint8_t> EncodeArguments(const CommandSpec& command, std::span<const int64_t> values);

std::string_view NameOf(protocol::CommandCode code);
std::string_view NameOf(protocol::EventCode code);
std::string_view NameOf(protocol::Reason reason);
std::string_view NameOf(engine::CommandOutcome outcome);
/// Of an edit of the map, as in "undid: stroke of "trail"".
std::string NameOf(const field::EditInfo& edit, std::string_view pheromone);
std::string_view NameOf(control::PoseSource source);
std::string_view NameOf(control::Notice::Topic topic);

/// The service of a client's opcode: "sense", "trace"; "unknown" for those without meaning.
std::string_view NameOfRequest(uint8_t opcode);

}  // namespace pheromone::web
