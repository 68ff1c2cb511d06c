// The tokens of SVG's attributes: numbers, flags, commas and white space, in path data (SVG 1.1,
// section 8.3.9; SVG 2, section 9.3.9), `points`, `viewBox` and `transform`.
//
//   SvgScanner scanner(text, offset, &sink);  // "1.5.5-3e2" is 1.5, .5 and -300
//   double x = 0;
//   scanner.Number(&x) && scanner.Separator() && ...
//
// Errors are reported to the sink; every reader then returns false. Internal to
// server/formats/maps.
#pragma once

#include <cstddef>
#include <string_view>

#include "server/formats/maps/polyline_sink.h"

namespace pheromone::maps {

class SvgScanner {
 public:
  /// `offset` is the position of `text` in the sink's text. Both outlive the scanner.
  SvgScanner(std::string_view text, size_t offset, PolylineSink* sink)
      : text_(text), offset_(offset), sink_(*sink) {}

  bool AtEnd() const { return at_ == text_.size(); }
  /// The next character; 0 at the end.
  char Peek() const { return AtEnd() ? '\0' : text_[at_]; }
  char Next() { return text_[at_++]; }
  /// The position of the next character in the sink's text.
  size_t offset() const { return offset_ + at_; }

  void SkipSpace();
  /// Skips `c` if it is next.
  bool Skip(char c);
  /// Skips a separator of numbers: white space and at most one comma.
  bool Separator();
  /// Whether a number could begin here.
  bool AtNumber() const;
  /// Behind an argument: whether another one follows, as it must behind a comma. `*more` is only
  /// set if true is returned.
  bool More(bool* more);

  bool Number(double* number);
  /// A single 0 or 1, which need not be separated from what follows.
  bool Flag(double* flag);
  /// The letters that are next.
  std::string_view Word();

  /// Reports that something else was expected here. Always false.
  bool Fail(std::string_view expected);

 private:
  size_t SkipDigits();

  std::string_view text_;
  size_t offset_;
  size_t at_ = 0;
  PolylineSink& sink_;
};

}  // namespace pheromone::maps
