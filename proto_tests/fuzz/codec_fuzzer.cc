// Any bytes as what the engine keeps in files. The first byte says what the rest is:
//
//   0  an event
//   1  a configuration
//   2  a state
//
// Reading must not crash. An event or a configuration is written back as the same bytes, for there
// is one way to write it; with a configuration an engine can be run: events happen, its log leads
// to the same state, and what it saves is restored.

#include <cstdint>
#include <cstdlib>
#include <iterator>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "proto_tests/fuzz/lasting.h"
#include "server/core/engine/config_codec.h"
#include "server/core/engine/event_codec.h"
#include "server/core/engine/testing/bench.h"

namespace {

using namespace pheromone::engine;  // NOLINT(google-build-using-namespace)
using pheromone::ByteReader;
using pheromone::ByteWriter;
using pheromone::fuzz::Require;
using pheromone::fuzz::RequireLasting;

// Large maps and many nodes are slow, not wrong; and sanitizers have no memory to spare.
constexpr uint64_t kMaxMemory = uint64_t{1} << 24;
constexpr int32_t kMaxSide = 2'000;

// Whether all was read, and it was good.
bool IsWhole(ByteReader* reader) {
  reader->ExpectEnd();
  return reader->ok();
}

// A robot in the middle of the map does what robots do, with every type.
void Run(const EngineConfig& config) {
  const pheromone::field::MapGeometry& map = config.field.map;
  if (config.field.memory_bytes > kMaxMemory || map.columns() > kMaxSide || map.rows() > kMaxSide ||
      config.links.empty()) {
    return;
  }
  Engine empty;
  if (!empty.Check(ConfigChanged{config, 7}).ok()) {
    return;
  }
  testing::Bench bench(config);
  bench.Handle(testing::Hello(1, 1));
  const PoseObserved seen{
      0, 1, {{map.origin.x + map.width_um / 2, map.origin.y + map.height_um / 2}, 8'192}, 60'000};
  bench.Apply(seen);
  const GoalSet set{0, 1, {{seen.pose.position, map.origin}, 100'000}};
  if (bench.engine.Check(set).ok()) {  // its corner may be blocked
    bench.Apply(set);
  }
  uint8_t seq = 0;
  for (uint8_t type = 1; type < pheromone::field::kTypes; ++type) {
    bench.Handle(testing::Deposit(1, ++seq, 0, 0, 9, type));
    bench.now_ms += 777;
    bench.Apply(Advance{});
    bench.Handle(testing::Trace(1, ++seq, 0, 0, 0, type));
    bench.Handle(testing::Sense(1, 0, 0, 0, type));
  }
  RequireLasting(bench.engine);
  Engine replayed;
  std::vector<Outgoing> none;
  for (size_t i = 0; i < bench.log.size(); ++i) {
    replayed.Apply(i + 1, {bench.log[i].first, 0}, bench.log[i].second, &none);
  }
  Require(replayed.StateHash() == bench.engine.StateHash());
}

void ReadEvent(std::string_view bytes) {
  ByteReader reader(bytes);
  const Event event = DecodeEvent(&reader);
  if (IsWhole(&reader)) {
    ByteWriter writer;
    EncodeEvent(event, &writer);
    Require(writer.bytes() == bytes);
    static_cast<void>(testing::Bench().engine.Check(event));
    Require(std::holds_alternative<ConfigChanged>(event) || !Engine().Check(event).ok());
  }
}

void ReadConfig(std::string_view bytes) {
  ByteReader reader(bytes);
  const EngineConfig config = DecodeConfig(&reader);
  if (IsWhole(&reader)) {
    ByteWriter writer;
    EncodeConfig(config, &writer);
    Require(writer.bytes() == bytes);
    Run(config);
  }
}

void ReadState(std::string_view bytes) {
  ByteReader reader(bytes);
  const auto restored = Engine::Restore(&reader);
  if (restored.ok()) {
    RequireLasting(restored.value());
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size == 0) {
    return 0;
  }
  const std::string_view bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  static constexpr void (*kReaders[])(std::string_view) = {ReadEvent, ReadConfig, ReadState};
  kReaders[data[0] % std::size(kReaders)](bytes);
  return 0;
}
