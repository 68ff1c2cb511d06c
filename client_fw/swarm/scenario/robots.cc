#include "client_fw/swarm/scenario/robots.h"

#include <algorithm>
#include <numbers>

#include "client_fw/sim/radio_medium.h"
#include "client_fw/swarm/collision.h"
#include "client_fw/swarm/fit.h"
#include "client_fw/swarm/robots.h"
#include "server/core/engine/wire_units.h"

namespace pheromone::swarm {
namespace {

using config::Notes;
using config::TableReader;
using config::Value;

constexpr config::Scale kMetresToMm{1'000};
constexpr int64_t kMaxUm = 1'000'000'000'000;
constexpr int64_t kAvrBaud = 9600;  // as the image is compiled
constexpr int64_t kAvrStepNs = 1'000'000;

// [[x_m, y_m, heading_deg], ...], on the map and clear of obstacles.
std::vector<sim::PlanePose> ReadStarts(const TableReader& table, const field::MapGeometry& map,
                                       const sim::Blocked& blocked) {
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
    const auto x = table.ScaledValue(pose.items[0], "starts", config::kMetresToUm, -kMaxUm, kMaxUm);
    const auto y = table.ScaledValue(pose.items[1], "starts", config::kMetresToUm, -kMaxUm, kMaxUm);
    const auto heading =
        table.ScaledValue(pose.items[2], "starts", config::kDegrees, -360'000'000, 360'000'000);
    if (x && y && heading) {
      starts.push_back({static_cast<double>(*x) / 1e6, static_cast<double>(*y) / 1e6,
                        static_cast<double>(*heading) / 1e6 * std::numbers::pi / 180});
      if (!map.Contains({*x, *y})) {
        table.Expected("starts", pose, kExpected);
      } else if (blocked && blocked(starts.back())) {
        table.Expected("starts", pose, "poses farther than radius_m from every obstacle");
      }
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

const sim::PioneerModel* ReadDrive(const TableReader& table) {
  std::vector<std::string_view> words = {"ideal"};
  for (const sim::PioneerModel& model : sim::PioneerModels()) {
    words.push_back(model.subclass);
  }
  const size_t drive = table.OneOf("drive", words, 0).value_or(0);
  return drive == 0 ? nullptr : &sim::PioneerModels()[drive - 1];
}

// Reports what an image cannot do, before a simulation would fail on it.
void CheckAvr(const TableReader& table, const Scenario& scenario, const RobotGroup& group) {
  if (!HasAvrRobots()) {
    table.Report("client",
                 "this program was built without libsimavr, which simulates an AVR, expected "
                 "\"core\"");
  }
  if (group.pioneer == nullptr) {
    table.Report("client",
                 "the AVR image drives a Pioneer, expected drive = \"p3dx-sh\" or another model");
  }
  if (scenario.timing.baud != kAvrBaud) {
    table.Report("client", "the AVR image's radio runs at 9600 baud, expected radio.baud = 9600");
  }
  if (scenario.timing.turnaround_ns < kAvrStepNs) {
    table.Report("client",
                 "the AVR image passes bytes to its modem once per millisecond, expected "
                 "radio.turnaround_s >= 0.001");
  }
  if (scenario.loss > 0) {
    table.Report("client",
                 "the AVR image passes single bytes to its modem, so radio.loss would not lose "
                 "whole frames, expected radio.bit_error instead");
  }
  if (engine::NeedsWide(scenario.engine.field.map, scenario.engine.pose_unit_10um)) {
    table.Report("client",
                 "the AVR image has 16-bit coordinates, expected a map within their range");
  }
}

// Empty unless the client is an image.
std::string ReadImage(const TableReader& table, const Scenario& scenario, const RobotGroup& group,
                      const Notes& notes) {
  static constexpr std::string_view kClients[] = {"core", "avr"};
  static constexpr std::string_view kElf[] = {".elf"};
  if (table.OneOf("client", kClients, 0).value_or(0) == 0) {
    if (table.Find("image") != nullptr) {
      table.Report("image", "only a client = \"avr\" runs an image");
    }
    return {};
  }
  CheckAvr(table, scenario, group);
  if (table.Find("image") == nullptr) {
    return BuiltAvrImage();
  }
  return config::ReadFileName(table, "image", kElf, notes).value_or("").string();
}

void CheckSpeed(const TableReader& table, const Value& robots, const field::PheromoneLaw& law,
                const RobotGroup& group, Notes* notes) {
  const auto warning =
      SpeedWarning({.speed_mm_s = group.client.speed_mm_s,
                    .period_ms = group.client.period_ms,
                    .reach_m = static_cast<double>(law.reach_um()) / 1e6,
                    .drive = group.pioneer != nullptr ? LimitsOf(*group.pioneer)
                                                      : LimitsOf(sim::DriveConfig())});
  if (warning) {
    const Value* const speed = table.Find("speed_m_per_s");
    notes->warnings.push_back(
        {config::FormatProblem(notes->file, (speed != nullptr ? *speed : robots).at,
                               table.KeyOf("speed_m_per_s"), *warning)});
  }
}

RobotGroup ReadGroup(const TableReader& table, const Value& robots, const Scenario& scenario,
                     Notes* notes) {
  static constexpr std::string_view kLaws[] = {"careful", "differential", "paper", "fuzzy"};
  static constexpr client::Law kLawOf[] = {client::Law::kCareful, client::Law::kDifferential,
                                           client::Law::kPaper, client::Law::kFuzzy};
  static constexpr std::string_view kLost[] = {"search", "stop", "straight", "spiral"};
  static constexpr client::LostTrail kLostOf[] = {
      client::LostTrail::kSearch, client::LostTrail::kStop, client::LostTrail::kStraight,
      client::LostTrail::kSpiral};
  table.AllowOnly({"pheromone", "starts", "count", "spread_m", "law", "lost_trail", "speed_m_per_s",
                   "period_s", "trail", "radius_m", "drive", "client", "image"});
  const field::FieldConfig& field = scenario.engine.field;
  RobotGroup group;
  group.client.type = ReadSensed(table, field);
  group.radius_m = table.Number("radius_m", 0, 10, 0.25).value_or(0);
  group.starts = ReadStarts(table, field.map, BlockedBy(field, group.radius_m));
  group.count =
      static_cast<int>(table
                           .Integer("count", 1, sim::kMaxRobots,
                                    std::max<int64_t>(1, static_cast<int64_t>(group.starts.size())))
                           .value_or(1));
  group.spread_m = table.Number("spread_m", 0, 100, 0).value_or(0);
  group.client.law = kLawOf[table.OneOf("law", kLaws, 0).value_or(0)];
  group.client.lost_trail = kLostOf[table.OneOf("lost_trail", kLost, 0).value_or(0)];
  group.client.speed_mm_s = static_cast<int16_t>(
      table.Scaled("speed_m_per_s", kMetresToMm, 0, client::kMaxSpeedMmS, 200).value_or(0));
  group.client.period_ms = static_cast<uint16_t>(
      table.Scaled("period_s", config::kSecondsToMs, 1, 30'000, 200).value_or(1));
  group.client.fail_safe_ms =
      std::max(group.client.fail_safe_ms, static_cast<uint16_t>(2 * group.client.period_ms));
  group.client.lay_trail = table.Boolean("trail", false).value_or(false);
  group.pioneer = ReadDrive(table);
  group.image = ReadImage(table, scenario, group, *notes);
  const field::PheromoneLaw* law = field.FindLaw(group.client.type);
  if (group.client.lay_trail && law != nullptr && law->is_blend()) {
    table.Report("trail", "nothing can be deposited to a blend, expected false");
  }
  if (law != nullptr && !law->is_blend()) {
    CheckSpeed(table, robots, *law, group, notes);
  }
  return group;
}

}  // namespace

void ReadRobots(const Value& root, Notes* notes, Scenario* scenario) {
  const std::vector<const Value*> tables =
      config::TablesOf(root, "robots", notes, config::kMaxTables);
  if (tables.empty()) {
    notes->problems.Add(root.at, "robots", "missing, expected at least one [[robots]]");
  }
  for (size_t i = 0; i < tables.size(); ++i) {
    const TableReader table(*tables[i], config::PathOf("robots", i), &notes->problems);
    scenario->groups.push_back(ReadGroup(table, *tables[i], *scenario, notes));
    if (scenario->robot_count() > sim::kMaxRobots) {
      table.Report("count", "makes more than " + std::to_string(sim::kMaxRobots) + " robots");
      return;
    }
  }
}

}  // namespace pheromone::swarm
