// A configuration as queries want it: tables instead of lists, the kernel's numbers worked out.
// Immutable; replaced whole when the configuration changes. Internal to this folder.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "server/field/config.h"
#include "server/field/kernel.h"

namespace pheromone::field {

/// One substance in the sum of eq. (4): P = 4096 * sum(weight * Q * S), S = sum of C * mu.
struct Part {
  uint8_t type = 0;
  int64_t factor = 0;  ///< weight in thousandths * Q in millionths
};

struct Setup {
  explicit Setup(FieldConfig config_in);

  FieldConfig config;
  std::array<const PheromoneLaw*, kTypes> law{};  ///< null: no such type
  std::array<KernelLaw, kTypes> kernel_law{};
  std::array<std::vector<Part>, kTypes> parts;
  int32_t columns = 0;
  int32_t rows = 0;
  double cells_per_um = 0;
  std::array<double, 8> cells_um{};  ///< 0 to 7 cells
};

/// The numbers of a law that the inner loops use.
KernelLaw ForKernel(const PheromoneLaw& law);

}  // namespace pheromone::field
