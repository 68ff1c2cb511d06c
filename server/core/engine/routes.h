// Which part of the engine answers which messages of clients.
#pragma once

#include <cstdint>

#include "protocol/opcodes.h"

namespace pheromone::engine {

/// What a message from a client asks for.
enum class Handling {
  kIgnore,  ///< never answered: an echo, an invalid robot ID, an old duplicate
  kAnswer,  ///< answered from the present state, which stays as it is
  kChange,  ///< must go through the log
};

struct Route {
  enum class Part : uint8_t { kNone, kRobots, kField, kTags };
  enum class Effect : uint8_t {
    kReads,    ///< leaves the state as it is
    kChanges,  ///< DATA begins with a seq; done exactly once
    kHello,    ///< the robots' HELLO, which has rules of its own
    kAck,      ///< and the ACK of a command, which is not answered
  };

  Part part = Part::kNone;        ///< kNone: no client sends such a message
  protocol::LengthRule length{};  ///< of DATA
  Effect effect = Effect::kReads;
};

/// For any opcode.
const Route& RouteOf(uint8_t opcode);

}  // namespace pheromone::engine
