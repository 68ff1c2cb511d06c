// Pictures of experiments, as SVG: the pheromone on the map, the path, and the ways of robots.
//
// Everything drawn comes from the data given; the pheromone is drawn as the field's own intensity,
// node by node, with the core and the slope of eq. (1) (Susnea et al. 2009).
#pragma once

#include <string>
#include <vector>

#include "client_fw/swarm/track.h"
#include "server/field/field.h"

namespace pheromone::swarm {

/// One way on the picture. A way with fewer than two samples is left out.
struct Way {
  std::string label;
  std::string colour;  ///< as SVG has it, "#1f77b4"
  std::vector<Sample> track;
  bool in_legend = true;
};

/// A complete SVG document: the part of the map around `path` and the ways, with a metre grid and a
/// legend. The pheromone shown is that of the path's type, as the field holds it at `now_ms`.
std::string DrawPathPicture(const std::string& title, const field::Field& field,
                            const field::Path& path, const std::vector<Way>& ways, uint64_t now_ms);

}  // namespace pheromone::swarm
