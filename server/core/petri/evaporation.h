// How the pheromone of a trail evaporates, which trail it advises, and until when. The paper
// (Ferreira, Tavares and Silva 2018, section 4.2) demands that a low concentration takes less time
// to evaporate than a high one; its equation (2) is lost. These are the laws that the sentence
// admits, and two others:
//
//   law          c(t), t since the last deposit on this trail     rate k in
//   E1           sqrt(c0^2 - 2 k t)     dc/dt = -k/c              units^2/s   the default
//   E2           c0 exp(-k t / c0)                                units/s
//   E3           c0 - k t                                         units/s
//   E4           c0 - k t / c0          E1 with c frozen at c0    units^2/s
//   exponential  c0 exp(-k t)           contradicts the sentence  1/s
//   counter      c0                     each deposit counts one   none
//
//   Trail a;
//   Deposit(evaporation, 40, now_ms, &a);
//   Advice advice = Compare(ConcentrationAt(evaporation, a, now_ms), ..., dead_band_milli);
//
// A unit is a unit of energy. Concentrations are integers in thousandths of it, rounded down, and
// times field time in milliseconds: the same bits on every machine. What is below a thousandth is
// gone. No law ever lets a concentration rise by itself. Pure functions; any thread.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace pheromone::petri {

enum class EvaporationLaw : uint8_t { kE1, kE2, kE3, kE4, kExponential, kCounter };
constexpr EvaporationLaw kLastEvaporationLaw = EvaporationLaw::kCounter;

/// "e1" to "e4", "exponential", "counter", as in configurations.
std::string_view NameOf(EvaporationLaw law);
/// Empty if no law has that name.
std::optional<EvaporationLaw> LawNamed(std::string_view name);

constexpr int64_t kMaxRateMilli = 1'000'000'000;
/// What a trail holds at most; more is lost.
constexpr int64_t kMaxConcentrationMilli = 1'000'000'000;
/// The largest field time, of 139 years.
constexpr uint64_t kLastFieldMs = (uint64_t{1} << 42) - 1;

struct Evaporation {
  EvaporationLaw law = EvaporationLaw::kE1;
  uint32_t rate_milli = 1000;  ///< k in thousandths; 0: nothing evaporates
  bool operator==(const Evaporation&) const = default;
};

/// The pheromone of one trail.
struct Trail {
  int64_t stored_milli = 0;  ///< c0: what there was after the last deposit
  uint64_t since_ms = 0;     ///< when that was
  bool operator==(const Trail&) const = default;
};

/// c(t). Before the last deposit, c0.
int64_t ConcentrationAt(const Evaporation& evaporation, const Trail& trail, uint64_t now_ms);

/// Adds `amount` units to what is left; of the law "counter", one.
void Deposit(const Evaporation& evaporation, uint16_t amount, uint64_t now_ms, Trail* trail);

/// The better trail: 00 none, 01 A, 10 B.
enum class Advice : uint8_t { kAny = 0, kA = 1, kB = 2 };

/// Three ways: a trail must have more than the other by more than the dead band.
Advice Compare(int64_t a_milli, int64_t b_milli, int64_t dead_band_milli);

/// Two trails that are compared.
struct Trails {
  Trail a;
  Trail b;
  bool operator==(const Trails&) const = default;
};
Advice AdviceAt(const Evaporation& evaporation, const Trails& trails, int64_t dead_band_milli,
                uint64_t now_ms);

/// The first instant after `after_ms`. Instants are half a period after its multiples.
uint64_t NextInstant(uint64_t after_ms, uint32_t period_ms);

/// The first instant after `after_ms` at which the advice is not `present`; empty if it stays for
/// ever. If that takes too long to find out, an earlier instant, up to which it certainly stays:
/// ask again there.
std::optional<uint64_t> NextChange(const Evaporation& evaporation, const Trails& trails,
                                   int64_t dead_band_milli, Advice present, uint64_t after_ms,
                                   uint32_t period_ms);

}  // namespace pheromone::petri
