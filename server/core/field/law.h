// The parameters of a pheromone, in integers, as the equations use them.
//
//   spread       how strongly a source is sensed at a distance: eq. (1), or a Gaussian
//   evaporation  eq. (2), (3): the content of a node decreases with time
//   strength     Q, the value of one quantum; a node holds at most `max_count` of them
//   weight       the factor with which it is sensed; negative = repellent
//
// A type may be a *blend* instead: a weighted sum of others, without pheromone of its own.
//
// All equations: Susnea et al. 2009. protocol/README.md has our interpretation of what they leave
// open, and the exact arithmetic.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "server/base/fields.h"

namespace pheromone::field {

/// The content of a node is counted in levels of 1/64 quantum, for the laws that divide a quantum.
/// With the paper's law, a node holds whole quanta.
constexpr int kLevelBits = 6;
constexpr uint32_t kLevelsPerQuantum = 1u << kLevelBits;

constexpr int kMaxType = 15;  ///< types are 1 to 15

/// Upper bounds of a law's parameters, at least those of configuration files.
constexpr int64_t kMaxTauMs = 1'000'000'000'000;
constexpr int64_t kMaxQuantumMicro = 1'000'000'000;
constexpr int64_t kMaxReachUm = 50'000'000;
constexpr int64_t kMaxReachCells = 1'000;  ///< from the robot: a query reads all nodes within it
constexpr int64_t kMaxWeightMilli = 1'000'000;
constexpr uint32_t kMaxExchangeQ16 = 1u << 14;  ///< a quarter: beyond it, steps would oscillate
constexpr uint32_t kMaxStepMs = 60'000;
constexpr uint32_t kMaxCutoffQ16 = 1u << 16;
constexpr uint16_t kMaxDiffusingCount = 32'767;  ///< quanta on a node of a type that diffuses

/// How the content of a node decreases. `tau_ms` = 0: it does not.
enum class Evaporation : uint8_t {
  kCounter,      ///< the paper's: one quantum less every tau
  kLinear,       ///< the same in steps of one level: tau / 64
  kExponential,  ///< halved every tau (the half-life)
};

/// How strongly a source is sensed at distance d.
enum class Profile : uint8_t {
  kZShape,    ///< eq. (1): full up to c, falling to nothing at c + sigma; c = 0 is a cone
  kGaussian,  ///< exp(-d^2 / (2 sigma^2)), nothing beyond `cutoff_um`
};

/// One part of a blend.
struct BlendPart {
  uint8_t type = 1;
  int32_t weight_milli = 1000;  ///< in thousandths; instead of the part's own weight
  bool operator==(const BlendPart&) const = default;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("type", it.type);
    visit("weight_milli", it.weight_milli, Within(-kMaxWeightMilli, kMaxWeightMilli));
  }
};

/// A diffusing pheromone type, which has a layer of its own (diffusion.h).
struct DiffusionLaw {
  /// The fraction of the difference between two neighbours that moves in a step, in 1/65 536: D *
  /// step / a^2; at most 1/4. 0 = this type does not diffuse.
  uint32_t exchange_q16 = 0;
  uint32_t step_ms = 100;
  uint32_t keep_q32 = 0;    ///< the fraction of the content that a step keeps, in 2^-32; 0 = all
  uint32_t cutoff_q16 = 0;  ///< a node with less than this (1/65 536 quantum) loses it
  bool operator==(const DiffusionLaw&) const = default;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("exchange_q16", it.exchange_q16, Within(0, kMaxExchangeQ16));
    visit("step_ms", it.step_ms, Within(1, kMaxStepMs));
    visit("keep_q32", it.keep_q32);
    visit("cutoff_q16", it.cutoff_q16, Within(0, kMaxCutoffQ16));
  }
};

struct PheromoneLaw {
  uint8_t type = 1;  ///< as in the opcodes
  std::string name;
  Profile profile = Profile::kZShape;
  int64_t core_um = 0;    ///< c; of a Gaussian: unused, 0
  int64_t sigma_um = 1;   ///< sigma, > 0
  int64_t cutoff_um = 0;  ///< of a Gaussian: its reach
  Evaporation evaporation = Evaporation::kCounter;
  int64_t tau_ms = 0;           ///< tau, or the half-life; 0 = never evaporates
  int64_t quantum_micro = 1;    ///< Q in millionths of a pheromone unit, > 0
  uint16_t max_count = 1;       ///< C_max = maximum / Q
  bool directional = true;      ///< only sources ahead of the axle line count
  int32_t weight_milli = 1000;  ///< in thousandths; negative = repellent
  DiffusionLaw diffusion;
  std::vector<BlendPart>
      blend;  ///< not empty: a blend; then only type, name and this mean anything
  bool operator==(const PheromoneLaw&) const = default;

  bool is_blend() const { return !blend.empty(); }
  bool diffuses() const { return diffusion.exchange_q16 != 0; }
  int64_t reach_um() const {
    return profile == Profile::kGaussian ? cutoff_um : core_um + sigma_um;
  }
  uint32_t max_level() const { return uint32_t{max_count} << kLevelBits; }

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("type", it.type, Within(1, kMaxType));
    visit("name", it.name);
    visit("profile", it.profile, UpTo(Profile::kGaussian));
    visit("core_um", it.core_um, Within(0, kMaxReachUm));
    visit("sigma_um", it.sigma_um, Within(1, kMaxReachUm));
    visit("cutoff_um", it.cutoff_um, Within(0, kMaxReachUm));
    visit("evaporation", it.evaporation, UpTo(Evaporation::kExponential));
    visit("tau_ms", it.tau_ms, Within(0, kMaxTauMs));
    visit("quantum_micro", it.quantum_micro, Within(1, kMaxQuantumMicro));
    visit("max_count", it.max_count, AtLeast(1));
    visit("directional", it.directional);
    visit("weight_milli", it.weight_milli, Within(-kMaxWeightMilli, kMaxWeightMilli));
    visit("diffusion", it.diffusion);
    visit("blend", it.blend);
  }
};

/// The stored state of a node: its level at the time of the last deposit.
struct NodeState {
  uint32_t level = 0;  ///< in 1/64 quantum
  uint64_t time_ms = 0;
  bool operator==(const NodeState&) const = default;
};

/// The level of a node at `now_ms`, or at its last deposit if that is later.
///
// /   counter      max(0, L - 64 floor(dt / tau)), our interpretation of eq. (2), (3) /   linear
// max(0, L - floor(64 dt / tau)) /   exponential  round(L 2^(-dt / tau)), by Exp2Minus (kernel.h)
uint32_t LevelAt(const PheromoneLaw& law, NodeState node, uint64_t now_ms);

/// When a node's level reaches 0 without further deposits (UINT64_MAX: never). Exact for stepwise
/// evaporation; too early by less than a tenth of the half-life if it is exponential.
uint64_t LivesUntil(const PheromoneLaw& law, NodeState node);

/// L_{n+1} = min(L_max, L(now) + 64 quanta), T_{n+1} = now: a deposit, eq. (2).
inline NodeState AfterDeposit(const PheromoneLaw& law, NodeState node, uint16_t quanta,
                              uint64_t now_ms) {
  const uint32_t sum = LevelAt(law, node, now_ms) + (uint32_t{quanta} << kLevelBits);
  return {std::min(sum, law.max_level()), std::max(now_ms, node.time_ms)};
}

}  // namespace pheromone::field
