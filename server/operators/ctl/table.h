// Tables on standard output.
#pragma once

#include <string>
#include <vector>

namespace pheromone::ctl {

/// Columns as wide as their widest cell; the first row is the heading, and as long as all others.
void PrintTable(const std::vector<std::vector<std::string>>& rows);

}  // namespace pheromone::ctl
