#include "client_fw/experiments/cleaning/model.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <vector>

#include "client_fw/core/tasks/cleaning.h"

namespace pheromone::swarm {
namespace {

constexpr int64_t kLeastCleaning = 5;
constexpr int64_t kMostCleaning = 7;
constexpr int64_t kLeastMove = 1;
constexpr int64_t kMostMove = 2;
constexpr double kMeanStep = (kLeastCleaning + kMostCleaning + kLeastMove + kMostMove) / 2.0;

struct ModelRobot {
  int zone = 0;
  int64_t until = 0;
  bool is_cleaning = false;
};

struct ModelZone {
  int64_t cleaned = 0;  // 0: never
  bool is_occupied = false;
};

class CleaningModel {
 public:
  CleaningModel(const CleaningGrid& grid, int robots, uint64_t seed)
      : grid_(grid), random_(seed), zones_(static_cast<size_t>(grid.zones())) {
    std::vector<int> starts(zones_.size());
    std::iota(starts.begin(), starts.end(), 0);
    for (int i = 0; i < robots; ++i) {
      std::swap(starts[static_cast<size_t>(i)],
                starts[static_cast<size_t>(Below(i, grid.zones() - 1))]);
      robots_.push_back({.zone = starts[static_cast<size_t>(i)]});
    }
  }

  // The longest gap until `end`.
  int64_t Run(int64_t end) {
    // From 1: 0 is the stamp of a zone that was never cleaned.
    for (now_ = 1; now_ < end; ++now_) {
      std::vector<ModelRobot*> due;
      for (ModelRobot& robot : robots_) {
        if (robot.until <= now_) {
          if (robot.is_cleaning) {
            zones_[static_cast<size_t>(robot.zone)] = {now_, false};
            robot.is_cleaning = false;
          }
          due.push_back(&robot);
        }
      }
      std::shuffle(due.begin(), due.end(), random_);
      for (ModelRobot* robot : due) {
        Act(robot);
      }
    }
    for (const ModelZone& zone : zones_) {
      if (!zone.is_occupied) {
        longest_ = std::max(longest_, end - zone.cleaned);
      }
    }
    return longest_;
  }

 private:
  int64_t Below(int64_t least, int64_t most) {
    return least + static_cast<int64_t>(random_() % static_cast<uint64_t>(most - least + 1));
  }

  void Act(ModelRobot* robot) {
    const int column = grid_.ColumnOf(robot->zone);
    const int row = grid_.RowOf(robot->zone);
    std::vector<int> seen = {robot->zone};
    for (const auto& [dx, dy] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
      const int x = column + dx;
      const int y = row + dy;
      if (x >= 0 && x < grid_.columns && y >= 0 && y < grid_.rows) {
        seen.push_back(x * grid_.rows + y);
      }
    }
    client::CleaningView view{};
    for (const int zone : seen) {
      const ModelZone& it = zones_[static_cast<size_t>(zone)];
      client::ZoneTag& tag = view.tags[view.count++];
      tag.is_occupied = it.is_occupied;
      tag.cleaned_s = static_cast<uint32_t>(it.cleaned);
    }
    const client::CleaningDecision decision =
        client::Decide(view, static_cast<uint8_t>(random_() % 240));
    switch (decision.act) {
      case client::CleaningAct::kWait:
        robot->until = now_ + 1;
        break;
      case client::CleaningAct::kMove:
        robot->zone = seen[decision.tag];
        robot->until = now_ + Below(kLeastMove, kMostMove);
        break;
      case client::CleaningAct::kClean: {
        ModelZone& zone = zones_[static_cast<size_t>(robot->zone)];
        longest_ = std::max(longest_, now_ - zone.cleaned);
        zone.is_occupied = true;
        robot->is_cleaning = true;
        robot->until = now_ + Below(kLeastCleaning, kMostCleaning);
        break;
      }
    }
  }

  CleaningGrid grid_;
  std::mt19937_64 random_;
  std::vector<ModelZone> zones_;
  std::vector<ModelRobot> robots_;
  int64_t now_ = 0;
  int64_t longest_ = 0;
};

}  // namespace

double ModelWorstGap(const CleaningGrid& grid, int robots, int cycles, uint64_t seed) {
  const double cycle = kMeanStep * grid.zones() / robots;
  CleaningModel model(grid, robots, seed);
  return static_cast<double>(model.Run(std::llround(cycle * cycles))) / cycle;
}

}  // namespace pheromone::swarm
