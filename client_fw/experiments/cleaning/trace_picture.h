// A refuted proof as a picture: the floor, and over time the soil of each zone, who is there and
// who cleans, up to the moment at which it is wrong; or the part that repeats for ever.
//
//   WriteFiles(folder, {{"cleaning-trace-bounded.svg", DrawTrace(floor, answer)}});
//
// Pure; any thread.
#pragma once

#include <string>

#include "client_fw/experiments/cleaning/floor.h"
#include "client_fw/experiments/cleaning/proof.h"

namespace pheromone::swarm {

/// A complete SVG document. The answer has a trace.
std::string DrawTrace(const CleaningFloor& floor, const ProofAnswer& answer);

}  // namespace pheromone::swarm
