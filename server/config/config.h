// The configuration file: TOML in, plain structs out, in the integers that the engine works with.
//
//   Result<config::Config> loaded = config::LoadConfig("pheromoned.toml");
//   if (!loaded.ok()) { std::cerr << loaded.error() << '\n'; return 2; }
//   service.Configure(loaded.value().engine, epoch);
//
// The keys, their units and defaults are described where users look: in default.toml, which is the
// configuration of a server that was given none. Errors are one line for each mistake,
//   FILE:LINE:COLUMN: KEY: what was found, expected what
// where `pheromone[2].sigma_m` is a key of the second [[pheromone]].
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/result.h"
#include "server/engine/event.h"

namespace pheromone::config {

struct DaemonSettings {
  int io_threads = 2;
  std::string log_level = "info";  ///< trace, debug, info, warn, error, critical or off
  bool operator==(const DaemonSettings&) const = default;
};

enum class LinkKind { kPty, kSerial, kTcp };

/// How a link is reached. Its name, slot and response window are in Config::engine.links too.
struct LinkConfig {
  std::string name;
  LinkKind kind = LinkKind::kPty;
  std::string path;             ///< kPty: the symbolic link to the slave side; kSerial: the port
  uint32_t baud = 9600;         ///< kSerial
  std::string listen_address;   ///< kTcp: numeric, IPv4 or IPv6 without brackets
  uint16_t listen_port = 0;     ///< kTcp: 0 lets the system choose
  bool required = false;        ///< start-up fails if the link does not come up
  uint16_t turnaround_ms = 0;   ///< kSerial: T_t, from receiving to sending
  uint16_t gap_timeout_ms = 0;  ///< longest silence inside a frame; 0 = no limit
  uint8_t slot_ms = 1;
  uint8_t response_window_ms = 100;
  bool operator==(const LinkConfig&) const = default;
};

struct Config {
  engine::EngineConfig engine;
  std::vector<LinkConfig> links;  ///< in the order of engine.links
  DaemonSettings daemon;
  std::vector<std::string> warnings;  ///< in the form of errors; the configuration may be used
};

/// Reads a file. Errors: it cannot be read, or what ParseConfig finds.
Result<Config> LoadConfig(const std::string& path);

/// Parses a text; `name` stands for the file in messages.
Result<Config> ParseConfig(std::string_view text, std::string_view name);

/// The default configuration, as a commented file.
std::string_view DefaultConfigText();

}  // namespace pheromone::config
