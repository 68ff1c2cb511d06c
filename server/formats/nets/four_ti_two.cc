#include "server/formats/nets/four_ti_two.h"

#include <algorithm>
#include <charconv>
#include <optional>

#include "server/base/message.h"

namespace pheromone::nets {
namespace {

std::string_view NextWord(std::string_view* text) {
  constexpr std::string_view kBlank = " \t\r\n";
  text->remove_prefix(std::min(text->find_first_not_of(kBlank), text->size()));
  const std::string_view word = text->substr(0, text->find_first_of(kBlank));
  text->remove_prefix(word.size());
  return word;
}

template <typename Number>
std::optional<Number> NextNumber(std::string_view* text) {
  const std::string_view word = NextWord(text);
  Number number = 0;
  const auto [at, error] = std::from_chars(word.data(), word.data() + word.size(), number);
  return error == std::errc() && at == word.data() + word.size() ? std::optional(number)
                                                                 : std::nullopt;
}

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

Result<std::vector<std::vector<int64_t>>> ParseFourTiTwo(std::string_view name,
                                                         std::string_view text) {
  const std::string_view all = text;
  const auto fail = [&](const std::string& expected) {
    return AtByte(name, all.size() - text.size(), "expected " + expected);
  };
  const std::optional<uint32_t> rows = NextNumber<uint32_t>(&text);
  const std::optional<uint32_t> columns = rows ? NextNumber<uint32_t>(&text) : std::nullopt;
  if (!columns) {
    return fail("the numbers of rows and columns");
  }
  // Each number has a digit and a blank: a size that cannot be is found before memory is reserved.
  if (uint64_t{*rows} * std::max(1u, *columns) > all.size()) {
    return fail(std::to_string(*rows) + " rows of " + std::to_string(*columns) + " numbers");
  }
  std::vector<std::vector<int64_t>> vectors(*rows, std::vector<int64_t>(*columns));
  for (std::vector<int64_t>& vector : vectors) {
    for (int64_t& number : vector) {
      const std::optional<int64_t> found = NextNumber<int64_t>(&text);
      if (!found) {
        return fail("a number of 64 bits");
      }
      number = *found;
    }
  }
  if (!NextWord(&text).empty()) {
    return fail("no more than " + std::to_string(*rows) + " rows of " + std::to_string(*columns) +
                " numbers");
  }
  return vectors;
}

}  // namespace pheromone::nets
