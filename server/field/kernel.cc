#include "server/field/kernel.h"

#include "server/field/kernel_table.h"

namespace pheromone::field {

KernelList Kernels() {
  KernelList list{{&kScalarKernel, nullptr, nullptr, nullptr}, 1};
#if defined(__x86_64__)
  list.kernel[list.count++] = &kSse2Kernel;
  if (__builtin_cpu_supports("avx2")) {
    list.kernel[list.count++] = &kAvx2Kernel;
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
        __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl")) {
      list.kernel[list.count++] = &kAvx512Kernel;
    }
  }
#endif
  return list;
}

const Kernel& BestKernel() {
  static const KernelList list = Kernels();
  const Kernel* best = &kScalarKernel;
  for (int i = 1; i < list.count; ++i) {
    best = list.kernel[i];
  }
  return *best;
}

}  // namespace pheromone::field
