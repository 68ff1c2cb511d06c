// The portable kernel, in loops that a compiler can turn into whatever vectors there are, and the
// choice between the kernels.
#include "server/field/diffusion_kernel.h"

#include "server/field/diffusion_lanes.h"

namespace pheromone::field {
namespace {

struct Portable {
  static constexpr int kRows = 1;
  static constexpr uint32_t kAll = 0xFF;
  struct V {
    int32_t lane[8];
  };
  using M = V;  // all ones in a lane that is chosen
  using X = int32_t;
  using K = uint32_t;
  using Sums = uint64_t;

  static X PrepareExchange(uint32_t exchange_q16) { return static_cast<X>(exchange_q16); }
  static K PrepareKeep(uint32_t keep_q32) { return keep_q32; }

  template <typename Function>
  static V Each(Function&& function) {
    V v{};
    for (int i = 0; i < 8; ++i) {
      v.lane[i] = function(i);
    }
    return v;
  }

  static V Set(int32_t number) {
    return Each([=](int) { return number; });
  }
  static V Load(const void* tile, int row) {
    V v{};
    __builtin_memcpy(v.lane, static_cast<const V*>(tile) + row, sizeof v.lane);
    return v;
  }
  static void Store(void* tile, int row, V v) {
    __builtin_memcpy(static_cast<V*>(tile) + row, v.lane, sizeof v.lane);
  }
  static V LoadAbove(const void* tile, const void* above, int row) {
    return row < 7 ? Load(tile, row + 1) : Load(above, 0);
  }
  static V OneUp(V a, V) { return a; }
  template <int kColumn>
  static V Column(const void* tile) {
    return Each([=](int i) { return Load(tile, i).lane[kColumn]; });
  }
  static V PushFirst(V v, const uint32_t* number) {
    return Each([=](int i) { return i > 0 ? v.lane[i - 1] : static_cast<int32_t>(*number); });
  }
  static V PushLast(V v, V other) {
    return Each([=](int i) { return i < 7 ? v.lane[i + 1] : other.lane[0]; });
  }
  static V Flux(V a, V b, X exchange) {
    // The quotient of C++ rounds towards zero; written with a shift, because that is a vector's.
    return Each([=](int i) {
      const int32_t difference = a.lane[i] - b.lane[i];
      const int32_t sign = difference >> 31;
      const int64_t size = (difference ^ sign) - sign;
      return (static_cast<int32_t>((size * exchange) >> 16) ^ sign) - sign;
    });
  }
  static V Scale(V v, K keep) {
    return Each([=](int i) {
      return static_cast<int32_t>((static_cast<uint64_t>(v.lane[i]) * keep) >> 32);
    });
  }
  static V Add(V a, V b) {
    return Each([=](int i) { return a.lane[i] + b.lane[i]; });
  }
  static V Sub(V a, V b) {
    return Each([=](int i) { return a.lane[i] - b.lane[i]; });
  }
  static M Choose(uint32_t bits) {
    return Each([=](int i) { return -static_cast<int32_t>((bits >> i) & 1); });
  }
  static M Greater(V a, V b) {
    return Each([=](int i) { return -static_cast<int32_t>(a.lane[i] > b.lane[i]); });
  }
  static V Keep(M m, V v) {
    return Each([=](int i) { return v.lane[i] & m.lane[i]; });
  }
  static V Drop(M m, V v) {
    return Each([=](int i) { return v.lane[i] & ~m.lane[i]; });
  }
  static uint32_t Bits(M m) {
    uint32_t bits = 0;
    for (int i = 0; i < 8; ++i) {
      bits |= uint32_t{m.lane[i] != 0} << i;
    }
    return bits;
  }
  static Sums Zero() { return 0; }
  static Sums AddTo(Sums sum, V v) {
    for (const int32_t number : v.lane) {
      sum += static_cast<uint32_t>(number);
    }
    return sum;
  }
  static uint64_t Total(Sums sum) { return sum; }
};

}  // namespace

const DiffusionKernel kPortableDiffusion = {"portable", StepFor<Portable>};

DiffusionKernelList DiffusionKernels() {
  DiffusionKernelList list{{&kPortableDiffusion, &kPortableDiffusion, &kPortableDiffusion}, 1};
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2")) {
    list.kernel[list.count++] = &kAvx2Diffusion;
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw")) {
      list.kernel[list.count++] = &kAvx512Diffusion;
    }
  }
#endif
  return list;
}

const DiffusionKernel& BestDiffusionKernel() {
  static const DiffusionKernel& best = *DiffusionKernels().kernel[DiffusionKernels().count - 1];
  return best;
}

}  // namespace pheromone::field
