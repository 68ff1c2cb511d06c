// A scenario: an arena, robots and radio channels in one TOML file, for `pheromone-swarm run`.
//
//   Result<Scenario> scenario = LoadScenario("two-on-a-circuit.toml");
//   if (!scenario.ok()) { std::cerr << scenario.error() << '\n'; return 2; }
//
// deploy/man/pheromone-scenario.5 has the format.
//
// Robots of all [[robots]] are numbered from 1, are assigned to the channels in turn, and their
// number is their ID. Errors are one line for each mistake, FILE:LINE:COLUMN: KEY: found ...,
// expected ...; a speed that does not fit the pheromone and the drive (fit.h) is a warning. Pure
// except for reading files; any thread.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "client_fw/core/steering/parameters.h"
#include "client_fw/sim/differential_drive.h"
#include "client_fw/sim/pioneer/pioneer_models.h"
#include "client_fw/sim/released.h"
#include "client_fw/swarm/channel_model.h"
#include "server/base/result.h"
#include "server/config/config.h"
#include "server/core/engine/event.h"

namespace pheromone::swarm {

/// Robots that differ only in their start poses.
struct RobotGroup {
  client::Parameters client = sim::ReleasedParameters();  ///< ID and start are set for each robot
  std::vector<sim::PlanePose> starts;                     ///< at least one
  int count = 1;
  double spread_m = 0;
  double radius_m = 0.25;
  const sim::PioneerModel* pioneer = nullptr;  ///< null: an ideal differential drive
  std::string image = {};                      ///< of an AVR; empty: the core on this machine
};

struct Scenario {
  std::string name;  ///< of the file, without folder and extension
  engine::EngineConfig engine;
  ChannelTiming timing;
  int channels = 1;
  double loss = 0;
  double bit_error = 0;
  std::vector<std::pair<size_t, size_t>> hidden_pairs;  ///< robots, counted from 0
  std::vector<RobotGroup> groups;
  int64_t duration_ms = 60'000;
  int64_t sample_ms = 200;
  uint64_t seed = 1;
  std::vector<config::Warning> warnings;

  int robot_count() const;
};

/// Adds what follows from the rest: links for the channels, memory for the field, and whether
/// messages are wide.
void Complete(Scenario* scenario);

/// Reads a file. Errors: it cannot be read, or what ParseScenario finds.
Result<Scenario> LoadScenario(const std::string& path);

/// Parses a text; `name` is the name of the file in messages. Files that the text names are
/// relative to `folder`; without a folder, it may name none.
Result<Scenario> ParseScenario(std::string_view text, std::string_view name,
                               const std::optional<std::filesystem::path>& folder = std::nullopt);

}  // namespace pheromone::swarm
