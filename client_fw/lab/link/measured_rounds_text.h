// measured_rounds.csv, as it was when the program was built.
#pragma once

#include <string_view>

namespace pheromone::lab {

std::string_view MeasuredRoundsText();

}  // namespace pheromone::lab
