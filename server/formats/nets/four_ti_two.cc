#include "server/formats/nets/four_ti_two.h"

namespace pheromone::nets {
namespace {

// A row of as many equal words.
std::string Row(size_t size, const char* word) {
  std::string row = "1 " + std::to_string(size) + "\n";
  for (size_t i = 0; i < size; ++i) {
    row += word;
  }
  return row + "\n";
}

}  // namespace

FourTiTwoProject ToFourTiTwo(const petri::Net& net, SemiflowsOf semiflows) {
  petri::IncidenceMatrix matrix = IncidenceOf(net);
  if (semiflows == SemiflowsOf::kTransitions) {
    matrix.transposeInPlace();
  }
  const auto rows = static_cast<size_t>(matrix.rows());
  const auto columns = static_cast<size_t>(matrix.cols());
  std::string mat = std::to_string(rows) + " " + std::to_string(columns) + "\n";
  for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
    for (Eigen::Index column = 0; column < matrix.cols(); ++column) {
      mat += std::to_string(matrix(row, column)) + " ";
    }
    mat += "\n";
  }
  return {.mat = mat, .sign = Row(columns, "1 "), .rel = Row(rows, "= ")};
}

}  // namespace pheromone::nets
