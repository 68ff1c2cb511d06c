// Prints the lines of a file as CSV in metres, a closed line with its first point repeated: what
// other programs compare their own reading of the file with.
//
//   maps_lines FILE [METRES_PER_UNIT [TOLERANCE_UM [ID]]]
#include <cstdio>
#include <cstdlib>
#include <string>

#include "server/formats/maps/polyline_file.h"

namespace {

void Print(pheromone::field::PointUm point) {
  std::printf("%.6f,%.6f\n", static_cast<double>(point.x) / 1e6,
              static_cast<double>(point.y) / 1e6);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fputs("usage: maps_lines FILE [METRES_PER_UNIT [TOLERANCE_UM [ID]]]\n", stderr);
    return 2;
  }
  pheromone::maps::PolylineOptions options;
  options.geojson_unit = pheromone::maps::GeoJsonUnit::kMetres;
  options.metres_per_unit = argc > 2 ? std::strtod(argv[2], nullptr) : options.metres_per_unit;
  options.tolerance_um = argc > 3 ? std::strtol(argv[3], nullptr, 10) : options.tolerance_um;
  options.svg_id = argc > 4 ? argv[4] : "";
  const auto lines = pheromone::maps::LoadPolylines(argv[1], options);
  if (!lines.ok()) {
    std::fprintf(stderr, "%s\n", lines.error().c_str());
    return 1;
  }
  std::puts("x_m,y_m");
  for (const pheromone::maps::Polyline& line : lines.value()) {
    for (const pheromone::field::PointUm point : line.points) {
      Print(point);
    }
    if (line.closed) {
      Print(line.points.front());
    }
    std::puts("");
  }
  return 0;
}
