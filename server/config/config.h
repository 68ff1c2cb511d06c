// The configuration file: TOML in, plain structs out, in the integers that the engine works with.
//
//   Result<config::Config> loaded = config::LoadConfig("pheromoned.toml");
//   if (!loaded.ok()) { std::cerr << loaded.error() << '\n'; return 2; }
//   service.Configure(loaded.value().engine, epoch);
//
// The keys, their units and defaults are described where users look: in default.toml, which is the
// configuration of a server that was given none, and in the manual, pheromoned.toml(5). Errors are
// one line for each mistake,
//   FILE:LINE:COLUMN: KEY: what was found, expected what
// where `pheromone[2].sigma_m` is a key of the second [[pheromone]].
//
// A configuration may name other files: maps, pictures, lines. They are read at once, with
// server/formats/maps, and what they say ends up in the same structs.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/result.h"
#include "server/core/engine/event.h"
#include "server/formats/maps/geodesy.h"
#include "server/net/certificate.h"
#include "server/net/endpoint.h"
#include "server/robots/links/link_config.h"
#include "server/robots/signing/keys.h"

namespace pheromone::config {

struct DaemonSettings {
  int io_threads = 1;
  std::string log_level = "info";  ///< trace, debug, info, warn, error, critical or off
  bool operator==(const DaemonSettings&) const = default;
};

/// How pheromonectl reaches the server.
struct ControlSettings {
  /// The Unix socket; empty: none. Relative to $RUNTIME_DIRECTORY, or else to the working
  /// directory.
  std::string socket = "pheromoned.sock";
  bool operator==(const ControlSettings&) const = default;
};

/// How browsers and programs reach the server over HTTP.
struct WebSettings {
  Endpoint listen;    ///< without an address: not at all
  std::string token;  ///< what changes must carry; empty: none are taken
  /// Names that the server may be asked by, in lower case, beside localhost and all addresses.
  std::vector<std::string> hosts;
  /// Web pages of other servers that may show the stream: "https://app.foxglove.dev".
  std::vector<std::string> origins = {};
  uint32_t max_viewers = 32;
  std::string ros_distro = "humble";  ///< told to viewers; empty: none
  std::string click_pheromone = {};   ///< deposited where viewers click; empty: the first one
  std::string root = {};  ///< a folder with the dashboard, from the command line; empty: built in
  std::string token_file = {};  ///< where the token is, or is to be made if there is none yet
  std::optional<Certificate> tls = {};  ///< checked; none: plain HTTP
  bool operator==(const WebSettings&) const = default;
};

/// Where the state is kept, so that it outlives the process.
struct JournalConfig {
  enum class Durability { kDurable, kRelaxed, kNone };

  std::string
      folder;  ///< empty: in the state directory, if there is one; JournalFolder (folders.h)
  Durability durability = Durability::kDurable;
  uint64_t segment_bytes = uint64_t{64} << 20;
  uint64_t snapshot_bytes = uint64_t{64} << 20;
  uint64_t snapshot_ms = 3'600'000;
  uint64_t sync_interval_ms = 1'000;  ///< of kRelaxed
  uint32_t keep_snapshots = 2;
  bool evaporate_while_down = true;
  bool operator==(const JournalConfig&) const = default;
};

/// Several daemons with one map (server/cluster).
struct ClusterSettings {
  struct Node {
    std::string name;
    Endpoint address;  ///< where its daemon listens for the others
    bool operator==(const Node&) const = default;
  };

  static constexpr uint32_t kHeartbeatMs = 50;  ///< between two of a daemon
  static constexpr size_t kMaxMachines = 9;

  std::string name;
  std::vector<Endpoint> engine;  ///< of etcd's members, in plain HTTP
  std::vector<Node> nodes;       ///< by name
  std::string node;    ///< which of them this machine is; empty: it was not asked for (Machine)
  std::string secret;  ///< that all of them have: bytes
  uint32_t suspect_ms = 300;  ///< a leader that is silent for so long is replaced
  uint32_t group_ms = 5;      ///< groups of events are at least so far apart
  bool operator==(const ClusterSettings&) const = default;
};

/// Recording of the traffic (server/store/capture).
struct CaptureSettings {
  bool start = false;       ///< at the start of the server
  std::string folder;       ///< where its files are; CaptureFolder (folders.h)
  uint64_t file_mb = 0;     ///< 10^6 bytes; about, after which another file is begun
  uint32_t most_files = 0;  ///< that are kept; 0: all
  bool operator==(const CaptureSettings&) const = default;
};

/// What may be wrong with a configuration that may be used.
struct Warning {
  std::string text;     ///< in the form of errors
  bool urgent = false;  ///< others may change things, or no one may connect: told at each start
};

struct Config {
  engine::EngineConfig engine;
  std::vector<links::LinkConfig> links;  ///< in the order of engine.links
  /// Of signed links, by their names. Apart from the links: a running server takes others.
  std::map<std::string, signing::Keys> keys;
  std::vector<links::TrackerConfig> trackers;
  std::optional<maps::Wgs84> datum;  ///< where on the Earth the map's (0, 0) is
  CaptureSettings capture;
  DaemonSettings daemon;
  ControlSettings control;
  WebSettings web;
  JournalConfig journal;
  std::optional<ClusterSettings> cluster;  ///< none: this daemon is alone
  std::string text;                        ///< of the file
  std::string file;                        ///< its absolute path; empty: a text without a file
  std::vector<Warning> warnings;
  std::vector<std::string> notes;  ///< nothing is wrong, but it is good to know
};

/// The machine that a configuration is read for: [cluster] is the same on all of them.
struct Machine {
  std::string host_name;  ///< perhaps with its domain
  std::string node{};     ///< by the command line; empty: as configured, or as the host is named
};

/// Reads a file. Errors: it cannot be read, or what ParseConfig finds.
Result<Config> LoadConfig(const std::string& path, const std::optional<Machine>& machine = {});

/// The same; for an empty path, the default configuration. A server that is started without a file
/// reads the files that it names relative to its working directory, `folder`; without a folder they
/// are not read: they are a server's.
Result<Config> LoadConfigOrDefault(const std::string& path,
                                   const std::optional<std::filesystem::path>& folder = {},
                                   const std::optional<Machine>& machine = {});

/// Parses a text; `name` stands for the file in messages. The names of other files are relative to
/// `folder`; without one, the text may name none, and files with secrets are not read. Without a
/// machine, it may be none of the cluster's nodes.
Result<Config> ParseConfig(std::string_view text, std::string_view name,
                           const std::optional<std::filesystem::path>& folder = std::nullopt,
                           const std::optional<Machine>& machine = std::nullopt);

/// Of what servers of a cluster must have in common: what a link's index means, and for how long
/// which of those that share a port may send on it.
uint64_t LinksHash(const Config& config);

/// The default configuration, as a commented file.
std::string_view DefaultConfigText();

}  // namespace pheromone::config
