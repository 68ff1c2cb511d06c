#include "client_fw/lab/scenario/robots_section.h"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>
#include <string_view>
#include <utility>

#include "client_fw/lab/starts.h"

namespace pheromone::lab {
namespace {

using config::Notes;
using config::TableReader;
using config::Value;

constexpr int64_t kMaxRobots = 1'000'000;
constexpr double kMaxCoordinateM = 1e6;

std::string PheromonesOf(const field::FieldConfig& field) {
  std::string list;
  for (const field::PheromoneLaw& law : field.pheromones) {
    list += (list.empty() ? "" : ", ") + std::to_string(law.type) + " or \"" + law.name + '"';
  }
  return list;
}

const field::PheromoneLaw* FindPheromone(const Value& value, const field::FieldConfig& field) {
  for (const field::PheromoneLaw& law : field.pheromones) {
    if ((value.kind == Value::Kind::kInteger && value.integer == law.type) ||
        (value.kind == Value::Kind::kString && value.text == law.name)) {
      return &law;
    }
  }
  return nullptr;
}

// The group under construction, and what it needs to know.
struct GroupReader {
  const TableReader& table;
  const Notes& notes;
  const field::FieldConfig& field;
  RobotGroup group;
  BehaviourPlan plan;

  void ReadSenses();
  void ReadDeposits();
  void ReadBehaviour();
  void ReadParameters();
  void CheckSpeed() const;
  void ReadPluginParameters();
  void ReadBody();
  std::optional<AreaM> ReadArea() const;
  std::vector<sim::PlanePose> ReadStarts() const;
  double quanta() const {
    const auto found = plan.values.find("quanta");
    return found != plan.values.end() ? found->second : 0;
  }
};

void GroupReader::ReadSenses() {
  const Value* senses = table.Find("senses");
  const std::string expected = "an array of at most " + std::to_string(int{kPheromoneSlots}) +
                               " pheromones: " + PheromonesOf(field);
  if (senses == nullptr) {
    if (plan.kind == nullptr || plan.kind->least_senses > 0) {
      group.senses = {field.pheromones.front().type};
    }
    return;
  }
  if (senses->kind != Value::Kind::kArray || senses->items.size() > kPheromoneSlots) {
    table.Expected("senses", *senses, expected);
    return;
  }
  for (const Value& item : senses->items) {
    const field::PheromoneLaw* law = FindPheromone(item, field);
    if (law == nullptr) {
      table.Expected("senses", item, PheromonesOf(field));
      return;
    }
    group.senses.push_back(law->type);
  }
  const auto home = plan.values.find("home");
  const bool leaves_second = home != plan.values.end() && home->second > 0;
  const size_t least = leaves_second ? 2 : plan.kind != nullptr ? plan.kind->least_senses : 0;
  if (group.senses.size() < least) {
    table.Expected("senses", *senses,
                   "at least " + std::to_string(least) + " pheromones, for this behaviour");
  } else if (leaves_second && quanta() > 0 && field.FindLaw(group.senses[1])->is_blend()) {
    table.Expected(
        "senses", senses->items[1],
        config::ListOf(field.pheromones) + ", since home = \"pheromone\" deposits the second");
  }
}

void GroupReader::ReadDeposits() {
  const Value* deposits = table.Find("deposits");
  const field::PheromoneLaw* law = nullptr;
  if (deposits != nullptr) {
    law = FindPheromone(*deposits, field);
    if (law == nullptr || law->is_blend()) {
      table.Expected("deposits", *deposits, config::ListOf(field.pheromones));
      return;
    }
  } else if (!group.senses.empty()) {
    law = field.FindLaw(group.senses.front());
  }
  if (law != nullptr && !law->is_blend()) {
    group.deposits = law->type;
  } else if (quanta() > 0) {
    table.Missing("deposits", config::ListOf(field.pheromones) + ", since it deposits quanta");
  }
}

void GroupReader::CheckSpeed() const {
  const auto speed = plan.values.find("speed_m_per_s");
  if (speed != plan.values.end() && speed->second > group.wheels.max_speed_m_s) {
    table.Report(table.Find("parameters") != nullptr ? "parameters" : "max_speed_m_per_s",
                 fmt::format("found speed_m_per_s = {} for wheels of at most {} m/s", speed->second,
                             group.wheels.max_speed_m_s));
  }
}

void GroupReader::ReadBehaviour() {
  std::vector<std::string_view> names;
  for (const BehaviourKind& kind : BehaviourKinds()) {
    names.push_back(kind.name);
  }
  if (table.Find("plugin") == nullptr) {
    if (const auto chosen = table.OneOf("behaviour", names, 0)) {
      plan.kind = &BehaviourKinds()[*chosen];
      plan.values = DefaultsOf(*plan.kind);
      ReadParameters();
    }
    return;
  }
  table.Without({"behaviour"}, "plugin", "one of the two");
  static constexpr std::string_view kLibrary[] = {".so"};
  const auto path = ReadFileName(table, "plugin", kLibrary, notes);
  plan.plugin =
      path ? std::filesystem::absolute(*path).string() : "";  // with a slash: not searched for
  ReadPluginParameters();
}

void GroupReader::ReadParameters() {
  if (table.Find("parameters") == nullptr) {
    return;
  }
  const auto parameters = table.Table("parameters", "a table of the behaviour's parameters");
  if (!parameters) {
    return;
  }
  std::vector<std::string_view> names;
  for (const ParameterSpec& spec : plan.kind->parameters) {
    names.push_back(spec.name);
    double& value = plan.values.find(spec.name)->second;
    if (!spec.words.empty()) {
      value = static_cast<double>(parameters->OneOf(spec.name, spec.words, 0).value_or(0));
    } else if (spec.whole) {
      value = static_cast<double>(parameters
                                      ->Integer(spec.name, static_cast<int64_t>(spec.least),
                                                static_cast<int64_t>(spec.most),
                                                static_cast<int64_t>(spec.fallback))
                                      .value_or(0));
    } else {
      value = parameters->Number(spec.name, spec.least, spec.most, spec.fallback).value_or(0);
    }
  }
  parameters->AllowOnly(names);
}

void GroupReader::ReadPluginParameters() {
  if (table.Find("parameters") == nullptr) {
    return;
  }
  const auto parameters = table.Table("parameters", "a table of numbers for the plug-in");
  const Value* found = table.Find("parameters");
  for (const Value& item : parameters ? found->items : std::vector<Value>()) {
    if (const auto value = parameters->Number(item.key, -1e300, 1e300)) {
      plan.plugin_parameters.emplace_back(item.key, *value);
    }
  }
}

void GroupReader::ReadBody() {
  group.name = table.String("name", "robots").value_or("");
  group.radius_m = table.Number("radius_m", 0, 10, 0.1).value_or(0);
  Wheels& wheels = group.wheels;
  wheels.wheelbase_m = table.Number("wheelbase_m", 0.01, 10, wheels.wheelbase_m).value_or(1);
  wheels.acceleration_m_s2 =
      table.Number("acceleration_m_per_s2", 0, 100, wheels.acceleration_m_s2).value_or(0);
  wheels.max_speed_m_s =
      table.Number("max_speed_m_per_s", 0.01, 10, wheels.max_speed_m_s).value_or(1);
  group.odometry.bias = table.Number("odometry_bias", 0, 1, 0).value_or(0);
  group.odometry.noise = table.Number("odometry_noise", 0, 1, 0).value_or(0);
  group.odometry.slip = table.Number("slip", 0, 1, 0).value_or(0);
  group.fixes.period_ms =
      table.Scaled("fix_period_s", config::kSecondsToMs, 0, 86'400'000, 0).value_or(0);
  group.fixes.sigma_m = table.Number("fix_sigma_m", 0, 1000, 0).value_or(0);
  group.range_m = table.Number("range_m", 0, 1e6, 0).value_or(0);
  if (group.fixes.sigma_m > 0 && group.fixes.period_ms == 0) {
    table.Missing("fix_period_s", "seconds between two fixes, since fix_sigma_m is given");
  }
}

std::optional<AreaM> GroupReader::ReadArea() const {
  const Value* area = table.Find("area_m");
  if (area == nullptr) {
    return AreaOf(field.map);
  }
  constexpr std::string_view kExpected =
      "two opposite corners of a rectangle on the map, [x0, y0, x1, y1] in metres";
  double at[4] = {};
  bool good = area->kind == Value::Kind::kArray && area->items.size() == 4;
  for (size_t i = 0; good && i < 4; ++i) {
    at[i] = area->items[i].number;
    good = (area->items[i].kind == Value::Kind::kInteger ||
            area->items[i].kind == Value::Kind::kFloat) &&
           at[i] >= -kMaxCoordinateM && at[i] <= kMaxCoordinateM;
  }
  const AreaM chosen{std::min(at[0], at[2]), std::min(at[1], at[3]), std::max(at[0], at[2]),
                     std::max(at[1], at[3])};
  const AreaM map = AreaOf(field.map);
  good = good && chosen.left >= map.left && chosen.right <= map.right &&
         chosen.bottom >= map.bottom && chosen.top <= map.top;
  if (!good) {
    table.Expected("area_m", *area, kExpected);
    return std::nullopt;
  }
  return chosen;
}

// [[x_m, y_m, heading_deg], ...]
std::vector<sim::PlanePose> GroupReader::ReadStarts() const {
  constexpr std::string_view kExpected =
      "poses [x_m, y_m, heading_deg] on the map, such as [[1, 2, 90]]";
  std::vector<sim::PlanePose> starts;
  const Value& poses = *table.Find("starts");
  if (poses.kind != Value::Kind::kArray || poses.items.empty()) {
    table.Expected("starts", poses, kExpected);
    return starts;
  }
  const Walls walls(field, group.radius_m);
  for (const Value& pose : poses.items) {
    const bool is_row =
        pose.kind == Value::Kind::kArray && pose.items.size() == 3 &&
        std::all_of(pose.items.begin(), pose.items.end(), [](const Value& item) {
          return (item.kind == Value::Kind::kInteger || item.kind == Value::Kind::kFloat) &&
                 item.number >= -kMaxCoordinateM && item.number <= kMaxCoordinateM;
        });
    if (!is_row || !walls.IsOnMap(pose.items[0].number, pose.items[1].number)) {
      table.Expected("starts", pose, kExpected);
    } else if (walls.Touches(pose.items[0].number, pose.items[1].number, group.radius_m)) {
      table.Expected("starts", pose, "poses farther than radius_m from every obstacle");
    } else {
      starts.push_back({pose.items[0].number, pose.items[1].number,
                        pose.items[2].number * std::numbers::pi / 180});
    }
  }
  return starts;
}

}  // namespace

void ReadGroups(const Value& root, Notes* notes, LabScenario* scenario) {
  const std::vector<const Value*> tables = config::TablesOf(root, "robots", notes);
  if (tables.empty()) {
    notes->problems.Add(root.at, "robots", "missing, expected at least one [[robots]]");
  }
  // Those with a place of their own come first, so that the others can keep away from them.
  struct Wanted {
    int64_t count;
    std::optional<AreaM> area;
  };
  std::vector<Wanted> wanted;
  double most_radius_m = 0;
  int64_t robots = 0;
  field::FieldConfig closed = scenario->world.field;
  closed.obstacles = ObstaclesOf(*scenario, scenario->gates);
  for (size_t i = 0; i < tables.size(); ++i) {
    const TableReader table(*tables[i], config::PathOf("robots", i), &notes->problems);
    table.AllowOnly({"name", "behaviour", "plugin", "parameters", "count", "starts", "area_m",
                     "senses", "deposits", "radius_m", "wheelbase_m", "max_speed_m_per_s",
                     "acceleration_m_per_s2", "odometry_bias", "odometry_noise", "slip",
                     "fix_period_s", "fix_sigma_m", "range_m"});
    GroupReader reader{table, *notes, closed, {}, {}};
    reader.ReadBody();
    reader.ReadBehaviour();
    reader.CheckSpeed();
    reader.ReadSenses();
    reader.ReadDeposits();
    int64_t count = 0;
    std::optional<AreaM> area;
    if (table.Find("starts") != nullptr) {
      table.Without({"count", "area_m"}, "starts", "either starts or count and area_m");
      reader.group.starts = reader.ReadStarts();
    } else {
      count = table.Integer("count", 1, kMaxRobots, 1).value_or(0);
      area = reader.ReadArea();
    }
    wanted.push_back({count, area});
    robots += count + static_cast<int64_t>(reader.group.starts.size());
    most_radius_m = std::max(most_radius_m, reader.group.radius_m);
    scenario->world.groups.push_back(std::move(reader.group));
    scenario->plans.push_back(std::move(reader.plan));
  }
  if (robots > kMaxRobots) {
    notes->problems.Add(root.at, "robots",
                        "found " + std::to_string(robots) + " robots in all, expected at most " +
                            std::to_string(kMaxRobots));
  }
  if (!notes->problems.empty()) {
    return;
  }
  StartPlacer placer(closed, most_radius_m, scenario->world.seed);
  for (const RobotGroup& group : scenario->world.groups) {
    for (const sim::PlanePose& start : group.starts) {
      placer.Take(start, group.radius_m);
    }
  }
  for (size_t i = 0; i < tables.size(); ++i) {
    RobotGroup& group = scenario->world.groups[i];
    for (int64_t robot = 0; wanted[i].area && robot < wanted[i].count; ++robot) {
      const auto start = placer.Find(*wanted[i].area, group.radius_m);
      if (!start) {
        TableReader(*tables[i], config::PathOf("robots", i), &notes->problems)
            .Report("count", "found room for " + std::to_string(robot) + " of " +
                                 std::to_string(wanted[i].count) +
                                 " robots, expected fewer or smaller ones, or a larger area_m");
        return;
      }
      group.starts.push_back(*start);
    }
  }
}

}  // namespace pheromone::lab
