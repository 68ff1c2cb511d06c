#include "client_fw/verify/cleaning_check.h"

#include <algorithm>
#include <cassert>
#include <utility>

#include "client_fw/verify/cleaning_levels.h"

namespace pheromone::verify {
namespace {

constexpr char kForgotten[] = "a zone need not be cleaned again";

// What Explore found, but for the proof that nothing goes on for ever.
CleaningResult ResultOf(CleaningGraph* graph, bool is_good) {
  CleaningResult result;
  result.states = graph->size();
  result.steps = graph->steps();
  result.bytes = graph->bytes();
  result.unfolded_states = graph->unfolded();
  result.wrong = graph->wrong();
  if (is_good) {
    result.verdict = Verdict::kProved;
  } else if (!result.wrong.empty()) {
    result.verdict = Verdict::kRefuted;
    result.trace = graph->TraceTo(graph->last());
    result.wrong_time = result.trace.back().time;
  }
  return result;
}

void Refute(CleaningGraph* graph, std::vector<uint32_t> cycle, const std::string& wrong,
            CleaningResult* result) {
  std::rotate(cycle.begin(), std::min_element(cycle.begin(), cycle.end()), cycle.end());
  std::vector<uint32_t> then(cycle.begin() + 1, cycle.end());
  then.push_back(cycle.front());
  result->verdict = Verdict::kRefuted;
  result->wrong = wrong;
  result->trace = graph->TraceTo(cycle.front(), then);
  result->repeats_from = result->trace.size() - then.size();
  result->wrong_time = result->trace[result->repeats_from].time;
}

uint64_t OpenZones(const CleaningWorld& world) {
  return world.all_zones() & ~world.limits().closed;
}

CleaningResult Prove(const CleaningLimits& limits, const CleaningStarts& starts,
                     const SearchLimits& search, bool symmetric) {
  CleaningWorld world(limits);
  CleaningGraph graph(&world, {.key = {.symmetric = symmetric}, .limits = search},
                      StartStates(&world, &starts));
  CleaningResult result = ResultOf(&graph, graph.Explore());
  // Passers-by can make tags forget when zones were cleaned, and so lead robots round for ever.
  if (result.verdict != Verdict::kProved || limits.passers_by) {
    return result;
  }
  std::vector<uint32_t> cycle;
  result.gaps = graph.LongestGaps(OpenZones(world), &result.first, &cycle);
  if (!cycle.empty() && graph.is_symmetric()) {
    return Prove(limits, starts, search, false);  // so that the cycle closes in the same directions
  }
  if (!cycle.empty()) {
    Refute(&graph, std::move(cycle), kForgotten, &result);
  }
  return result;
}

CleaningResult CleanAfter(const CleaningLimits& limits, const CleaningStarts& starts,
                          const SoilPercents& soil, const SearchLimits& search, bool symmetric) {
  CleaningWorld world(limits);
  world.LimitSoil(soil.below);  // what is not below is all the same
  CleaningGraph graph(&world,
                      {.key = {.symmetric = symmetric, .soil = true, .leveled = world.all_zones()},
                       .goal_percent = soil.below,
                       .limits = search},
                      StartStates(&world, &starts, std::min(soil.start, soil.below)));
  CleaningResult result = ResultOf(&graph, graph.Explore());
  if (result.verdict == Verdict::kRefuted) {
    return result;
  }
  LongestWay way = graph.LongestUntilEnd();
  result.longest = way.time;
  if (!way.cycle.empty() && graph.is_symmetric()) {
    return CleanAfter(limits, starts, soil, search, false);
  }
  if (!way.cycle.empty()) {
    Refute(&graph, std::move(way.cycle), "not all zones need ever be clean", &result);
  }
  return result;
}

// Of some zones, as bits, and with a horizon of 0 for all time; with a trace.
CleaningResult Levels(const CleaningLimits& limits, const CleaningStarts& starts,
                      const SoilPercents& soil, int horizon, uint64_t zones,
                      const SearchLimits& search) {
  CleaningWorld world(limits);
  CleaningGraph graph(&world,
                      {.key = {.soil = true, .leveled = zones, .clock = horizon != 0},
                       .below_percent = soil.below,
                       .horizon = static_cast<uint16_t>(horizon),
                       .has_longest = false,
                       .limits = search},
                      StartStates(&world, &starts, soil.start));
  return ResultOf(&graph, graph.Explore());
}

}  // namespace

CleaningResult ProveCleaning(const CleaningLimits& limits, const CleaningStarts& starts,
                             const SearchLimits& search) {
  return Prove(limits, starts, search, starts.empty());
}

CleaningResult CheckCleanAfter(const CleaningLimits& limits, const CleaningStarts& starts,
                               const SoilPercents& soil, const SearchLimits& search) {
  assert(!limits.rates_percent.empty());
  return CleanAfter(limits, starts, soil, search, true);
}

CleaningResult CheckLevels(const CleaningLimits& limits, const CleaningStarts& starts,
                           const SoilPercents& soil, int horizon, const SearchLimits& search) {
  assert(!limits.rates_percent.empty() && horizon > 0);
  CleaningWorld world(limits);
  LevelSearch levels(&world, {.below = soil.below, .horizon = static_cast<uint16_t>(horizon)},
                     StartStates(&world, &starts, soil.start), search);
  CleaningResult result;
  const bool is_good = levels.Run();
  result.states = levels.states();
  result.unfolded_states = levels.states();
  result.steps = levels.steps();
  result.bytes = levels.bytes();
  if (is_good) {
    result.verdict = Verdict::kProved;
    result.levels = levels.highest();
  } else if (!levels.wrong().empty()) {
    const CleaningResult shown = Levels(limits, starts, soil, levels.wrong_time() + 1,
                                        uint64_t{1} << levels.wrong_zone(), search);
    result.verdict = Verdict::kRefuted;
    result.wrong = levels.wrong();
    result.wrong_time = levels.wrong_time();
    result.trace = shown.trace;  // none if there was not enough memory for it
  }
  return result;
}

CleaningResult CheckLevelsForEver(const CleaningLimits& limits, const CleaningStarts& starts,
                                  const SoilPercents& soil, const CleaningResult& proof,
                                  const SearchLimits& search) {
  assert(!limits.rates_percent.empty());
  if (proof.verdict != Verdict::kProved) {
    return proof;
  }
  const CleaningWorld world(limits);
  CleaningResult result = proof;
  for (size_t zone = 0; zone < world.zones(); ++zone) {
    const int rate = world.RateOf(zone);
    const int later = HighestPercent(rate, proof.gaps[zone], limits.soiling_step);
    // The first step comes after a whole one.
    const int at_first = soil.start + rate * (proof.first[zone] / limits.soiling_step);
    result.levels.push_back(
        world.IsClosed(zone) ? 0 : std::min(kFullPercent, std::max(later, at_first)));
  }
  for (size_t zone = 0; zone < world.zones(); ++zone) {
    if (result.levels[zone] >= soil.below) {
      CleaningResult one = Levels(limits, starts, soil, 0, uint64_t{1} << zone, search);
      if (one.verdict != Verdict::kProved) {
        return one;
      }
      result.levels[zone] = soil.below - 1;
      result.states += one.states;
      result.steps += one.steps;
      result.bytes = std::max(result.bytes, one.bytes);
    }
  }
  return result;
}

std::vector<int> PaperRates() {
  std::vector<int> rates;
  for (size_t zone = 1; zone <= 12; ++zone) {
    rates.push_back((zone >= 5 && zone <= 8) || zone == 11 ? 10 : 5);
  }
  return rates;
}

int HighestPercent(int rate_percent, int gap, int soiling_step) {
  return rate_percent * (gap / soiling_step + 1);
}

std::string TraceText(const CleaningResult& result) {
  std::string text;
  for (size_t i = 1; i < result.trace.size(); ++i) {
    const CleaningMoment& moment = result.trace[i];
    if (i == result.repeats_from) {
      text += "for ever:\n";
    }
    text += std::to_string(moment.time) + ": " + StepText(moment.step) + "\n";
  }
  return text + result.wrong + "\n";
}

}  // namespace pheromone::verify
