// The step of one tile in vectors of one or two rows, or of half a row each: diffusion_kernel.cc
// has the same edge by edge. Written once, with Highway, which includes this file for each
// instruction set that it knows on this family of processors.

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/core/field/diffusion_vectors.cc"
#include "server/core/field/kernel_targets.h"
// In this order: the first of them includes this file again.
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <type_traits>

#include "server/core/field/diffusion_kernel.h"

#if HWY_TARGET != HWY_SCALAR && HWY_TARGET != HWY_EMU128

HWY_BEFORE_NAMESPACE();
namespace pheromone::field {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using D = hn::CappedTag<int32_t, 16>;
using Unsigned = hn::RebindToUnsigned<D>;
using Wide = hn::RepartitionToWide<Unsigned>;
using Narrow = hn::RepartitionToNarrow<Unsigned>;
using V = hn::Vec<D>;
using M = hn::Mask<D>;

constexpr int kLanes = HWY_LANES(int32_t);
constexpr int kRows = kLanes == 16 ? 2 : 1;  // of a tile, in one `Rows`
constexpr int kParts = kLanes == 4 ? 2 : 1;  // vectors of one `Rows`
constexpr uint32_t kAll = kRows == 2 ? 0xFFFF : 0xFF;

// A row from left to right, or two, the lower first. Never without contents: a constructor of its
// own would be compiled for every processor.
struct Rows {
  V part[kParts];
};

const int32_t* RowOf(const void* tile, int row) {
  return static_cast<const int32_t*>(tile) + 8 * row;
}

template <class DV>
HWY_INLINE Rows Load(DV d, const void* tile, int row) {
  const int32_t* from = RowOf(tile, row);
  if constexpr (kParts == 2) {
    return {{hn::LoadU(d, from), hn::LoadU(d, from + kLanes)}};
  } else {
    return {{hn::LoadU(d, from)}};
  }
}

// The rows above these, the last of them from the tile above.
template <class DV>
HWY_INLINE Rows LoadAbove(DV d, const void* tile, const void* above, int row) {
  if (row + kRows < 8) {
    return Load(d, tile, row + 1);
  }
  if constexpr (kRows == 2) {
    const hn::Half<DV> half;
    return {{hn::Combine(d, hn::Load(half, RowOf(above, 0)), hn::Load(half, RowOf(tile, 7)))}};
  } else {
    return Load(d, above, 0);
  }
}

// The last row of a, and but for the last those of b.
template <class DV>
HWY_INLINE Rows OneUp(DV d, const Rows& a, const Rows& b) {
  if constexpr (kRows == 2) {
    return {{hn::ConcatLowerUpper(d, b.part[0], a.part[0])}};
  } else {
    return a;
  }
}

// The first or the last column of half a tile, from the halves of rows that it is in.
template <int kColumn>
HWY_INLINE hn::Vec<hn::Full128<int32_t>> HalfColumn(const void* tile, int row) {
  const hn::Full128<int32_t> d;
  const hn::Full128<int64_t> pairs;
  const auto half = [&](int r) HWY_ATTR {
    return hn::Load(d, RowOf(tile, row + r) + (kColumn == 0 ? 0 : 4));
  };
  if constexpr (kColumn == 0) {
    return hn::BitCast(
        d, hn::InterleaveLower(pairs, hn::BitCast(pairs, hn::InterleaveLower(d, half(0), half(1))),
                               hn::BitCast(pairs, hn::InterleaveLower(d, half(2), half(3)))));
  } else {
    return hn::BitCast(
        d, hn::InterleaveUpper(pairs, hn::BitCast(pairs, hn::InterleaveUpper(d, half(0), half(1))),
                               hn::BitCast(pairs, hn::InterleaveUpper(d, half(2), half(3)))));
  }
}

// A lane for each row: of two rows' worth the first.
template <int kColumn, class DV>
HWY_INLINE Rows Column(DV d, const void* tile) {
  static_assert(kColumn == 0 || kColumn == 7);
  const auto low = HalfColumn<kColumn>(tile, 0);
  const auto high = HalfColumn<kColumn>(tile, 4);
  if constexpr (kParts == 2) {
    return {{low, high}};
  } else if constexpr (kRows == 1) {
    return {{hn::Combine(d, high, low)}};
  } else {
    return {{hn::ZeroExtendVector(d, hn::Combine(hn::Half<DV>(), high, low))}};
  }
}

// Lanes that their rows' neighbours to the right, or to the left, move into.
HWY_ALIGN constexpr int32_t kFromRight[] = {1, 2, 3, 4, 5, 6, 7, 0, 9, 10, 11, 12, 13, 14, 15, 8};
HWY_ALIGN constexpr int32_t kFromLeft[] = {7, 0, 1, 2, 3, 4, 5, 6, 15, 8, 9, 10, 11, 12, 13, 14};
HWY_ALIGN constexpr int32_t kRowOfLane[] = {0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1};
HWY_ALIGN constexpr int32_t kFirstOfRow[] = {-1, 0, 0, 0, 0, 0, 0, 0, -1, 0, 0, 0, 0, 0, 0, 0};

// The node to the right of each node; `beside` are the same rows of the tile to the right.
template <class DV>
HWY_INLINE Rows RightOf(DV d, const Rows& here, const Rows& beside) {
  if constexpr (kParts == 2) {
    return {{hn::CombineShiftRightBytes<4>(d, here.part[1], here.part[0]),
             hn::CombineShiftRightBytes<4>(d, beside.part[0], here.part[1])}};
  } else {
    const M first = hn::MaskFromVec(hn::Load(d, kFirstOfRow));
    return {{hn::TableLookupLanes(hn::IfThenElse(first, beside.part[0], here.part[0]),
                                  hn::SetTableIndices(d, kFromRight))}};
  }
}

// The flow into each node from its left: the flow to the right of that neighbour, and at the border
// the lanes of these rows of `border`.
template <class DV>
HWY_INLINE Rows FromLeft(DV d, const Rows& to_right, const Rows& border, const int32_t* in_memory,
                         int row) {
  if constexpr (kParts == 2) {
    return {{hn::CombineShiftRightBytes<12>(d, to_right.part[0], hn::Set(d, in_memory[row])),
             hn::CombineShiftRightBytes<12>(d, to_right.part[1], to_right.part[0])}};
  } else {
    const M first = hn::MaskFromVec(hn::Load(d, kFirstOfRow));
    const V moved = hn::TableLookupLanes(to_right.part[0], hn::SetTableIndices(d, kFromLeft));
    V over;
    if constexpr (kRows == 2) {
      const V rows = hn::Add(hn::Load(d, kRowOfLane), hn::Set(d, row));
      over = hn::TableLookupLanes(border.part[0], hn::IndicesFromVec(d, rows));
    } else {
      over = hn::Set(d, in_memory[row]);
    }
    return {{hn::IfThenElse(first, over, moved)}};
  }
}

// The factor of Flux, in one half of each lane.
struct Exchange {
  hn::Vec<Narrow> lower;
  hn::Vec<Narrow> upper;
};

// trunc((a - b) * x / 65 536). With |a - b| = 65 536 h + l that is, but for the sign,
// h x + floor(l x / 65 536).
HWY_INLINE Rows Flux(const Rows& a, const Rows& b, const Exchange& exchange) {
  const D d;
  Rows flux = a;
  for (int p = 0; p < kParts; ++p) {
    const V difference = hn::Sub(a.part[p], b.part[p]);
    const auto size = hn::BitCast(Narrow(), hn::Abs(difference));
#if HWY_ARCH_X86
    // Here products of neighbours are added in place (h is below 2^15, so a signed one holds it),
    // which Highway does not promise elsewhere.
    const hn::Repartition<int16_t, D> halves;
    V none = hn::Zero(d);
    const V high = hn::ReorderWidenMulAccumulate(
        d, hn::BitCast(halves, size), hn::BitCast(halves, exchange.upper), hn::Zero(d), none);
    const V low = hn::BitCast(d, hn::MulHigh(size, exchange.lower));
#else
    // The upper halves of both products are where they belong, the lower one of h x is not.
    const auto both = hn::Or(exchange.lower, exchange.upper);
    const V high = hn::BitCast(d, hn::MulHigh(size, both));
    const V low = hn::BitCast(d, hn::ShiftRight<16>(hn::BitCast(Unsigned(), hn::Mul(size, both))));
#endif
    const V sum = hn::Add(high, low);
    if constexpr (kLanes == 16) {
      flux.part[p] = hn::IfThenElse(hn::Lt(difference, hn::Zero(d)), hn::Neg(sum), sum);
    } else {
      const V sign = hn::BroadcastSignBit(difference);
      flux.part[p] = hn::Sub(hn::Xor(sum, sign), sign);
    }
  }
  return flux;
}

// A mask of the edges whose bit is set, from bit `at` on.
HWY_INLINE Rows WhereOpen(uint64_t bits, int at, const Rows& rows) {
  Rows open = rows;
  for (int p = 0; p < kParts; ++p) {
    const uint64_t lanes = bits >> (at + p * kLanes);
    uint8_t bytes[8];
    hwy::CopyBytes<8>(&lanes, bytes);
    open.part[p] = hn::IfThenElseZero(hn::LoadMaskBits(D(), bytes), rows.part[p]);
  }
  return open;
}

// floor(v * keep / 2^32).
HWY_INLINE V Scale(V v, hn::Vec<Unsigned> keep) {
  const auto whole = hn::BitCast(Unsigned(), v);
  const auto even = hn::ShiftRight<32>(hn::MulEven(whole, keep));
  const auto odds = hn::BitCast(Unsigned(), hn::ShiftRight<32>(hn::BitCast(Wide(), whole)));
  const auto odd = hn::MulEven(odds, keep);
  return hn::BitCast(D(), hn::OddEven(hn::BitCast(Unsigned(), odd), hn::BitCast(Unsigned(), even)));
}

// Lanes to sums in 64 bits.
HWY_INLINE hn::Vec<Wide> AddTo(hn::Vec<Wide> sums, V v) {
  const auto pairs = hn::BitCast(Wide(), v);
  const auto even = hn::And(pairs, hn::Set(Wide(), UINT32_MAX));
  return hn::Add(sums, hn::Add(even, hn::ShiftRight<32>(pairs)));
}

HWY_INLINE uint32_t BitsOf(M mask) {
  std::conditional_t<kLanes == 16, uint16_t, uint8_t> bits = 0;
  hn::StoreMaskBits(D(), mask, reinterpret_cast<uint8_t*>(&bits));
  return bits;
}

template <bool kWalls, bool kEvaporates>
void StepRows(const DiffusionNumbers& numbers, DiffusionTile* tile) {
  const D d;
  const auto exchange_q16 = hn::Set(Unsigned(), numbers.exchange_q16);
  const Exchange exchange = {hn::BitCast(Narrow(), exchange_q16),
                             hn::BitCast(Narrow(), hn::ShiftLeft<16>(exchange_q16))};
  const auto keep = hn::Set(Unsigned(), numbers.keep_q32);
  // Contents are at most INT32_MAX: a cut-off beyond that removes everything. A cut-off of 0 is
  // equivalent to 1: it removes nothing, and the remaining contents are those that are not 0.
  const uint32_t up_to = numbers.cutoff_q16 > 0 ? numbers.cutoff_q16 - 1 : 0;
  const V cut_up_to = hn::Set(d, static_cast<int32_t>(up_to < INT32_MAX ? up_to : INT32_MAX));

  // The flow over the left border, a lane for each row: one vector instead of eight.
  Rows over_left =
      Flux(Column<7>(d, tile->beside[DiffusionTile::kLeft]), Column<0>(d, tile->centre), exchange);
  if (kWalls) {
    over_left = WhereOpen(tile->open_left, 0, over_left);
  }
  HWY_ALIGN int32_t in_memory[8 * kRows];
  if constexpr (kRows == 1) {
    for (int p = 0; p < kParts; ++p) {
      hn::Store(over_left.part[p], d, in_memory + p * kLanes);
    }
  }

  // And over the one below; of these rows only the last counts.
  constexpr int kLast = 8 - kRows;
  Rows to_above =
      Flux(Load(d, tile->beside[DiffusionTile::kBelow], kLast),
           LoadAbove(d, tile->beside[DiffusionTile::kBelow], tile->centre, kLast), exchange);
  if (kWalls) {
    to_above = WhereOpen(uint64_t{tile->open_below} << (8 * (kRows - 1)), 0, to_above);
  }

  uint64_t occupied = 0;
  auto sum = hn::Zero(Wide());
  auto cut = hn::Zero(Wide());
  V waiting = hn::Zero(d);
#pragma GCC unroll 4
  for (int row = 0; row < 8; row += kRows) {
    const Rows here = Load(d, tile->centre, row);
    const Rows over_below = to_above;
    to_above =
        Flux(here, LoadAbove(d, tile->centre, tile->beside[DiffusionTile::kAbove], row), exchange);
    Rows to_right =
        Flux(here, RightOf(d, here, Load(d, tile->beside[DiffusionTile::kRight], row)), exchange);
    if (kWalls) {
      to_above = WhereOpen(tile->open_above, 8 * row, to_above);
      to_right = WhereOpen(tile->open_right, 8 * row, to_right);
    }
    const Rows from_below = OneUp(d, over_below, to_above);
    const Rows from_left = FromLeft(d, to_right, over_left, in_memory, row);
    uint32_t kept = 0;
    Rows after = here;
    Rows left_out = here;
    for (int p = 0; p < kParts; ++p) {
      const V in = hn::Add(from_below.part[p], from_left.part[p]);
      const V out = hn::Add(to_above.part[p], to_right.part[p]);
      V next = hn::Add(here.part[p], hn::Sub(in, out));
      if (kEvaporates) {
        next = Scale(next, keep);
      }
      const M enough = hn::Gt(next, cut_up_to);
      after.part[p] = next;
      hn::StoreU(hn::IfThenElseZero(enough, next), d,
                 static_cast<int32_t*>(tile->next) + 8 * row + p * kLanes);
      left_out.part[p] = hn::IfThenZeroElse(enough, next);
      kept |= BitsOf(enough) << (p * kLanes);
    }
    // Two numbers below 2^31 at a time.
    if constexpr (kParts == 2) {
      sum = AddTo(sum, hn::Add(after.part[0], after.part[1]));
    } else if (row % (2 * kRows) == 0) {
      waiting = after.part[0];
    } else {
      sum = AddTo(sum, hn::Add(waiting, after.part[0]));
    }
    if (kept != kAll) {
      for (int p = 0; p < kParts; ++p) {
        cut = AddTo(cut, left_out.part[p]);
      }
    }
    occupied |= uint64_t{kept} << (8 * row);
  }
  tile->occupied = occupied;
  tile->cut = hn::GetLane(hn::SumOfLanes(Wide(), cut));
  tile->sum = hn::GetLane(hn::SumOfLanes(Wide(), sum)) - tile->cut;
}

void Step(const DiffusionNumbers& numbers, DiffusionTile* tile) {
  const bool walls = (tile->open_right & tile->open_above) != UINT64_MAX ||
                     (tile->open_left & tile->open_below) != UINT8_MAX;
  if (numbers.keep_q32 == 0) {
    walls ? StepRows<true, false>(numbers, tile) : StepRows<false, false>(numbers, tile);
  } else {
    walls ? StepRows<true, true>(numbers, tile) : StepRows<false, true>(numbers, tile);
  }
}

constexpr DiffusionKernel kVectorKernel = {PHEROMONE_TARGET_NAME, Step};

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace pheromone::field
HWY_AFTER_NAMESPACE();

#endif

#if HWY_ONCE
namespace pheromone::field {

void AppendVectorDiffusion(DiffusionKernelList* list) {
  static const Compiled<DiffusionKernel> compiled[] = PHEROMONE_COMPILED(kVectorKernel);
  AppendRunning(compiled, list);
}

}  // namespace pheromone::field
#endif
