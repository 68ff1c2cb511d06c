// What dialects of PNML say of a transition that a P/T net does not have, but that decides what can
// happen: a guard, time, priority. Rates and what else is for simulation only are left out.
#pragma once

#include <string>

#include <pugixml.hpp>

namespace pheromone::nets {

/// The condition under which it fires, of data or colours: "guard" or "condition" of ProM, CPN
/// Tools and others. Empty if there is none, or if it is true.
std::string GuardOf(const pugi::xml_node& transition);

/// Its interval or delay, as TINA, Romeo, Oris and others have it. Empty if there is none, or if it
/// leaves open when the transition fires.
std::string TimeOf(const pugi::xml_node& transition);

/// What decides between enabled transitions: its priority, and whether it is immediate or timed, as
/// PIPE and GreatSPN have it, where immediate ones go first. Empty if it has neither. All
/// transitions of a net that have the same are without priorities.
std::string PriorityOf(const pugi::xml_node& transition);

}  // namespace pheromone::nets
