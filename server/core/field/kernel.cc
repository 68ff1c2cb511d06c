#include "server/core/field/kernel.h"

#include "server/core/field/kernel_table.h"

namespace pheromone::field {

KernelList Kernels() {
  KernelList list{{&kScalarKernel}, 1};
  AppendVectorKernels(&list);
  return list;
}

const Kernel& BestKernel() {
  static const KernelList list = Kernels();
  return *list.kernel[list.count - 1];
}

}  // namespace pheromone::field
