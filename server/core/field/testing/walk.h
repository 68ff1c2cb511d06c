// One client that deposits as fast as it can on a very large map, and what that must not do: make
// the process grow beyond the limit, or keep others from being served.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <string>

#include "server/core/field/field.h"
#include "server/core/field/testing/random_field.h"

// g++ has macros for it, clang++ a function.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define PHEROMONE_SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define PHEROMONE_SANITIZED 1
#endif
#endif
#ifndef PHEROMONE_SANITIZED
#define PHEROMONE_SANITIZED 0
#endif

namespace pheromone::field::testing {

/// The memory of this process that is in the machine, in bytes.
inline uint64_t ResidentBytes() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    uint64_t kilobytes = 0;
    if (word == "VmRSS:" && status >> kilobytes) {
      return 1024 * kilobytes;
    }
  }
  ADD_FAILURE() << "no VmRSS in /proc/self/status";
  return 0;
}

enum class Client { kWalks, kJumps };

/// 30 000 x 30 000 nodes; type 1 evaporates within four minutes, type 2 never.
inline FieldConfig WalkConfig() {
  FieldConfig config;
  config.map = {.origin = {0, 0},
                .width_um = int64_t{29'999} * 100'000,
                .height_um = int64_t{29'999} * 100'000,
                .cell_um = 100'000};
  config.antennas.distance_um = 300'000;
  PheromoneLaw trail;
  trail.core_um = 100'000;
  trail.sigma_um = 400'000;
  trail.tau_ms = 30'000;
  trail.quantum_micro = 125'000;
  trail.max_count = 8;
  PheromoneLaw path = trail;
  path.type = 2;
  path.tau_ms = 0;
  config.pheromones = {trail, path};
  config.memory_bytes = 64 << 20;
  return config;
}

/// Makes `requests` deposits in `type`, a millisecond apart, each at the next step of a random walk
/// or anywhere. Beside them a robot keeps to its own trail, which it must always be able to renew
/// and to sense.
inline void WalkAndWatch(Client client, uint8_t type, int64_t requests) {
  const uint64_t before = ResidentBytes();
  const FieldConfig config = WalkConfig();
  const auto allowed = static_cast<uint64_t>(static_cast<double>(config.memory_bytes) * 1.1);
  Random random(42);
  Field field(config);
  const PointUm own{150'000'000, 150'000'000};
  PointUm at{config.map.width_um / 2, config.map.height_um / 2};
  int64_t refused = 0;
  uint64_t most_resident = 0;
  for (int64_t i = 0; i < requests && !::testing::Test::HasFailure(); ++i) {
    const auto now_ms = static_cast<uint64_t>(i);
    if (client == Client::kJumps) {
      at = RandomPoint(random, config.map);
    } else {
      const uint64_t step = random();
      at.x += static_cast<int64_t>(step % 3) * 100'000 - 100'000;
      at.y += static_cast<int64_t>(step / 3 % 3) * 100'000 - 100'000;
      at.y = std::clamp<int64_t>(at.y, 0, config.map.height_um);
    }
    at.x = std::clamp(at.x, 2 * own.x, config.map.width_um);
    refused += field.Deposit(type, at, 1, now_ms) == DepositResult::kMapFull ? 1 : 0;
    if (i % 1'000 == 0) {
      if (field.NextDeadline().value_or(UINT64_MAX) <= now_ms) {
        field.Advance(now_ms);
      }
      EXPECT_EQ(field.Deposit(1, own, 8, now_ms), DepositResult::kDone);
      EXPECT_EQ(field.Sense(1, {own, 0}, now_ms)->left, 4096 * 7 / 8);  // 0.05 m beyond the core
    }
    if (i % 100'000 == 0 || i + 1 == requests) {
      const uint64_t resident = ResidentBytes();
      most_resident = std::max(most_resident, resident - std::min(resident, before));
    }
    EXPECT_LE(field.used_bytes(), config.memory_bytes);
  }
  EXPECT_EQ(field.hash(), HashFromADump(field));
#if !PHEROMONE_SANITIZED
  EXPECT_LE(most_resident, allowed);
#else
  (void)allowed;  // a sanitizer keeps what was freed
#endif
  ::testing::Test::RecordProperty("refused", std::to_string(refused));
  ::testing::Test::RecordProperty("most_resident_bytes", std::to_string(most_resident));
}

}  // namespace pheromone::field::testing
