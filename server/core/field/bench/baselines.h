// What the field is compared with: other ways to answer the same question.
//
//   LiteralMap   the paper as printed: N x N nodes, all of them looked at, for each antenna
//   ScannedMap   the best one-pass scan of the whole map that we could write
//   DenseGrid    what common pheromone simulators do: each frame evaporates the whole grid, robots
//                stamp cones on it and read the cells under their antennas
//   LinesUnder,  what memory alone asks for the nodes that a robot can sense: the lower bound of
//   TiledMemory  any answer that looks at them
//
// The two maps compute what Field::Sense computes (baselines_test.cc); the grid answers a poorer
// question, since a cell has no direction. Intensities are in pheromone units.
//
// Equations: Susnea et al. 2009, with the readings of protocol/README.md. Not thread-safe.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "server/core/field/bench/wide.h"
#include "server/core/field/geometry.h"
#include "server/core/field/law.h"

namespace pheromone::field::bench {

/// P_L and P_R of eq. (4).
struct Smell {
  double left = 0;
  double right = 0;
};

/// The antennas of eq. (5), in micrometres.
struct AntennaPair {
  double left_x = 0;
  double left_y = 0;
  double right_x = 0;
  double right_y = 0;
};
AntennaPair AntennaPairOf(const PoseUm& pose, int64_t distance_um);

class LiteralMap {
 public:
  LiteralMap(const MapGeometry& map, int64_t antenna_distance_um, const PheromoneLaw& law);

  void set_law(const PheromoneLaw& law) { law_ = law; }
  void Deposit(PointUm point, uint16_t quanta, uint64_t now_ms);
  Smell Sense(const PoseUm& pose, uint64_t now_ms) const;

 private:
  double Count(size_t node, double now_ms) const;
  double Spread(double distance_um) const;
  double IntensityAt(double x, double y, const PoseUm& pose, double now_ms) const;

  MapGeometry map_;
  int64_t antenna_distance_um_;
  PheromoneLaw law_;
  std::vector<int32_t> count_;
  std::vector<uint32_t> time_ms_;
};

/// Times are multiples of tau / 16 here; anything between is cut off.
class ScannedMap {
 public:
  ScannedMap(const MapGeometry& map, int64_t antenna_distance_um, const PheromoneLaw& law);

  void set_law(const PheromoneLaw& law) { law_ = law; }
  void Deposit(PointUm point, uint16_t quanta, uint64_t now_ms);
  Smell Sense(const Wide& wide, const PoseUm& pose, uint64_t now_ms) const {
    return Scan(wide.scan, pose, now_ms);
  }
  /// With the short cut of Wide::scan_skipping.
  Smell SenseSkipping(const Wide& wide, const PoseUm& pose, uint64_t now_ms) const {
    return Scan(wide.scan_skipping, pose, now_ms);
  }

 private:
  uint32_t Ticks(uint64_t time_ms) const;
  Smell Scan(void (*scan)(const ScanQuery&, float*), const PoseUm& pose, uint64_t now_ms) const;

  MapGeometry map_;
  int64_t antenna_distance_um_;
  PheromoneLaw law_;
  size_t stride_;
  std::vector<uint32_t> words_;
};

class DenseGrid {
 public:
  /// `reach_cells` is the radius of the cone that a robot stamps.
  DenseGrid(const MapGeometry& map, int64_t antenna_distance_um, int reach_cells);

  void Evaporate(const Wide& wide, float keep) {
    wide.evaporate(cells_.data(), cells_.size(), keep);
  }
  void Stamp(const Wide& wide, PointUm point);
  Smell Sense(const PoseUm& pose) const;

 private:
  float At(double x_um, double y_um) const;

  MapGeometry map_;
  int64_t antenna_distance_um_;
  int32_t reach_;
  int32_t side_;  // of the grid, with a margin so that no stamp needs to be clipped
  std::vector<float> stamp_;
  std::vector<float> cells_;
};

/// The 64-byte lines of memory that hold the nodes which a robot can sense from these poses: in
/// reach of an antenna and ahead of the axle line. Nodes are words of 8 bytes in tiles of 8 x 8, so
/// a line is one row of a tile; the tiles lie row by row, which is kinder than any real layout.
/// Pose after pose, in the order of the poses.
std::vector<uint32_t> LinesUnder(const MapGeometry& map, int64_t antenna_distance_um,
                                 int64_t reach_um, const std::vector<PoseUm>& poses);

/// The bytes of such a map.
size_t TiledBytes(const MapGeometry& map);

/// As much memory, on large pages where the system has them.
class TiledMemory {
 public:
  explicit TiledMemory(const MapGeometry& map);

  /// Reads a word of each of these lines, each asked for well before it is needed. The sum keeps
  /// the compiler from leaving the reading out.
  uint64_t Touch(const std::vector<uint32_t>& lines) const;

 private:
  struct Free {
    void operator()(void* memory) const;
  };
  std::unique_ptr<uint64_t[], Free> words_;
};

}  // namespace pheromone::field::bench
