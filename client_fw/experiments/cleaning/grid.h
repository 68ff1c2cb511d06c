// The floor of the cleaning swarm: square zones, on a grid or anywhere, the soil on them, and who
// cleaned when.
//
//   const CleaningGrid grid{.columns = 4, .rows = 3};
//   grid.RatePercent(4);                                  // 10: the paper's zone 5
//   const std::vector<SoilStep> soil = SoilOf(grid, rule, 4, cleanings, end_ms);
//   WorstGapMs(4, cleanings, end_ms);                     // the longest without a cleaning
//
// After Tammet, Vain and Kuusik 2006, section 4, whose zones 5 to 8 and 11 of twelve soil twice as
// fast as the others. Zones are numbered from 0, column by column, each from its bottom upwards:
// the paper's numbers less 1.
//
// Pure; any thread.
#pragma once

#include <cstdint>
#include <vector>

namespace pheromone::swarm {

/// From how far a tag is read, by the side of a zone: beyond the next tag, not to the diagonal one.
constexpr double kRangeOfZone = 1.2;

/// A zone of a floor that is not the paper's: its middle, from the floor's lower left corner, and
/// from how far its tag is read.
struct CleaningZone {
  double x_m = 0;
  double y_m = 0;
  double range_m = 1.2;
  int rate_percent = 5;  ///< of soil in each step
};

struct CleaningGrid {
  int columns = 4;
  int rows = 3;
  double zone_m = 1;                ///< the side of a zone
  std::vector<CleaningZone> own{};  ///< not empty: these, whatever `columns` and `rows` are

  int zones() const { return own.empty() ? columns * rows : static_cast<int>(own.size()); }
  /// Of a grid.
  int ColumnOf(int zone) const { return zone / rows; }
  int RowOf(int zone) const { return zone % rows; }
  /// The middle of a zone, from the floor's lower left corner.
  double CentreX(int zone) const;
  double CentreY(int zone) const;
  /// From how far its tag is read.
  double RangeOf(int zone) const;
  /// Of a floor with half a zone around all middles.
  double width_m() const;
  double height_m() const;
  /// The zone that a point is in; beyond the edge, the nearest.
  int ZoneAt(double x_m, double y_m) const;
  /// What a zone soils in each step: 10 in the paper's zones 5 to 8 and 11, else 5. The pattern of
  /// 4 x 3 zones is repeated over larger grids, so that they soil as fast on average.
  int RatePercent(int zone) const;
};

/// A robot in a zone, from its claim on.
struct Cleaning {
  int zone = 0;
  int robot = 0;  ///< counted from 0
  int64_t begin_ms = 0;
  int64_t end_ms = 0;
  bool is_done = false;  ///< to the end, so that the zone is clean
};

/// How zones soil: by their rate after each step, up to 100 %.
struct SoilRule {
  double start_percent = 20;  ///< of all zones
  int64_t unit_ms = 3000;
  double threshold_percent = 51;  ///< to stay below: the paper's TR
  int step_units = 15;            ///< the paper's time_step

  int64_t step_ms() const { return step_units * unit_ms; }
};

/// From `time_ms` on, until the next.
struct SoilStep {
  int64_t time_ms = 0;
  double percent = 0;
};

/// The soil of one zone from 0 to `end_ms`. While a zone is being cleaned its level stays as it was
/// (the paper has anything from 0 to that), then it is 0. `cleanings` of all zones, by their begin.
std::vector<SoilStep> SoilOf(const CleaningGrid& grid, const SoilRule& rule, int zone,
                             const std::vector<Cleaning>& cleanings, int64_t end_ms);

/// The highest of a zone's levels.
double HighestPercent(const std::vector<SoilStep>& soil);

/// The longest time in which nobody cleaned a zone: from the end of a cleaning until the next
/// begins, from the start until the first, and from the last until the end of the run.
int64_t WorstGapMs(int zone, const std::vector<Cleaning>& cleanings, int64_t end_ms);

/// For how long two robots cleaned one zone, over all pairs of them, in ms; never, that is.
int64_t TogetherMs(const std::vector<Cleaning>& cleanings);

}  // namespace pheromone::swarm
