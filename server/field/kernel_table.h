// The kernels by name, for the list of kernel.cc, and the defined exponential for single numbers.
#pragma once

#include "server/field/kernel.h"

namespace pheromone::field {

extern const Kernel kScalarKernel;
extern const Kernel kSse2Kernel;
extern const Kernel kAvx2Kernel;
extern const Kernel kAvx512Kernel;

/// 2^-x for x >= 0, as defined in kernel.h.
double Exp2Minus(double x);

}  // namespace pheromone::field
