// Pictures of experiments, as SVG: the pheromone on the map, the path, and the tracks of robots.
//
// Everything drawn comes from the data given; the pheromone is drawn as the field's own intensity,
// node by node, with the core and the slope of eq. (1) (Susnea et al. 2009).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "client_fw/swarm/track.h"
#include "server/core/field/field.h"

namespace pheromone::swarm {

/// One track in the picture. A track with fewer than two samples is omitted.
struct Way {
  std::string label;
  std::string colour;  ///< as SVG has it, "#1f77b4"
  std::vector<Sample> track;
  bool in_legend = true;
};

/// One pheromone in the picture, as in the field. A type that does not exist is omitted.
struct Shade {
  uint8_t type = 1;
  std::string colour;       ///< of what it spreads to
  std::string node_colour;  ///< of the dots on its nodes
  double opacity = 0.16;    ///< of one full node; less where many overlap
};

struct Picture {
  std::string title;
  field::Path path;
  std::vector<Shade> shades;    ///< the first at the bottom
  bool with_obstacles = false;  ///< the field's blocked nodes, as the squares they stand for
  std::vector<Way> ways;
};

/// A complete SVG document: the part of the map around the path and the tracks, with a metre grid
/// and a legend. The pheromone is that at `now_ms`.
std::string Draw(const Picture& picture, const field::Field& field, uint64_t now_ms);

/// The same with the pheromone of the path's type, and nothing else.
std::string DrawPathPicture(const std::string& title, const field::Field& field,
                            const field::Path& path, const std::vector<Way>& ways, uint64_t now_ms);

}  // namespace pheromone::swarm
