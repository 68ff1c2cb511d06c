// A frozen state is copied unchanged while the engine continues. The oracle is Engine::Save at the
// moment of the freeze.

#include "server/core/engine/frozen_state.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "server/core/engine/engine.h"
#include "server/core/engine/testing/bench.h"
#include "server/core/engine/testing/random_traffic.h"

namespace pheromone::engine {
namespace {

using testing::RandomTraffic;
using testing::Saved;

TEST(FrozenState, IsWhatSaveWouldHaveGivenWhateverHappensMeanwhile) {
  for (uint64_t seed = 0; seed < 12; ++seed) {
    RandomTraffic traffic(seed, testing::RichConfig(seed % 3 == 0));
    Engine engine;
    std::vector<Outgoing> out;
    engine.Apply(1, traffic.stamp(), traffic.First(), &out);
    const auto some = [&](uint64_t most) {
      for (uint64_t left = traffic.Below(most); left > 0; --left) {
        const Event event = traffic.Next(engine);
        engine.Apply(engine.sequence() + 1, traffic.stamp(), event, &out);
      }
    };
    for (int round = 0; round < 5; ++round) {
      some(200);
      // Not while a large configuration is laid, nor must a caller wait for long.
      const auto is_busy = [&] { return engine.Freeze(FrozenState::kMaxKeptBytes) == nullptr; };
      constexpr int kMaxPortions = 2'000;
      for (int portion = 0; is_busy() && portion < kMaxPortions; ++portion) {
        engine.Apply(engine.sequence() + 1, traffic.stamp(), Advance{}, &out);
      }
      const std::string expected = Saved(engine);
      const uint64_t hash = engine.StateHash();
      const uint64_t sequence = engine.sequence();
      const std::unique_ptr<FrozenState> frozen = engine.Freeze(FrozenState::kMaxKeptBytes);
      ASSERT_NE(frozen, nullptr);
      EXPECT_EQ(engine.Freeze(FrozenState::kMaxKeptBytes), nullptr);
      EXPECT_EQ(frozen->bytes(), expected.size());
      EXPECT_EQ(frozen->sequence(), sequence);
      EXPECT_EQ(frozen->state_hash(), hash);
      EXPECT_EQ(frozen->stamp().utc_ms, engine.last_stamp().utc_ms);
      some(50);
      std::string copied;
      while (frozen->CopySome(&copied, 1)) {
        some(30);
      }
      ASSERT_FALSE(frozen->failed());
      ASSERT_TRUE(frozen->done());
      ASSERT_TRUE(copied == expected) << "seed " << seed << ", round " << round;
      ByteReader reader(copied);
      const Result<Engine> restored = Engine::Restore(&reader);
      ASSERT_TRUE(restored.ok());
      EXPECT_EQ(restored.value().StateHash(), hash);
    }
  }
}

TEST(FrozenState, MayOutliveItsEngineButHasFailedThen) {
  RandomTraffic traffic(1);
  auto engine = std::make_unique<Engine>();
  std::vector<Outgoing> out;
  engine->Apply(1, traffic.stamp(), traffic.First(), &out);
  const std::unique_ptr<FrozenState> frozen = engine->Freeze(FrozenState::kMaxKeptBytes);
  std::string copied;
  EXPECT_TRUE(frozen->CopyConfig(&copied));
  EXPECT_FALSE(frozen->CopyConfig(&copied));
  engine.reset();
  EXPECT_TRUE(frozen->failed());
  EXPECT_FALSE(frozen->CopySome(&copied));
}

}  // namespace
}  // namespace pheromone::engine
