// The steering laws side by side, and with it the paper's claim that pheromones guide a robot at
// "levels entirely comparable to those of a fuzzy controller" (Susnea et al. 2009, "Experimental
// results").
//
//   const Tuning fuzzy = Tune(client::Law::kFuzzy, 600, /*seed=*/1);
//   const Comparison row = Compare({"fuzzy", fuzzy.steering()}, Curve::kSpiral, 20);
//
// `differential` and `fuzzy` are tuned by the same search with the same budget, the same cost, the
// same curves (line and circle) and the same seeds; the wheels of both turn at 300 mm/s at most.
// Then they are compared on curves and seeds that the search has not seen. The results of the
// search are committed: TunedDifferential() here, client::kTunedFuzzy in
// client_fw/core/steering/fuzzy.h.
//
// Virtual time, one thread; the same arguments give the same figures.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "client_fw/experiments/laws/follow.h"
#include "client_fw/experiments/laws/law_search.h"

namespace pheromone::swarm {

/// Found by `pheromone-experiments laws --search 600` (results/laws-search.csv).
Steering TunedDifferential();
Steering TunedFuzzy();

/// A law as it appears in tables.
struct Contender {
  std::string name;
  Steering steering;
};

/// The paper's law, the differential law as it is by default, and the two tuned ones.
std::vector<Contender> ContendersOf(const Steering& differential, const Steering& fuzzy);

/// The parameters of a law that a search varies, and their ranges.
struct Tunable {
  std::vector<std::string> names;
  std::vector<SearchRange> ranges;
  std::vector<int> start;
};

/// For kDifferential and kFuzzy.
Tunable TunableOf(client::Law law);
Steering SteeringOf(client::Law law, const std::vector<int>& values);

/// One millimetre of mean error costs as much as one per cent of the progress (of 300 mm/s). Means
/// over the tuning curves and over seeds that no comparison uses.
struct Merit {
  double error_mm = 0;
  double progress_mm_s = 0;
  double cost() const { return error_mm + (300 - progress_mm_s) / 3; }
};
Merit MeritOf(const Steering& steering);

struct Tuning {
  client::Law law = client::Law::kDifferential;
  SearchResult search;
  std::vector<Merit> merits;  ///< of each evaluation
  Steering steering() const { return SteeringOf(law, search.best().values); }
};

/// `shown` is called before each evaluation with its number, from 0.
Tuning Tune(client::Law law, int budget, uint64_t seed, const std::function<void(int)>& shown);

struct Comparison {
  Contender contender;
  FollowSummary summary;
};

/// Seeds 1, 2, ... for 40 s each.
Comparison Compare(const Contender& contender, Curve curve, int seeds);

/// A header line, then one line each.
std::string ToCsv(const std::vector<Comparison>& rows);
std::string ToCsv(const std::vector<Tuning>& tunings);

}  // namespace pheromone::swarm
