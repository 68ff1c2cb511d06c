#include "client_fw/lab/coverage.h"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <utility>

namespace pheromone::lab {
namespace {

// 5 x 4 places of 1 m, one of which is all obstacle, on a map of nodes 0.25 m apart.
field::FieldConfig Floor() {
  field::FieldConfig field;
  field.map = {
      .origin = {-1'000'000, 0}, .width_um = 5'000'000, .height_um = 4'000'000, .cell_um = 250'000};
  field::ObstacleMask mask(field.map.columns(), field.map.rows());
  for (int32_t row = 4; row < 8; ++row) {
    mask.BlockRow(row, 8, 11);
  }
  mask.Set({0, 0});
  field.obstacles = field::Shared(std::move(mask));
  return field;
}

TEST(Coverage, IsWhatTheVisitsOfEachPlaceSay) {
  std::mt19937_64 random(7);
  Coverage coverage(Floor(), 1'000'000);
  std::map<std::pair<int, int>, std::vector<bool>> visited;  // of each place, in each step
  constexpr size_t kSteps = 60;
  for (int column = 0; column < 5; ++column) {
    for (int row = 0; row < 4; ++row) {
      if (column != 2 || row != 1) {
        visited[{column, row}].resize(kSteps + 1);
      }
    }
  }
  for (size_t step = 1; step <= kSteps; ++step) {
    for (int robot = 0; robot < 2; ++robot) {
      const int column = static_cast<int>(random() % 5);
      const int row = static_cast<int>(random() % 2);
      coverage.Visit(column - 0.7, row + 0.999, step);
      if (auto place = visited.find({column, row}); place != visited.end()) {
        place->second[step] = true;
      }
    }
  }
  double idle = 0;
  uint64_t most = 0;
  double covered = 0;
  for (const auto& [place, steps] : visited) {
    uint64_t last = 0;
    for (size_t step = 1; step <= kSteps; ++step) {
      if (steps[step]) {
        const double gap = static_cast<double>(step - last);
        idle += gap > 1 ? gap * gap / 2 : 0;
        last = step;
      }
    }
    const double gap = static_cast<double>(kSteps - last);
    idle += gap * gap / 2;
    most = std::max(most, kSteps - last);
    covered += last != 0 ? 1 : 0;
  }
  const Coverage::Share share = coverage.At(kSteps);
  EXPECT_DOUBLE_EQ(share.covered, covered / 19);
  EXPECT_NEAR(share.mean_idle_steps, idle / 19 / kSteps, 1e-9);
  EXPECT_EQ(share.most_idle_steps, most);
}

TEST(Coverage, ARobotOnTheEdgeIsAtNoOtherPlace) {
  Coverage coverage(Floor(), 1'000'000);
  coverage.Visit(4, 4, 1);
  coverage.Visit(4, 0, 1);
  EXPECT_EQ(coverage.At(1).covered, 0);
  coverage.Visit(3.9, 3.9, 1);
  EXPECT_DOUBLE_EQ(coverage.At(1).covered, 1 / 19.0);
}

}  // namespace
}  // namespace pheromone::lab
