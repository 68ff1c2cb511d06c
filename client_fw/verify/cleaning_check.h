// What cleaning robots do for all time, and the two queries of Tammet, Vain and Kuusik 2006,
// section 4.5.
//
//   CleaningLimits limits{.columns = 4, .rows = 3, .rates_percent = PaperRates()};
//   const CleaningResult proof = ProveCleaning(limits);
//   // proof.gaps[z]: the longest that zone z + 1 is not cleaned, if proof.verdict is kProved
//   const CleaningResult safe = CheckLevels(limits, {{5, 6}}, {.start = 20, .below = 51}, 240);
//   // safe.trace: the shortest way to a zone of 51 % or more, if kRefuted
//
// The proof for all time leaves out soil and the clock, on which no decision depends. Gaps below 75
// and 150 keep zones of 10 % and 5 % below 51 %, always: see CheckLevelsForEver.
//
// Limits that WhatIsWrong names are a bug of the caller. Pure; a search at a time for each thread.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "client_fw/verify/cleaning_graph.h"
#include "client_fw/verify/cleaning_starts.h"
#include "client_fw/verify/cleaning_trace.h"
#include "client_fw/verify/cleaning_world.h"
#include "client_fw/verify/explore.h"

namespace pheromone::verify {

struct CleaningResult {
  Verdict verdict = Verdict::kUnknown;
  size_t states = 0;
  size_t steps = 0;
  size_t bytes = 0;
  /// The number of states if those that differ in directions on the floor are not taken for equal.
  size_t unfolded_states = 0;
  std::string wrong{};                  ///< if refuted
  int wrong_time = 0;                   ///< when that is, or begins to repeat
  std::vector<CleaningMoment> trace{};  ///< to what is wrong
  size_t repeats_from = 0;              ///< not 0: from this moment on, the trace repeats for ever
  std::vector<int> gaps{};              ///< by zone, of ProveCleaning
  std::vector<int> first{};             ///< the same from a start to the first cleaning
  std::vector<int> levels{};            ///< by zone, at most so many %, of CheckLevels...
  int longest = 0;                      ///< of CheckCleanAfter
};

/// From the starts and for all time: two robots never clean one zone, something can always happen,
/// and, without passers-by, each zone that is not closed is cleaned again and again, and no robot
/// is in a closed one.
CleaningResult ProveCleaning(const CleaningLimits& limits, const CleaningStarts& starts = {},
                             const SearchLimits& search = {});

/// Soil in %: of all zones at the start, and what they are to be below.
struct SoilPercents {
  int start = 0;
  int below = 0;
};

/// The paper's first query: all zones are eventually below, at the latest after `longest`.
CleaningResult CheckCleanAfter(const CleaningLimits& limits, const CleaningStarts& starts,
                               const SoilPercents& soil, const SearchLimits& search = {});

/// The second: all zones are below at all times before `horizon`.
CleaningResult CheckLevels(const CleaningLimits& limits, const CleaningStarts& starts,
                           const SoilPercents& soil, int horizon, const SearchLimits& search = {});

/// The same at all times, from a proof of the same limits and starts by ProveCleaning. Between two
/// cleanings, and as soil may come at any moment of the step, a zone's level is at most its rate
/// times (gap / step + 1), halves dropped: where this is below, and before the first cleaning too,
/// no further search is needed, and `levels` has these bounds. Else the worst of the other zones
/// are searched for a way there, a zone at a time: its level alone is part of the states.
/// Where the proof failed, its result is this one too, even if the forgotten zone does not soil.
CleaningResult CheckLevelsForEver(const CleaningLimits& limits, const CleaningStarts& starts,
                                  const SoilPercents& soil, const CleaningResult& proof,
                                  const SearchLimits& search = {});

/// The paper's, in %: 10 for zones 5 to 8 and 11, 5 for the others of twelve.
std::vector<int> PaperRates();

/// What a gap lets a zone of this rate come to, in %.
int HighestPercent(int rate_percent, int gap, int soiling_step = kSoilingStep);

/// One line for each moment.
std::string TraceText(const CleaningResult& result);

}  // namespace pheromone::verify
