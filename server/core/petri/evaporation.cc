#include "server/core/petri/evaporation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

namespace pheromone::petri {
namespace {

__extension__ using UInt128 = unsigned __int128;

constexpr std::array<std::string_view, 6> kNames = {"e1", "e2",          "e3",
                                                    "e4", "exponential", "counter"};

// exp(-2^i) for i from 4 to -32, in units of 2^-62.
constexpr int kUnitBits = 62;
constexpr uint64_t kExponentials[] = {
    518'976'891'834,           1'547'048'310'802'923,     84'465'975'781'740'359,
    624'123'833'502'197'200,   1'696'544'475'317'221'319, 2'797'128'963'144'291'325,
    3'591'584'682'430'698'961, 4'069'798'626'954'855'183, 4'332'278'087'304'955'805,
    4'469'799'356'029'710'115, 4'540'188'453'729'421'605, 4'575'797'593'107'614'195,
    4'593'706'758'521'714'574, 4'602'687'609'541'841'169, 4'607'184'617'107'619'806,
    4'609'434'768'280'048'980, 4'610'560'255'948'314'624, 4'611'123'102'832'306'901,
    4'611'404'552'040'437'080, 4'611'545'283'086'494'379, 4'611'615'650'220'078'421,
    4'611'650'834'189'516'459, 4'611'668'426'274'897'877, 4'611'677'222'342'754'299,
    4'611'681'620'382'973'951, 4'611'683'819'404'656'640, 4'611'684'918'915'891'200,
    4'611'685'468'671'606'784, 4'611'685'743'549'489'152, 4'611'685'880'988'436'480,
    4'611'685'949'707'911'680, 4'611'685'984'067'649'664, 4'611'686'001'247'518'752,
    4'611'686'009'837'453'320, 4'611'686'014'132'420'610, 4'611'686'016'279'904'256,
    4'611'686'017'353'646'080};
constexpr int kFractionBits = 32;
// exp(-22) of the most that there may be is less than a thousandth.
constexpr uint64_t kGoneAt = 22;

// c0 exp(-numerator / denominator), rounded down.
int64_t Decay(int64_t stored, UInt128 numerator, uint64_t denominator) {
  if (numerator >= UInt128{kGoneAt} * denominator) {
    return 0;
  }
  const auto exponent = static_cast<uint64_t>((numerator << kFractionBits) / denominator);
  uint64_t share = uint64_t{1} << kUnitBits;
  for (size_t i = 0; i < std::size(kExponentials); ++i) {
    if ((exponent >> (std::size(kExponentials) - 1 - i) & 1) != 0) {
      share = static_cast<uint64_t>((UInt128{share} * kExponentials[i]) >> kUnitBits);
    }
  }
  return static_cast<int64_t>((UInt128{share} * static_cast<uint64_t>(stored)) >> kUnitBits);
}

// The root, rounded down; `square` up to 10^18.
int64_t Root(int64_t square) {
  auto root = static_cast<int64_t>(std::sqrt(static_cast<double>(square)));
  while (root * root > square) {
    --root;
  }
  while ((root + 1) * (root + 1) <= square) {
    ++root;
  }
  return root;
}

// (whole - rate * t) / divisor, rounded down and not below 0.
int64_t Linear(int64_t whole, UInt128 loss, int64_t divisor) {
  const auto left = static_cast<UInt128>(whole);
  return loss >= left ? 0 : static_cast<int64_t>((left - loss) / static_cast<uint64_t>(divisor));
}

// Whether the advice stays `present` from p to q: concentrations do not rise meanwhile.
bool Stays(const Evaporation& evaporation, const Trails& trails, int64_t dead_band, Advice present,
           uint64_t p, uint64_t q) {
  const auto exceeds = [&](const Trail& one, uint64_t at, const Trail& other, uint64_t other_at) {
    return ConcentrationAt(evaporation, one, at) - ConcentrationAt(evaporation, other, other_at) >
           dead_band;
  };
  switch (present) {
    case Advice::kA:
      return exceeds(trails.a, q, trails.b, p);
    case Advice::kB:
      return exceeds(trails.b, q, trails.a, p);
    case Advice::kAny:
      break;
  }
  return !exceeds(trails.a, p, trails.b, q) && !exceeds(trails.b, p, trails.a, q);
}

}  // namespace

std::string_view NameOf(EvaporationLaw law) {
  return kNames[static_cast<size_t>(law)];
}

std::optional<EvaporationLaw> LawNamed(std::string_view name) {
  const auto* const found = std::find(kNames.begin(), kNames.end(), name);
  return found != kNames.end() ? std::optional(static_cast<EvaporationLaw>(found - kNames.begin()))
                               : std::nullopt;
}

// In thousandths, C = 1000 c, K = 1000 k, T = 1000 t.
int64_t ConcentrationAt(const Evaporation& evaporation, const Trail& trail, uint64_t now_ms) {
  const int64_t stored = trail.stored_milli;
  if (stored == 0 || now_ms <= trail.since_ms || evaporation.rate_milli == 0) {
    return stored;
  }
  const UInt128 loss = UInt128{evaporation.rate_milli} * (now_ms - trail.since_ms);  // K T
  constexpr int64_t kThousand = 1000;
  switch (evaporation.law) {
    case EvaporationLaw::kE1: {
      const int64_t left = Linear(stored * stored, 2 * loss, 1);
      return Root(left);
    }
    case EvaporationLaw::kE2:
      return Decay(stored, loss, static_cast<uint64_t>(kThousand * stored));
    case EvaporationLaw::kE3:
      return Linear(stored * kThousand, loss, kThousand);
    case EvaporationLaw::kE4:
      return Linear(stored * stored, loss, stored);
    case EvaporationLaw::kExponential:
      return Decay(stored, loss, kThousand * kThousand);
    case EvaporationLaw::kCounter:
      break;
  }
  return stored;
}

void Deposit(const Evaporation& evaporation, uint16_t amount, uint64_t now_ms, Trail* trail) {
  constexpr int64_t kThousand = 1000;
  const int64_t units = evaporation.law == EvaporationLaw::kCounter ? 1 : amount;
  const int64_t left = ConcentrationAt(evaporation, *trail, now_ms);
  *trail = {std::min(left + units * kThousand, kMaxConcentrationMilli), now_ms};
}

Advice Compare(int64_t a_milli, int64_t b_milli, int64_t dead_band_milli) {
  return a_milli - b_milli > dead_band_milli   ? Advice::kA
         : b_milli - a_milli > dead_band_milli ? Advice::kB
                                               : Advice::kAny;
}

Advice AdviceAt(const Evaporation& evaporation, const Trails& trails, int64_t dead_band_milli,
                uint64_t now_ms) {
  return Compare(ConcentrationAt(evaporation, trails.a, now_ms),
                 ConcentrationAt(evaporation, trails.b, now_ms), dead_band_milli);
}

uint64_t NextInstant(uint64_t after_ms, uint32_t period_ms) {
  const uint64_t half = period_ms / 2;
  return after_ms < half ? half : half + ((after_ms - half) / period_ms + 1) * period_ms;
}

// Concentrations only fall: what two instants say bounds all in between. Steps double where that
// decides, and are halved where it does not.
std::optional<uint64_t> NextChange(const Evaporation& evaporation, const Trails& trails,
                                   int64_t dead_band_milli, Advice present, uint64_t after_ms,
                                   uint32_t period_ms) {
  constexpr int kMaxSteps = 1024;
  const auto stays = [&](uint64_t p, uint64_t q) {
    return Stays(evaporation, trails, dead_band_milli, present, p, q);
  };
  const auto changed = [&](uint64_t at) {
    return AdviceAt(evaporation, trails, dead_band_milli, at) != present;
  };
  uint64_t certain = NextInstant(after_ms, period_ms);
  if (changed(certain)) {
    return certain;
  }
  uint64_t step = period_ms;
  for (int i = 0; i < kMaxSteps; ++i) {
    if (certain > kLastFieldMs || stays(certain, kLastFieldMs)) {
      return std::nullopt;
    }
    const uint64_t next = certain + step;
    if (stays(certain, next)) {
      certain = next;
      step *= 2;
    } else if (step > period_ms) {
      step /= 2;
    } else if (changed(next)) {
      return next;
    } else {
      certain = next;
    }
  }
  return certain;
}

}  // namespace pheromone::petri
