// How a radio channel that gives its robots turns answers them, as it was measured: a table of the
// gaps between a robot's answers and of how old a pose is when it is answered.
//
//   const MeasuredChannel* channel = FindMeasured(/*lost_percent=*/1, /*robots=*/16);
//   channel->gaps.At(0.5);              // ms, the median
//   1000 / channel->gaps.Mean();        // answers a second, of each robot
//
// The table is measured_rounds.csv, which the program carries: 1 to 40 robots that ask at 5 Hz, a
// channel of 9600 baud, modems and server with 2 ms each, nothing or 1 or 5 % of the frames lost
// for each listener. It is made, from bytes on the air, by
//
//   pheromone-experiments channel --seeds 3 --link-table client_fw/lab/link/measured_rounds.csv
//
// Pure; any thread.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "server/base/result.h"

namespace pheromone::lab {

/// What was counted of one figure, in bins.
class Distribution {
 public:
  /// Bins in the order of their values, which lie from `from_ms` to `to_ms`.
  void Add(int64_t from_ms, int64_t to_ms, uint64_t count);

  /// The value below which this share lies, from 0 up to, but not including, 1; evenly within a
  /// bin. Requires a bin.
  int64_t At(double share) const;
  double Mean() const;
  /// Of the values, those above.
  double ShareAbove(int64_t ms) const;
  bool empty() const { return bins_.empty(); }

 private:
  struct Bin {
    int64_t from_ms;
    int64_t to_ms;
    uint64_t before;  // values in the bins before
    uint64_t until;   // and in this one
  };
  std::vector<Bin> bins_;
};

struct MeasuredChannel {
  int lost_percent = 0;
  int robots = 0;
  Distribution gaps;
  Distribution pose_ages;
};

/// Errors: a line of the CSV that is not as the command above writes it.
Result<std::vector<MeasuredChannel>> ReadMeasuredRounds(std::string_view csv);

/// The program's own table, in its order.
std::span<const MeasuredChannel> MeasuredRounds();

/// Null if it was not measured.
const MeasuredChannel* FindMeasured(int lost_percent, int robots);

}  // namespace pheromone::lab
