#include "client_fw/lab/scenario/scenario.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include "client_fw/lab/firmware/firmware_swarm.h"
#include "client_fw/lab/scenario/level.h"
#include "client_fw/lab/scenario/robots_section.h"
#include "server/base/file.h"
#include "server/config/points.h"
#include "server/config/sections.h"

namespace pheromone::lab {
namespace {

using config::Notes;
using config::TableReader;
using config::Value;

constexpr uint64_t kFieldBytes = uint64_t{1} << 30;
constexpr int64_t kMaxDurationMs = int64_t{366} * 86'400'000;
constexpr double kMaxAmount = 1e12;

void ReadRadioSection(const Value& root, Notes* notes, LabScenario* scenario) {
  const TableReader radio(config::TableOf(root, "radio", notes), "radio", &notes->problems);
  radio.AllowOnly({"model", "robots_per_channel", "lost"});
  static constexpr std::string_view kModels[] = {"ideal", "rounds"};
  const bool on_air = scenario->level == Level::kRadio;
  const auto found = radio.OneOf("model", kModels, on_air ? 1 : 0);
  if (!found) {
    return;
  }
  const bool ideal = *found == 0;
  if (ideal && on_air) {
    radio.Report("model", "not known to " + LevelText(*scenario) + ", expected \"rounds\"");
  } else if (ideal) {
    radio.Without({"robots_per_channel", "lost"}, "model = \"ideal\"", "model = \"rounds\"");
  } else {
    RadioModel model;
    model.robots_per_channel = static_cast<int>(
        radio.Integer("robots_per_channel", 1, kMaxMeasuredRobots, model.robots_per_channel)
            .value_or(1));
    const double lost = radio.Number("lost", 0, 1, 0).value_or(0);
    model.lost_percent = static_cast<int>(std::lround(100 * lost));
    if (100 * lost != model.lost_percent || FindMeasured(model.lost_percent, 1) == nullptr) {
      radio.Report("lost",
                   fmt::format("found {}, expected what was measured: 0, 0.01 or 0.05", lost));
    }
    scenario->world.radio = model;
  }
}

// With the radio: steps have to be short where answers come in between.
void ReadRunSection(const Value& root, Notes* notes, LabScenario* scenario) {
  const TableReader run(config::TableOf(root, "run", notes), "run", &notes->problems);
  run.AllowOnly({"level", "duration_s", "step_s", "seed"});
  scenario->duration_ms =
      run.Scaled("duration_s", config::kSecondsToMs, 1, kMaxDurationMs, 60'000).value_or(1);
  scenario->world.seed = static_cast<uint64_t>(run.Integer("seed", 0, INT64_MAX, 1).value_or(0));
  const auto level = run.OneOf("level", kLevelNames, 0);
  if (!level) {
    return;
  }
  scenario->level = static_cast<Level>(*level);
  ReadRadioSection(root, notes, scenario);
  if (scenario->level == Level::kRadio) {
    run.Without({"step_s"}, LevelText(*scenario), "its own step, a millisecond");
    return;
  }
  const bool fine = scenario->world.radio || scenario->level != Level::kField;
  scenario->world.step_ms = run.Scaled("step_s", config::kSecondsToMs, 1,
                                       fine ? kMaxRadioStepMs : 60'000, fine ? 20 : 200)
                                .value_or(1);
}

void ReadMeasureSection(const Value& root, Notes* notes, LabScenario* scenario) {
  const TableReader measure(config::TableOf(root, "measure", notes), "measure", &notes->problems);
  measure.AllowOnly({"place_m", "from_s"});
  scenario->world.measure_from_ms =
      measure.Scaled("from_s", config::kSecondsToMs, 0, scenario->duration_ms - 1, 0).value_or(0);
  if (scenario->level == Level::kRadio) {
    measure.Without({"place_m"}, LevelText(*scenario), "no measure of coverage");
    return;
  }
  const int64_t cell_um = scenario->world.field.map.cell_um;
  scenario->world.coverage_cell_um =
      measure
          .Scaled("place_m", config::kMetresToUm, cell_um, 1'000'000'000,
                  std::max<int64_t>(1'000'000, cell_um))
          .value_or(cell_um);
}

// A name that no other table [[KIND]] has.
std::string ReadUniqueName(const TableReader& table, const std::vector<std::string>& names) {
  std::string name = config::ReadName(table).value_or("");
  if (!name.empty() && std::find(names.begin(), names.end(), name) != names.end()) {
    table.Report("name", "found \"" + name + "\" a second time, expected a name of its own");
  }
  return name;
}

void ReadSites(const Value& root, Notes* notes, LabScenario* scenario) {
  static constexpr std::string_view kKinds[] = {"nest", "food"};
  const std::vector<const Value*> tables = config::TablesOf(root, "site", notes, kMaxSites);
  for (size_t i = 0; i < tables.size(); ++i) {
    const TableReader table(*tables[i], config::PathOf("site", i), &notes->problems);
    table.AllowOnly({"name", "kind", "at_m", "radius_m", "amount", "quality", "refill_s"});
    scenario->site_names.push_back(ReadUniqueName(table, scenario->site_names));
    SiteConfig site;
    site.site.is_food = table.OneOf("kind", kKinds).value_or(0) == 1 ? 1 : 0;
    const Value* at = table.Find("at_m");
    if (at == nullptr) {
      table.Missing("at_m", "a point on the map [x, y] in metres");
    } else if (const auto point = ReadPointOnMap(table, *at, "at_m", scenario->world.field.map)) {
      site.site.x_m = static_cast<double>(point->x) / 1e6;
      site.site.y_m = static_cast<double>(point->y) / 1e6;
    }
    site.site.radius_m = table.Number("radius_m", 0.01, 1e6, 0.5).value_or(0);
    site.site.quality = table.Number("quality", 0, 1e6, 1).value_or(0);
    if (site.site.is_food != 0) {
      site.site.amount = table.Number("amount", 0, kMaxAmount, kMaxAmount).value_or(0);
      site.refill_ms = static_cast<uint64_t>(
          table.Scaled("refill_s", config::kSecondsToMs, 0, kMaxDurationMs, 0).value_or(0));
    } else {
      table.Without({"amount", "quality", "refill_s"}, "kind = \"nest\"", "food");
    }
    scenario->world.sites.push_back(site);
  }
}

void ReadGates(const Value& root, Notes* notes, LabScenario* scenario) {
  std::vector<std::string> names;
  const std::vector<const Value*> tables =
      config::TablesOf(root, "wall", notes, config::kMaxTables);
  for (size_t i = 0; i < tables.size(); ++i) {
    const TableReader table(*tables[i], config::PathOf("wall", i), &notes->problems);
    table.AllowOnly({"name", "points_m", "thickness_m", "open"});
    names.push_back(ReadUniqueName(table, names));
    Gate gate;
    gate.name = names.back();
    gate.points = ReadPoints(table, "points_m", 2, nullptr).value_or(std::vector<field::PointUm>());
    gate.thickness_um =
        table.Scaled("thickness_m", config::kMetresToUm, 0, 1'000'000'000, 100'000).value_or(0);
    gate.open = table.Boolean("open", false).value_or(false);
    scenario->gates.push_back(std::move(gate));
  }
}

// Which of `names` a key has.
std::optional<size_t> ReadWhich(const TableReader& table, std::string_view key,
                                const std::vector<std::string>& names) {
  const std::vector<std::string_view> words(names.begin(), names.end());
  if (words.empty()) {
    table.Report(key, "found a name, but the scenario has none of this kind");
    return std::nullopt;
  }
  const auto which = table.OneOf(key, words);
  if (which && std::count(words.begin(), words.end(), words[*which]) > 1) {
    table.Report(key, "found a name that several have, expected names of their own");
  }
  return which;
}

template <typename List>
std::vector<std::string> NamesOf(const List& list) {
  std::vector<std::string> names;
  names.reserve(list.size());
  for (const auto& item : list) {
    names.push_back(item.name);
  }
  return names;
}

void ReadSiteEvent(const TableReader& table, const LabScenario& scenario, LabEvent* event) {
  table.Without({"open", "fail"}, "site", "to_m or amount");
  event->which = ReadWhich(table, "site", scenario.site_names).value_or(0);
  const Value* to = table.Find("to_m");
  if (to != nullptr) {
    table.Without({"amount"}, "to_m", "an event each");
    event->kind = LabEvent::Kind::kMoveSite;
    event->to =
        ReadPointOnMap(table, *to, "to_m", scenario.world.field.map).value_or(field::PointUm());
    return;
  }
  event->kind = LabEvent::Kind::kSetAmount;
  event->amount = table.Number("amount", 0, kMaxAmount).value_or(0);
  if (event->which < scenario.world.sites.size() &&
      scenario.world.sites[event->which].site.is_food == 0) {
    table.Report("amount", "not permitted for a nest, expected food");
  }
}

void ReadEvents(const Value& root, Notes* notes, LabScenario* scenario) {
  const std::vector<const Value*> tables = config::TablesOf(root, "event", notes, 10'000);
  for (size_t i = 0; i < tables.size(); ++i) {
    const TableReader table(*tables[i], config::PathOf("event", i), &notes->problems);
    table.AllowOnly({"at_s", "wall", "open", "site", "to_m", "amount", "robots", "fail"});
    LabEvent event;
    event.at_ms = table.Scaled("at_s", config::kSecondsToMs, 0, kMaxDurationMs).value_or(0);
    if (table.Find("wall") != nullptr) {
      table.Without({"site", "to_m", "amount", "robots", "fail"}, "wall", "open = true or false");
      event.which = ReadWhich(table, "wall", NamesOf(scenario->gates)).value_or(0);
      event.open = table.Boolean("open", true).value_or(true);
    } else if (table.Find("site") != nullptr) {
      table.Without({"robots"}, "site", "an event each");
      ReadSiteEvent(table, *scenario, &event);
    } else if (table.Find("robots") != nullptr) {
      table.Without({"open", "to_m", "amount"}, "robots", "fail");
      event.kind = LabEvent::Kind::kFail;
      event.which = ReadWhich(table, "robots", NamesOf(scenario->world.groups)).value_or(0);
      event.amount = table.Number("fail", 0, 1).value_or(0);
    } else {
      table.Missing("wall", "one of wall, site and robots");
    }
    scenario->events.push_back(event);
  }
  std::stable_sort(scenario->events.begin(), scenario->events.end(),
                   [](const LabEvent& a, const LabEvent& b) { return a.at_ms < b.at_ms; });
}

KeyValues ParametersOf(const Value& tree) {
  KeyValues parameters;
  for (auto& [key, value] : Flatten(tree)) {
    if (key != "run.seed" && !key.starts_with("sweep.")) {
      parameters.emplace_back(std::move(key), std::move(value));
    }
  }
  return parameters;
}

}  // namespace

field::Shared<field::ObstacleMask> ObstaclesOf(const LabScenario& scenario,
                                               const std::vector<Gate>& gates) {
  const field::FieldConfig& field = scenario.world.field;
  const bool any_closed =
      std::any_of(gates.begin(), gates.end(), [](const Gate& gate) { return !gate.open; });
  if (!any_closed) {
    return field.obstacles;
  }
  field::ObstacleMask mask(field.map.columns(), field.map.rows());
  if (field.obstacles) {
    field.obstacles->ForEach([&](field::NodeIndex node) { mask.Set(node); });
  }
  for (const Gate& gate : gates) {
    if (!gate.open) {
      field::BlockLine(field.map, gate.points, gate.thickness_um, &mask);
    }
  }
  return field::Shared(std::move(mask));
}

Result<LabScenario> ReadLabScenario(const Value& tree, const std::string& name,
                                    const std::optional<std::filesystem::path>& folder) {
  Notes notes{config::Problems(name), name, folder, {}, {}};
  LabScenario scenario;
  scenario.name = std::filesystem::path(name).stem().string();
  TableReader(tree, "", &notes.problems)
      .AllowOnly({"run", "measure", "sweep", "robots", "site", "wall", "event", "radio", "map",
                  "antennas", "pheromone", "obstacles", "path", "print"});
  config::Config server;
  const bool has_field = config::ReadField(tree, &notes, &server);
  ReadRunSection(tree, &notes, &scenario);
  if (has_field) {
    field::FieldConfig& field = server.engine.field;
    field.memory_bytes = kFieldBytes;
    scenario.world.field = field;
    scenario.world.pose_unit_10um = server.engine.pose_unit_10um;
    ReadMeasureSection(tree, &notes, &scenario);
    ReadSites(tree, &notes, &scenario);
    ReadGates(tree, &notes, &scenario);
    ReadGroups(tree, &notes, &scenario);
    ReadEvents(tree, &notes, &scenario);
    if (notes.problems.empty()) {
      CheckLevel(tree, scenario, &notes);
    }
  }
  if (!notes.problems.empty()) {
    return Error{notes.problems.Text()};
  }
  scenario.parameters = ParametersOf(tree);
  scenario.warnings = std::move(notes.warnings);
  return scenario;
}

Result<Value> LoadTree(const std::string& path, const KeyValues& settings) {
  PHEROMONE_TRY(const std::string text, ReadFile(path, config::kMaxText));
  PHEROMONE_TRY(Value tree, config::ParseDocument(text, path));
  for (const auto& [key, value] : settings) {
    PHEROMONE_TRY_STATUS(SetValue(key, value, &tree));
  }
  return tree;
}

Result<LabScenario> LoadLabScenario(const std::string& path, const KeyValues& settings) {
  PHEROMONE_TRY(const Value tree, LoadTree(path, settings));
  return ReadLabScenario(tree, path, std::filesystem::path(path).parent_path());
}

namespace {

// All groups at level "firmware": what they sense and deposit is their firmware's matter.
Result<std::shared_ptr<Behaviour>> MakeFirmware(const LabScenario& scenario,
                                                std::shared_ptr<Server> server,
                                                WorldConfig* config) {
  FirmwareConfig firmware;
  firmware.server = std::move(server);
  firmware.engine.field = config->field;
  firmware.engine.pose_unit_10um = config->pose_unit_10um;
  firmware.radio = std::exchange(config->radio, std::nullopt);
  firmware.seed = config->seed;
  for (size_t i = 0; i < config->groups.size(); ++i) {
    RobotGroup& group = config->groups[i];
    client::Parameters robot;
    static_cast<client::Settings&>(robot) = FollowSettings(scenario.plans[i].values);
    robot.type = group.senses.front();
    firmware.robots.insert(firmware.robots.end(), group.starts.size(), robot);
    group.senses.clear();
    group.deposits = 0;
  }
  PHEROMONE_TRY(std::shared_ptr<Behaviour> swarm, FirmwareSwarm::Create(std::move(firmware)));
  return swarm;
}

}  // namespace

Result<std::unique_ptr<World>> MakeWorld(const LabScenario& scenario, int threads,
                                         std::shared_ptr<Server> server) {
  WorldConfig config = scenario.world;
  config.field.obstacles = ObstaclesOf(scenario, scenario.gates);
  config.threads = threads;
  std::shared_ptr<Behaviour> firmware;
  if (scenario.level == Level::kRadio) {
    return Error{scenario.name +
                 ": found run.level = \"radio\", which pheromone-swarm lab run "
                 "simulates, expected \"field\" or \"firmware\""};
  }
  if (scenario.level == Level::kFirmware) {
    PHEROMONE_TRY(firmware, MakeFirmware(scenario, std::move(server), &config));
  }
  for (size_t i = 0; i < config.groups.size(); ++i) {
    const BehaviourPlan& plan = scenario.plans[i];
    RobotGroup& group = config.groups[i];
    if (firmware != nullptr && plan.outside) {
      return Error{scenario.name + ": \"" + group.name +
                   "\" is driven from outside, expected "
                   "run.level = \"field\""};
    }
    if (firmware != nullptr) {
      group.behaviour = firmware;
    } else if (plan.outside) {
      continue;
    } else if (plan.kind != nullptr) {
      group.behaviour = plan.kind->make(plan.values, group.starts.size());
    } else {
      PHEROMONE_TRY(group.behaviour, LoadPlugin(plan.plugin, plan.plugin_parameters));
    }
  }
  return World::Create(std::move(config));
}

}  // namespace pheromone::lab
