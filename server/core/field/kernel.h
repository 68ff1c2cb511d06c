// The inner loops of a query, once for each instruction set. What they compute is defined to the
// bit (protocol/README.md, "Arithmetic"), so it does not matter which one runs: all values are
// integers that a double represents exactly, except for one quotient, root, product or exponential
// in IEEE double precision, each operation rounded once and none fused with another.
//
// Thread-safe: kernels have no state.
#pragma once

#include <stddef.h>
#include <stdint.h>

namespace pheromone::field {

/// A node in one word: the level in the high 22 bits, the time in ms in the low 42 (139 years).
constexpr int kTimeBits = 42;
constexpr uint64_t kTimeMask = (uint64_t{1} << kTimeBits) - 1;

/// The evaporation and spread of a law, prepared for the inner loop.
struct KernelLaw {
  // Evaporation. Stepwise: level - unit * floor(scale * dt / tau). Exponential: halved every tau.
  bool exponential = false;
  double tau_ms = 1;
  double per_tau = 1;  ///< 1 / tau
  double scale = 0;
  double unit = 0;
  // Spread.
  bool gaussian = false;
  double reach_um = 0;
  double slope = 0;     // z-shape: 65 536 / sigma
  double exponent = 0;  // Gaussian: mu = 65 536 * 2^(-exponent * d^2)
  double reach_um2 = 0;
};

/// The parameters of one query; positions are relative to the robot's centre, in micrometres.
struct KernelQuery {
  uint64_t now_ms = 0;
  double cos = 0;  // heading in Q14; both 0: not directional
  double sin = 0;
  double antenna_x[2] = {0, 0};
  double antenna_y[2] = {0, 0};
};

/// Nodes to be weighed, `count` of them, with room for the kernel to round up to whole vectors. The
/// kernel loads their words itself, each with one relaxed load, as a writer may be changing them.
struct Candidates {
  static constexpr size_t kMax = 512;
  size_t count = 0;
  const uint64_t* word[kMax + 8];
  alignas(64) double x[kMax + 8];  // relative to the robot's centre, um
  alignas(64) double y[kMax + 8];
};

/// Tiles of 8 x 8 nodes that may contribute to a query.
struct TileList {
  static constexpr size_t kMax = 64;
  size_t count = 0;
  uint64_t occupied[kMax];      ///< bit 8 * row + column: there is something
  const uint64_t* words[kMax];  ///< of the tile's nodes
  int32_t column[kMax];         ///< of the tile, in tiles
  int32_t row[kMax];
};

/// The region whose nodes can contribute: a circle around the robot's centre, ahead of its axle
/// line, both slightly enlarged so that rounding loses no node. In cells.
struct MaskQuery {
  float cos = 0;
  float sin = 0;
  float margin = 0;  ///< of the axle line
  float radius_squared = 0;
  double column = 0;  ///< of node (0, 0), from the robot's centre
  double row = 0;
};

struct Kernel {
  const char* name;

  /// sum[a] += level * mu over all candidates, for each of `antennas` (1 or 2).
  void (*weigh)(const KernelLaw& law, const KernelQuery& query, Candidates* candidates,
                int antennas, int64_t* sum);

  /// Removes from the bitmaps the nodes that cannot contribute, and from the list the tiles that
  /// have no other nodes.
  void (*mask)(const MaskQuery& query, TileList* tiles);
};

/// The kernels that this processor can run, the best one last; the first is portable.
struct KernelList {
  const Kernel* kernel[6];
  int count;
};
KernelList Kernels();
const Kernel& BestKernel();

// 2^-x for 0 <= x, as defined: n = floor(min(x, 60)), f = x - n, g = f - 1/2, the polynomial below
// in g by Horner's rule from the highest coefficient down, times 2^-n. The coefficients are those
// of the Taylor series of 2^-1/2 * e^(-g ln 2), c_k = 2^-1/2 (-ln 2)^k / k!; the error is below
// 3e-10 of the value.
constexpr int kExp2Terms = 9;
constexpr double kExp2Coefficient[kExp2Terms] = {
    0.7071067811865476,     -0.4901290717342736,     0.16986579209153746,
    -0.03924733162061035,   0.006801044314331813,    -0.0009428249382684685,
    0.00010891940795373224, -1.0785311504483997e-05, 9.344760325992282e-07};
constexpr double kExp2Most = 60;

}  // namespace pheromone::field
