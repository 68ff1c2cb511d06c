#include "client_fw/verify/cleaning_check.h"

#include <algorithm>

#include "client_fw/verify/cleaning_graph.h"

namespace pheromone::verify {
namespace {

std::vector<CleaningState> StatesOf(const CleaningWorld& world, const CleaningStarts& starts,
                                    int start_percent) {
  std::vector<CleaningState> states;
  for (const std::vector<uint8_t>& start : starts.empty() ? world.AllStarts() : starts) {
    CleaningState state = world.Start(start);
    if (start_percent >= 0) {
      state.tick = kSoilingStep;
      std::fill_n(state.level.begin(), world.zones(),
                  static_cast<uint8_t>(start_percent / kLevelPercent));
    }
    states.push_back(state);
  }
  return states;
}

// What Explore found, but for the proof that nothing goes on for ever.
template <size_t kWords>
CleaningResult ResultOf(CleaningGraph<kWords>* graph, bool is_good) {
  CleaningResult result;
  result.states = graph->size();
  result.steps = graph->steps();
  result.unfolded_states = graph->unfolded();
  result.wrong = graph->wrong();
  if (is_good) {
    result.verdict = Verdict::kProved;
  } else if (!result.wrong.empty()) {
    result.verdict = Verdict::kRefuted;
    result.trace = graph->TraceTo(graph->last());
  }
  return result;
}

template <size_t kWords>
void Refute(CleaningGraph<kWords>* graph, std::vector<uint32_t> cycle, const std::string& wrong,
            CleaningResult* result) {
  std::rotate(cycle.begin(), std::min_element(cycle.begin(), cycle.end()), cycle.end());
  std::vector<uint32_t> then(cycle.begin() + 1, cycle.end());
  then.push_back(cycle.front());
  result->verdict = Verdict::kRefuted;
  result->wrong = wrong;
  result->trace = graph->TraceTo(cycle.front(), then);
  result->repeats_from = result->trace.size() - then.size();
}

std::array<uint8_t, kMaxZones> RatesInLevels() {
  const std::array<int, kMaxZones> percents = PaperRates();
  std::array<uint8_t, kMaxZones> rates{};
  std::transform(percents.begin(), percents.end(), rates.begin(),
                 [](int percent) { return static_cast<uint8_t>(percent / kLevelPercent); });
  return rates;
}

CleaningResult Prove(const CleaningLimits& limits, bool symmetric, size_t max_states) {
  CleaningWorld world(limits);
  CleaningGraph<2> graph(&world, {.symmetric = symmetric, .max_states = max_states});
  CleaningResult result = ResultOf(&graph, graph.Explore(StatesOf(world, {}, -1)));
  // Passers-by can make tags forget when zones were cleaned, and so lead robots round for ever.
  if (result.verdict != Verdict::kProved || limits.passers_by) {
    return result;
  }
  std::vector<uint32_t> cycle;
  result.gaps = graph.LongestGaps(&cycle);
  if (!cycle.empty() && symmetric) {
    return Prove(limits, false, max_states);  // so that the cycle closes in the same directions
  }
  if (!cycle.empty()) {
    Refute(&graph, std::move(cycle), "a zone need not be cleaned again", &result);
  }
  return result;
}

}  // namespace

CleaningResult ProveCleaning(const CleaningLimits& limits, size_t max_states) {
  return Prove(limits, limits.closed == 0, max_states);  // closed zones are where they are
}

CleaningResult CheckCleanAfter(const CleaningLimits& limits, const CleaningStarts& starts,
                               int start_percent, int below_percent, size_t max_states) {
  CleaningWorld world(limits);
  world.Soil(RatesInLevels());
  const auto goal = static_cast<uint8_t>((below_percent + kLevelPercent - 1) / kLevelPercent);
  CleaningGraph<3> graph(&world, {.goal_level = goal, .max_states = max_states});
  CleaningResult result = ResultOf(&graph, graph.Explore(StatesOf(world, starts, start_percent)));
  if (result.verdict != Verdict::kRefuted) {
    LongestWay way = graph.LongestUntilEnd();
    result.longest = way.time;
    if (!way.cycle.empty()) {
      Refute(&graph, std::move(way.cycle), "not all zones need ever be clean", &result);
    }
  }
  return result;
}

CleaningResult CheckLevels(const CleaningLimits& limits, const CleaningStarts& starts,
                           int start_percent, int below_percent, int horizon, size_t max_states) {
  CleaningWorld world(limits);
  world.Soil(RatesInLevels());
  const auto highest = static_cast<uint8_t>((below_percent - 1) / kLevelPercent);
  CleaningGraph<3> graph(
      &world,
      {.max_level = highest, .horizon = static_cast<uint16_t>(horizon), .max_states = max_states});
  return ResultOf(&graph, graph.Explore(StatesOf(world, starts, start_percent)));
}

std::array<int, kMaxZones> PaperRates() {
  std::array<int, kMaxZones> rates{};
  for (size_t zone = 1; zone <= 12; ++zone) {
    rates[zone - 1] = (zone >= 5 && zone <= 8) || zone == 11 ? 10 : 5;
  }
  return rates;
}

int HighestPercent(int rate_percent, int gap) {
  return rate_percent * (gap / kSoilingStep + 1);
}

std::string TraceText(const CleaningResult& result) {
  static constexpr const char* kWhat[] = {"waits in",
                                          "goes to",
                                          "decides to clean",
                                          "claims",
                                          "is refused",
                                          "has cleaned",
                                          "breaks down in",
                                          "",
                                          "passers-by write in",
                                          "an operator asks for"};
  std::string text;
  for (size_t i = 1; i < result.trace.size(); ++i) {
    const CleaningMoment& moment = result.trace[i];
    if (i == result.repeats_from) {
      text += "for ever:\n";
    }
    text += std::to_string(moment.time) + ": ";
    if (moment.step.action == CleaningAction::kSoils) {
      text += "zones become dirtier\n";
      continue;
    }
    if (moment.step.action < CleaningAction::kCrowds) {
      text += std::string(1, static_cast<char>('A' + moment.step.robot)) + " ";
    }
    text += std::string(kWhat[static_cast<size_t>(moment.step.action)]) + " zone " +
            std::to_string(moment.step.zone + 1) + "\n";
  }
  return text + result.wrong + "\n";
}

}  // namespace pheromone::verify
