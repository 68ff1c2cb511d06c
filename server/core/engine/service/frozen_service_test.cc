// A state is copied from a running service, between the batches of other threads.

#include <gtest/gtest.h>

#include <atomic>
#include <cstdint>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "server/core/engine/service/service.h"
#include "server/core/engine/testing/bench.h"

namespace pheromone::engine {
namespace {

using testing::Deposit;
using testing::Hello;

// 20 m x 20 m in nodes of 2 cm: 64 leaves.
EngineConfig WideConfig() {
  EngineConfig config = testing::SmallConfig();
  config.field.map.width_um = 20'000'000;
  config.field.map.height_um = 20'000'000;
  config.field.map.cell_um = 20'000;
  return config;
}

class SilentObserver final : public Observer {
 public:
  void OnBatch(const Stamp& /*stamp*/, LinkIndex /*link*/,
               std::span<const protocol::Message> /*messages*/,
               std::span<const Outcome> /*outcomes*/, std::span<const Outgoing> /*sent*/) override {
  }
  void OnEvent(uint64_t /*sequence*/, const Stamp& /*stamp*/, const Event& /*event*/,
               std::span<const Outgoing> /*sent*/) override {}
};

class FrozenServiceTest : public ::testing::Test {
 protected:
  FrozenServiceTest() : service_(&log_, [this] { return ClockReading{now_ms_.load(), 0}; }) {
    EXPECT_TRUE(service_.Configure(WideConfig(), 7).ok());
  }

  // One robot's deposits, all over the map.
  void Lay(uint8_t id, int count) {
    std::vector<Outgoing> out;
    service_.Handle(0, std::vector{Hello(id, 1)}, &out);
    uint32_t random = id;
    for (int i = 1; i <= count; ++i) {
      random = random * 1'664'525 + 1'013'904'223;
      const auto x = static_cast<int16_t>(random >> 8 & 0x3FFF);
      const auto y = static_cast<int16_t>(random >> 18 & 0x3FFF);
      service_.Handle(0, std::vector{Deposit(id, static_cast<uint8_t>(i), x, y)}, &out);
      now_ms_ += 1;
    }
  }

  VolatileLog log_;
  std::atomic<uint64_t> now_ms_{1'000};
  Service service_;
};

TEST_F(FrozenServiceTest, AStateIsCopiedWhileRobotsGoOn) {
  Lay(1, 2'000);
  std::thread robot([this] { Lay(2, 5'000); });
  for (int round = 0; round < 20; ++round) {
    const Service::Frozen frozen = service_.Freeze();
    ASSERT_NE(frozen, nullptr);
    EXPECT_EQ(service_.Freeze(), nullptr);
    std::string copied;
    while (service_.CopySome(frozen.get(), &copied)) {
    }
    ASSERT_TRUE(frozen->done());
    EXPECT_EQ(copied.size(), frozen->bytes());
    ByteReader reader(copied);
    const Result<Engine> restored = Engine::Restore(&reader);
    ASSERT_TRUE(restored.ok()) << restored.error();
    EXPECT_EQ(restored.value().StateHash(), frozen->state_hash());
    EXPECT_EQ(restored.value().sequence(), frozen->sequence());
  }
  robot.join();
}

TEST_F(FrozenServiceTest, AStateThatIsGivenUpIsInNobodysWay) {
  Lay(1, 2'000);
  std::thread robot([this] { Lay(2, 2'000); });
  for (int round = 0; round < 200; ++round) {
    const Service::Frozen frozen = service_.Freeze();
    ASSERT_NE(frozen, nullptr);
    std::string copied;
    service_.CopySome(frozen.get(), &copied);
    service_.CopySome(frozen.get(), &copied);
  }
  robot.join();
}

TEST_F(FrozenServiceTest, AWitnessMayBeAttachedAtTheSameMoment) {
  Lay(1, 100);
  Service::Frozen frozen;
  uint64_t hash = 0;
  SilentObserver observer;
  service_.Attach(&observer, [&](const Engine& engine) {
    frozen = service_.FreezeInside(engine);
    hash = engine.StateHash();
  });
  Lay(2, 100);
  ASSERT_NE(frozen, nullptr);
  EXPECT_EQ(frozen->state_hash(), hash);
}

}  // namespace
}  // namespace pheromone::engine
