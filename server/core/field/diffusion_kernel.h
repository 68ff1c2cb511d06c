// One step of diffusion over one tile, once for each instruction set. All in integers, so every
// kernel gives the same bits (protocol/README.md, "Arithmetic"); which one runs is a matter of
// speed.
//
// Thread-safe: kernels have no state.
#pragma once

#include <stdint.h>

namespace pheromone::field {

/// The parameters of a step, the same for all tiles of a layer (DiffusionLaw in law.h).
struct DiffusionNumbers {
  uint32_t exchange_q16 = 0;  // at most 1/4
  uint32_t keep_q32 = 0;      // 0: nothing evaporates
  uint32_t cutoff_q16 = 0;
};

/// A tile and its surroundings before the step, and the result. Contents are 64 numbers below 2^31
/// in 1/65 536 quantum, row by row from the bottom, on a boundary of 64 bytes.
struct DiffusionTile {
  enum : uint8_t { kLeft, kRight, kBelow, kAbove, kSides };
  const void* centre;
  const void* beside[kSides];

  // The edges between nodes that flow may cross. Bit 8 * row + column of `open_right` is the edge
  // between that node and the one to its right, of `open_above` to the one above; bit `row` of
  // `open_left`, bit `column` of `open_below`: the edges between this tile and those neighbours.
  uint64_t open_right;
  uint64_t open_above;
  uint8_t open_left;
  uint8_t open_below;

  void* next;         // 64 numbers, which none of the above overlaps
  uint64_t occupied;  // bit 8 * row + column: `next` is not 0
  uint64_t sum;       // of `next`
  uint64_t cut;       // the total removed by the cut-off
};

struct DiffusionKernel {
  const char* name;
  void (*step)(const DiffusionNumbers& numbers, DiffusionTile* tile);
};

/// The kernels that this processor can run, the best one last; the first is portable.
struct DiffusionKernelList {
  const DiffusionKernel* kernel[6];
  int count;
};
DiffusionKernelList DiffusionKernels();
const DiffusionKernel& BestDiffusionKernel();

/// For the list above: appends the kernels that Highway has compiled and this processor can run.
void AppendVectorDiffusion(DiffusionKernelList* list);

}  // namespace pheromone::field
