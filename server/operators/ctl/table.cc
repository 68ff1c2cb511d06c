#include "server/operators/ctl/table.h"

#include <fmt/format.h>

#include <algorithm>

#include "server/base/escape.h"

namespace pheromone::ctl {

void PrintTable(std::vector<std::vector<std::string>> rows) {
  // Here and not only where it is printed: a newline in a name would make a row.
  for (auto& row : rows) {
    for (std::string& cell : row) {
      cell = EscapeControls(cell, "");
    }
  }
  std::vector<size_t> widths(rows.front().size());
  for (const auto& row : rows) {
    for (size_t i = 0; i < row.size(); ++i) {
      widths[i] = std::max(widths[i], row[i].size());
    }
  }
  for (const auto& row : rows) {
    std::string line;
    for (size_t i = 0; i < row.size(); ++i) {
      line += i + 1 < row.size() ? fmt::format("{:<{}}  ", row[i], widths[i]) : row[i];
    }
    fmt::print("{}\n", line.substr(0, line.find_last_not_of(' ') + 1));
  }
}

}  // namespace pheromone::ctl
