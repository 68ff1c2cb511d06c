// A scenario: an arena, robots and radio channels in one TOML file, for `pheromone-swarm run`.
//
//   Result<Scenario> scenario = LoadScenario("two-on-a-circuit.toml");
//   if (!scenario.ok()) { std::cerr << scenario.error() << '\n'; return 2; }
//
// The tables [map], [antennas], [[pheromone]], [obstacles], [[path]] and [[print]] are those of the
// server's configuration (pheromoned.toml(5)). To these come
//
//   [run]      duration_s (60), sample_s (0.2), seed (1)
//   [radio]    baud (9600), channels (1), turnaround_s (0.002), server_delay_s (0.002),
//              adapter_latency_s (0: of a USB adapter at the server), carrier_detect (true), loss,
//              bit_error (0: shares of frames, of bits), hidden_pairs (robots out of each other's
//              range, counted from 1: [[1, 2]])
//   [[robots]] pheromone, starts ([x_m, y_m, heading_deg] each), count (as many as starts; more
//              begin again at the first), spread_m (0: moved at random by up to this in x and y),
//              law ("careful"; "differential", "paper" or "fuzzy"), speed_m_per_s (0.2),
//              period_s (0.2), lost_trail ("search": where nothing is sensed look around, then
//              stop; "stop", "straight" or "spiral"),
//              trail (false; true: deposit a quantum with each request),
//              radius_m (0.25: of the disc that obstacles stop),
//              drive ("ideal"; "p3dx", "p3dx-sh", "peoplebot-sh", "p3at", "p3at-sh", "amigo" or
//              "amigo-sh": a simulated Pioneer),
//              client ("core": the client compiled for this machine; "avr": the image that one
//              would flash, which drives a Pioneer), image (the ELF file; the one of this build)
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

/// Reads a file. Errors: it cannot be read, or what ParseScenario finds.
Result<Scenario> LoadScenario(const std::string& path);

/// Parses a text; `name` is the name of the file in messages. Files that the text names are
/// relative to `folder`; without a folder, it may name none.
Result<Scenario> ParseScenario(std::string_view text, std::string_view name,
                               const std::optional<std::filesystem::path>& folder = std::nullopt);

}  // namespace pheromone::swarm
