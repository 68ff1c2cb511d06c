// The field against the naive oracle (testing/naive_field.h): equal to the last bit.

#include <gtest/gtest.h>

#include <cstdint>
#include <random>

#include "server/field/field.h"
#include "server/field/testing/naive_field.h"

namespace pheromone::field {
namespace {

using testing::NaiveField;

using Random = std::mt19937_64;

int64_t Between(Random& random, int64_t low, int64_t high) {
  return low + static_cast<int64_t>(random() % static_cast<uint64_t>(high - low + 1));
}

PheromoneLaw RandomLaw(Random& random, uint8_t type, int64_t cell_um) {
  PheromoneLaw law;
  law.type = type;
  law.core_um = Between(random, 0, 2 * cell_um);
  law.sigma_um = Between(random, 2 * cell_um, 5 * cell_um);
  law.tau_ms = Between(random, 0, 2) == 0 ? 0 : Between(random, 100, 5000);
  law.quantum_micro = Between(random, 2'000, 20'000);
  law.max_count = static_cast<uint16_t>(Between(random, 4, 15));
  law.directional = Between(random, 0, 3) != 0;
  return law;
}

FieldConfig RandomConfig(Random& random) {
  FieldConfig config;
  config.map.cell_um = Between(random, 20'000, 200'000);
  config.map.origin = {Between(random, -5'000'000, 5'000'000),
                       Between(random, -5'000'000, 5'000'000)};
  config.map.width_um = Between(random, 12 * config.map.cell_um, 40 * config.map.cell_um);
  config.map.height_um = Between(random, 12 * config.map.cell_um, 40 * config.map.cell_um);
  config.antenna_distance_um = Between(random, 0, 5 * config.map.cell_um);
  config.memory_bytes = 64 << 20;
  config.pheromones = {RandomLaw(random, 1, config.map.cell_um),
                       RandomLaw(random, 15, config.map.cell_um)};
  return config;
}

PointUm RandomPoint(Random& random, const MapGeometry& map) {
  return {map.origin.x + Between(random, 0, map.width_um),
          map.origin.y + Between(random, 0, map.height_um)};
}

// How many cases were of use as evidence, and how many not.
struct Tally {
  int cases = 0;
  int telling = 0;  // both antennas smell something that a message can hold

  void Add(const Intensities& p) {
    ++cases;
    telling += p.left > 0 && p.right > 0 && p.left <= 32767 && p.right <= 32767 ? 1 : 0;
  }
};

TEST(Oracle, RandomMapsPosesAndTimesGiveTheSameBits) {
  Random random(20090117);
  Tally tally;
  for (int round = 0; round < 400; ++round) {
    const FieldConfig config = RandomConfig(random);
    Field field(config);
    NaiveField naive(config);
    uint64_t now_ms = static_cast<uint64_t>(Between(random, 0, 1'000'000'000));
    const int nodes = config.map.columns() * config.map.rows();
    for (int i = 0; i < nodes; ++i) {
      const uint8_t type = random() % 2 == 0 ? 1 : 15;
      const PointUm point = RandomPoint(random, config.map);
      const auto quanta = static_cast<uint16_t>(Between(random, 1, 15));
      ASSERT_EQ(field.Deposit(type, point, quanta, now_ms), DepositResult::kDone);
      naive.Deposit(type, point, quanta, now_ms);
      now_ms += static_cast<uint64_t>(Between(random, 0, 3));
    }
    for (int i = 0; i < 100; ++i) {
      const PoseUm pose{RandomPoint(random, config.map),
                        static_cast<uint16_t>(Between(random, 0, 65535))};
      const uint8_t type = random() % 2 == 0 ? 1 : 15;
      const auto p = field.Sense(type, pose, now_ms);
      ASSERT_TRUE(p.has_value());
      ASSERT_EQ(*p, naive.Sense(type, pose, now_ms)) << "round " << round << " pose " << i;
      tally.Add(*p);
      now_ms += static_cast<uint64_t>(Between(random, 0, 20));
    }
  }
  EXPECT_GE(tally.telling, tally.cases * 95 / 100) << tally.telling << " of " << tally.cases;
  RecordProperty("cases", tally.cases);
  RecordProperty("telling", tally.telling);
}

// Rows of nodes lie exactly on the axle line: headings that are multiples of 45 degrees, poses on
// the grid. One wrong rounding of the direction would make whole rows appear or vanish.
TEST(Oracle, NodesExactlyOnTheAxleLineGiveTheSameBits) {
  Random random(7);
  Tally tally;
  for (int round = 0; round < 100; ++round) {
    FieldConfig config = RandomConfig(random);
    for (PheromoneLaw& law : config.pheromones) {
      law.directional = true;
    }
    Field field(config);
    NaiveField naive(config);
    const MapGeometry& map = config.map;
    for (int i = 0; i < 2 * map.columns() * map.rows(); ++i) {
      const PointUm point = RandomPoint(random, map);
      field.Deposit(1, point, 8, 0);
      naive.Deposit(1, point, 8, 0);
    }
    for (int i = 0; i < 100; ++i) {
      const NodeIndex node{static_cast<int32_t>(Between(random, 5, map.columns() - 6)),
                           static_cast<int32_t>(Between(random, 5, map.rows() - 6))};
      const PoseUm pose{map.PositionOf(node), static_cast<uint16_t>(8192 * Between(random, 0, 7))};
      const auto p = field.Sense(1, pose, 10);
      ASSERT_TRUE(p.has_value());
      ASSERT_EQ(*p, naive.Sense(1, pose, 10));
      tally.Add(*p);
    }
  }
  EXPECT_GE(tally.telling, tally.cases * 95 / 100);
}

// Far beyond what a message holds: the field's sum is carried as it is, eq. (4).
TEST(Oracle, SumsBeyondTheMessagesRangeGiveTheSameBits) {
  Random random(11);
  int beyond = 0;
  for (int round = 0; round < 20; ++round) {
    FieldConfig config = RandomConfig(random);
    for (PheromoneLaw& law : config.pheromones) {
      law.quantum_micro = Between(random, 1'000'000, 100'000'000);
      law.max_count = 60000;
      law.tau_ms = 0;
    }
    Field field(config);
    NaiveField naive(config);
    for (int i = 0; i < config.map.columns() * config.map.rows(); ++i) {
      const PointUm point = RandomPoint(random, config.map);
      field.Deposit(1, point, 50000, 0);
      naive.Deposit(1, point, 50000, 0);
    }
    for (int i = 0; i < 50; ++i) {
      const PoseUm pose{RandomPoint(random, config.map),
                        static_cast<uint16_t>(Between(random, 0, 65535))};
      const auto p = field.Sense(1, pose, 0);
      ASSERT_TRUE(p.has_value());
      ASSERT_EQ(*p, naive.Sense(1, pose, 0));
      beyond += p->left > 32767 || p->right > 32767 ? 1 : 0;
    }
  }
  EXPECT_GE(beyond, 20 * 50 * 95 / 100);
}

TEST(Oracle, TheSpreadEqualsTheExactlyRoundedZShape) {
  Random random(13);
  for (int i = 0; i < 200'000; ++i) {
    PheromoneLaw law;
    law.core_um = Between(random, 0, 1'000'000);
    law.sigma_um = Between(random, 1, 2'000'000);
    const int64_t reach = law.reach_um() + 2;
    const int64_t d = Between(random, 0, reach);
    const int64_t d2 = d * d + Between(random, -1, 1) * (d > 0 ? Between(random, 0, d) : 0);
    ASSERT_EQ(SpreadQ16(law, d2), NaiveField::ExactSpread(law, d2))
        << "c " << law.core_um << " sigma " << law.sigma_um << " d2 " << d2;
  }
}

}  // namespace
}  // namespace pheromone::field
