#include "server/config/config.h"

#include <utility>

#include "server/base/fields.h"
#include "server/base/file.h"
#include "server/base/hash.h"
#include "server/config/folders.h"
#include "server/config/sections.h"

namespace pheromone::config {
namespace {

constexpr int64_t kMaxMemoryMib = 1 << 20;
constexpr int64_t kMaxRate = 1'000'000;

void ReadLimits(const Value& root, Notes* notes, Config* config) {
  engine::EngineConfig* const engine = &config->engine;
  const TableReader limits(TableOf(root, "limits", notes), "limits", &notes->problems);
  limits.AllowOnly({"field_memory_mib", "requests_per_client_s", "requests_per_link_s"});
  engine->field.memory_bytes =
      static_cast<uint64_t>(limits.Integer("field_memory_mib", 1, kMaxMemoryMib, 1024).value_or(1))
      << 20;
  const field::FieldConfig& field = engine->field;
  const uint64_t laid = notes->problems.empty()
                            ? field::BytesOfLaid(
                                  field, [](const field::Path&) { return true; },
                                  [](const field::InitialRaster&) { return true; })
                            : 0;
  if (laid > field.memory_bytes) {
    limits.Report("field_memory_mib",
                  "is not enough for the paths and initial rasters, expected at least " +
                      std::to_string((laid >> 20) + 1));
  }
  const auto per_client = limits.Integer("requests_per_client_s", 0, kMaxRate, 0).value_or(0);
  const auto per_link = limits.Integer("requests_per_link_s", 0, kMaxRate, 0).value_or(0);
  for (links::LinkConfig& link : config->links) {
    link.admission.per_client_per_s = static_cast<uint32_t>(per_client);
    link.admission.per_link_per_s = static_cast<uint32_t>(per_link);
  }
}

void ReadDaemon(const Value& root, Notes* notes, DaemonSettings* daemon) {
  static constexpr std::string_view kLevels[] = {"trace", "debug",    "info", "warn",
                                                 "error", "critical", "off"};
  const TableReader table(TableOf(root, "daemon", notes), "daemon", &notes->problems);
  table.AllowOnly({"io_threads", "log_level"});
  daemon->io_threads = static_cast<int>(table.Integer("io_threads", 1, 64, 1).value_or(1));
  daemon->log_level = kLevels[table.OneOf("log_level", kLevels, 2).value_or(2)];
}

void ReadCapture(const Value& root, Notes* notes, CaptureSettings* capture) {
  const TableReader table(TableOf(root, "capture", notes), "capture", &notes->problems);
  table.AllowOnly({"folder", "start", "max_mb", "max_files"});
  capture->folder = table.String("folder", "captures").value_or("");
  capture->start = table.Boolean("start", false).value_or(false);
  capture->file_mb = static_cast<uint64_t>(table.Integer("max_mb", 1, 1'000'000, 64).value_or(1));
  capture->most_files =
      static_cast<uint32_t>(table.Integer("max_files", 0, 1'000'000, 16).value_or(0));
}

}  // namespace

bool ReadField(const Value& root, Notes* notes, Config* config) {
  field::FieldConfig& field = config->engine.field;
  const bool has_map = ReadMap(root, notes, config);
  ReadAntennas(root, notes, &field);
  const bool has_pheromones = ReadPheromones(root, has_map, notes, &field);
  if (has_map) {
    CheckAntennas(root, notes, field);
    ReadObstacles(root, notes, &field);
  }
  if (has_map && has_pheromones) {
    ReadPaths(root, config->datum, notes, &field);
    ReadPrints(root, notes, &field);
  }
  return has_map && has_pheromones;
}

Result<Config> ParseConfig(std::string_view text, std::string_view name,
                           const std::optional<std::filesystem::path>& folder,
                           const std::optional<Machine>& machine) {
  PHEROMONE_TRY(const Value root, ParseDocument(text, name));
  Notes notes{Problems(name), std::string(name), folder, {}, {}};
  Config config;
  TableReader(root, "", &notes.problems)
      .AllowOnly({"map", "antennas", "pheromone", "obstacles", "path", "print", "link", "frame",
                  "tracker", "limits", "journal", "capture", "daemon", "control", "web", "tags",
                  "tag", "net", "cluster"});
  ReadField(root, &notes, &config);
  ReadCluster(root, machine, &notes, &config.cluster);
  ReadLinks(root, &notes, &config);
  ReadFrames(root, &notes, &config.engine);
  ReadTrackers(root, &notes, &config);
  ReadLimits(root, &notes, &config);
  ReadJournal(root, &notes, &config.journal);
  ReadCapture(root, &notes, &config.capture);
  ReadDaemon(root, &notes, &config.daemon);
  ReadTags(root, &notes, &config.engine);
  ReadNets(root, &notes, &config.engine);
  ReadControl(root, &notes, &config.control);
  ReadWeb(root, &notes, &config.web);
  CheckJournalOfCluster(root, &notes, config);
  CheckConflicts(root, &notes, config.control, config.cluster ? config.cluster->node : "");
  if (!notes.problems.empty()) {
    return Error{notes.problems.Text()};
  }
  config.text = text;
  config.warnings = std::move(notes.warnings);
  config.notes = std::move(notes.notes);
  return config;
}

Result<Config> LoadConfig(const std::string& path, const std::optional<Machine>& machine) {
  PHEROMONE_TRY(const std::string text, ReadFile(path, kMaxText));
  Result<Config> config =
      ParseConfig(text, path, std::filesystem::path(path).parent_path(), machine);
  if (config.ok()) {
    config.value().file = AbsolutePath(path);
  }
  return config;
}

Result<Config> LoadConfigOrDefault(const std::string& path,
                                   const std::optional<std::filesystem::path>& folder,
                                   const std::optional<Machine>& machine) {
  return path.empty() ? ParseConfig(DefaultConfigText(), "default configuration", folder, machine)
                      : LoadConfig(path, machine);
}

uint64_t LinksHash(const Config& config) {
  uint64_t hash = HashFields(config.engine.links);
  for (const links::LinkConfig& link : config.links) {
    hash = HashStep(fields::HashInto(hash, link.on), link.baud);
  }
  return hash;
}

}  // namespace pheromone::config
