// The names of places and transitions in a claim's text, whose grammar is in property.h.
//
//   RenameIn("always wait <= 1", {{"wait", "N1.wait"}})  // "always N1.wait <= 1"
//
// A pure function; any thread.
#pragma once

#include <map>
#include <string>
#include <string_view>

namespace pheromone::petri {

using Renaming = std::map<std::string, std::string, std::less<>>;

/// The text with other names, which are words that are no keywords there, and texts in quotes.
/// Those that `names` does not have stay.
std::string RenameIn(std::string_view text, const Renaming& names);

}  // namespace pheromone::petri
