#include <memory>

#include "server/core/field/bench/cases.h"
#include "server/core/field/bench/maps.h"

namespace pheromone::field::bench {
namespace {

Case FieldQuery(const MapSpec& map, int reach) {
  auto cursor = std::make_shared<PoseCursor>();
  return {.key = {kQuery, kField, map, reach},
          .run =
              [=](benchmark::State& state) {
                const Field& field = FilledField({ConfigOf(map.nodes, LawOf(reach)), map});
                const std::vector<PoseUm>& poses = ManyPoses(map.nodes);
                for (auto _ : state) {
                  benchmark::DoNotOptimize(field.Sense(kType, cursor->Next(poses), kNowMs));
                }
              },
          .seconds = kFieldSeconds};
}

Case LiteralQuery(const MapSpec& map, int reach) {
  auto cursor = std::make_shared<PoseCursor>();
  return {.key = {kQuery, kLiteralScan, map, reach},
          .run =
              [=](benchmark::State& state) {
                const auto& literal = FilledMap<LiteralMap>(map, reach);
                const std::vector<PoseUm>& poses = ManyPoses(map.nodes);
                for (auto _ : state) {
                  const PoseUm& pose = cursor->Next(poses);
                  benchmark::DoNotOptimize(literal.Sense(pose, kNowMs));
                  benchmark::DoNotOptimize(literal.Sense(Opposite(pose), kNowMs));
                }
              },
          .operations = 2};
}

Case WideQuery(const MapSpec& map, int reach, bool skipping) {
  auto cursor = std::make_shared<PoseCursor>();
  return {{kQuery, skipping ? kSkippingScan : kWideScan, map, reach}, [=](benchmark::State& state) {
            const auto& scanned = FilledMap<ScannedMap>(map, reach);
            const std::vector<PoseUm>& poses = ManyPoses(map.nodes);
            for (auto _ : state) {
              const PoseUm& pose = cursor->Next(poses);
              benchmark::DoNotOptimize(skipping ? scanned.SenseSkipping(BestWide(), pose, kNowMs)
                                                : scanned.Sense(BestWide(), pose, kNowMs));
            }
          }};
}

constexpr size_t kBoundPoses = size_t{1} << 16;

Case MemoryBound(int32_t nodes, int reach) {
  const MapSpec map{.nodes = nodes};
  return {{kQuery, kMemoryBound, map, reach},
          [=](benchmark::State& state) {
            const MapGeometry geometry = GeometryOf(nodes);
            const TiledMemory memory(geometry);
            const std::vector<uint32_t> lines = LinesUnder(
                geometry, kAntennaDistanceUm, reach * kCellUm, RandomPoses(nodes, kBoundPoses, 2));
            for (auto _ : state) {
              benchmark::DoNotOptimize(memory.Touch(lines));
            }
          },
          kBoundPoses};
}

}  // namespace

std::vector<Case> QueryCases() {
  std::vector<Case> cases;
  const auto add_map = [&cases](const MapSpec& map, const std::vector<int>& reaches) {
    for (const int reach : reaches) {
      cases.push_back(FieldQuery(map, reach));
      cases.push_back(LiteralQuery(map, reach));
      cases.push_back(WideQuery(map, reach, false));
      cases.push_back(WideQuery(map, reach, true));
    }
  };
  for (const int32_t nodes : {100, 1000, 4000}) {
    for (const int reach : {4, 10, 20}) {
      cases.push_back(MemoryBound(nodes, reach));
    }
    for (const double density_percent : {1, 10}) {
      add_map({.nodes = nodes, .density_percent = density_percent}, {4, 10, 20});
    }
  }
  for (const double density_percent : {0.1, 100.0}) {
    add_map({.nodes = 1000, .density_percent = density_percent}, {kStandardReach});
  }
  add_map({.nodes = 1000, .density_percent = 1, .pattern = Pattern::kTrails}, {kStandardReach});
  return cases;
}

}  // namespace pheromone::field::bench
