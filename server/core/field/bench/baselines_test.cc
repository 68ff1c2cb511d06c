// A baseline is a fair one only if it computes the same: the literal scan and the wide scans
// against Field::Sense, within what their arithmetic loses.

#include "server/core/field/bench/baselines.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>

#include "server/core/field/bench/workload.h"
#include "server/core/field/field.h"
#include "server/core/field/heading.h"

namespace pheromone::field::bench {
namespace {

constexpr double kQuantum = static_cast<double>(kQuantumMicro) / 1e6;

struct FieldMap {
  Field field;
  void Deposit(PointUm point, uint16_t quanta, uint64_t now_ms) {
    ASSERT_EQ(field.Deposit(kType, point, quanta, now_ms), DepositResult::kDone);
  }
};

// Whether some node is so near the axle line that floats may see it on the other side.
bool NodeOnTheAxleLine(const MapGeometry& map, const PoseUm& pose) {
  const DirectionQ14 heading = DirectionOf(pose.heading);
  for (int32_t row = 0; row < map.rows(); ++row) {
    for (int32_t column = 0; column < map.columns(); ++column) {
      const PointUm at = map.PositionOf({column, row});
      const int64_t ahead = (at.x - pose.position.x) * heading.cos / 16384 +
                            (at.y - pose.position.y) * heading.sin / 16384;
      if (std::llabs(ahead) < 10) {  // micrometres
        return true;
      }
    }
  }
  return false;
}

struct Case {
  MapSpec spec;
  int reach;
  uint64_t later_ms;
};

class BaselinesTest : public ::testing::TestWithParam<Case> {};

TEST_P(BaselinesTest, SmellWhatTheFieldSmells) {
  const auto& [spec, reach, later_ms] = GetParam();
  const PheromoneLaw law = LawOf(reach);
  const MapGeometry map = GeometryOf(spec.nodes);
  FieldMap field{Field(ConfigOf(spec.nodes, law))};
  LiteralMap literal(map, kAntennaDistanceUm, law);
  ScannedMap scanned(map, kAntennaDistanceUm, law);
  Lay(spec, &field);
  Lay(spec, &literal);
  Lay(spec, &scanned);
  const uint64_t now_ms = kNowMs + later_ms;
  // A source within reach adds at most 15 quanta, each off by half of 1/65 536 (the field), or by
  // the error of a distance in floats.
  const double sources = 2.0 * reach * reach + 4 * reach;
  const double literal_error = 1.0 / 4096 + sources * kMaxCount * kQuantum / 131072;
  const double scanned_error = literal_error + sources * kMaxCount * kQuantum * 1e-5;

  int compared = 0;
  int telling = 0;
  for (const PoseUm& pose : RandomPoses(spec.nodes, 300, 5)) {
    if (NodeOnTheAxleLine(map, pose)) {
      continue;
    }
    const auto sensed = field.field.Sense(kType, pose, now_ms);
    ASSERT_TRUE(sensed.has_value());
    const Smell exact = {static_cast<double>(sensed->left) / 4096,
                         static_cast<double>(sensed->right) / 4096};
    const auto expect_near = [&](const Smell& smell, double error, const char* who) {
      EXPECT_NEAR(smell.left, exact.left, error) << who;
      EXPECT_NEAR(smell.right, exact.right, error) << who;
    };
    expect_near(literal.Sense(pose, now_ms), literal_error, "literal");
    for (const Wide* wide : AllWides()) {
      expect_near(scanned.Sense(*wide, pose, now_ms), scanned_error, wide->name);
      expect_near(scanned.SenseSkipping(*wide, pose, now_ms), scanned_error, wide->name);
    }
    ++compared;
    telling += exact.left > 100 * scanned_error && exact.right > 100 * scanned_error ? 1 : 0;
  }
  EXPECT_GE(compared, 200);
  EXPECT_GE(telling, compared / 2);
}

INSTANTIATE_TEST_SUITE_P(
    Maps, BaselinesTest,
    ::testing::Values(Case{{.nodes = 33, .density_percent = 100}, 4, 0},
                      Case{{.nodes = 50, .density_percent = 30}, 10, kTauMs},
                      Case{{.nodes = 64, .density_percent = 10}, 20, 3 * kTickMs},
                      Case{{.nodes = 47, .density_percent = 30, .pattern = Pattern::kTrails},
                           10,
                           2 * kTauMs + kTickMs}));

// The lines of the lower bound, counted the plain way: every node of the map, every tile row.
TEST(MemoryBound, CountsTheLinesThatHoldVisibleNodes) {
  const MapGeometry map = GeometryOf(61);
  const int64_t reach_um = 7 * kCellUm;
  for (const PoseUm& pose : RandomPoses(61, 50, 9)) {
    const AntennaPair antennas = AntennaPairOf(pose, kAntennaDistanceUm);
    const DirectionQ14 heading = DirectionOf(pose.heading);
    std::vector<bool> touched(size_t{61} * 8);
    for (int32_t row = 0; row < 61; ++row) {
      for (int32_t column = 0; column < 61; ++column) {
        const PointUm at = map.PositionOf({column, row});
        const auto squared = [&](double x, double y) {
          return (static_cast<double>(at.x) - x) * (static_cast<double>(at.x) - x) +
                 (static_cast<double>(at.y) - y) * (static_cast<double>(at.y) - y);
        };
        const auto reach = static_cast<double>(reach_um);
        if ((at.x - pose.position.x) * heading.cos + (at.y - pose.position.y) * heading.sin >= 0 &&
            std::min(squared(antennas.left_x, antennas.left_y),
                     squared(antennas.right_x, antennas.right_y)) <= reach * reach) {
          touched[static_cast<size_t>(row) * 8 + static_cast<size_t>(column) / 8] = true;
        }
      }
    }
    const auto expected = std::count(touched.begin(), touched.end(), true);
    const std::vector<uint32_t> lines = LinesUnder(map, kAntennaDistanceUm, reach_um, {pose});
    EXPECT_EQ(lines.size(), static_cast<size_t>(expected));
    for (const uint32_t line : lines) {
      EXPECT_LT(line * size_t{64}, TiledBytes(map));
    }
  }
}

TEST(DenseGrid, ShowsTheConeThatARobotStampedUntilItEvaporates) {
  const MapGeometry map = GeometryOf(40);
  for (const Wide* wide : AllWides()) {
    DenseGrid grid(map, kAntennaDistanceUm, 4);
    grid.Stamp(*wide, map.PositionOf({20, 20}));
    grid.Evaporate(*wide, 0.5f);
    // Antennas one cell to either side of the robot: the left one on the peak.
    const Smell smell = grid.Sense({map.PositionOf({20, 19}), 0});
    EXPECT_FLOAT_EQ(static_cast<float>(smell.left), 0.5f) << wide->name;
    EXPECT_FLOAT_EQ(static_cast<float>(smell.right), 0.25f) << wide->name;
  }
}

TEST(Stencil, MovesTheShareOfADifferenceToTheFourNeighbours) {
  constexpr size_t kSide = 37;
  std::vector<float> from(kSide * kSide);
  from[18 * kSide + 20] = 8;
  for (const Wide* wide : AllWides()) {
    std::vector<float> to(kSide * kSide);
    wide->stencil(from.data(), to.data(), kSide, 0.125f);
    EXPECT_EQ(to[18 * kSide + 20], 4) << wide->name;
    for (const size_t neighbour :
         {17 * kSide + 20, 19 * kSide + 20, 18 * kSide + 19, 18 * kSide + 21}) {
      EXPECT_EQ(to[neighbour], 1) << wide->name;
    }
    EXPECT_EQ(to[17 * kSide + 19], 0) << wide->name;
  }
}

}  // namespace
}  // namespace pheromone::field::bench
