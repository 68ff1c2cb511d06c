#include "server/core/field/setup.h"

#include <utility>

namespace pheromone::field {
namespace {

constexpr double kHalfLog2E = 0.72134752044448170368;  // log2(e) / 2

}  // namespace

KernelLaw ForKernel(const PheromoneLaw& law) {
  KernelLaw kernel;
  kernel.exponential = law.evaporation == Evaporation::kExponential && law.tau_ms != 0;
  if (law.tau_ms != 0) {
    const bool linear = law.evaporation == Evaporation::kLinear;
    kernel.tau_ms = static_cast<double>(law.tau_ms);
    kernel.per_tau = 1 / kernel.tau_ms;
    kernel.scale = linear ? kLevelsPerQuantum : 1;
    kernel.unit = linear ? 1 : kLevelsPerQuantum;
  }
  kernel.gaussian = law.profile == Profile::kGaussian;
  const auto reach = static_cast<double>(law.reach_um());
  const auto sigma = static_cast<double>(law.sigma_um);
  kernel.reach_um = reach;
  kernel.reach_um2 = reach * reach;
  if (kernel.gaussian) {
    kernel.exponent = kHalfLog2E / (sigma * sigma);
  } else {
    kernel.slope = 65536.0 / sigma;
  }
  return kernel;
}

Setup::Setup(std::shared_ptr<const FieldConfig> shared_config)
    : shared(std::move(shared_config)),
      config(*shared),
      columns(config.map.columns()),
      rows(config.map.rows()),
      cells_per_um(1 / static_cast<double>(config.map.cell_um)) {
  for (size_t i = 0; i < cells_um.size(); ++i) {
    cells_um[i] = static_cast<double>(static_cast<int64_t>(i) * config.map.cell_um);
  }
  for (const PheromoneLaw& it : config.pheromones) {
    law[it.type] = &it;
    kernel_law[it.type] = ForKernel(it);
  }
  for (const PheromoneLaw& it : config.pheromones) {
    if (!it.is_blend()) {
      parts[it.type] = {{it.type, int64_t{it.weight_milli} * it.quantum_micro}};
    }
    for (const BlendPart& part : it.blend) {
      if (law[part.type] != nullptr) {
        parts[it.type].push_back(
            {part.type, int64_t{part.weight_milli} * law[part.type]->quantum_micro});
      }
    }
  }
}

}  // namespace pheromone::field
