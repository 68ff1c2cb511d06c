#include "server/field/rebase.h"

#include <gtest/gtest.h>

namespace pheromone::field {
namespace {}  // namespace
}  // namespace pheromone::field
