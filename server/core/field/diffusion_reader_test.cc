#include <gtest/gtest.h>

#include <atomic>
#include <random>
#include <thread>
#include <vector>

#include "server/core/field/diffusion.h"

namespace pheromone::field {
namespace {

// Values that a reader may see lie below the highest ever deposited, whatever the writer does;
// ThreadSanitizer sees the rest.
TEST(DiffusionReader, ReadersLookOnWhileItIsSteppedFilledAndEmptied) {
  MemoryBudget budget{uint64_t{1} << 30, 0};
  TilePool pool;
  Reclaimer reclaimer;
  DiffusionLayer layer(100, 100, &budget, &reclaimer, &pool);
  constexpr uint32_t kHighest = 1u << 24;
  constexpr int kRounds = 60;
  std::atomic<bool> done{false};
  std::vector<std::thread> readers;
  readers.reserve(3);
  std::atomic<int> ready{0};
  for (int i = 0; i < 3; ++i) {
    readers.emplace_back([&, place = reclaimer.Register()] {
      uint64_t looks = 0;
      while (!done || looks == 0) {
        reclaimer.Enter(place);
        layer.ForEach([&](NodeIndex node, uint32_t content) {
          EXPECT_TRUE(node.column >= 0 && node.column < 100 && node.row >= 0 && node.row < 100);
          EXPECT_LE(content, kHighest);
        });
        EXPECT_LE(layer.Read({50, 50}), kHighest);
        reclaimer.Leave(place);
        if (++looks == 1) {
          ++ready;
        }
      }
      reclaimer.Unregister(place);
    });
  }
  while (ready < 3) {
    std::this_thread::yield();
  }
  std::mt19937 random(5);
  const auto any = [&] { return static_cast<int32_t>(random() % 100); };
  const DiffusionLaw law{12'000, 100, 2'000'000'000, 1000};
  for (int round = 0; round < kRounds; ++round) {
    for (int i = 0; i < 5; ++i) {
      layer.Add({any(), any()}, kHighest, kHighest);
    }
    for (int step = 0; step < 20; ++step) {
      layer.Step(law, nullptr);
    }
    layer.Clear();
  }
  done = true;
  for (std::thread& reader : readers) {
    reader.join();
  }
  reclaimer.Collect();
  EXPECT_EQ(reclaimer.waiting(), 0u);
  EXPECT_EQ(budget.used_bytes, 0u);
}

}  // namespace
}  // namespace pheromone::field
