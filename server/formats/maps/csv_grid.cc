#include "server/formats/maps/csv_grid.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <functional>

#include "server/base/file.h"
#include "server/base/format.h"
#include "server/base/message.h"
#include "server/base/text.h"

namespace pheromone::maps {

namespace {

// One non-empty line, without its line break.
struct TextLine {
  std::string_view text;
  size_t number = 1;
};

// Calls `visit` for each non-empty line until one fails.
Status ForEachLine(std::string_view bytes, const std::function<Status(const TextLine&)>& visit) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (bytes.substr(0, kByteOrderMark.size()) == kByteOrderMark) {
    bytes.remove_prefix(kByteOrderMark.size());
  }
  for (size_t number = 1; !bytes.empty(); ++number) {
    const size_t end = std::min(bytes.find('\n'), bytes.size());
    const TextLine line{bytes.substr(0, end), number};
    bytes.remove_prefix(std::min(end + 1, bytes.size()));
    const std::string_view text = Trim(line.text);
    if (text.empty() || text.front() == '#') {
      continue;
    }
    PHEROMONE_TRY_STATUS(visit(line));
  }
  return Ok();
}

// Appends the numbers of a line, at most `limit`.
Status ReadNumbers(const TextLine& line, std::string_view name, size_t limit,
                   std::vector<double>* values) {
  size_t count = 0;
  for (size_t at = 0; at <= line.text.size(); ++count) {
    const size_t comma = std::min(line.text.find(',', at), line.text.size());
    const std::string_view word = Trim(line.text.substr(at, comma - at));
    double value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size() || std::isinf(value)) {
      return AtLine(name, line.number, at + 1, "found " + Quoted(word) + ", expected a number");
    }
    if (count == limit) {
      return AtLine(name, line.number, at + 1,
                    "found more numbers, expected " + std::to_string(limit) + " on this line");
    }
    values->push_back(value);
    at = comma + 1;
  }
  return Ok();
}

// to_chars would keep a nan's sign, which means nothing.
std::string NumberText(double value) {
  return std::isnan(value) ? "nan" : ShortestText(value);
}

}  // namespace

Result<Raster> ParseCsvGrid(std::string_view bytes, std::string_view name) {
  std::vector<double> top_down;
  size_t columns = 0;
  size_t rows = 0;
  const Status read = ForEachLine(bytes, [&](const TextLine& line) -> Status {
    const size_t before = top_down.size();
    const size_t limit = rows == 0 ? static_cast<size_t>(kMaxSide) : columns;
    Status numbers = ReadNumbers(line, name, limit, &top_down);
    if (!numbers.ok()) {
      return numbers;
    }
    const size_t found = top_down.size() - before;
    columns = rows == 0 ? found : columns;
    ++rows;
    if (found != columns) {
      return AtLine(name, line.number, 0,
                    "found " + std::to_string(found) + " numbers, expected " +
                        std::to_string(columns) + " as in the first row");
    }
    const std::string problem = SizeProblem(columns, rows);
    return problem.empty() ? Ok() : AtLine(name, line.number, 0, problem);
  });
  if (!read.ok()) {
    return read.error();
  }
  if (rows == 0) {
    return AtLine(name, 1, 0, "found nothing, expected rows of numbers");
  }
  Raster raster;
  raster.columns = static_cast<int32_t>(columns);
  raster.rows = static_cast<int32_t>(rows);
  raster.values = std::move(top_down);
  for (int32_t row = 0; row < raster.rows / 2; ++row) {
    double* const lower = &raster.At(0, row);
    std::swap_ranges(lower, lower + columns, &raster.At(0, raster.rows - 1 - row));
  }
  return raster;
}

Result<Raster> LoadCsvGrid(const std::string& path) {
  const Result<std::string> bytes = ReadFile(path);
  return bytes.ok() ? ParseCsvGrid(bytes.value(), path) : bytes.error();
}

std::string EncodeCsvGrid(const Raster& raster) {
  std::string text;
  for (int32_t row = raster.rows - 1; row >= 0; --row) {
    for (int32_t column = 0; column < raster.columns; ++column) {
      text += NumberText(raster.At(column, row));
      text += column + 1 < raster.columns ? ',' : '\n';
    }
  }
  return text;
}

Status SaveCsvGrid(const std::string& path, const Raster& raster) {
  return WriteFile(path, EncodeCsvGrid(raster));
}

}  // namespace pheromone::maps
