#include "client_fw/verify/cleaning_trace.h"

#include <algorithm>

namespace pheromone::verify {

std::string StepText(const CleaningStep& step) {
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
  if (step.action == CleaningAction::kSoils) {
    return "zones become dirtier";
  }
  std::string text;
  if (step.action < CleaningAction::kCrowds) {
    text += std::string(1, static_cast<char>('A' + step.robot)) + " ";
  }
  return text + kWhat[static_cast<size_t>(step.action)] + " zone " + std::to_string(step.zone + 1);
}

std::vector<std::vector<int>> SoilOn(const std::vector<CleaningMoment>& trace,
                                     const std::vector<int>& rates_percent, int start_percent) {
  std::vector<int> soil(rates_percent.size(), start_percent);
  std::vector<std::vector<int>> all;
  for (const CleaningMoment& moment : trace) {
    if (!all.empty() && moment.step.action == CleaningAction::kFinishes) {
      soil[moment.step.zone] = 0;
    } else if (!all.empty() && moment.step.action == CleaningAction::kSoils) {
      for (size_t zone = 0; zone < soil.size(); ++zone) {
        const auto& cleaners = moment.state.cleaners;
        const bool is_cleaned =
            std::any_of(cleaners.begin(), cleaners.end(),
                        [&](const Cleaner& it) { return it.is_cleaning() && it.zone == zone; });
        soil[zone] =
            is_cleaned ? soil[zone] : std::min(soil[zone] + rates_percent[zone], kFullPercent);
      }
    }
    all.push_back(soil);
  }
  return all;
}

}  // namespace pheromone::verify
