// A configuration prepared for queries: tables instead of lists, with the kernel's numbers
// computed. Immutable; replaced as a whole when the configuration changes. Internal to this folder.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "server/core/field/config.h"
#include "server/core/field/kernel.h"
#include "server/core/field/rebase.h"

namespace pheromone::field {

/// One substance in the sum of eq. (4): P = 4096 * sum(weight * Q * S), S = sum of C * mu.
struct Part {
  uint8_t type = 0;
  int64_t factor = 0;  ///< weight in thousandths * Q in millionths
};

struct Setup {
  explicit Setup(std::shared_ptr<const FieldConfig> shared_config);

  std::shared_ptr<const FieldConfig> shared;
  const FieldConfig& config;                      ///< the same
  std::array<const PheromoneLaw*, kTypes> law{};  ///< null: no such type
  /// Of types with nodes that were stored under an earlier law.
  std::array<std::optional<LawChange>, kTypes> change;
  std::array<KernelLaw, kTypes> kernel_law{};
  std::array<std::vector<Part>, kTypes> parts;
  int32_t columns = 0;
  int32_t rows = 0;
  double cells_per_um = 0;
  std::array<double, 8> cells_um{};  ///< 0 to 7 cells

  const LawChange* ChangeOf(uint8_t type) const { return change[type] ? &*change[type] : nullptr; }
  /// Converts a stored state of an existing type to its present law.
  NodeState Present(uint8_t type, NodeState stored) const {
    return Rebased(ChangeOf(type), *law[type], stored);
  }
};

/// The numbers of a law that the inner loops use.
KernelLaw ForKernel(const PheromoneLaw& law);

}  // namespace pheromone::field
