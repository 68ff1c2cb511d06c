// The step of one tile, written once over a type `Lanes` that stands for a vector of one or two
// rows of 32-bit numbers and names the few operations it needs. Included by the kernels' sources
// alone; everything is in an unnamed namespace, and nothing of the standard library is used
// (diffusion_kernel.h says why).
//
// Lanes: kRows; V (the rows' numbers, the lower row first); M (a choice of lanes); X and K
// (exchange and keep, prepared); Sums; Set; Load and Store rows from a given one up; LoadAbove (the
// rows above these, the last of them from the tile above); OneUp (the last row of a, and but for
// the last those of b); Column<c> (of a tile, a lane a row); PushFirst (into lane 0 of each row,
// the others move up, the last one falls out); PushLast (the other way, with lane 0 of another's
// rows); Flux (trunc((a - b) * x / 65 536)); Scale (floor(v * keep / 2^32)); Add, Sub; Choose
// (lanes by bits), Greater (a > b), Keep (what is chosen, else 0), Drop (what is not), Bits (kAll:
// all lanes); AddTo (all lanes to a sum in 64 bits), Total.
#pragma once

#include "server/field/diffusion_kernel.h"

namespace pheromone::field {
namespace {  // NOLINT(google-build-namespaces): each kernel has its own

template <typename L, bool kWalls, bool kEvaporates>
inline void StepRows(const DiffusionNumbers& numbers, DiffusionTile* tile) {
  using V = typename L::V;
  const typename L::X exchange = L::PrepareExchange(numbers.exchange_q16);
  const typename L::K keep = L::PrepareKeep(numbers.keep_q32);
  // Contents are at most INT32_MAX: a cut-off beyond that takes all. One of 0 takes as much as one
  // of 1: nothing; so what is not cut off is what is not 0.
  const uint32_t up_to = numbers.cutoff_q16 > 0 ? numbers.cutoff_q16 - 1 : 0;
  const V cut_up_to = L::Set(static_cast<int32_t>(up_to < INT32_MAX ? up_to : INT32_MAX));

  // What comes in over the left border, a lane for each row: one vector saves eight.
  V over_left = L::Flux(L::template Column<7>(tile->beside[DiffusionTile::kLeft]),
                        L::template Column<0>(tile->centre), exchange);
  if (kWalls) {
    over_left = L::Keep(L::Choose(tile->open_left), over_left);
  }
  alignas(64) uint32_t from_left[8 * L::kRows];
  L::Store(from_left, 0, over_left);

  // And over the one below; of these rows only the last counts.
  constexpr int kLast = 8 - L::kRows;
  V to_above =
      L::Flux(L::Load(tile->beside[DiffusionTile::kBelow], kLast),
              L::LoadAbove(tile->beside[DiffusionTile::kBelow], tile->centre, kLast), exchange);
  if (kWalls) {
    to_above = L::Keep(L::Choose(uint32_t{tile->open_below} << (8 * (L::kRows - 1))), to_above);
  }

  uint64_t occupied = 0;
  typename L::Sums sum = L::Zero();
  typename L::Sums cut = L::Zero();
  for (int row = 0; row < 8; row += L::kRows) {
    const V here = L::Load(tile->centre, row);
    const V over_below = to_above;
    to_above = L::Flux(here, L::LoadAbove(tile->centre, tile->beside[DiffusionTile::kAbove], row),
                       exchange);
    V to_right = L::Flux(here, L::PushLast(here, L::Load(tile->beside[DiffusionTile::kRight], row)),
                         exchange);
    if (kWalls) {
      to_above = L::Keep(L::Choose(static_cast<uint32_t>(tile->open_above >> (8 * row))), to_above);
      to_right = L::Keep(L::Choose(static_cast<uint32_t>(tile->open_right >> (8 * row))), to_right);
    }
    const V in = L::Add(L::OneUp(over_below, to_above), L::PushFirst(to_right, from_left + row));
    V next = L::Add(here, L::Sub(in, L::Add(to_above, to_right)));
    if (kEvaporates) {
      next = L::Scale(next, keep);
    }
    const typename L::M enough = L::Greater(next, cut_up_to);
    sum = L::AddTo(sum, next);
    L::Store(tile->next, row, L::Keep(enough, next));
    const uint32_t kept = L::Bits(enough);
    if (kept != L::kAll) {
      cut = L::AddTo(cut, L::Drop(enough, next));
    }
    occupied |= uint64_t{kept} << (8 * row);
  }
  tile->occupied = occupied;
  tile->cut = L::Total(cut);
  tile->sum = L::Total(sum) - tile->cut;
}

template <typename L>
void StepFor(const DiffusionNumbers& numbers, DiffusionTile* tile) {
  const bool walls = (tile->open_right & tile->open_above) != UINT64_MAX ||
                     (tile->open_left & tile->open_below) != UINT8_MAX;
  if (numbers.keep_q32 == 0) {
    walls ? StepRows<L, true, false>(numbers, tile) : StepRows<L, false, false>(numbers, tile);
  } else {
    walls ? StepRows<L, true, true>(numbers, tile) : StepRows<L, false, true>(numbers, tile);
  }
}

}  // namespace
}  // namespace pheromone::field
