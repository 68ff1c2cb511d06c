// The field against the naive oracle (testing/naive_field.h), with every kernel that this processor
// can run: equal to the last bit where the laws are defined by whole numbers, and to one unit of P
// where an exponential is rounded. The kernels agree with each other to the bit in all cases.

#include <gtest/gtest.h>

#include <cstdint>
#include <cstdlib>
#include <memory>
#include <set>
#include <vector>

#include "server/core/field/field.h"
#include "server/core/field/testing/naive_field.h"
#include "server/core/field/testing/random_field.h"

namespace pheromone::field {
namespace {

using testing::Between;
using testing::Laws;
using testing::NaiveField;
using testing::OneIn;
using testing::Random;
using testing::RandomConfig;
using testing::RandomPoint;
using testing::RandomPose;
using testing::Tally;

// The same field once for each kernel, and the oracle.
class Fields {
 public:
  explicit Fields(const FieldConfig& config, const std::vector<NodeIndex>& blocked = {})
      : naive_(config, blocked) {
    const KernelList kernels = Kernels();
    for (int i = 0; i < kernels.count; ++i) {
      fields_.push_back(std::make_unique<Field>(config, *kernels.kernel[i]));
    }
  }

  void Deposit(uint8_t type, PointUm point, uint16_t quanta, uint64_t now_ms) {
    const bool done = naive_.Deposit(type, point, quanta, now_ms);
    for (const auto& field : fields_) {
      ASSERT_EQ(field->Deposit(type, point, quanta, now_ms),
                done ? DepositResult::kDone : DepositResult::kBlocked);
    }
  }

  // What they say of a pose, after it was compared.
  Intensities Sense(uint8_t type, const PoseUm& pose, uint64_t now_ms, Laws laws) const {
    const Intensities p = fields_.front()->Sense(type, pose, now_ms).value_or(Intensities{});
    for (const auto& field : fields_) {
      EXPECT_EQ(field->Sense(type, pose, now_ms), p) << field->kernel().name;
    }
    const Intensities expected = naive_.Sense(type, pose, now_ms);
    const int64_t tolerance = laws == Laws::kExact ? 0 : 1;
    EXPECT_LE(std::abs(p.left - expected.left), tolerance) << p.left << ' ' << expected.left;
    EXPECT_LE(std::abs(p.right - expected.right), tolerance) << p.right << ' ' << expected.right;
    return p;
  }

  const Field& field() const { return *fields_.back(); }
  const NaiveField& naive() const { return naive_; }

 private:
  NaiveField naive_;
  std::vector<std::unique_ptr<Field>> fields_;
};

// Up to `quanta` on each of as many random places as there are nodes, a few milliseconds apart.
void Fill(Random& random, const std::vector<uint8_t>& types, Fields& fields, uint64_t& now_ms) {
  const MapGeometry& map = fields.field().config().map;
  const int32_t nodes = map.columns() * map.rows();
  for (int32_t i = 0; i < nodes; ++i) {
    const uint8_t type = types[random() % types.size()];
    fields.Deposit(type, RandomPoint(random, map), static_cast<uint16_t>(Between(random, 1, 15)),
                   now_ms);
    now_ms += static_cast<uint64_t>(Between(random, 0, 3));
  }
}

Tally CompareRandomFields(Laws laws, int rounds, int poses, uint64_t seed) {
  Random random(seed);
  Tally tally;
  const std::vector<uint8_t> types = {1, 15};
  for (int round = 0; round < rounds && !::testing::Test::HasFailure(); ++round) {
    Fields fields(RandomConfig(random, types, laws));
    auto now_ms = static_cast<uint64_t>(Between(random, 0, 1'000'000'000));
    Fill(random, types, fields, now_ms);
    for (int i = 0; i < poses; ++i) {
      const PoseUm pose = RandomPose(random, fields.field().config().map);
      tally.Add(fields.Sense(types[random() % 2], pose, now_ms, laws));
      now_ms += static_cast<uint64_t>(Between(random, 0, 20));
    }
  }
  ::testing::Test::RecordProperty("cases", tally.cases);
  ::testing::Test::RecordProperty("telling", tally.telling);
  return tally;
}

TEST(Oracle, LawsOfWholeNumbersGiveTheSameBits) {
  EXPECT_GE(CompareRandomFields(Laws::kExact, 400, 100, 20090117).percent(), 90);
}

TEST(Oracle, ExponentialAndGaussianLawsDifferByARoundingAtMost) {
  EXPECT_GE(CompareRandomFields(Laws::kRounded, 400, 100, 1812).percent(), 90);
}

// Rows of nodes lie exactly on the axle line: headings that are multiples of 45 degrees, poses on
// the grid. One wrong rounding of the direction would make whole rows appear or vanish.
TEST(Oracle, NodesExactlyOnTheAxleLineGiveTheSameBits) {
  Random random(7);
  Tally tally;
  for (int round = 0; round < 200 && !HasFailure(); ++round) {
    FieldConfig config = RandomConfig(random, {1}, Laws::kExact);
    config.antennas = {.distance_um = config.antennas.distance_um};
    config.pheromones[0].directional = true;
    Fields fields(config);
    const MapGeometry& map = config.map;
    for (int i = 0; i < 2 * map.columns() * map.rows(); ++i) {
      fields.Deposit(1, RandomPoint(random, map), 8, 0);
    }
    for (int i = 0; i < 50; ++i) {
      const NodeIndex node{static_cast<int32_t>(Between(random, 5, map.columns() - 6)),
                           static_cast<int32_t>(Between(random, 5, map.rows() - 6))};
      const PoseUm pose{map.PositionOf(node), static_cast<uint16_t>(8192 * Between(random, 0, 7))};
      tally.Add(fields.Sense(1, pose, 10, Laws::kExact));
    }
  }
  EXPECT_GE(tally.percent(), 95);
}

// Poses on and next to the map's borders and corners, where the window of nodes is cut off and
// the antennas leave the map.
TEST(Oracle, PosesAtTheEdgesOfTheMapGiveTheSameBits) {
  Random random(31);
  Tally tally;
  for (int round = 0; round < 200 && !HasFailure(); ++round) {
    FieldConfig config = RandomConfig(random, {1}, Laws::kExact);
    config.pheromones[0].directional = false;
    Fields fields(config);
    const MapGeometry& map = config.map;
    uint64_t now_ms = 0;
    Fill(random, {1}, fields, now_ms);
    const auto edge = [&](int64_t length) {
      const int64_t inward = OneIn(random, 2) ? 0 : Between(random, 0, map.cell_um);
      return OneIn(random, 2) ? inward : length - inward;
    };
    for (int i = 0; i < 50; ++i) {
      PoseUm pose = RandomPose(random, map);
      const int64_t which = Between(random, 1, 3);
      pose.position.x = (which & 1) != 0 ? map.origin.x + edge(map.width_um) : pose.position.x;
      pose.position.y = (which & 2) != 0 ? map.origin.y + edge(map.height_um) : pose.position.y;
      tally.Add(fields.Sense(1, pose, now_ms, Laws::kExact));
    }
  }
  EXPECT_GE(tally.percent(), 75);
}

// Far beyond what a message holds: the field's sum is carried as it is, eq. (4).
TEST(Oracle, SumsBeyondTheMessagesRangeGiveTheSameBits) {
  Random random(11);
  int beyond = 0;
  for (int round = 0; round < 20 && !HasFailure(); ++round) {
    FieldConfig config = RandomConfig(random, {1}, Laws::kExact);
    PheromoneLaw& law = config.pheromones[0];
    law.quantum_micro = Between(random, 1'000'000, 100'000'000);
    law.weight_milli = OneIn(random, 2) ? 1'000'000 : -1'000'000;
    law.max_count = 60000;
    law.tau_ms = 0;
    Fields fields(config);
    for (int i = 0; i < config.map.columns() * config.map.rows(); ++i) {
      fields.Deposit(1, RandomPoint(random, config.map), 50000, 0);
    }
    for (int i = 0; i < 50; ++i) {
      const Intensities p = fields.Sense(1, RandomPose(random, config.map), 0, Laws::kExact);
      beyond += std::abs(p.left) > 32767 || std::abs(p.right) > 32767 ? 1 : 0;
    }
  }
  EXPECT_GE(beyond, 20 * 50 * 95 / 100);
}

// A blend is the weighted sum of its parts, rounded once: rounding each part would be off by up to
// half a unit a part.
TEST(Oracle, BlendsOfAllTypesGiveTheSameBits) {
  Random random(4);
  Tally tally;
  std::vector<uint8_t> types;
  for (uint8_t type = 1; type <= 14; ++type) {
    types.push_back(type);
  }
  for (int round = 0; round < 80 && !HasFailure(); ++round) {
    FieldConfig config = RandomConfig(random, types, Laws::kExact);
    PheromoneLaw blend;
    blend.type = 15;
    for (const uint8_t type : types) {
      if (type <= 3 || OneIn(random, 2)) {
        blend.blend.push_back({type, static_cast<int32_t>(Between(random, -1500, 3000))});
      }
    }
    config.pheromones.push_back(blend);
    Fields fields(config);
    uint64_t now_ms = 5;
    for (int i = 0; i < 4; ++i) {
      Fill(random, types, fields, now_ms);
    }
    EXPECT_EQ(const_cast<Field&>(fields.field()).Deposit(15, config.map.origin, 1, now_ms),
              DepositResult::kNotPermitted);
    for (int i = 0; i < 30; ++i) {
      const PoseUm pose = RandomPose(random, config.map);
      tally.Add(fields.Sense(15, pose, now_ms, Laws::kExact));
      fields.Sense(static_cast<uint8_t>(Between(random, 1, 14)), pose, now_ms, Laws::kExact);
      now_ms += static_cast<uint64_t>(Between(random, 0, 20));
    }
  }
  EXPECT_GE(tally.percent(), 90);
}

// Reaches of some hundred cells: more candidates than are weighed at once, more tiles in a row than
// are masked at once, and several leaves of 128 nodes a side.
TEST(Oracle, ReachesOfHundredsOfCellsGiveTheSameBits) {
  Random random(128);
  Tally tally;
  for (int round = 0; round < 8 && !HasFailure(); ++round) {
    FieldConfig config = RandomConfig(random, {1}, Laws::kExact);
    config.map.width_um = 299 * config.map.cell_um + Between(random, 0, config.map.cell_um - 1);
    config.map.height_um = 199 * config.map.cell_um;
    PheromoneLaw& law = config.pheromones[0];
    law.sigma_um = Between(random, 60, 250) * config.map.cell_um;
    law.quantum_micro = 200;
    law.weight_milli = 100;
    Fields fields(config);
    uint64_t now_ms = 0;
    for (int i = 0; i < 3'000; ++i) {
      fields.Deposit(1, RandomPoint(random, config.map),
                     static_cast<uint16_t>(Between(random, 1, 15)), now_ms);
    }
    for (int i = 0; i < 25; ++i) {
      const PoseUm pose = RandomPose(random, config.map);
      tally.Add(fields.Sense(1, pose, now_ms + static_cast<uint64_t>(i), Laws::kExact));
    }
  }
  EXPECT_GE(tally.percent(), 75);
}

// Trails along the borders between tiles (8 nodes) and between leaves (128 nodes).
TEST(Oracle, TrailsAlongTileAndLeafBordersGiveTheSameBits) {
  Random random(8128);
  Tally tally;
  for (int round = 0; round < 20 && !HasFailure(); ++round) {
    FieldConfig config = RandomConfig(random, {1}, Laws::kExact);
    config.map.width_um = 140 * config.map.cell_um;
    config.map.height_um = 140 * config.map.cell_um;
    config.pheromones[0].tau_ms = 0;
    config.pheromones[0].directional = OneIn(random, 2);
    config.pheromones[0].weight_milli = 3000;
    Fields fields(config);
    const auto border = [&] { return (OneIn(random, 2) ? 128 : 120) - Between(random, 0, 1); };
    for (int i = 0; i < 600; ++i) {
      NodeIndex node{static_cast<int32_t>(border()),
                     static_cast<int32_t>(Between(random, 90, 140))};
      if (OneIn(random, 2)) {
        std::swap(node.column, node.row);
      }
      fields.Deposit(1, config.map.PositionOf(node), 15, 0);
    }
    for (int i = 0; i < 50; ++i) {
      const PointUm corner = config.map.PositionOf({128, 128});
      const int64_t margin = 6 * config.map.cell_um;
      const PoseUm pose{{corner.x + Between(random, -margin, margin),
                         corner.y + Between(random, -margin, margin)},
                        static_cast<uint16_t>(random())};
      tally.Add(fields.Sense(1, pose, 0, Laws::kExact));
    }
  }
  EXPECT_GE(tally.percent(), 70);
}

TEST(Oracle, AnyNumberOfAntennasGiveTheSameBits) {
  Random random(17);
  Tally tally;
  for (int round = 0; round < 80 && !HasFailure(); ++round) {
    Fields fields(RandomConfig(random, {1}, Laws::kExact));
    const MapGeometry& map = fields.field().config().map;
    uint64_t now_ms = 0;
    Fill(random, {1}, fields, now_ms);
    for (int i = 0; i < 10; ++i) {
      const PoseUm pose = RandomPose(random, map);
      std::vector<PointUm> antennas(static_cast<size_t>(Between(random, 0, 40)));
      for (PointUm& antenna : antennas) {
        antenna = RandomPoint(random, map);
      }
      std::vector<int64_t> p(antennas.size());
      ASSERT_EQ(fields.field().SenseAll(1, pose, antennas, now_ms, p), SenseError::kNone);
      ASSERT_EQ(p, fields.naive().SenseAll(1, pose, antennas, now_ms));
      for (size_t a = 0; a + 1 < p.size(); a += 2) {
        tally.Add({p[a], p[a + 1]});
      }
    }
  }
  EXPECT_GE(tally.percent(), 20);  // half of the map is behind the robot
}

// Walls and lone blocked nodes. The poses and the antennas' distance are often whole multiples of
// half a cell, so that lines of sight run exactly along edges and through corners.
TEST(Oracle, ObstaclesHideTheSameNodes) {
  Random random(1913);
  Tally tally;
  int hidden = 0;
  for (int round = 0; round < 400 && !HasFailure(); ++round) {
    FieldConfig config = RandomConfig(random, {1}, Laws::kExact);
    config.map.cell_um &= ~int64_t{1};
    const MapGeometry& map = config.map;
    const int64_t half = map.cell_um / 2;
    if (OneIn(random, 2)) {
      config.antennas = {.distance_um = Between(random, 0, 8) * half};
    }
    ObstacleMask mask(map.columns(), map.rows());
    std::vector<NodeIndex> blocked;
    const int64_t count = Between(random, 1, map.columns() * map.rows() / 10);
    for (int64_t i = 0; i < count; ++i) {
      const NodeIndex node{static_cast<int32_t>(Between(random, 0, map.columns() - 1)),
                           static_cast<int32_t>(Between(random, 0, map.rows() - 1))};
      if (!mask.Blocked(node)) {
        mask.Set(node);
        blocked.push_back(node);
      }
    }
    FieldConfig open = config;
    config.obstacles = Shared<ObstacleMask>(std::move(mask));
    Fields fields(config, blocked);
    NaiveField without(open);
    uint64_t now_ms = 0;
    for (int i = 0; i < map.columns() * map.rows(); ++i) {
      const PointUm point = RandomPoint(random, map);
      fields.Deposit(1, point, 15, now_ms);
      without.Deposit(1, point, 15, now_ms);
    }
    for (int i = 0; i < 30; ++i) {
      PoseUm pose = RandomPose(random, map);
      if (OneIn(random, 2)) {
        pose.position = {map.origin.x + pose.position.x / half % (2 * map.columns() - 2) * half,
                         map.origin.y + pose.position.y / half % (2 * map.rows() - 2) * half};
        pose.position.x = std::max(pose.position.x, map.origin.x);
        pose.position.y = std::max(pose.position.y, map.origin.y);
        pose.heading = static_cast<uint16_t>(8192 * Between(random, 0, 7));
      }
      const Intensities p = fields.Sense(1, pose, now_ms, Laws::kExact);
      hidden += p == without.Sense(1, pose, now_ms) ? 0 : 1;
      tally.Add(p);
    }
  }
  EXPECT_GE(tally.percent(), 50);
  EXPECT_GE(hidden, tally.cases / 2);
}

}  // namespace
}  // namespace pheromone::field
