// What a net's file has itself: its parameters, places, transitions and claims. The format is in
// system_file.h.
#pragma once

#include <vector>

#include "server/core/petri/net.h"
#include "server/formats/nets/keys.h"

namespace pheromone::nets {

struct OwnPart {
  petri::Net net;
  /// Places that arcs name, but the file does not have: the last ones of `net`, in this order.
  std::vector<Located> foreign{};
};

/// The values of [parameters]; `chosen` ones instead of the file's.
Parameters ReadParameters(const Keys& file, const Parameters& chosen);

OwnPart ReadOwnPart(const Keys& file);

}  // namespace pheromone::nets
