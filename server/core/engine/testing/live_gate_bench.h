// An engine with the small net of server/core/petri/testing/live_gate.h on three tags, and robots
// that write records on them by radio.
#pragma once

#include <algorithm>
#include <cstring>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "protocol/byte_order.h"
#include "protocol/net_record.h"
#include "protocol/tag_messages.h"
#include "server/core/engine/nets_part.h"
#include "server/core/engine/tags_part.h"
#include "server/core/engine/testing/bench.h"
#include "server/core/petri/testing/live_gate.h"

namespace pheromone::engine::testing {

/// Tags 1 "north", 2 "exit" and 3 "pheromone", all in range of (1 m, 1 m).
inline tags::Settings GateTags() {
  return {.tags = {{"north", 1'000'000, 1'000'000, 900'000, 8},
                   {"exit", 1'100'000, 1'000'000, 900'000, 8},
                   {"pheromone", 1'200'000, 1'000'000, 900'000, 8}},
          .privileged = {"operator", "net:gate"}};
}

inline EngineConfig ConfigWith(const std::vector<petri::LiveSettings>& nets,
                               const tags::Settings& tags = GateTags()) {
  EngineConfig config = SmallConfig();
  config.tags = tags;
  config.nets = nets;
  return config;
}

inline EngineConfig GateConfig() {
  return ConfigWith({petri::LiveGateSettings()});
}

class GateBench {
 public:
  static constexpr uint16_t kNorth = 1;
  static constexpr uint16_t kExit = 2;
  static constexpr uint16_t kPheromone = 3;
  static constexpr uint32_t kHash = 0x1234;

  explicit GateBench(const EngineConfig& config = GateConfig()) : bench(config) {}

  /// A robot that says HELLO and names itself; its number as an author is its ID.
  void Register(uint8_t id) {
    bench.Handle(Hello(id, 1));
    const std::string unique_id = "robot " + std::to_string(id);
    protocol::SymbolRequest request{
        id, NextSeq(id), protocol::SymbolKind::kRobot, id, static_cast<uint8_t>(unique_id.size()),
        {}};
    std::memcpy(request.text, unique_id.data(), unique_id.size());
    bench.Handle(MessageOf(request));
  }

  uint8_t NextSeq(uint8_t id) { return ++seqs[id]; }

  protocol::TagWriteRequest WriteRequest(uint8_t id, uint16_t tag, const uint8_t* statement,
                                         uint16_t lease_s = 3'600) {
    protocol::TagWriteRequest request;
    request.id = id;
    request.seq = NextSeq(id);
    request.x = 1'000;
    request.y = 1'000;
    request.tag = tag;
    request.slot = protocol::kNoSlot;
    request.lease_s = lease_s;
    for (size_t i = 0; i < protocol::kStatementWords; ++i) {
      request.words[i] = protocol::GetI32(statement + 4 * i);
    }
    return request;
  }

  protocol::Message RecordMessage(uint8_t id, uint16_t tag, protocol::NetAction action, uint8_t seq,
                                  uint16_t amount = 0) {
    uint8_t statement[protocol::kNetStatementSize];
    protocol::Encode(protocol::RobotRecord{kHash, seq, action, 1, amount, 0}, statement);
    return MessageOf(WriteRequest(id, tag, statement));
  }

  /// The reason of a refusal by the tag, kNone if the record was written.
  protocol::Reason Write(uint8_t id, uint16_t tag, protocol::NetAction action, uint8_t seq,
                         uint16_t amount = 0) {
    return bench.HandleForReason(RecordMessage(id, tag, action, seq, amount));
  }

  /// What slot 1 tells; nothing if it is not the environment's.
  std::optional<protocol::EnvironmentRecord> Read(uint8_t id, uint16_t tag) {
    const auto statement = StatementIn(id, tag, protocol::kEnvironmentSlot);
    protocol::EnvironmentRecord record{};
    return protocol::Decode(statement.data(), kHash, &record) == protocol::NetRecordFault::kNone
               ? std::optional(record)
               : std::nullopt;
  }

  std::array<uint8_t, protocol::kNetStatementSize> StatementIn(uint8_t id, uint16_t tag,
                                                               uint8_t slot) {
    std::array<uint8_t, protocol::kNetStatementSize> statement{};
    const auto answer =
        bench.Handle(MessageOf(protocol::TagReadRequest{id, 1'000, 1'000, tag, slot}));
    protocol::TagReadAnswer read;
    if (answer && protocol::Decode(*answer, &read)) {
      for (size_t i = 0; i < protocol::kStatementWords; ++i) {
        protocol::PutI32(&statement[4 * i], read.words[protocol::kWordSubjectNamespace + i]);
      }
    }
    return statement;
  }

  /// Lets time pass as the service does: an Advance whenever one is due.
  void Wait(uint64_t ms) {
    const uint64_t until_ms = bench.now_ms + ms;
    for (auto due = bench.engine.NextDeadline(); due && *due <= until_ms;
         due = bench.engine.NextDeadline()) {
      bench.now_ms = std::max(bench.now_ms, *due);
      bench.Apply(Advance{});
    }
    bench.now_ms = until_ms;
  }

  const NetsPart& nets() const { return bench.engine.nets(); }
  const petri::LiveNet& net() const { return nets().nets().find("gate")->second.net; }
  const tags::Store& store() const { return bench.engine.tags(); }
  const tags::Tag& tag(uint16_t number) const { return store().Find(number)->tag; }

  Bench bench;
  std::map<uint8_t, uint8_t> seqs;
};

}  // namespace pheromone::engine::testing
