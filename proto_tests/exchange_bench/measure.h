// The measurements of exchange_bench against one server, and those of the machine without it.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "proto_tests/exchange_bench/arena.h"
#include "proto_tests/exchange_bench/pty_load.h"
#include "proto_tests/exchange_bench/report.h"
#include "proto_tests/exchange_bench/server_process.h"
#include "proto_tests/exchange_bench/udp_load.h"

namespace pheromone::bench {

struct Effort {
  int rounds = 5;
  double seconds = 2;  ///< of each half of a round
  double pty_seconds = 10;
  size_t bytes_at_once = 1;  ///< that a pty hands over together
  int pty_rounds = 7;        ///< of those that are compared
  double roaming_seconds = 30;
  int syncs = 1000;
};

/// What the arena's configuration has of each kind.
inline constexpr LinkNumbers kLinks{8, 16};

/// A load and another with it, by turns: `row` with the medians of the first one's rate, of the
/// other one's (echo_per_second) and of their ratio, the sums of the counts, and the last times.
Row RunInTurn(int rounds, const std::function<LoadResult()>& load,
              const std::function<LoadResult()>& with, Row row);

class Measure {
 public:
  /// `name` is the server's in the report. All outlive this; `folder` is where the server runs.
  Measure(std::string name, std::string folder, const Effort& effort, const Arena& arena,
          const ServerProcess& server, Report* report);

  /// Over UDP, in turn with the echo; medians of the rounds.
  void CompareUdp(Load what, int clients);
  /// SENSE on a signed link, in turn with SENSE on those that are not.
  void CompareSigned(int clients);
  /// A load about tags in turn with SENSE or TRACE, as many rounds.
  void CompareTags(Load what, Load with, const TagSites& tags, int clients);
  /// At a modem's pace. `beside`: the concurrent load, for the report.
  void TimePtys(bool trace, int ptys, int baud, const std::string& beside = "");
  /// SENSE at a modem's pace, in turn alone and while what `begin` returns lives: so that what else
  /// the machine does meets both. Reports the medians of the rounds' quantiles, and their range.
  void ComparePtys(int ptys, int baud, const std::string& beside,
                   const std::function<std::shared_ptr<void>()>& begin);
  /// TRACE everywhere, of a pheromone that evaporates: measures the growth of the server's memory.
  void Roam(int clients);

 private:
  PtyLoadResult RunPtys(bool trace, int ptys, int baud);
  /// Reports a load in turn with another.
  void Compare(const LoadOptions& load, const LoadOptions& with, Row row);

  const std::string name_;
  const std::string folder_;
  const Effort& effort_;
  const Arena& arena_;
  const ServerProcess& server_;
  std::vector<uint16_t> ports_;
  Report* report_;
};

/// The speed of the disk under `folder` alone: records of the size of an event, written and synced
/// one after the other.
void TimeSyncs(const std::string& folder, const Effort& effort, Report* report);

}  // namespace pheromone::bench
