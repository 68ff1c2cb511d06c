#include "server/chart/axis.h"

#include <algorithm>
#include <cmath>

namespace pheromone::chart {
namespace {

constexpr double kSlack = 1e-9;  // relative: 0.30000000000000004 is at the tick of 0.3
constexpr int kMaxRoundTicks = 9;
constexpr int kMaxDecades = 9;

// Three to six steps.
Axis LinearAxis(double least, double most) {
  const double largest = std::max(std::abs(least), std::abs(most));
  const double span = most - least > kSlack * largest ? most - least : std::max(largest, 1.0);
  const double power = std::pow(10, std::floor(std::log10(span / 4)));
  double step = 10 * power;
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (span / (factor * power) <= 6) {
      step = factor * power;
      break;
    }
  }
  const double first = std::floor(least / step + kSlack);
  const double last = std::max(std::ceil(most / step - kSlack), first + 1);
  Axis axis{Scale::kLinear, first * step, last * step, {}};
  for (double place = first; place <= last; ++place) {
    axis.ticks.push_back(place * step);
  }
  return axis;
}

// The round numbers 1, 2, 5, 10, 20, ... by their index; negative ones are below 1.
double RoundNumber(int index) {
  const int decade = static_cast<int>(std::floor(index / 3.0));
  constexpr double kFactors[] = {1, 2, 5};
  return kFactors[index - 3 * decade] * std::pow(10, decade);
}

Axis LogarithmicAxis(double least, double most) {
  int first = 3 * static_cast<int>(std::floor(std::log10(least)));
  while (RoundNumber(first + 1) <= least * (1 + kSlack)) {
    ++first;
  }
  int last = first;
  while (RoundNumber(last) < most * (1 - kSlack)) {
    ++last;
  }
  int step = 1;
  if (last - first >= kMaxRoundTicks) {
    first = 3 * static_cast<int>(std::floor(first / 3.0));
    last = 3 * static_cast<int>(std::ceil(last / 3.0));
    step = 3 * (1 + ((last - first) / 3 - 1) / kMaxDecades);
    last = first + (last - first + step - 1) / step * step;
  } else if (first == last) {
    --first;
    ++last;
  }
  Axis axis{Scale::kLogarithmic, RoundNumber(first), RoundNumber(last), {}};
  for (int i = first; i <= last; i += step) {
    axis.ticks.push_back(RoundNumber(i));
  }
  return axis;
}

}  // namespace

double Axis::ShareOf(double value) const {
  const double inside = std::clamp(value, from, to);
  if (scale == Scale::kLogarithmic) {
    return std::log(inside / from) / std::log(to / from);
  }
  return (inside - from) / (to - from);
}

bool HasPlace(Scale scale, double value) {
  return scale == Scale::kLinear ? std::isfinite(value) : std::isnormal(value) && value > 0;
}

Axis AxisOver(Scale scale, double least, double most) {
  return scale == Scale::kLogarithmic ? LogarithmicAxis(least, most) : LinearAxis(least, most);
}

Axis CategoryAxis(int count) {
  Axis axis{Scale::kLinear, -0.5, count - 0.5, {}};
  for (int i = 0; i < count; ++i) {
    axis.ticks.push_back(i);
  }
  return axis;
}

}  // namespace pheromone::chart
