#include "server/core/petri/growth.h"

#include <algorithm>
#include <random>

namespace pheromone::petri {
namespace {

constexpr size_t kLongWay = 300;
constexpr size_t kMaxComparisons = 300'000;
constexpr int kWalks = 20;
constexpr size_t kStepsOfWalk = 1000;
constexpr int32_t kMostInWalk = 1'000'000;

class GrowthSearch {
 public:
  explicit GrowthSearch(const Net& net) : net_(net) {}

  std::optional<Growth> Along(const std::vector<uint32_t>& way) {
    Begin();
    for (const uint32_t transition : way) {
      Fire(transition);
      if (way.size() <= kLongWay || way_.size() == way.size()) {
        if (auto growth = InLast()) {
          return growth;
        }
      }
    }
    return std::nullopt;
  }

  std::optional<Growth> OnWalk(std::mt19937* random) {
    Begin();
    int64_t most = Sum();
    while (way_.size() < kStepsOfWalk && markings_.back().maxCoeff() <= kMostInWalk) {
      std::vector<uint32_t> enabled;
      for (uint32_t t = 0; t < net_.transitions.size(); ++t) {
        if (IsEnabled(net_, t, markings_.back())) {
          enabled.push_back(t);
        }
      }
      if (enabled.empty()) {
        break;
      }
      Fire(enabled[(*random)() % enabled.size()]);
      if (Sum() > most) {  // only then can it have grown
        most = Sum();
        if (auto growth = InLast()) {
          return growth;
        }
      }
    }
    return std::nullopt;
  }

  bool is_tired() const { return comparisons_ >= kMaxComparisons; }

 private:
  void Begin() {
    way_.clear();
    markings_ = {InitialMarking(net_)};
  }

  void Fire(uint32_t transition) {
    way_.push_back(transition);
    markings_.push_back(petri::Fire(net_, transition, markings_.back()));
  }

  int64_t Sum() const { return markings_.back().cast<int64_t>().sum(); }

  bool HasGrownSince(size_t from) const {
    const Marking& last = markings_.back();
    const Marking& earlier = markings_[from];
    for (Eigen::Index place = 0; place < last.size(); ++place) {
      if (last[place] < earlier[place]) {
        return false;
      }
    }
    const auto grows = [&](const Arc& arc) { return last[arc.place] != earlier[arc.place]; };
    for (size_t step = from; step < way_.size(); ++step) {
      const std::vector<Arc>& inhibitors = net_.transitions[way_[step]].inhibitors;
      if (std::any_of(inhibitors.begin(), inhibitors.end(), grows)) {
        return false;
      }
    }
    return last != earlier;
  }

  std::optional<Growth> InLast() {
    for (size_t from = 0; from + 1 < markings_.size() && !is_tired(); ++from) {
      ++comparisons_;
      if (HasGrownSince(from)) {
        const auto middle = way_.begin() + static_cast<std::ptrdiff_t>(from);
        Eigen::Index place = 0;
        (markings_.back() - markings_[from]).maxCoeff(&place);
        return Growth{{way_.begin(), middle}, {middle, way_.end()}, static_cast<uint32_t>(place)};
      }
    }
    return std::nullopt;
  }

  const Net& net_;
  std::vector<uint32_t> way_;
  std::vector<Marking> markings_;  // one more
  size_t comparisons_ = 0;
};

}  // namespace

std::optional<Growth> FindGrowth(const Net& net, const std::vector<uint32_t>& way) {
  return GrowthSearch(net).Along(way);
}

std::optional<Growth> WalkToGrowth(const Net& net) {
  GrowthSearch search(net);
  std::mt19937 random(1);
  for (int walk = 0; walk < kWalks && !search.is_tired(); ++walk) {
    if (auto growth = search.OnWalk(&random)) {
      return growth;
    }
  }
  return std::nullopt;
}

}  // namespace pheromone::petri
