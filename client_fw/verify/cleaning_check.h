// What cleaning robots do for all time, and the two queries of Tammet, Vain and Kuusik 2006,
// section 4.5.
//
//   const CleaningResult proof = ProveCleaning({.clean_min = 5, .clean_max = 5});
//   // proof.gaps[z]: the longest that zone z + 1 is not cleaned, if proof.verdict is kProved
//   const CleaningResult safe = CheckLevels({.clean_min = 5, .clean_max = 5}, {{5, 6}}, 20, 51,
//   240);
//   // safe.trace: the shortest way to a zone of 51 % or more, if kRefuted
//
// The proof for all time leaves out soil and the clock, on which no decision depends. Of a zone
// that is cleaned at least every `gap`, the level is at most its rate times (gap / 15 + 1), halves
// dropped: so gaps below 75 and 150 keep zones of 10 % and 5 % below 51 %, always.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "client_fw/verify/cleaning_world.h"
#include "client_fw/verify/explore.h"

namespace pheromone::verify {

/// One step of a trace, and the state after it. The first has no step.
struct CleaningMoment {
  CleaningStep step;
  CleaningState state;
  int time = 0;  ///< of the step, since the start
};

struct CleaningResult {
  Verdict verdict = Verdict::kUnknown;
  size_t states = 0;
  size_t steps = 0;
  /// The number of states if those that differ in directions on the grid are not taken for equal.
  size_t unfolded_states = 0;
  std::string wrong{};                  ///< if refuted
  std::vector<CleaningMoment> trace{};  ///< to what is wrong
  size_t repeats_from = 0;              ///< not 0: from this moment on, the trace repeats for ever
  std::vector<int> gaps{};              ///< by zone, of ProveCleaning
  int longest = 0;                      ///< of CheckCleanAfter
};

/// Robots' starts: a zone for each.
using CleaningStarts = std::vector<std::vector<uint8_t>>;

/// From all starts and for all time: two robots never clean one zone, something can always happen,
/// and, without passers-by, each zone that is not closed is cleaned again and again, and no robot
/// is in a closed one.
CleaningResult ProveCleaning(const CleaningLimits& limits, size_t max_states = 100'000'000);

/// The paper's first query: from `start_percent` everywhere, all zones are eventually below
/// `below_percent`, at the latest after `longest`. No starts: all.
CleaningResult CheckCleanAfter(const CleaningLimits& limits, const CleaningStarts& starts,
                               int start_percent, int below_percent,
                               size_t max_states = 40'000'000);

/// The second: from `start_percent` everywhere, all zones are below `below_percent` at all times
/// before `horizon`.
CleaningResult CheckLevels(const CleaningLimits& limits, const CleaningStarts& starts,
                           int start_percent, int below_percent, int horizon,
                           size_t max_states = 40'000'000);

/// The paper's, in %: 10 for zones 5 to 8 and 11, 5 for others.
std::array<int, kMaxZones> PaperRates();

/// What a gap lets a zone of this rate come to, in %.
int HighestPercent(int rate_percent, int gap);

/// One line for each moment.
std::string TraceText(const CleaningResult& result);

}  // namespace pheromone::verify
