// pheromone-experiments cleaning --prove: what a floor's robots do for all time, by a search
// through all states that they can come to.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace pheromone::swarm {

constexpr int kNotDecided = 3;  ///< exit status: the memory was not enough for a verdict

struct ProveOptions {
  std::string file;                  ///< of the floor
  std::vector<std::string> queries;  ///< by their names; empty: all
  size_t memory_mib = 2048;
  std::string out;  ///< folder; empty: none
};

/// Prints each verdict and the trace of what is refuted, and tells on stderr how far the search is.
/// Returns the exit status: 0 if all is proved, kFailed if something is refuted, kNotDecided if
/// the memory is used up before, kWrongInput.
int Prove(const ProveOptions& options);

}  // namespace pheromone::swarm
