#include "server/base/result.h"

#include <ostream>

namespace pheromone {

void PrintTo(const Error& error, std::ostream* out) {
  *out << '"' << error << '"';
}

}  // namespace pheromone
