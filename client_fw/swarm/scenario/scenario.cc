#include "client_fw/swarm/scenario/scenario.h"

#include <algorithm>

#include "client_fw/sim/radio_medium.h"
#include "client_fw/swarm/scenario/robots.h"
#include "server/base/file.h"
#include "server/config/sections.h"
#include "server/core/engine/wire_units.h"

namespace pheromone::swarm {
namespace {

using config::Notes;
using config::TableReader;
using config::Value;

constexpr config::Scale kSecondsToUs{1'000'000};
constexpr uint64_t kFieldBytes = uint64_t{1} << 30;

void ReadRun(const Value& root, Notes* notes, Scenario* scenario) {
  const TableReader run(config::TableOf(root, "run", notes), "run", &notes->problems);
  run.AllowOnly({"duration_s", "sample_s", "seed"});
  scenario->duration_ms =
      run.Scaled("duration_s", config::kSecondsToMs, 1, 86'400'000, 60'000).value_or(1);
  scenario->sample_ms = run.Scaled("sample_s", config::kSecondsToMs, 1, 60'000, 200).value_or(1);
  scenario->seed = static_cast<uint64_t>(run.Integer("seed", 0, INT64_MAX, 1).value_or(0));
}

void ReadRadio(const Value& root, Notes* notes, Scenario* scenario) {
  const TableReader radio(config::TableOf(root, "radio", notes), "radio", &notes->problems);
  radio.AllowOnly({"baud", "channels", "turnaround_s", "server_delay_s", "adapter_latency_s",
                   "carrier_detect", "loss", "bit_error", "hidden_pairs"});
  ChannelTiming& timing = scenario->timing;
  timing.baud = radio.Integer("baud", 300, 115'200, 9600).value_or(9600);
  timing.turnaround_ns =
      radio.Scaled("turnaround_s", kSecondsToUs, 0, 100'000, 2'000).value_or(0) * 1'000;
  timing.server_delay_ns =
      radio.Scaled("server_delay_s", kSecondsToUs, 0, 100'000, 2'000).value_or(0) * 1'000;
  timing.adapter_ns =
      radio.Scaled("adapter_latency_s", kSecondsToUs, 0, 255'000, 0).value_or(0) * 1'000;
  timing.carrier_detect = radio.Boolean("carrier_detect", true).value_or(true);
  scenario->channels =
      static_cast<int>(radio.Integer("channels", 1, sim::kMaxChannels, 1).value_or(1));
  scenario->loss = radio.Number("loss", 0, 1, 0).value_or(0);
  scenario->bit_error = radio.Number("bit_error", 0, 1, 0).value_or(0);
}

// [[1, 2], [1, 3]], once it is known how many robots there are.
void ReadHiddenPairs(const Value& root, Notes* notes, Scenario* scenario) {
  const TableReader radio(config::TableOf(root, "radio", notes), "radio", &notes->problems);
  const Value* pairs = radio.Find("hidden_pairs");
  if (pairs == nullptr) {
    return;
  }
  const int64_t most = scenario->robot_count();
  const std::string expected = "pairs of two different robots, numbers from 1 to " +
                               std::to_string(most) + ", such as [[1, 2]]";
  if (pairs->kind != Value::Kind::kArray) {
    radio.Expected("hidden_pairs", *pairs, expected);
    return;
  }
  for (const Value& pair : pairs->items) {
    const auto is_robot = [most](const Value& value) {
      return value.kind == Value::Kind::kInteger && value.integer >= 1 && value.integer <= most;
    };
    if (pair.kind != Value::Kind::kArray || pair.items.size() != 2 || !is_robot(pair.items[0]) ||
        !is_robot(pair.items[1]) || pair.items[0].integer == pair.items[1].integer) {
      radio.Expected("hidden_pairs", pair, expected);
      continue;
    }
    scenario->hidden_pairs.emplace_back(pair.items[0].integer - 1, pair.items[1].integer - 1);
  }
}

}  // namespace

int Scenario::robot_count() const {
  int count = 0;
  for (const RobotGroup& group : groups) {
    count += group.count;
  }
  return count;
}

void Complete(Scenario* scenario) {
  engine::EngineConfig& engine = scenario->engine;
  engine.field.memory_bytes = kFieldBytes;
  ChannelTiming told = scenario->timing;
  if (std::any_of(scenario->groups.begin(), scenario->groups.end(),
                  [](const RobotGroup& group) { return !group.image.empty(); })) {
    // The modem of an image keys with the first byte, so for the image, whose bytes have been sent
    // by then, every answer is later by a turnaround.
    told.server_delay_ns += told.turnaround_ns;
  }
  for (int i = 0; i < scenario->channels; ++i) {
    engine.links.push_back(told.Link("radio-" + std::to_string(i + 1)));
  }
  for (RobotGroup& group : scenario->groups) {
    group.client.wide = engine::NeedsWide(engine.field.map, engine.pose_unit_10um);
  }
}

Result<Scenario> ParseScenario(std::string_view text, std::string_view name,
                               const std::optional<std::filesystem::path>& folder) {
  PHEROMONE_TRY(const Value root, config::ParseDocument(text, name));
  Notes notes{config::Problems(name), std::string(name), folder, {}, {}};
  Scenario scenario;
  scenario.name = std::filesystem::path(name).stem().string();
  TableReader(root, "", &notes.problems)
      .AllowOnly(
          {"run", "radio", "robots", "map", "antennas", "pheromone", "obstacles", "path", "print"});
  config::Config server;
  const bool has_field = config::ReadField(root, &notes, &server);
  scenario.engine = server.engine;
  ReadRun(root, &notes, &scenario);
  ReadRadio(root, &notes, &scenario);
  if (has_field) {
    ReadRobots(root, &notes, &scenario);
    ReadHiddenPairs(root, &notes, &scenario);
  }
  if (!notes.problems.empty()) {
    return Error{notes.problems.Text()};
  }
  scenario.warnings = std::move(notes.warnings);
  Complete(&scenario);
  return scenario;
}

Result<Scenario> LoadScenario(const std::string& path) {
  PHEROMONE_TRY(const std::string text, ReadFile(path, config::kMaxText));
  return ParseScenario(text, path, std::filesystem::path(path).parent_path());
}

}  // namespace pheromone::swarm
