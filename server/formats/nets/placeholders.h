// Numbers of a net that its user chooses, and where a file uses them: "{robots}", "{robots - 1}",
// and "{as}" for the name of the instance that the file is read for.
//
//   FillIn("overtaken at most {robots - 1} by a", {{"robots", 4}}, "")
//
// Pure function; any thread.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>

#include "server/base/result.h"

namespace pheromone::nets {

using Parameters = std::map<std::string, int64_t, std::less<>>;

/// Errors say what is in the braces and what was expected there.
Result<std::string> FillIn(std::string_view text, const Parameters& parameters,
                           std::string_view as);

/// "a, b, c"; or, if there are none, "none".
std::string NamesOf(const Parameters& parameters);

}  // namespace pheromone::nets
