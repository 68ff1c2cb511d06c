#include "server/config/law.h"

#include <algorithm>
#include <cmath>

#include "server/base/format.h"
#include "server/core/field/diffusion.h"
#include "server/core/field/field.h"

namespace pheromone::config {
namespace {

enum ProfileWord : size_t { kZShape, kCone, kGaussian };
constexpr std::string_view kProfiles[] = {"z-shape", "cone", "gaussian"};

enum EvaporationWord : size_t { kCounter, kLinear, kExponential, kPermanent };
constexpr std::string_view kEvaporations[] = {"counter", "linear", "exponential", "permanent"};

constexpr double kMaxCoefficient = 1'000;

// The names of a profile's lengths, for the error if their sum is too long.
struct ReachKeys {
  std::string_view key;
  std::string words;
};

std::optional<ReachKeys> ReadLengths(const TableReader& table, size_t profile,
                                     field::PheromoneLaw* law) {
  const auto length = [&](std::string_view key, int64_t least,
                          std::optional<int64_t> fallback = std::nullopt) {
    return table.Scaled(key, kMetresToUm, least, field::kMaxReachUm, fallback);
  };
  if (profile == kCone) {
    const bool alone =
        table.Without({"core_m", "sigma_m", "cutoff_m"}, "profile = \"cone\"", "only radius_m");
    const auto radius_um = length("radius_m", 1);
    law->sigma_um = radius_um.value_or(1);
    return alone && radius_um ? std::optional(ReachKeys{"radius_m", "radius_m"}) : std::nullopt;
  }
  if (profile == kGaussian) {
    const bool alone = table.Without({"core_m", "radius_m"}, "profile = \"gaussian\"",
                                     "sigma_m and optionally cutoff_m");
    const auto sigma_um = length("sigma_m", 1);
    const bool cut = table.Find("cutoff_m") != nullptr;
    const auto cutoff_um = length("cutoff_m", 1, 3 * sigma_um.value_or(1));
    if (!alone || !sigma_um || !cutoff_um) {
      return std::nullopt;
    }
    law->profile = field::Profile::kGaussian;
    law->sigma_um = *sigma_um;
    law->cutoff_um = *cutoff_um;
    return cut ? ReachKeys{"cutoff_m", "cutoff_m"} : ReachKeys{"sigma_m", "3 sigma_m"};
  }
  const bool alone =
      table.Without({"radius_m", "cutoff_m"}, "profile = \"z-shape\"", "core_m and sigma_m");
  const auto core_um = length("core_m", 0);
  const auto sigma_um = length("sigma_m", 1);
  if (!alone || !core_um || !sigma_um) {
    return std::nullopt;
  }
  law->core_um = *core_um;
  law->sigma_um = *sigma_um;
  return ReachKeys{"sigma_m", "core_m + sigma_m"};
}

// The number of quanta that make up the maximum, which must be whole.
std::optional<uint16_t> ReadMaxCount(const TableReader& table, int64_t quantum_micro) {
  const auto maximum = table.Scaled("maximum", kToMicro, 1, UINT16_MAX * field::kMaxQuantumMicro);
  if (!maximum) {
    return std::nullopt;
  }
  const int64_t count = *maximum / quantum_micro;
  const std::string found = "found " + FormatScaled(*maximum, kToMicro) + ", expected ";
  if (*maximum % quantum_micro != 0) {
    const std::string below =
        count > 0 ? FormatScaled(count * quantum_micro, kToMicro) + " or " : "";
    table.Report("maximum", found + "a multiple of the quantum " +
                                FormatScaled(quantum_micro, kToMicro) + ", such as " + below +
                                FormatScaled((count + 1) * quantum_micro, kToMicro));
    return std::nullopt;
  }
  if (count > UINT16_MAX) {
    table.Report("maximum",
                 found + "at most 65535 quanta of " + FormatScaled(quantum_micro, kToMicro));
    return std::nullopt;
  }
  return static_cast<uint16_t>(count);
}

// The fraction of a difference that moves in a step, D * step / a^2, or empty if such a step is too
// large.
std::optional<uint32_t> ExchangeOf(const TableReader& table, double coefficient, int64_t step_ms,
                                   const field::MapGeometry& map) {
  const double cell_m = static_cast<double>(map.cell_um) / 1e6;
  const double step_s = static_cast<double>(step_ms) / 1e3;
  const double exchange = std::round(65536 * coefficient * step_s / (cell_m * cell_m));
  if (exchange >= 1 && exchange <= double{field::kMaxExchangeQ16}) {
    return static_cast<uint32_t>(exchange);
  }
  const std::string found = "found " + FormatNumber(coefficient) + " with a step of " +
                            FormatScaled(step_ms, kSecondsToMs) + " s and cells of " +
                            FormatScaled(map.cell_um, kMetresToUm) + " m, ";
  // Rounded so that the proposed value is accepted.
  const auto tenth_percent = [](double number, bool up) {
    const double unit = std::pow(10, std::floor(std::log10(number)) - 2);
    return FormatNumber((up ? std::ceil(number / unit) : std::floor(number / unit)) * unit);
  };
  const double quarter = cell_m * cell_m / 4;
  if (exchange < 1) {
    table.Report("coefficient_m2_per_s",
                 found + "which moves nothing, expected at least " +
                     tenth_percent(quarter / step_s / double{field::kMaxExchangeQ16}, true));
    return std::nullopt;
  }
  const auto most_ms = static_cast<int64_t>(quarter / coefficient * 1e3);
  table.Report("coefficient_m2_per_s",
               found + "which is unstable, expected at most " +
                   tenth_percent(quarter / step_s, false) +
                   (most_ms > 0 ? ", or step_s at most " + FormatScaled(most_ms, kSecondsToMs)
                                : std::string()));
  return std::nullopt;
}

// The fraction that a step keeps, in 2^-32; 0 is all.
uint32_t KeepOf(const field::PheromoneLaw& law, int64_t step_ms) {
  if (law.tau_ms == 0) {
    return 0;
  }
  const double halvings = static_cast<double>(step_ms) / static_cast<double>(law.tau_ms);
  const double keep = std::round(std::ldexp(std::exp2(-halvings), 32));
  return keep >= std::ldexp(1.0, 32) ? 0 : static_cast<uint32_t>(keep);
}

}  // namespace

bool ReadSpread(const TableReader& table, const field::MapGeometry* map, field::PheromoneLaw* law) {
  const auto profile = table.OneOf("profile", kProfiles, kZShape);
  const auto keys = profile ? ReadLengths(table, *profile, law) : std::nullopt;
  if (!keys) {
    return false;
  }
  const int64_t reach_um = law->reach_um();
  const std::string reach = keys->words + " is " + FormatScaled(reach_um, kMetresToUm) + " m";
  if (reach_um > field::kMaxReachUm) {
    table.Report(keys->key, reach + ", expected at most 50 m");
    return false;
  }
  if (map != nullptr && reach_um / map->cell_um > field::kMaxReachCells) {
    table.Report(keys->key, reach + " or " + std::to_string(reach_um / map->cell_um) +
                                " cells, expected at most " +
                                std::to_string(field::kMaxReachCells) + " cells");
    return false;
  }
  return true;
}

bool ReadEvaporation(const TableReader& table, field::PheromoneLaw* law) {
  const auto evaporation = table.OneOf("evaporation", kEvaporations, kCounter);
  if (!evaporation) {
    return false;
  }
  const std::string choice = "evaporation = \"" + std::string(kEvaporations[*evaporation]) + '"';
  if (*evaporation == kPermanent) {
    return table.Without({"tau_s", "half_life_s"}, choice, "neither tau_s nor half_life_s");
  }
  if (*evaporation == kExponential) {
    const bool alone = table.Without({"tau_s"}, choice, "half_life_s");
    const auto half_life_ms = table.Scaled("half_life_s", kSecondsToMs, 1, field::kMaxTauMs);
    law->evaporation = field::Evaporation::kExponential;
    law->tau_ms = half_life_ms.value_or(1);
    return alone && half_life_ms;
  }
  const bool linear = *evaporation == kLinear;
  if (table.Find("evaporation") == nullptr && table.Find("tau_s") == nullptr &&
      table.Find("half_life_s") != nullptr) {
    table.Missing("evaporation", "\"exponential\", to which half_life_s belongs");
    return false;
  }
  const bool alone = table.Without({"half_life_s"}, choice, "tau_s");
  const auto tau_ms = table.Scaled("tau_s", kSecondsToMs, linear ? 1 : 0, field::kMaxTauMs);
  law->evaporation = linear ? field::Evaporation::kLinear : field::Evaporation::kCounter;
  law->tau_ms = tau_ms.value_or(1);
  return alone && tau_ms;
}

bool ReadStrength(const TableReader& table, field::PheromoneLaw* law) {
  const auto quantum = table.Scaled("quantum", kToMicro, 1, field::kMaxQuantumMicro);
  const auto count = quantum ? ReadMaxCount(table, *quantum) : std::nullopt;
  if (!count) {
    return false;
  }
  law->quantum_micro = *quantum;
  law->max_count = *count;
  return true;
}

bool ReadDiffusion(const TableReader& table, const field::MapGeometry* map,
                   field::PheromoneLaw* law) {
  if (table.Find("diffusion") == nullptr) {
    return true;
  }
  const auto diffusion = table.Table("diffusion", "{coefficient_m2_per_s = ...}");
  if (!diffusion) {
    return false;
  }
  diffusion->AllowOnly({"coefficient_m2_per_s", "step_s", "cutoff"});
  if (law->tau_ms != 0 && law->evaporation != field::Evaporation::kExponential) {
    table.Report("evaporation",
                 "expected \"exponential\" or \"permanent\" for a pheromone with diffusion");
    return false;
  }
  const auto coefficient = diffusion->Number("coefficient_m2_per_s", 1e-9, kMaxCoefficient);
  const int64_t longest_ms = law->tau_ms == 0 ? int64_t{field::kMaxStepMs}
                                              : std::min(int64_t{field::kMaxStepMs}, law->tau_ms);
  const auto step_ms =
      diffusion->Scaled("step_s", kSecondsToMs, 1, longest_ms, std::min<int64_t>(100, longest_ms));
  // By default, the smallest content that an antenna can sense: half a level of 1/64 quantum.
  const auto cutoff_micro =
      diffusion->Scaled("cutoff", kToMicro, 0, law->quantum_micro, law->quantum_micro / 128);
  if (!coefficient || !step_ms || !cutoff_micro || map == nullptr) {
    return false;
  }
  if (law->max_count > field::kMaxDiffusingCount) {
    table.Report("maximum", "found " + FormatScaled(law->max_count * law->quantum_micro, kToMicro) +
                                " or " + std::to_string(law->max_count) +
                                " quanta, expected at most " +
                                std::to_string(field::kMaxDiffusingCount) +
                                " quanta for a pheromone with diffusion");
    return false;
  }
  const auto exchange = ExchangeOf(*diffusion, *coefficient, *step_ms, *map);
  if (!exchange) {
    return false;
  }
  const int64_t cutoff_q16 = diffusion->Find("cutoff") != nullptr
                                 ? field::RoundDiv(*cutoff_micro * 65536, law->quantum_micro)
                                 : 65536 / 128;
  law->diffusion = {*exchange, static_cast<uint32_t>(*step_ms), KeepOf(*law, *step_ms),
                    static_cast<uint32_t>(cutoff_q16)};
  return true;
}

double StrongestSmell(const field::MapGeometry& map, const field::PheromoneLaw& law) {
  const int64_t cells = law.reach_um() / map.cell_um;
  const int64_t columns = std::min<int64_t>(cells, map.columns() - 1);
  const int64_t rows = std::min<int64_t>(cells, map.rows() - 1);
  double sum = 0;
  for (int64_t x = 0; x <= columns; ++x) {
    for (int64_t y = 0; y <= rows; ++y) {
      // One quadrant for all: those behind the robot, and the axes, have fewer nodes.
      const double mirrored = (x != 0 && !law.directional ? 2.0 : 1.0) * (y != 0 ? 2.0 : 1.0);
      const int64_t d2_um2 = (x * x + y * y) * map.cell_um * map.cell_um;
      sum += mirrored * field::SpreadQ16(law, d2_um2) / 65536.0;
    }
  }
  return sum * static_cast<double>(law.max_count) * static_cast<double>(law.quantum_micro) / 1e6;
}

}  // namespace pheromone::config
