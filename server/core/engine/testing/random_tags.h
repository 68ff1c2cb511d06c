// Tags for RandomTraffic: three where its robots meet, and three more with a net that is executed;
// and random requests and changes about them.
#pragma once

#include <cstdint>
#include <optional>
#include <random>
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

inline tags::Settings RichTags() {
  return {.tags = {{"a", 500'000, 500'000, 600'000, 8},
                   {"b", 800'000, 700'000, 600'000, 2},
                   {"c", 700'000, 900'000, 600'000, 3},
                   {"north", 600'000, 600'000, 600'000, 8},
                   {"exit", 700'000, 600'000, 600'000, 8},
                   {"pheromone", 600'000, 700'000, 600'000, 6}},
          .privileged = {"robot 1", "nobody", "net:gate"}};
}
/// The tags of the net are numbers 4 to 6.
inline constexpr uint16_t kFirstNetTag = 4;

inline std::vector<petri::LiveSettings> RichNets() {
  petri::LiveSettings gate = petri::LiveGateSettings();
  gate.has_source = true;
  gate.source = 5'000;
  return {gate};
}

class RandomTags {
 public:
  explicit RandomTags(std::mt19937_64* random) : random_(random) {}

  protocol::Message Request(uint8_t id, uint8_t seq, int16_t x, int16_t y) {
    switch (Below(12)) {
      case 0:
      case 1:
        return Define(id, seq);
      case 8:
      case 9:
      case 10:
        return WriteRecord(id, seq, x, y);
      case 2:
        return MessageOf(protocol::TagEraseRequest{id, seq, x, y, AnyTag(), AnySlot(), AnyFlags(),
                                                   AnyGeneration()});
      default:
        return Write(id, seq, x, y);
    }
  }

  TagsChanged Change() {
    switch (Below(10)) {
      case 0:
        return {TagsChanged::Forget{{Below(2) == 0 ? "" : "radio-a", 0}}};
      case 1:
      case 2:
      case 3: {
        tags::Row row{static_cast<tags::RowKind>(1 + Below(3)), AnyNumber(), AnyNumber(),
                      AnyText()};
        if (row.kind == tags::RowKind::kRobot) {
          row.number = row.robot;
        }
        return {TagsChanged::Define{row}};
      }
      case 4:
      case 5:
      case 6: {
        TagsChanged::Write write;
        write.tag = AnyTag();
        write.slot = Maybe(2, AnySlot());
        write.expected = Maybe(4, AnyGeneration());
        write.is_state = Below(2) == 0;
        write.lease_ms = Below(3) == 0 ? static_cast<uint32_t>(Below(5'000)) : 0;
        write.block = {AnyNumber(),
                       static_cast<uint32_t>(Below(200'000)),
                       {-17, AnyNumber()},
                       {1, AnyNumber()},
                       {-3, AnyNumber()}};
        return {write};
      }
      default:
        return {TagsChanged::Erase{AnyTag(), AnySlot(), Maybe(4, AnyGeneration())}};
    }
  }

  /// Another configuration: a tag moves, goes or returns, or has more slots.
  tags::Settings Settings() {
    tags::Settings settings = RichTags();
    settings.tags[Below(3)].x_um += static_cast<int64_t>(Below(200'000));
    if (Below(2) == 0) {
      settings.tags.erase(settings.tags.begin() + static_cast<ptrdiff_t>(Below(3)));
    }
    settings.tags[0].slots = static_cast<uint8_t>(settings.tags[0].slots + Below(2));
    return settings;
  }

  /// Another one: the pheromone evaporates by another law, or the source is filled; or no net.
  std::vector<petri::LiveSettings> Nets() {
    std::vector<petri::LiveSettings> nets = RichNets();
    nets[0].law = static_cast<petri::EvaporationLaw>(Below(6));
    nets[0].rate_milli = static_cast<uint32_t>(Below(9'000));
    nets[0].source += static_cast<uint32_t>(Below(2));
    if (Below(8) == 0) {
      nets.clear();
    }
    return nets;
  }

 private:
  uint64_t Below(uint64_t limit) { return (*random_)() % limit; }
  // One time in `times`.
  template <typename T>
  std::optional<T> Maybe(uint64_t times, T value) {
    return Below(times) == 0 ? std::optional(value) : std::nullopt;
  }
  uint16_t AnyTag() { return static_cast<uint16_t>(1 + Below(Below(8) == 0 ? 9 : 3)); }
  uint16_t AnyNetTag() { return static_cast<uint16_t>(kFirstNetTag + Below(3)); }
  uint8_t AnySlot() { return static_cast<uint8_t>(Below(9)); }
  uint8_t AnyFlags() { return static_cast<uint8_t>(Below(Below(16) == 0 ? 256 : 4)); }
  uint16_t AnyGeneration() { return static_cast<uint16_t>(Below(12)); }
  int32_t AnyNumber() { return static_cast<int32_t>(1 + Below(7)); }
  std::string AnyText() { return "robot " + std::to_string(Below(9)); }

  protocol::Message Define(uint8_t id, uint8_t seq) {
    const std::string text = AnyText();
    protocol::SymbolRequest request{
        id, seq, static_cast<protocol::SymbolKind>(1 + Below(3)), static_cast<int32_t>(Below(7)),
        0,  {}};
    if (request.kind != protocol::SymbolKind::kMapping) {
      request.length = static_cast<uint8_t>(text.size());
      std::copy(text.begin(), text.end(), request.text);
    }
    return MessageOf(request);
  }

  // What robots of a net leave: mostly as it should be.
  protocol::Message WriteRecord(uint8_t id, uint8_t seq, int16_t x, int16_t y) {
    protocol::TagWriteRequest request;
    request.id = id;
    request.seq = seq;
    request.x = x;
    request.y = y;
    request.tag = Below(16) == 0 ? AnyTag() : AnyNetTag();
    request.slot = Below(16) == 0 ? AnySlot() : protocol::kNoSlot;
    request.lease_s = static_cast<uint16_t>(Below(8) == 0 ? 0 : 60);
    uint8_t statement[protocol::kNetStatementSize];
    protocol::Encode(protocol::RobotRecord{petri::LiveGateSettings().robot_hash,
                                           static_cast<uint8_t>(Below(256)),
                                           static_cast<protocol::NetAction>(1 + Below(8)), 1,
                                           static_cast<uint16_t>(Below(100)), 0},
                     statement);
    if (Below(16) == 0) {
      statement[4 + Below(20)] ^= 1;
    }
    for (size_t i = 0; i < protocol::kStatementWords; ++i) {
      request.words[i] = protocol::GetI32(statement + 4 * i);
    }
    return MessageOf(request);
  }

  protocol::Message Write(uint8_t id, uint8_t seq, int16_t x, int16_t y) {
    protocol::TagWriteRequest request;
    request.id = id;
    request.seq = seq;
    request.x = x;
    request.y = y;
    request.tag = AnyTag();
    request.slot = Below(2) == 0 ? protocol::kNoSlot : AnySlot();
    request.flags = AnyFlags();
    request.expected = AnyGeneration();
    request.lease_s = static_cast<uint16_t>(Below(3) == 0 ? Below(4) : 0);
    request.time = static_cast<uint32_t>(Below(3) == 0 ? 0 : Below(200'000));
    const int32_t words[] = {-17,
                             AnyNumber(),
                             1,
                             AnyNumber(),
                             Below(16) == 0 ? -2 : -3,
                             static_cast<int32_t>((*random_)())};
    std::copy(std::begin(words), std::end(words), request.words);
    return MessageOf(request);
  }

  std::mt19937_64* random_;
};

}  // namespace pheromone::engine::testing
