// The sections of the configuration file, each read by a function of its own. For
// this folder, and for programs whose files share some of the sections (client_fw/swarm).
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>

#include "server/config/config.h"
#include "server/config/reader.h"

namespace pheromone::config {

/// Where problems, warnings and notes go while a file is read, and where the files are that it
/// names.
struct Notes {
  Problems problems;
  std::string file;
  std::optional<std::filesystem::path> folder;
  std::vector<Warning> warnings;
  std::vector<std::string> notes;
};

// --- The sections. Those of the field need what was read before them: the geometry, then the
// --- pheromones.

/// [map]. False if the geometry is not known well enough to read what lies on the map.
bool ReadMap(const Value& root, Notes* notes, Config* config);

/// [antennas]
void ReadAntennas(const Value& root, Notes* notes, field::FieldConfig* field);

/// That an answer does not cost more than a robot may wait for, once the pheromones are known.
void CheckAntennas(const Value& root, Notes* notes, const field::FieldConfig& field);

/// [[pheromone]]. False if there is one that is not understood.
bool ReadPheromones(const Value& root, bool has_map, Notes* notes, field::FieldConfig* field);

/// [obstacles]
void ReadObstacles(const Value& root, Notes* notes, field::FieldConfig* field);

/// [[path]]
void ReadPaths(const Value& root, const std::optional<maps::Wgs84>& datum, Notes* notes,
               field::FieldConfig* field);

/// [[print]]
void ReadPrints(const Value& root, Notes* notes, field::FieldConfig* field);

/// All of these, in that order. False if the map or the pheromones are not understood.
bool ReadField(const Value& root, Notes* notes, Config* config);

/// [cluster], with the secret that its file holds. Nothing is left in `cluster` without it.
void ReadCluster(const Value& root, const std::optional<Machine>& machine, Notes* notes,
                 std::optional<ClusterSettings>* cluster);

/// That a cluster has a journal, once both are read.
void CheckJournalOfCluster(const Value& root, Notes* notes, const Config& config);

/// [[link]], after the cluster
void ReadLinks(const Value& root, Notes* notes, Config* config);

/// Of a link whose kind and baud are known: who may send when. False if a problem was noted.
bool ReadMedium(const TableReader& table, links::LinkConfig* link);

/// [[frame]], which needs the links
void ReadFrames(const Value& root, Notes* notes, engine::EngineConfig* engine);

/// [[tracker]]
void ReadTrackers(const Value& root, Notes* notes, Config* config);

/// [control]
void ReadControl(const Value& root, Notes* notes, ControlSettings* control);

/// [web], with the token that its file holds
void ReadWeb(const Value& root, Notes* notes, WebSettings* web);

/// [journal]
void ReadJournal(const Value& root, Notes* notes, JournalConfig* journal);

/// That nothing is configured for two of them that only one can have: a port, a path. `control` is
/// what ReadControl read, `node` the cluster's node that this machine is. What is in the way of
/// what is made is a warning.
void CheckConflicts(const Value& root, Notes* notes, const ControlSettings& control,
                    const std::string& node);

/// [[tag]] and [tags]; after the map, the links and [map]'s pose unit.
void ReadTags(const Value& root, Notes* notes, engine::EngineConfig* engine);

/// [[net]], after the tags.
void ReadNets(const Value& root, Notes* notes, engine::EngineConfig* engine);

// --- What several of them have in common.

/// [NAME], or an empty table if there is none. A value of another kind is noted.
const Value& TableOf(const Value& root, std::string_view name, Notes* notes);

/// The tables of [[NAME]]; other values are noted, and tables beyond `most`.
constexpr size_t kMaxTables = 256;  ///< of those that hold something open
std::vector<const Value*> TablesOf(const Value& root, std::string_view name, Notes* notes,
                                   size_t most = SIZE_MAX);

/// `NAME[2]`, the path of the second table of an array.
std::string PathOf(std::string_view name, size_t index);

/// Pheromone types and their names, as messages list what may be chosen.
std::string ListOf(const std::vector<field::PheromoneLaw>& laws);

/// The law that a path or a print is laid in, by the type or the name of its key `pheromone`. A
/// blend has no pheromone of its own, so it is none of them.
const field::PheromoneLaw* ReadPheromoneOf(const TableReader& table,
                                           const field::FieldConfig& field);

/// Whether no node of a cluster has both of two links, by LinkConfig::on.
bool AreApart(const std::vector<std::string>& on, const std::vector<std::string>& other);

/// The path of a serial port that is configured by it, or by its name in /dev/serial/by-id.
std::string PortPath(const std::string& port);

/// `name` is at most 32 letters, digits, hyphens, underscores and dots.
std::optional<std::string> ReadName(const TableReader& table);
constexpr std::string_view kNameExpected =
    "at most 32 letters, digits, hyphens, underscores and dots";
bool IsName(std::string_view text);

/// A numeric address and a port: "127.0.0.1:4950", "[::1]:4950".
std::optional<Endpoint> ParseEndpoint(std::string_view text);
std::optional<Endpoint> ReadEndpoint(const TableReader& table, std::string_view key);

/// The regular file that `key` names, its extension one of `extensions` (".csv"), in any case; any
/// extension if there are none.
std::optional<std::filesystem::path> ReadFileName(const TableReader& table, std::string_view key,
                                                  std::span<const std::string_view> extensions,
                                                  const Notes& notes);

/// A file that a key names, with its whole text.
struct NamedFile {
  std::string path;
  std::string text;
};
std::optional<NamedFile> ReadNamedFile(const TableReader& table, std::string_view key,
                                       size_t max_bytes, const Notes& notes);

/// A warning about a key, at its value.
void Warn(const TableReader& table, std::string_view key, const std::string& text, Notes* notes);

/// What is to be said of a file with a secret that all users can read; empty: they cannot.
std::string WhyNotSecret(const std::string& path);

/// The extension of a file name in lower case.
std::string ExtensionOf(const std::filesystem::path& path);

}  // namespace pheromone::config
