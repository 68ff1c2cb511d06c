#include "client_fw/experiments/laws/law_search.h"

#include <algorithm>
#include <cmath>
#include <random>

namespace pheromone::swarm {
namespace {

// Of a range, the first and the last step around the best.
constexpr double kFirstStep = 0.3;
constexpr double kLastStep = 0.02;

int Draw(std::mt19937_64* random, int least, int most) {
  const auto count = static_cast<uint64_t>(most - least) + 1;
  return least + static_cast<int>((*random)() % count);
}

std::vector<int> Anywhere(const std::vector<SearchRange>& ranges, std::mt19937_64* random) {
  std::vector<int> values;
  values.reserve(ranges.size());
  for (const SearchRange& range : ranges) {
    values.push_back(Draw(random, range.least, range.most));
  }
  return values;
}

// About half of the values moved, one at least.
std::vector<int> Near(const std::vector<int>& values, double step,
                      const std::vector<SearchRange>& ranges, std::mt19937_64* random) {
  std::vector<int> moved = values;
  const auto surely = static_cast<size_t>((*random)() % values.size());
  for (size_t i = 0; i < moved.size(); ++i) {
    const SearchRange& range = ranges[i];
    const int reach = std::max(1, static_cast<int>(std::lround(step * (range.most - range.least))));
    const bool moves = i == surely || (*random)() % 2 == 0;
    const int way = Draw(random, -reach, reach);
    moved[i] = moves ? std::clamp(moved[i] + way, range.least, range.most) : moved[i];
  }
  return moved;
}

}  // namespace

SearchResult Search(const std::vector<SearchRange>& ranges, const std::vector<int>& start,
                    int budget, uint64_t seed,
                    const std::function<double(const std::vector<int>&)>& cost) {
  std::mt19937_64 random(seed);
  SearchResult result;
  for (int i = 0; i < std::max(1, budget); ++i) {
    std::vector<int> values = start;
    if (i > 0 && i < budget / 2) {
      values = Anywhere(ranges, &random);
    } else if (i > 0) {
      const double done = static_cast<double>(2 * i - budget) / budget;
      values = Near(result.best().values, kFirstStep * std::pow(kLastStep / kFirstStep, done),
                    ranges, &random);
    }
    const double value = cost(values);
    result.evaluations.push_back({std::move(values), value});
    if (value < result.best().cost) {
      result.best_index = result.evaluations.size() - 1;
    }
  }
  return result;
}

}  // namespace pheromone::swarm
