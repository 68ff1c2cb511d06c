// The portable kernel, edge by edge, and the list of all.
#include "server/core/field/diffusion_kernel.h"

namespace pheromone::field {
namespace {

// Towards zero, from the first node to the second.
int32_t Flux(uint32_t from, uint32_t to, uint32_t exchange_q16) {
  const int64_t difference = int64_t{from} - int64_t{to};
  return static_cast<int32_t>(difference * exchange_q16 / 65536);
}

void Step(const DiffusionNumbers& numbers, DiffusionTile* tile) {
  using Row = uint32_t[8];
  const auto* centre = static_cast<const Row*>(tile->centre);
  const auto side = [tile](int which) { return static_cast<const Row*>(tile->beside[which]); };
  // Over each edge, rightwards into column i and upwards into row i.
  int32_t right[8][9];
  int32_t up[9][8];
  for (int row = 0; row < 8; ++row) {
    for (int column = 0; column <= 8; ++column) {
      const bool open = column == 0 ? (tile->open_left >> row & 1) != 0
                                    : (tile->open_right >> (8 * row + column - 1) & 1) != 0;
      const uint32_t from =
          column == 0 ? side(DiffusionTile::kLeft)[row][7] : centre[row][column - 1];
      const uint32_t to = column == 8 ? side(DiffusionTile::kRight)[row][0] : centre[row][column];
      right[row][column] = open ? Flux(from, to, numbers.exchange_q16) : 0;
    }
  }
  for (int row = 0; row <= 8; ++row) {
    for (int column = 0; column < 8; ++column) {
      const bool open = row == 0 ? (tile->open_below >> column & 1) != 0
                                 : (tile->open_above >> (8 * (row - 1) + column) & 1) != 0;
      const uint32_t from =
          row == 0 ? side(DiffusionTile::kBelow)[7][column] : centre[row - 1][column];
      const uint32_t to = row == 8 ? side(DiffusionTile::kAbove)[0][column] : centre[row][column];
      up[row][column] = open ? Flux(from, to, numbers.exchange_q16) : 0;
    }
  }

  auto* next = static_cast<Row*>(tile->next);
  tile->occupied = 0;
  tile->sum = 0;
  tile->cut = 0;
  for (int row = 0; row < 8; ++row) {
    for (int column = 0; column < 8; ++column) {
      const int32_t gain =
          right[row][column] - right[row][column + 1] + up[row][column] - up[row + 1][column];
      uint64_t left = centre[row][column] + static_cast<uint32_t>(gain);
      left &= UINT32_MAX;
      if (numbers.keep_q32 != 0) {
        left = left * numbers.keep_q32 >> 32;
      }
      if (left < numbers.cutoff_q16) {
        tile->cut += left;
        left = 0;
      }
      next[row][column] = static_cast<uint32_t>(left);
      tile->occupied |= uint64_t{left != 0} << (8 * row + column);
      tile->sum += left;
    }
  }
}

constexpr DiffusionKernel kPortable = {"portable", Step};

}  // namespace

DiffusionKernelList DiffusionKernels() {
  DiffusionKernelList list{{&kPortable}, 1};
  AppendVectorDiffusion(&list);
  return list;
}

const DiffusionKernel& BestDiffusionKernel() {
  static const DiffusionKernelList list = DiffusionKernels();
  return *list.kernel[list.count - 1];
}

}  // namespace pheromone::field
