// The parts of the list in kernel.cc, and the exponential defined in kernel.h for single numbers.
#pragma once

#include "server/core/field/kernel.h"

namespace pheromone::field {

extern const Kernel kScalarKernel;

/// Appends the kernels that Highway has compiled and this processor can run, the best one last.
void AppendVectorKernels(KernelList* list);

/// 2^-x for x >= 0, as defined in kernel.h.
double Exp2Minus(double x);

}  // namespace pheromone::field
