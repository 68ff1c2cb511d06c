#include "server/formats/maps/csv_polyline.h"

#include <algorithm>
#include <charconv>
#include <optional>

#include "server/base/message.h"
#include "server/base/text.h"
#include "server/formats/maps/polyline_sink.h"

namespace pheromone::maps {
namespace {

constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
constexpr double kMetresToUm = 1e6;

char SeparatorOf(std::string_view row) {
  for (const char separator : {';', '\t'}) {
    if (row.find(separator) != std::string_view::npos) {
      return separator;
    }
  }
  return ',';
}

class CsvReader {
 public:
  explicit CsvReader(PolylineSink* sink) : sink_(*sink) {}

  bool Read() {
    const std::string_view text = sink_.text();
    for (size_t at = text.starts_with(kByteOrderMark) ? kByteOrderMark.size() : 0;
         at < text.size();) {
      const size_t end = std::min(text.find('\n', at), text.size());
      if (!ReadRow(text.substr(at, end - at))) {
        return false;
      }
      at = end + 1;
    }
    sink_.End(/*closed=*/false);
    return true;
  }

 private:
  bool ReadRow(std::string_view row) {
    const std::string_view content = Trim(row.substr(0, row.find('#')));
    if (content.empty()) {
      if (row.find('#') == std::string_view::npos) {
        sink_.End(/*closed=*/false);
      }
      return true;
    }
    const bool first = !separator_;
    if (first) {
      separator_ = SeparatorOf(content);
    }
    const size_t split = content.find(*separator_);
    if (split == std::string_view::npos) {
      return sink_.Fail(OffsetOf(content), Quoted(content), "two columns, x and y in metres");
    }
    const std::string_view left = Trim(content.substr(0, split));
    const std::string_view right = Trim(content.substr(split + 1));
    if (right.find(*separator_) != std::string_view::npos) {
      return sink_.Fail(OffsetOf(right), Quoted(content), "two columns, x and y in metres");
    }
    if (first && ((left == "x" && right == "y") || (left == "x_m" && right == "y_m"))) {
      return true;
    }
    double x_m = 0;
    double y_m = 0;
    return ReadNumber(left, &x_m) && ReadNumber(right, &y_m) &&
           sink_.Add(x_m * kMetresToUm, y_m * kMetresToUm, OffsetOf(left));
  }

  bool ReadNumber(std::string_view column, double* number) {
    // from_chars knows no plus sign; "+-1" is no number.
    const bool plus = column.size() > 1 && column[0] == '+' && column[1] != '-';
    const char* end = column.data() + column.size();
    const auto read = std::from_chars(column.data() + (plus ? 1 : 0), end, *number);
    if (read.ec != std::errc() || read.ptr != end) {
      return sink_.Fail(OffsetOf(column), Quoted(column),
                        "a number of metres with a decimal point, such as -1.25");
    }
    return true;
  }

  size_t OffsetOf(std::string_view part) const {
    return static_cast<size_t>(part.data() - sink_.text().data());
  }

  PolylineSink& sink_;
  std::optional<char> separator_;
};

}  // namespace

Result<std::vector<Polyline>> ParseCsvLines(std::string_view text, std::string_view name) {
  PolylineSink sink(text, name);
  if (!sink.failed()) {
    CsvReader(&sink).Read();
  }
  return std::move(sink).Take();
}

}  // namespace pheromone::maps
