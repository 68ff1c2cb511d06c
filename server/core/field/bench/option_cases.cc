#include <memory>
#include <utility>

#include "server/core/field/bench/cases.h"
#include "server/core/field/bench/maps.h"

namespace pheromone::field::bench {
namespace {

constexpr uint8_t kBlend = 4;

// The standard query with another configuration, asked for `type`.
Case Option(const std::string& name, const FieldSpec& spec, uint8_t type = kType) {
  auto cursor = std::make_shared<PoseCursor>();
  return {.key = {kOption, name, kStandardMap, kStandardReach},
          .run =
              [=](benchmark::State& state) {
                const Field& field = FilledField(spec);
                const std::vector<PoseUm>& poses = ManyPoses(spec.map.nodes);
                for (auto _ : state) {
                  benchmark::DoNotOptimize(field.Sense(type, cursor->Next(poses), kNowMs));
                }
              },
          .seconds = kFieldSeconds};
}

FieldConfig StandardConfig() {
  return ConfigOf(kStandardMap.nodes, LawOf(kStandardReach));
}

Case OptionLaw(const std::string& name, void (*change)(PheromoneLaw*)) {
  FieldConfig config = StandardConfig();
  change(&config.pheromones[0]);
  return Option(name, {config, kStandardMap});
}

Case BlendOfThree() {
  FieldConfig config = StandardConfig();
  PheromoneLaw law = config.pheromones[0];
  for (const uint8_t type : {uint8_t{2}, uint8_t{3}}) {
    law.type = type;
    config.pheromones.push_back(law);
  }
  law.type = kBlend;
  law.blend = {{1, 1'000'000}, {2, 500'000}, {3, -1'000'000}};
  config.pheromones.push_back(law);
  return Option("blend of three", {config, kStandardMap}, kBlend);
}

// Walls of 12 nodes, along x or y, that block about a fiftieth of the map.
Case Obstacles() {
  constexpr int32_t kLength = 12;
  constexpr int32_t kSide = kStandardMap.nodes;
  constexpr uint64_t kWalls = uint64_t{kSide} * kSide / 50 / kLength;
  ObstacleMask mask(kSide, kSide);
  for (uint64_t wall = 0; wall < kWalls; ++wall) {
    const auto places = static_cast<uint64_t>(kSide - kLength);
    const auto column = static_cast<int32_t>(Mix(2 * wall) % places);
    const auto row = static_cast<int32_t>(Mix(2 * wall + 1) % places);
    for (int32_t i = 0; i < kLength; ++i) {
      mask.Set(wall % 2 == 0 ? NodeIndex{column + i, row} : NodeIndex{column, row + i});
    }
  }
  FieldConfig config = StandardConfig();
  config.obstacles = Shared(std::move(mask));
  return Option("obstacles", {config, kStandardMap});
}

}  // namespace

std::vector<Case> OptionCases() {
  std::vector<Case> cases = {
      OptionLaw("linear", [](PheromoneLaw* law) { law->evaporation = Evaporation::kLinear; }),
      OptionLaw("exponential",
                [](PheromoneLaw* law) { law->evaporation = Evaporation::kExponential; }),
      OptionLaw("permanent", [](PheromoneLaw* law) { law->tau_ms = 0; }),
      OptionLaw("cone",
                [](PheromoneLaw* law) {
                  law->sigma_um += law->core_um;
                  law->core_um = 0;
                }),
      OptionLaw("Gaussian",
                [](PheromoneLaw* law) {
                  law->profile = Profile::kGaussian;
                  law->cutoff_um = law->core_um + law->sigma_um;
                  law->sigma_um = law->cutoff_um / 3;
                  law->core_um = 0;
                }),
      OptionLaw("not directional", [](PheromoneLaw* law) { law->directional = false; }),
      BlendOfThree(),
      Obstacles(),
  };
  const KernelList kernels = Kernels();
  for (int i = 0; i < kernels.count; ++i) {
    const Kernel* kernel = kernels.kernel[i];
    cases.push_back(
        Option(std::string("kernel ") + kernel->name, {StandardConfig(), kStandardMap, kernel}));
  }
  return cases;
}

}  // namespace pheromone::field::bench
