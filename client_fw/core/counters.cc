#include "client_fw/core/counters.h"

namespace pheromone {
namespace client {

void Count(uint32_t* counter) {
  ++*counter;
}

}  // namespace client
}  // namespace pheromone
