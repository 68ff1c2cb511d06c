// A scenario of the lab: a map, groups of robots, sites, walls that move, events, in one TOML file.
//
//   Result<LabScenario> scenario = LoadLabScenario("ants.toml", {{"robots.count", "200"}});
//   if (!scenario.ok()) { std::cerr << scenario.error() << '\n'; return 2; }
//   auto world = MakeWorld(scenario.value(), /*threads=*/2);
//
// client_fw/lab/README.md has the format. Errors are one line for each mistake, FILE:LINE:COLUMN:
// KEY: found ..., expected ...; of a value that was set by the command line, the place is the one
// that it replaces. Pure except for reading files and, in MakeWorld, loading plug-ins; any thread.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client_fw/lab/behaviours/kinds.h"
#include "client_fw/lab/firmware/server.h"
#include "client_fw/lab/plugin.h"
#include "client_fw/lab/scenario/tree.h"
#include "client_fw/lab/world.h"
#include "server/base/result.h"
#include "server/config/config.h"
#include "server/config/document.h"

namespace pheromone::lab {

/// How the behaviour of a group is made, anew for each world.
struct BehaviourPlan {
  bool outside = false;                 ///< whoever owns the world decides; the rest is unused
  const BehaviourKind* kind = nullptr;  ///< null: a plug-in
  ParameterValues values;
  std::string plugin;  ///< its path
  PluginParameters plugin_parameters;
};

/// A wall that can open and close.
struct Gate {
  std::string name;
  std::vector<field::PointUm> points;
  int64_t thickness_um = 0;
  bool open = false;
};

struct LabEvent {
  enum class Kind : uint8_t { kGate, kMoveSite, kSetAmount, kFail };
  int64_t at_ms = 0;
  Kind kind = Kind::kGate;
  size_t which = 0;   ///< gate, site or group, from 0
  bool open = false;  ///< of a gate
  field::PointUm to;  ///< of a site
  double amount = 0;  ///< of food; of a robot of the group, the probability to fail
};

/// What of a robot is simulated: the law and the field; its firmware, whose messages the engine
/// answers; or all, with each byte on the air (client_fw/swarm).
enum class Level : uint8_t { kField, kFirmware, kRadio };
constexpr std::string_view kLevelNames[] = {"field", "firmware", "radio"};
constexpr std::string_view NameOf(Level level) {
  return kLevelNames[static_cast<size_t>(level)];
}

struct LabScenario {
  std::string name;  ///< of the file, without folder and extension
  Level level = Level::kField;
  WorldConfig world;                 ///< groups without behaviours; all gates are open
  std::vector<BehaviourPlan> plans;  ///< a group
  std::vector<std::string> site_names;
  std::vector<Gate> gates;
  std::vector<LabEvent> events;  ///< in the order of their times
  int64_t duration_ms = 60'000;
  KeyValues parameters;  ///< all values of the file, as set, but for [sweep] and run.seed
  std::vector<config::Warning> warnings;
};

/// A file as a tree, with `settings` in place of what it says. Errors: it cannot be read, is no
/// TOML, or a setting has no place in it.
Result<config::Value> LoadTree(const std::string& path, const KeyValues& settings = {});

/// Reads a file as LoadTree. Errors: also what ReadLabScenario finds.
Result<LabScenario> LoadLabScenario(const std::string& path, const KeyValues& settings = {});

/// Reads a tree; `name` is that of the file, and `folder` where the files are that it names.
Result<LabScenario> ReadLabScenario(const config::Value& tree, const std::string& name,
                                    const std::optional<std::filesystem::path>& folder = {});

/// The obstacles of the map, and of the gates that are closed.
field::Shared<field::ObstacleMask> ObstaclesOf(const LabScenario& scenario,
                                               const std::vector<Gate>& gates);

/// A world as it is at the start. At level "firmware", `server` answers its robots; none: the
/// engine in this process. Errors: level "radio", which has no world; a plug-in that cannot be
/// loaded.
Result<std::unique_ptr<World>> MakeWorld(const LabScenario& scenario, int threads,
                                         std::shared_ptr<Server> server = nullptr);

}  // namespace pheromone::lab
