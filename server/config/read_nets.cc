// [[net]]: Petri nets that the server executes on virtual tags.
#include <algorithm>
#include <array>
#include <filesystem>
#include <set>
#include <utility>

#include "server/config/sections.h"
#include "server/core/engine/nets_part.h"
#include "server/core/petri/live_rules.h"
#include "server/formats/nets/robot_tables.h"
#include "server/formats/nets/system_file.h"

namespace pheromone::config {
namespace {

constexpr std::array<std::string_view, 1> kExtensions = {".toml"};
constexpr int64_t kMaxParameter = 1'000'000;
constexpr std::array<std::string_view, 6> kLaws = {"e1", "e2",          "e3",
                                                   "e4", "exponential", "counter"};

// A file's problem has its own place in that file; here it is one of the key that names the file.
void ReportFile(const TableReader& table, std::string_view key, std::string_view error) {
  table.Report(key, "found a net with an error: " + std::string(error));
}

std::optional<nets::Parameters> ReadParameters(const TableReader& table) {
  nets::Parameters parameters;
  if (table.Find("parameters") == nullptr) {
    return parameters;
  }
  const auto inner = table.Table("parameters", "a table such as { robots = 4 }");
  if (!inner) {
    return std::nullopt;
  }
  for (const Value& it : table.Find("parameters")->items) {
    const auto number = inner->Integer(it.key, 0, kMaxParameter);
    if (!number) {
      return std::nullopt;
    }
    parameters.emplace(it.key, *number);
  }
  return parameters;
}

std::optional<petri::Net> ReadNetFile(const TableReader& table, std::string_view key,
                                      const nets::Parameters& parameters, const Notes& notes) {
  const std::optional<std::filesystem::path> path = ReadFileName(table, key, kExtensions, notes);
  if (!path) {
    return std::nullopt;
  }
  Result<petri::Net> net = nets::LoadSystem(*path, parameters);
  if (!net.ok()) {
    ReportFile(table, key, net.error());
    return std::nullopt;
  }
  petri::Net its = std::move(net).value();
  its.claims.clear();  // they are proved elsewhere, and are not executed
  return its;
}

// By the net's names of its tags; those that are not named are called alike.
bool ReadTagNames(const TableReader& table, petri::LiveSettings* settings) {
  std::string names;
  for (const std::string& name : petri::LiveTagsOf(settings->net)) {
    settings->tags.push_back({name, name});
    names += (names.empty() ? "" : ", ") + name;
  }
  if (table.Find("tags") == nullptr) {
    return true;
  }
  const auto inner = table.Table("tags", "a table such as { N1 = \"nest\" }");
  if (!inner) {
    return false;
  }
  for (const Value& it : table.Find("tags")->items) {
    const auto found =
        std::find_if(settings->tags.begin(), settings->tags.end(),
                     [&](const petri::LiveTag& tag) { return tag.in_net == it.key; });
    if (found == settings->tags.end()) {
      inner->Report(it.key, "unknown tag of the net, expected one of " + names);
      return false;
    }
    const auto name = inner->String(it.key);
    if (!name) {
      return false;
    }
    found->tag = *name;
  }
  return true;
}

bool ReadRobots(const TableReader& table, const petri::Net& robots, petri::LiveSettings* settings) {
  const Result<nets::RobotTables> tables = nets::MakeRobotTables(robots);
  if (!tables.ok()) {
    ReportFile(table, "robot_file", tables.error());
    return false;
  }
  settings->robot_hash = tables.value().hash;
  for (const nets::RobotTransition& it : tables.value().transitions) {
    const auto is_its = [&](const petri::LiveTag& tag) { return tag.in_net == it.tag; };
    if (std::none_of(settings->tags.begin(), settings->tags.end(), is_its)) {
      ReportFile(table, "robot_file",
                 "transition \"" + it.id + "\" is at tag \"" + it.tag +
                     "\", but the net in \"file\" has no transition of a robot there");
      return false;
    }
  }
  for (petri::LiveTag& tag : settings->tags) {
    tag.candidates = tables.value().CandidatesOf(tag.in_net);
  }
  return true;
}

// That its tags exist, have enough slots, and are no other net's.
void CheckTags(const TableReader& table, const petri::LiveSettings& settings,
               const std::vector<tags::TagSettings>& tags, std::set<std::string>* used) {
  for (const petri::LiveTag& tag : settings.tags) {
    const auto found =
        std::find_if(tags.begin(), tags.end(), [&](const auto& it) { return it.name == tag.tag; });
    const std::string what = "tag \"" + tag.in_net + "\" of the net is [[tag]] \"" + tag.tag + '"';
    if (found == tags.end()) {
      table.Report("tags", what + ", which is missing");
    } else if (found->slots < engine::NetsPart::kLeastSlots) {
      table.Report("tags", what + " with " + std::to_string(found->slots) +
                               " slots, expected at least " +
                               std::to_string(engine::NetsPart::kLeastSlots));
    } else if (!used->insert(tag.tag).second) {
      table.Report("tags", what + ", which another tag of a net is already");
    }
  }
}

std::optional<petri::LiveSettings> ReadNet(const TableReader& table, const Notes& notes) {
  table.AllowOnly({"name", "file", "robot_file", "parameters", "period_ms", "law", "rate",
                   "dead_band", "source", "tags"});
  petri::LiveSettings settings;
  auto name = ReadName(table);
  const auto parameters = ReadParameters(table);
  auto net = parameters ? ReadNetFile(table, "file", *parameters, notes) : std::nullopt;
  const auto robots = ReadNetFile(table, "robot_file", {}, notes);
  const auto period_ms = table.Integer("period_ms", petri::LiveSettings::kLeastPeriodMs,
                                       petri::LiveSettings::kMaxPeriodMs, settings.period_ms);
  const auto law = table.OneOf("law", kLaws, 0);
  const auto rate = table.Scaled("rate", kToMilli, 0, petri::kMaxRateMilli, settings.rate_milli);
  const auto dead_band = table.Scaled("dead_band", kToMilli, 0, petri::kMaxConcentrationMilli, 0);
  settings.has_source = table.Find("source") != nullptr;
  const auto source = table.Integer("source", 0, 0xFFFF'FFFF, 0);
  if (!name || !net || !robots || !period_ms || !law || !rate || !dead_band || !source) {
    return std::nullopt;
  }
  settings.name = std::move(*name);
  settings.net = std::move(*net);
  settings.period_ms = static_cast<uint32_t>(*period_ms);
  settings.law = *petri::LawNamed(kLaws[*law]);
  settings.rate_milli = static_cast<uint32_t>(*rate);
  settings.dead_band_milli = static_cast<uint32_t>(*dead_band);
  settings.source = static_cast<uint32_t>(*source);
  if (!ReadTagNames(table, &settings) || !ReadRobots(table, *robots, &settings)) {
    return std::nullopt;
  }
  if (const auto rules = petri::MakeLiveRules(settings); !rules.ok()) {
    ReportFile(table, "file", rules.error());
    return std::nullopt;
  }
  return settings;
}

}  // namespace

void ReadNets(const Value& root, Notes* notes, engine::EngineConfig* engine) {
  const std::vector<const Value*> tables = TablesOf(root, "net", notes, petri::kMaxLiveNets);
  std::set<std::string> names;
  std::set<std::string> used;
  for (size_t i = 0; i < tables.size(); ++i) {
    const TableReader table(*tables[i], PathOf("net", i), &notes->problems);
    std::optional<petri::LiveSettings> net = ReadNet(table, *notes);
    if (!net) {
      continue;
    }
    if (!names.insert(net->name).second) {
      table.Report("name", "found " + table.Find("name")->Describe() +
                               " again, expected a value not used by another net");
    }
    CheckTags(table, *net, engine->tags.tags, &used);
    engine->nets.push_back(std::move(*net));
  }
}

}  // namespace pheromone::config
