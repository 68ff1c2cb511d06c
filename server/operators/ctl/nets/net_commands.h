// pheromonectl net ...: Petri nets in files; no server is needed.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace pheromone::ctl {

/// A net: TOML (server/formats/nets/system_file.h) or, by its ending .pnml or .xml, PNML.
struct NetSource {
  std::string path;
  std::vector<std::string> parameters;  ///< NAME=NUMBER, of TOML
};

struct NetCheck {
  NetSource source;
  std::vector<std::string> claims;  ///< besides those of the file
  bool no_claims = false;           ///< none of the file
  bool json = false;
  bool reduce = false;
  bool quick = false;  ///< without liveness and reversibility
  double memory_gib = 4;
  std::optional<uint64_t> max_states;
};

/// Returns the exit status: 0 if all claims are proved, 1 if not, 2 for an error in a file, a
/// claim or the command line.
int CheckNetFile(const NetCheck& check);

/// Writes a picture for Graphviz: of the net or, with an ID, of the trace that CheckNetFile prints
/// for it. 1 if there is no such trace.
int DrawNet(const NetCheck& check, const std::string& id, const std::string& output);

struct NetExport {
  NetSource source;
  std::string format;  ///< pnml, promela or 4ti2
  std::string output;  ///< empty: standard output; of 4ti2: without an ending
  bool core = false;   ///< without read and inhibitor arcs: see nets/core_net.h
};

int ExportNet(const NetExport& to);

/// Writes the tables of a robot's net as a C++ header for firmware (nets/robot_tables.h).
int WriteRobotTables(const NetSource& source, const std::string& output);

}  // namespace pheromone::ctl
