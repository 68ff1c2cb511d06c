// The engine under any messages at any times: it must not crash, and what it became must equal what
// its log says when applied to a fresh engine. The input is a list of records: a byte of time, a
// byte of length, then ID, opcode and data. Lengths from 252 on are what others than robots do,
// each made of the ID and of four bytes that follow: a new configuration, a command, what a tracker
// saw, an edit of the map.

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <vector>

#include "server/engine/service.h"
#include "server/engine/testing/bench.h"

namespace {

using pheromone::engine::Outgoing;
using pheromone::field::FieldEdit;

class RememberingLog final : public pheromone::engine::OrderedLog {
 public:
  pheromone::protocol::Reason Admit() override { return pheromone::protocol::Reason::kNone; }
  uint64_t Append(const pheromone::engine::Stamp& stamp,
                  const pheromone::engine::Event& event) override {
    events.emplace_back(stamp, event);
    return events.size();
  }
  uint64_t DurableSequence() const override { return events.size(); }
  void Probe(std::function<void()> done) override { done(); }

  std::vector<std::pair<pheromone::engine::Stamp, pheromone::engine::Event>> events;
};

pheromone::field::PointUm PointOf(const uint8_t* data) {
  return {(data[0] - 20) * int64_t{50'000}, (data[1] - 20) * int64_t{50'000}};
}

FieldEdit EditOf(const uint8_t* data) {
  FieldEdit edit;
  edit.type = data[0] % 4;
  edit.shape = static_cast<FieldEdit::Shape>(data[0] / 4 % 4);
  edit.action = static_cast<FieldEdit::Action>(data[0] / 16 % 4);
  edit.level = data[1] * 4u;
  edit.radius_um = data[1] * int64_t{4'000};
  edit.points = {PointOf(data + 1), PointOf(data + 2)};
  return edit;
}

pheromone::engine::CommandIssued CommandOf(uint8_t id, const uint8_t* data) {
  pheromone::engine::CommandIssued command;
  command.link = data[0] % 3;
  command.id = id;
  command.code = static_cast<pheromone::protocol::CommandCode>(data[1] % 12);
  std::copy_n(data + 2, 2, command.arguments.begin());
  return command;
}

// One of those that an operator might change to; some of them the running state cannot follow.
pheromone::engine::EngineConfig ConfigOf(pheromone::engine::EngineConfig config,
                                         const uint8_t* data) {
  pheromone::field::PheromoneLaw& law = config.field.pheromones[data[0] % 2];
  law.tau_ms = data[1] * int64_t{1'000};
  law.max_count = 1u + data[2] % 16u;
  config.robots_per_link = static_cast<uint16_t>(1 + data[3] % 4);
  if (data[0] >= 128) {
    config.field.pheromones.pop_back();
  }
  if (data[0] % 16 == 15) {
    config.field.map.cell_um *= 2;
  }
  if (data[0] % 16 == 14) {
    config.links.pop_back();
  }
  return config;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  RememberingLog log;
  uint64_t now_ms = 1;
  pheromone::engine::Service service(&log, [&now_ms] {
    return pheromone::engine::ClockReading{now_ms, 0};
  });
  pheromone::engine::EngineConfig config = pheromone::engine::testing::SmallConfig();
  config.robots_per_link = 3;
  using pheromone::field::CellMap;
  config.field.memory_bytes =
      4 * CellMap::kTileBytes + 2 * CellMap::kLeafBytes +
      2 * CellMap::TopBytes(config.field.map.columns(), config.field.map.rows());
  config.frames = {pheromone::engine::MakeFrame("radio-b", 1, {3'000'000, 0}, 30)};
  if (!service.Configure(config, 1).ok()) {
    std::abort();
  }
  std::vector<Outgoing> out;
  for (size_t at = 0; at + 4 <= size;) {
    now_ms += uint64_t{data[at]} * data[at] * data[at];
    if (data[at + 1] >= 252 && at + 8 <= size) {
      const uint8_t* four = data + at + 4;
      if (data[at + 1] == 252) {
        static_cast<void>(service.Configure(ConfigOf(config, four), data[at + 2] + 1u));
      } else if (data[at + 1] == 253) {
        static_cast<void>(service.Issue(CommandOf(data[at + 2], four), &out));
      } else if (data[at + 1] == 254) {
        const pheromone::engine::PoseObserved seen{
            static_cast<pheromone::engine::LinkIndex>(data[at + 2] % 3),
            data[at + 2],
            {PointOf(four), static_cast<uint16_t>(four[2] * 256)},
            four[3] * 100u};
        service.Observe({&seen, 1});
      } else {
        static_cast<void>(service.Edit(EditOf(four)));
      }
      at += 8;
      continue;
    }
    pheromone::protocol::Message message;
    const size_t rest = size - at - 4;
    message.length = static_cast<uint8_t>(
        std::min({size_t{data[at + 1]} % 20, rest, size_t{pheromone::protocol::kMaxData}}));
    message.id = data[at + 2];
    message.opcode = data[at + 3];
    std::copy_n(data + at + 4, message.length, message.data);
    at += 4u + message.length;
    // The second link may have left.
    const auto link = static_cast<pheromone::engine::LinkIndex>(
        message.id % service.Inspect([](const auto& it) { return it.config().links.size(); }));
    const size_t before = out.size();
    service.Handle(link, {&message, 1}, &out);
    if (out.size() > before + 1) {
      std::abort();  // one answer at most
    }
    service.AdvanceIfDue(&out);
  }
  pheromone::engine::Engine replayed;
  std::vector<Outgoing> again;
  for (size_t i = 0; i < log.events.size(); ++i) {
    replayed.Apply(i + 1, log.events[i].first, log.events[i].second, &again);
  }
  if (replayed.StateHash() != service.StateHash()) {
    std::abort();
  }
  return 0;
}
