// pheromonectl tags export, import: what is written on the tags of a running server as RDF, and
// back.
#pragma once

#include <string>
#include <vector>

#include "server/operators/ctl/server_call.h"

namespace pheromone::ctl {

/// Empty strings: by default.
struct TagFile {
  std::string path;    ///< of export: standard output
  std::string format;  ///< by name; by the file's ending, else N-Triples
};

/// Of the tags of these names, or of all.
int ExportTags(const ServerOptions& options, const TagFile& file,
               const std::vector<std::string>& names);

/// Writes each fact on its tag, with its author and time, unless a tag has it: whose numbers say it
/// does not matter. Where a tag has no room for all, the latest remain; the others are reported
/// with the reason, and the exit status is kFailed. Nothing is written if the file has an error.
int ImportTags(const ServerOptions& options, const TagFile& file);

}  // namespace pheromone::ctl
