#include "client_fw/verify/conversation_changes.h"

#include <algorithm>
#include <cassert>
#include <string_view>
#include <utility>
#include <vector>

#include "protocol/tag_messages.h"

namespace pheromone::verify {
namespace {

using engine::Engine;
using protocol::Message;

constexpr uint8_t kType = 1;
constexpr uint16_t kTag = 1;
constexpr int32_t kAuthor = 15;
constexpr uint16_t kEarlierNonce = 0xFFFF;  // of the boot in which the robot told its number

engine::EngineConfig ConfigFor(ChangeKind kind) {
  field::PheromoneLaw law;
  law.type = kType;
  law.name = "path";
  law.core_um = 100'000;
  law.sigma_um = 100'000;
  law.tau_ms = 0;  // what was deposited stays
  law.quantum_micro = 125'000;
  law.max_count = 8;
  engine::EngineConfig config;
  config.field.map = {
      .origin = {0, 0}, .width_um = 1'000'000, .height_um = 100'000, .cell_um = 100'000};
  config.field.antennas.distance_um = 100'000;
  config.field.pheromones = {law};
  config.field.memory_bytes = 1 << 20;
  config.links = {{"radio-a", 1, 40}};
  if (kind != ChangeKind::kDeposit) {
    config.tags.tags = {{.name = "tag", .slots = kMaxWrites}};
  }
  return config;
}

template <typename Request>
void Apply(const Request& request, Engine* server) {
  Message message;
  protocol::Encode(request, &message);
  std::vector<engine::Outgoing> out;
  server->Apply(server->sequence() + 1, {1, 0}, engine::RequestReceived{0, message}, &out);
  assert(out.size() == 1 && out.front().message.opcode != protocol::kError);
}

const tags::Tag& TagOn(const Engine& server) {
  return server.tags().Find(kTag)->tag;
}

}  // namespace

Engine ServerFor(ChangeKind kind) {
  Engine server;
  std::vector<engine::Outgoing> none;
  server.Apply(1, {1, 0}, engine::ConfigChanged{ConfigFor(kind), 7}, &none);
  if (kind != ChangeKind::kDeposit) {
    constexpr std::string_view kId = "123-233-201";
    protocol::SymbolRequest symbol{kChangesRobot,       1, protocol::SymbolKind::kRobot, kAuthor,
                                   uint8_t{kId.size()}, {}};
    std::copy(kId.begin(), kId.end(), symbol.text);
    Apply(protocol::HelloRequest{kChangesRobot, kEarlierNonce, 1, 0}, &server);
    Apply(symbol, &server);
  }
  return server;
}

client::Parameters RobotFor(ChangeKind kind, uint16_t boot_counter) {
  client::Parameters parameters{};
  parameters.id = kChangesRobot;
  parameters.type = kType;
  parameters.start_released = true;
  parameters.boot_counter = boot_counter;
  parameters.lay_trail = kind == ChangeKind::kDeposit;
  if (kind != ChangeKind::kDeposit) {
    // Its periods end, and it falls silent, when the world says so.
    parameters.period_ms = kTagPeriodMs;
    parameters.fail_safe_ms = 28'000;
    parameters.lost_after_ms = 0;
  }
  return parameters;
}

Message WriteOf(ChangeKind kind, int change) {
  assert(kind != ChangeKind::kDeposit && change < kMaxWrites);
  protocol::TagWriteRequest write;
  write.tag = kTag;
  write.slot = static_cast<uint8_t>(change);
  write.flags = kind == ChangeKind::kConditionalWrite ? protocol::kTagExpect : uint8_t{0};
  write.expected = IsInVain(kind, change) ? uint16_t{7} : uint16_t{0};
  const int32_t words[] = {protocol::kTypeTag, kTag, 1, 2, protocol::kTypeInt, change};
  std::copy(std::begin(words), std::end(words), write.words);
  Message message;
  protocol::Encode(write, &message);
  return message;
}

uint32_t TimesMade(ChangeKind kind, const Engine& server, int change) {
  if (kind != ChangeKind::kDeposit) {
    return TagOn(server).slots()[static_cast<size_t>(change)].generation;
  }
  const uint32_t level = server.field().LevelOf(kType, {change, 0}, server.field_time_ms());
  return level / field::kLevelsPerQuantum;
}

uint16_t GenerationOn(const Engine& server) {
  return TagOn(server).generation();
}

std::string FaultOfAnswer(const Engine& server, int change, const Message& answer) {
  protocol::TagWritten written;
  if (!protocol::Decode(answer, &written) || written.erased || written.tag != kTag ||
      written.slot != change) {
    return "is of something else";
  }
  return written.slot_generation == 1 && written.tag_generation == GenerationOn(server)
             ? ""
             : "has generations that are not those after it";
}

}  // namespace pheromone::verify
