// Which instruction sets the sources are compiled for that Highway compiles once for each
// (kernel_vectors.cc, diffusion_vectors.cc, bench/wide.cc), and which of them this processor has.
// Included by these alone, ahead of Highway's own headers:
//
//   #define HWY_TARGET_INCLUDE "server/core/field/kernel_vectors.cc"
//   #include "server/core/field/kernel_targets.h"
//   #include <hwy/foreach_target.h>
//   ...
//   #if HWY_ONCE
//   static const Compiled<Kernel> compiled[] = PHEROMONE_COMPILED(kVectorKernel);
//
// Thread-safe.
#pragma once

// Lanes are counted at compile time here, and SVE's are not known by then.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)

#include <hwy/detect_targets.h>
#include <hwy/targets.h>

#include <cstddef>
#include <cstdint>

namespace pheromone::field {

/// A kernel of one instruction set; null if that one is of another family of processors.
template <typename Kernel>
struct Compiled {
  int64_t target;
  const Kernel* kernel;
};

/// Whether this processor has it. What the compiler may use everywhere needs no question, and on
/// 64-bit ARM must not be requested: Highway's NEON includes cryptography, which no kernel uses and
/// a Raspberry Pi 4 lacks.
inline bool Runs(int64_t target) {
  return target == HWY_STATIC_TARGET || (HWY_SUPPORTED_TARGETS & target) != 0;
}

/// Appends those that this processor can run to a list of kernels, the best one last.
template <typename Kernel, size_t kCount, typename List>
void AppendRunning(const Compiled<Kernel> (&compiled)[kCount], List* list) {
  for (const Compiled<Kernel>& each : compiled) {
    if (each.kernel != nullptr && Runs(each.target)) {
      list->kernel[list->count++] = each.kernel;
    }
  }
}

}  // namespace pheromone::field

/// What a kernel is called: as Highway calls its instruction set, whose namespace is N_AVX2, say. A
/// constant, so that no code compiled for an instruction set runs before its support was checked.
#define PHEROMONE_TARGET_NAME (&HWY_STR(HWY_NAMESPACE)[2])

/// `name` of each instruction set, the best one last.
#define PHEROMONE_COMPILED(name)                                              \
  {                                                                           \
    {HWY_SSSE3, HWY_CHOOSE_SSSE3(name)}, {HWY_SSE4, HWY_CHOOSE_SSE4(name)},   \
        {HWY_AVX2, HWY_CHOOSE_AVX2(name)}, {HWY_AVX3, HWY_CHOOSE_AVX3(name)}, \
        {HWY_NEON, HWY_CHOOSE_NEON(name)},                                    \
  }
