// The inner loops of the baselines that use wide registers, compiled by Highway once for each
// instruction set, as the field's own are.
//
// Thread-safe: the loops have no state.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace pheromone::field::bench {

// A node of the scanned map in 4 bytes: its count in the high bits, the tick of its last deposit in
// the low ones. A tick is a sixteenth of tau. Half the memory of exact milliseconds, in favour of
// the baseline.
constexpr int kTickBits = 20;
constexpr uint32_t kTickMask = (uint32_t{1} << kTickBits) - 1;
constexpr int kTicksPerTauBits = 4;
constexpr int kWidestRegister = 16;  ///< floats; rows of a map are padded to whole ones

/// A map and a query, all lengths in cells from node (0, 0).
struct ScanQuery {
  const uint32_t* words = nullptr;
  int32_t rows = 0;
  int32_t stride = 0;  ///< words in a row; those beyond the map are 0
  uint32_t now_ticks = 0;
  float centre_x = 0;
  float centre_y = 0;
  float cos = 0;
  float sin = 0;
  float antenna_x[2] = {0, 0};
  float antenna_y[2] = {0, 0};
  float reach = 0;          ///< c + sigma
  float inverse_sigma = 0;  ///< mu(d) = min(1, max(0, (reach - d) / sigma)), eq. (1)
};

struct Wide {
  const char* name;

  /// sum[a] = sum of C mu over all nodes ahead of the axle line, for both antennas in one pass.
  void (*scan)(const ScanQuery& query, float* sum);
  /// The same; but where no node of a register is in reach, it is prefetched and no more.
  void (*scan_skipping)(const ScanQuery& query, float* sum);

  /// grid[i] *= keep.
  void (*evaporate)(float* grid, size_t count, float keep);
  /// grid = max(grid, stamp) on a square of `side` cells.
  void (*stamp)(float* grid, size_t stride, const float* stamp, int32_t side);
  /// One step of to = from + rate * (sum of the four neighbours - 4 from), the border left out.
  void (*stencil)(const float* from, float* to, int32_t side, float rate);
};

/// Those that this processor can run, the best one last.
std::vector<const Wide*> AllWides();
const Wide& BestWide();

}  // namespace pheromone::field::bench
