#include <atomic>
#include <optional>
#include <span>
#include <thread>
#include <vector>

#include "server/core/field/bench/cases.h"
#include "server/core/field/bench/maps.h"

namespace pheromone::field::bench {
namespace {

// On nodes whose tiles exist and lie in the cache.
Case WarmDeposit() {
  constexpr uint64_t kSide = 32;
  return {.key = {kDeposit, kField, {.nodes = kStandardMap.nodes}},
          .run =
              [](benchmark::State& state) {
                Field field(ConfigOf(kStandardMap.nodes, LawOf(kStandardReach)));
                const MapGeometry map = GeometryOf(kStandardMap.nodes);
                std::vector<PointUm> points;
                for (uint64_t i = 0; i < kSide * kSide; ++i) {
                  points.push_back(map.PositionOf({static_cast<int32_t>(Mix(i) % kSide),
                                                   static_cast<int32_t>(Mix(~i) % kSide)}));
                  field.Deposit(kType, points.back(), 1, kNowMs);
                }
                uint64_t now_ms = kNowMs;
                size_t next = 0;
                for (auto _ : state) {
                  benchmark::DoNotOptimize(field.Deposit(kType, points[next], 1, ++now_ms));
                  next = next + 1 < points.size() ? next + 1 : 0;
                }
              },
          .seconds = kFieldSeconds};
}

// Operations on one field, of which a tenth are deposits where pheromone lies already: shared out
// in portions to the writer and, on a second thread, to a reader. Beside a reader the writer
// deposits twice as often, so that the share is the same.
Case MixedWork(bool reader) {
  constexpr size_t kOperations = size_t{1} << 16;
  constexpr size_t kPortion = 256;
  return {
      .key = {kReaders, reader ? kTwoThreads : kOneThread, kStandardMap, kStandardReach},
      .run =
          [=](benchmark::State& state) {
            FieldMap map(ConfigOf(kStandardMap.nodes, LawOf(kStandardReach)));
            Lay(kStandardMap, &map);
            const std::vector<Source> sources = SourcesOf(kStandardMap);
            const std::vector<PoseUm>& poses = ManyPoses(kStandardMap.nodes);
            const MapGeometry geometry = GeometryOf(kStandardMap.nodes);
            const size_t between_deposits = reader ? 5 : 10;
            uint64_t round = 0;
            for (auto _ : state) {
              const size_t first = ++round * kOperations;
              std::atomic<size_t> done = 0;
              const auto each_portion = [&](auto operation) {
                for (size_t i; (i = done.fetch_add(kPortion)) < kOperations;) {
                  for (size_t j = i; j < i + kPortion; ++j) {
                    operation(first + j);
                  }
                }
              };
              std::thread beside;
              if (reader) {
                beside = std::thread([&] {
                  const FieldReader view(map.field);
                  std::vector<std::optional<Intensities>> answers(kPortion);
                  for (size_t i; (i = done.fetch_add(kPortion)) < kOperations;) {
                    const std::span some(&poses[(first + i) % poses.size()], kPortion);
                    view.SenseEach(kType, some, kNowMs, answers);
                    benchmark::DoNotOptimize(answers.data());
                  }
                });
              }
              each_portion([&](size_t i) {
                if (i % between_deposits == 0) {
                  const Source& source = sources[Mix(i) % sources.size()];
                  map.field.Deposit(kType, geometry.PositionOf(source.node), 1, kNowMs);
                } else {
                  benchmark::DoNotOptimize(map.field.Sense(kType, poses[i % poses.size()], kNowMs));
                }
              });
              if (reader) {
                beside.join();
              }
            }
          },
      .operations = kOperations,
      .wall_time = true,
      .seconds = kFieldSeconds};
}

Case Stencil() {
  constexpr int32_t kSide = 1000;
  return {.key = {kMachine, kStencil, {.nodes = kSide}},
          .run =
              [](benchmark::State& state) {
                std::vector<float> from(size_t{kSide} * kSide, 1);
                std::vector<float> to(from);
                for (auto _ : state) {
                  BestWide().stencil(from.data(), to.data(), kSide, 0.1f);
                  benchmark::ClobberMemory();
                  from.swap(to);
                }
              },
          .operations = double{kSide} * kSide};
}

// A step of a diffusing type on a map that is full, per node. With obstacles: a twentieth of them.
Case Diffusion(bool obstacles) {
  constexpr int32_t kSide = 320;
  return {.key = {kDiffusion, obstacles ? kWithObstacles : kField, {.nodes = kSide}},
          .run =
              [=](benchmark::State& state) {
                MemoryBudget budget{uint64_t{1} << 30, 0};
                TilePool pool;
                Reclaimer reclaimer;
                DiffusionLayer layer(kSide, kSide, &budget, &reclaimer, &pool);
                ObstacleMask mask(kSide, kSide);
                for (int32_t row = 0; row < kSide; ++row) {
                  for (int32_t column = 0; column < kSide; ++column) {
                    const int32_t node = row * kSide + column;
                    const uint64_t random = Mix(static_cast<uint64_t>(node));
                    layer.Set({column, row}, static_cast<uint32_t>(random >> 34));
                    if (random % 20 == 0) {
                      mask.Set({column, row});
                    }
                  }
                }
                DiffusionLaw law;
                law.exchange_q16 = 6554;
                law.keep_q32 = 4'294'000'000;
                for (auto _ : state) {
                  layer.Step(law, obstacles ? &mask : nullptr);
                }
              },
          .operations = double{kSide} * kSide};
}

}  // namespace

std::vector<Case> SingleCases() {
  return {WarmDeposit(), MixedWork(false), MixedWork(true),
          Stencil(),     Diffusion(false), Diffusion(true)};
}

}  // namespace pheromone::field::bench
