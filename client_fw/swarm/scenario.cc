#include "client_fw/swarm/scenario.h"

#include <algorithm>
#include <cstdlib>
#include <numbers>

#include "server/config/sections.h"
#include "server/maps/file.h"

namespace pheromone::swarm {
namespace {

using config::Notes;
using config::TableReader;
using config::Value;

constexpr config::Scale kSecondsToUs{1'000'000};
constexpr config::Scale kMetresToMm{1'000};
constexpr int64_t kMostUm = 1'000'000'000'000;
constexpr int64_t kMostRobots = 254;  // of a link, and enough for a simulation
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
  radio.AllowOnly({"baud", "channels", "turnaround_s", "server_delay_s", "carrier_detect", "loss",
                   "bit_error", "hidden_pairs"});
  ChannelTiming& timing = scenario->timing;
  timing.baud = radio.Integer("baud", 300, 115'200, 9600).value_or(9600);
  timing.turnaround_ns =
      radio.Scaled("turnaround_s", kSecondsToUs, 0, 100'000, 2'000).value_or(0) * 1'000;
  timing.server_delay_ns =
      radio.Scaled("server_delay_s", kSecondsToUs, 0, 100'000, 2'000).value_or(0) * 1'000;
  timing.carrier_detect = radio.Boolean("carrier_detect", true).value_or(true);
  scenario->channels = static_cast<int>(radio.Integer("channels", 1, 16, 1).value_or(1));
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

// [[x_m, y_m, heading_deg], ...], on the map.
std::vector<sim::PlanePose> ReadStarts(const TableReader& table, const field::MapGeometry& map) {
  constexpr std::string_view kExpected =
      "poses on the map, [x_m, y_m, heading_deg] each, such as [[1, 2, 90]]";
  std::vector<sim::PlanePose> starts;
  const Value* poses = table.Find("starts");
  if (poses == nullptr) {
    table.Missing("starts", kExpected);
    return starts;
  }
  if (poses->kind != Value::Kind::kArray || poses->items.empty()) {
    table.Expected("starts", *poses, kExpected);
    return starts;
  }
  for (const Value& pose : poses->items) {
    if (pose.kind != Value::Kind::kArray || pose.items.size() != 3) {
      table.Expected("starts", pose, kExpected);
      continue;
    }
    const auto x =
        table.ScaledValue(pose.items[0], "starts", config::kMetresToUm, -kMostUm, kMostUm);
    const auto y =
        table.ScaledValue(pose.items[1], "starts", config::kMetresToUm, -kMostUm, kMostUm);
    const auto heading =
        table.ScaledValue(pose.items[2], "starts", config::kDegrees, -360'000'000, 360'000'000);
    if (x && y && heading) {
      if (!map.Contains({*x, *y})) {
        table.Expected("starts", pose, kExpected);
      }
      starts.push_back({static_cast<double>(*x) / 1e6, static_cast<double>(*y) / 1e6,
                        static_cast<double>(*heading) / 1e6 * std::numbers::pi / 180});
    }
  }
  return starts;
}

// A pheromone or a blend, by its type or name.
uint8_t ReadSensed(const TableReader& table, const field::FieldConfig& field) {
  std::string list;
  const Value* value = table.Find("pheromone");
  for (const field::PheromoneLaw& law : field.pheromones) {
    if (value != nullptr && ((value->kind == Value::Kind::kInteger && value->integer == law.type) ||
                             (value->kind == Value::Kind::kString && value->text == law.name))) {
      return law.type;
    }
    list += (list.empty() ? "" : ", ") + std::to_string(law.type) + " or \"" + law.name + '"';
  }
  if (value == nullptr) {
    table.Missing("pheromone", list);
  } else {
    table.Expected("pheromone", *value, list);
  }
  return 1;
}

RobotGroup ReadGroup(const TableReader& table, const field::FieldConfig& field) {
  static constexpr std::string_view kLaws[] = {"differential", "paper", "fuzzy"};
  static constexpr client::Law kLawOf[] = {client::Law::kDifferential, client::Law::kPaper,
                                           client::Law::kFuzzy};
  table.AllowOnly(
      {"pheromone", "starts", "count", "spread_m", "law", "speed_m_per_s", "period_s", "trail"});
  RobotGroup group;
  group.client.type = ReadSensed(table, field);
  group.starts = ReadStarts(table, field.map);
  group.count =
      static_cast<int>(table
                           .Integer("count", 1, kMostRobots,
                                    std::max<int64_t>(1, static_cast<int64_t>(group.starts.size())))
                           .value_or(1));
  group.spread_m = table.Number("spread_m", 0, 100, 0).value_or(0);
  group.client.law = kLawOf[table.OneOf("law", kLaws, 0).value_or(0)];
  group.client.speed_mm_s = static_cast<int16_t>(
      table.Scaled("speed_m_per_s", kMetresToMm, 0, client::kMaxSpeedMmS, 200).value_or(0));
  group.client.period_ms = static_cast<uint16_t>(
      table.Scaled("period_s", config::kSecondsToMs, 1, 30'000, 200).value_or(1));
  group.client.fail_safe_ms =
      std::max(group.client.fail_safe_ms, static_cast<uint16_t>(2 * group.client.period_ms));
  group.client.lay_trail = table.Boolean("trail", false).value_or(false);
  const field::PheromoneLaw* law = nullptr;
  for (const field::PheromoneLaw& known : field.pheromones) {
    law = known.type == group.client.type ? &known : law;
  }
  if (group.client.lay_trail && law != nullptr && law->is_blend()) {
    table.Report("trail", "a blend has no pheromone of its own to leave, expected false");
  }
  return group;
}

void ReadRobots(const Value& root, Notes* notes, Scenario* scenario) {
  const std::vector<const Value*> tables =
      config::TablesOf(root, "robots", notes, config::kMostTables);
  if (tables.empty()) {
    notes->problems.Add(root.at, "robots", "missing, expected at least one [[robots]]");
  }
  for (size_t i = 0; i < tables.size(); ++i) {
    const TableReader table(*tables[i], config::PathOf("robots", i), &notes->problems);
    scenario->groups.push_back(ReadGroup(table, scenario->engine.field));
    if (scenario->robot_count() > kMostRobots) {
      table.Report("count", "makes more than " + std::to_string(kMostRobots) + " robots");
      return;
    }
  }
}

// 16-bit coordinates reach 32 767 pose units from (0, 0).
bool NeedsWide(const engine::EngineConfig& engine) {
  const field::MapGeometry& map = engine.field.map;
  const int64_t reach_um = int64_t{32'767} * engine.pose_unit_10um * 10;
  return std::max({std::abs(map.origin.x), std::abs(map.origin.y),
                   std::abs(map.origin.x + map.width_um), std::abs(map.origin.y + map.height_um)}) >
         reach_um;
}

void Finish(Scenario* scenario) {
  engine::EngineConfig& engine = scenario->engine;
  engine.field.memory_bytes = kFieldBytes;
  for (int i = 0; i < scenario->channels; ++i) {
    engine.links.push_back(scenario->timing.Link("radio-" + std::to_string(i + 1)));
  }
  for (RobotGroup& group : scenario->groups) {
    group.client.wide = NeedsWide(engine);
    group.client.three_bytes_ms = static_cast<uint8_t>(
        std::min<int64_t>(255, 3 * scenario->timing.byte_ns() / 1'000'000 + 1));
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

Result<Scenario> ParseScenario(std::string_view text, std::string_view name,
                               const std::optional<std::filesystem::path>& folder) {
  const Result<Value> document = config::ParseDocument(text, name);
  if (!document.ok()) {
    return Error{document.error()};
  }
  const Value& root = document.value();
  Notes notes{config::Problems(name), std::string(name), folder, {}};
  Scenario scenario;
  scenario.name = std::filesystem::path(name).stem().string();
  TableReader(root, "", &notes.problems)
      .AllowOnly(
          {"run", "radio", "robots", "map", "antennas", "pheromone", "obstacles", "path", "print"});
  config::Config server;
  field::FieldConfig& field = server.engine.field;
  const bool has_map = config::ReadMap(root, &notes, &server);
  config::ReadAntennas(root, &notes, &field);
  const bool has_pheromones = config::ReadPheromones(root, has_map, &notes, &field);
  if (has_map) {
    config::CheckAntennas(root, &notes, field);
    config::ReadObstacles(root, &notes, &field);
  }
  if (has_map && has_pheromones) {
    config::ReadPaths(root, server.datum, &notes, &field);
    config::ReadPrints(root, &notes, &field);
  }
  scenario.engine = server.engine;
  ReadRun(root, &notes, &scenario);
  ReadRadio(root, &notes, &scenario);
  if (has_map && has_pheromones) {
    ReadRobots(root, &notes, &scenario);
    ReadHiddenPairs(root, &notes, &scenario);
  }
  if (!notes.problems.empty()) {
    return Error{notes.problems.Text()};
  }
  scenario.warnings = std::move(notes.warnings);
  Finish(&scenario);
  return scenario;
}

Result<Scenario> LoadScenario(const std::string& path) {
  const Result<std::string> text = maps::ReadFile(path, config::kMaxText);
  if (!text.ok()) {
    return Error{text.error()};
  }
  return ParseScenario(text.value(), path, std::filesystem::path(path).parent_path());
}

}  // namespace pheromone::swarm
