// Tables on standard output.
#pragma once

#include <string>
#include <vector>

namespace pheromone::ctl {

/// Columns as wide as their widest cell; the first row is the heading, and as long as all others.
/// Newlines in a cell are escaped too: a row is a line.
void PrintTable(std::vector<std::vector<std::string>> rows);

}  // namespace pheromone::ctl
