// An axis: from where to where it goes, where its ticks are, and where a value lies on it.
//
//   const Axis axis = AxisOver(Scale::kLogarithmic, 3, 400);  // 2 to 500: ticks 2, 5, 10, ... 500
//   axis.ShareOf(20);                                         // 0.417 of the way
//
// Plain values; any thread.
#pragma once

#include <vector>

namespace pheromone::chart {

enum class Scale { kLinear, kLogarithmic };

struct Axis {
  Scale scale = Scale::kLinear;
  double from = 0;
  double to = 1;
  std::vector<double> ticks;  ///< rising

  /// Where `value` lies: 0 at `from`, 1 at `to`; what is beyond an end lies on it.
  double ShareOf(double value) const;
};

/// Whether an axis of that scale has a place for `value`: it is finite, and on a logarithmic axis
/// positive (and not denormal).
bool HasPlace(Scale scale, double value);

/// An axis from a tick at or below `least` to one at or above `most`. Linear ticks are 1, 2 or 5
/// times a power of ten apart. Logarithmic ones are at 1, 2 and 5 times the powers of ten, or,
/// where those would be more than nine, at powers of ten alone. Both values have a place on it, and
/// `least` <= `most`; if they are equal, the axis is wider than they say.
Axis AxisOver(Scale scale, double least, double most);

/// One place of width 1 for each of `count` categories, in the middle of which is its number.
Axis CategoryAxis(int count);

}  // namespace pheromone::chart
