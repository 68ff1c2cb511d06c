// Putting nets together: components share some of their places.
//
//   Result<Net> bench = Compose("bench", {{.net = entrance, .as = "N1", .with = {{"lane",
//   "nest"}}},
//                                         {.net = entrance, .as = "N2", .with = {{"lane",
//                                         "back"}}},
//                                         {.net = lanes}});
//
// What is `wait` in an instance `N1` is `N1.wait` in the whole, and its name begins with "N1: ".
// Two kinds of places are shared, that is, joined with all places that have the same ID in the
// whole:
//
//   - one that the instance binds: `lane` of N1 is `nest`, which another instance has to have;
//   - a pseudo-box (Ferreira et al. 2018, section 4.1) that is not bound: its ID in the whole is
//   its
//     message's name, without a prefix.
//
// A shared place begins with the tokens that one of its parts gives, or several alike. It is a box
// if one of its parts is; name, owner, tag and does are the first ones given. Names in claims
// follow. Pure functions; any thread.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/result.h"
#include "server/core/petri/net.h"

namespace pheromone::petri {

struct Instance {
  Net net;
  std::string as{};                           ///< the prefix; empty: IDs stay as they are
  std::map<std::string, std::string> with{};  ///< a place of `net` -> its ID in the whole
};

/// Errors: what CheckNet says of an instance or of the whole; a binding of or to a place that does
/// not exist; two places of one ID that are not shared; different tokens of a shared place; arcs
/// that would join the same place to the same transition twice.
Result<Net> Compose(std::string name, const std::vector<Instance>& instances);

/// The ID in the whole of a place or transition that is not shared.
std::string PrefixedId(std::string_view as, std::string_view id);

}  // namespace pheromone::petri
