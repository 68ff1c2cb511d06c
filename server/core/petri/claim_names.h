// The names of places and transitions in a claim's text, whose grammar is in property.h.
//
//   ForEachName("always N1.wait <= 1", [](std::string_view name) { ... });
//   RenameIn("always wait <= 1", {{"wait", "N1.wait"}})  // "always N1.wait <= 1"
//
// Pure functions; any thread.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <string_view>

namespace pheromone::petri {

using Renaming = std::map<std::string, std::string, std::less<>>;

/// Calls `use` with each name: words that are no keywords there, and texts in quotes.
void ForEachName(std::string_view text, const std::function<void(std::string_view)>& use);

/// The text with other names; words that `names` does not have stay.
std::string RenameIn(std::string_view text, const Renaming& names);

}  // namespace pheromone::petri
