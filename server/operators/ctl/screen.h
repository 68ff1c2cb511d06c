// A map in text: two cells of a raster in each character, the upper one as the colour of a half
// block and the lower one as its background; robots as arrows in the direction they face.
//
//   const std::string text = Draw(view, {.columns = 80, .rows = 24, .colours = Colours::k24Bit});
//
// Without colours a character shows the stronger of its two cells, from blank to '@', and '#' for
// an obstacle. Pure; any thread.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace pheromone::ctl {

enum class Colours { kNone, k256, k24Bit };

/// A robot on the map.
struct Marker {
  double x_m = 0;
  double y_m = 0;
  double heading_deg = 0;
  std::string label;  ///< its number
};

/// The data to draw: a raster with its top row first, as sent by the server.
struct MapPicture {
  int columns = 0;
  int rows = 0;
  std::vector<std::optional<double>> values;  ///< empty: an obstacle
  double maximum = 1;
  double left_m = 0;  ///< of the left edge
  double bottom_m = 0;
  double cell_m = 1;
  std::vector<Marker> markers;
};

/// Lines of at most `columns` characters, each ending in "\n", at most `rows` of them.
struct ScreenSize {
  int columns = 80;
  int rows = 24;
};
std::string Draw(const MapPicture& picture, ScreenSize size, Colours colours);

/// The number of nodes along a cell's side for which a map of this many nodes fits.
int NodesPerCell(int map_columns, int map_rows, ScreenSize size);

/// The arrow for a heading, to the nearest eighth of a turn.
std::string ArrowOf(double heading_deg);

}  // namespace pheromone::ctl
