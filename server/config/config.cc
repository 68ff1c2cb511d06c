#include "server/config/config.h"

#include <cerrno>
#include <cstring>
#include <fstream>

#include "server/config/sections.h"

namespace pheromone::config {
namespace {

constexpr int64_t kMaxMemoryMib = 1 << 20;

void ReadLimits(const Value& root, Notes* notes, engine::EngineConfig* engine) {
  const TableReader limits(TableOf(root, "limits", notes), "limits", &notes->problems);
  limits.AllowOnly({"field_memory_mib", "robots_per_link"});
  engine->field.memory_bytes =
      static_cast<uint64_t>(limits.Integer("field_memory_mib", 1, kMaxMemoryMib, 1024).value_or(1))
      << 20;
  const field::FieldConfig& field = engine->field;
  const size_t tiles = notes->problems.empty()
                           ? field::TilesOfPaths(field, [](const field::Path&) { return true; })
                           : 0;
  if (tiles > field::TileLimit(field)) {
    const uint64_t mib = ((tiles * field::CellMap::kTileBytes) >> 20) + 1;
    limits.Report("field_memory_mib",
                  "is not enough for the paths, expected at least " + std::to_string(mib));
  }
  engine->robots_per_link =
      static_cast<uint16_t>(limits.Integer("robots_per_link", 1, 254, 254).value_or(1));
}

void ReadDaemon(const Value& root, Notes* notes, DaemonSettings* daemon) {
  static constexpr std::string_view kLevels[] = {"trace", "debug",    "info", "warn",
                                                 "error", "critical", "off"};
  const TableReader table(TableOf(root, "daemon", notes), "daemon", &notes->problems);
  table.AllowOnly({"io_threads", "log_level"});
  daemon->io_threads = static_cast<int>(table.Integer("io_threads", 1, 64, 2).value_or(1));
  daemon->log_level = kLevels[table.OneOf("log_level", kLevels, 2).value_or(2)];
}

}  // namespace

const Value& TableOf(const Value& root, std::string_view name, Notes* notes) {
  static const Value empty_table;
  const Value* value = root.Find(name);
  if (value != nullptr && value->kind != Value::Kind::kTable) {
    notes->problems.Add(
        value->at, name,
        "found " + value->Describe() + ", expected a table [" + std::string(name) + "]");
    return empty_table;
  }
  return value != nullptr ? *value : empty_table;
}

std::vector<const Value*> TablesOf(const Value& root, std::string_view name, Notes* notes) {
  std::vector<const Value*> tables;
  const Value* value = root.Find(name);
  if (value == nullptr) {
    return tables;
  }
  const auto refuse = [&](const Value& found) {
    notes->problems.Add(
        found.at, name,
        "found " + found.Describe() + ", expected tables [[" + std::string(name) + "]]");
  };
  if (value->kind != Value::Kind::kArray) {
    refuse(*value);
    return tables;
  }
  for (const Value& item : value->items) {
    if (item.kind == Value::Kind::kTable) {
      tables.push_back(&item);
    } else {
      refuse(item);
    }
  }
  return tables;
}

std::string PathOf(std::string_view name, size_t index) {
  return std::string(name) + '[' + std::to_string(index + 1) + ']';
}

Result<Config> ParseConfig(std::string_view text, std::string_view name) {
  const Result<Value> document = ParseDocument(text, name);
  if (!document.ok()) {
    return Error{document.error()};
  }
  const Value& root = document.value();
  Notes notes{Problems(name), std::string(name), {}};
  Config config;
  TableReader(root, "", &notes.problems)
      .AllowOnly({"map", "antennas", "pheromone", "path", "link", "limits", "daemon"});
  if (ReadField(root, &notes, &config.engine)) {
    ReadPaths(root, &notes, &config.engine.field);
  }
  ReadLinks(root, &notes, &config);
  ReadLimits(root, &notes, &config.engine);
  ReadDaemon(root, &notes, &config.daemon);
  if (!notes.problems.empty()) {
    return Error{notes.problems.Text()};
  }
  config.warnings = std::move(notes.warnings);
  return config;
}

Result<Config> LoadConfig(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  // One byte more than ParseConfig takes, so that it can say that the file is too large.
  std::string text((size_t{1} << 20) + 1, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (file.bad() || !file.is_open() || (file.fail() && !file.eof())) {
    return Error{path + ": cannot be read: " + std::strerror(errno)};
  }
  text.resize(static_cast<size_t>(file.gcount()));
  return ParseConfig(text, path);
}

}  // namespace pheromone::config
