// The changes that the robot of conversation_world.h makes, each at a place of its own, so that the
// server's state tells how often it was made: deposits, of which the level of a node is the number,
// or WRITEs of a tag, of which the generation of a slot is.
//
//   Engine server = ServerFor(ChangeKind::kWrite);
//   exchange.message = WriteOf(ChangeKind::kWrite, 2);   // the third change
//   ...
//   if (TimesMade(ChangeKind::kWrite, server, 2) != 1) ...
//
// Pure.
#pragma once

#include <cstdint>
#include <string>

#include "client_fw/core/steering/parameters.h"
#include "protocol/messages.h"
#include "server/core/engine/engine.h"

namespace pheromone::verify {

enum class ChangeKind : uint8_t {
  kDeposit,           ///< TRACE
  kWrite,             ///< WRITE to a slot of a tag, whatever is there
  kConditionalWrite,  ///< WRITE that expects a generation: the slot's, but for what IsInVain tells
};
/// Of tags, as many as a tag has slots.
constexpr int kMaxWrites = 8;

constexpr uint8_t kChangesRobot = 1;      ///< CLIENT_ID of the robot that makes them, on link 0
constexpr int32_t kBetweenMm = 100;       ///< deposit n is made at x = n * kBetweenMm, y = 0
constexpr uint16_t kTagPeriodMs = 2'000;  ///< of a robot that writes on tags: `period_ms`

/// Whether a request is one of TAG.
inline bool IsOfTags(uint8_t opcode) {
  return protocol::ServiceOf(opcode) == protocol::ServiceOf(protocol::kTagWrite);
}

/// A server that has been started. It knows the robot that is to write on tags from before.
engine::Engine ServerFor(ChangeKind kind);
client::Parameters RobotFor(ChangeKind kind, uint16_t boot_counter);
/// The request, for client::Conversation::Ask; only of tags.
protocol::Message WriteOf(ChangeKind kind, int change);

/// A WRITE that is to be refused, since the slot never has the generation that it expects.
constexpr bool IsInVain(ChangeKind kind, int change) {
  return kind == ChangeKind::kConditionalWrite && change % 2 == 1;
}

uint32_t TimesMade(ChangeKind kind, const engine::Engine& server, int change);
/// Of the tag.
uint16_t GenerationOn(const engine::Engine& server);
/// Empty, or what the server's answer to a WRITE has that does not fit. It follows its only
/// execution, and no later change has been made before it.
std::string FaultOfAnswer(const engine::Engine& server, int change,
                          const protocol::Message& answer);

}  // namespace pheromone::verify
