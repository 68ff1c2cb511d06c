// The sections of the configuration file, each read by a function of its own. Internal to this
// folder.
#pragma once

#include "server/config/config.h"
#include "server/config/reader.h"

namespace pheromone::config {

/// Where problems and warnings go while a file is read.
struct Notes {
  Problems problems;
  std::string file;
  std::vector<std::string> warnings;
};

/// [map], [antennas] and [[pheromone]]. False if the geometry is not known well enough to read the
/// paths.
bool ReadField(const Value& root, Notes* notes, engine::EngineConfig* engine);

/// [[path]]; needs the geometry and the pheromones.
void ReadPaths(const Value& root, Notes* notes, field::FieldConfig* field);

/// [[link]]
void ReadLinks(const Value& root, Notes* notes, Config* config);

/// [NAME], or an empty table if there is none. A value of another kind is noted.
const Value& TableOf(const Value& root, std::string_view name, Notes* notes);

/// The tables of [[NAME]]; other values are noted.
std::vector<const Value*> TablesOf(const Value& root, std::string_view name, Notes* notes);

/// `NAME[2]`, the path of the second table of an array.
std::string PathOf(std::string_view name, size_t index);

}  // namespace pheromone::config
