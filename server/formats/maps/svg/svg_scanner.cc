#include "server/formats/maps/svg/svg_scanner.h"

#include <charconv>
#include <system_error>

#include "server/base/message.h"

namespace pheromone::maps {
namespace {

bool IsDigit(char c) {
  return c >= '0' && c <= '9';
}

bool IsLetter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}

bool IsSpace(char c) {
  return c == ' ' || c == '\t' || c == '\n' || c == '\r' || c == '\f';
}

}  // namespace

void SvgScanner::SkipSpace() {
  while (IsSpace(Peek())) {
    ++at_;
  }
}

bool SvgScanner::Skip(char c) {
  if (AtEnd() || text_[at_] != c) {
    return false;
  }
  ++at_;
  return true;
}

bool SvgScanner::Separator() {
  SkipSpace();
  if (Skip(',')) {
    SkipSpace();
  }
  return true;
}

bool SvgScanner::AtNumber() const {
  const char c = Peek();
  return IsDigit(c) || c == '+' || c == '-' || c == '.';
}

bool SvgScanner::More(bool* more) {
  SkipSpace();
  if (Skip(',')) {
    SkipSpace();
    if (!AtNumber()) {
      return Fail("a number after the comma");
    }
  }
  *more = AtNumber();
  return true;
}

size_t SvgScanner::SkipDigits() {
  const size_t begin = at_;
  while (IsDigit(Peek())) {
    ++at_;
  }
  return at_ - begin;
}

bool SvgScanner::Number(double* number) {
  const size_t begin = at_;
  if (!Skip('-')) {
    Skip('+');
  }
  size_t digits = SkipDigits();
  if (Skip('.')) {
    digits += SkipDigits();
  }
  if (digits == 0) {
    return Fail("a number");
  }
  // An e without digits is not an exponent, but part of the following text, such as a unit.
  const size_t mantissa_end = at_;
  if (Skip('e') || Skip('E')) {
    if (!Skip('-')) {
      Skip('+');
    }
    if (SkipDigits() == 0) {
      at_ = mantissa_end;
    }
  }
  const size_t first = begin + (text_[begin] == '+' ? 1 : 0);  // from_chars knows no plus sign
  if (std::from_chars(text_.data() + first, text_.data() + at_, *number).ec != std::errc()) {
    return sink_.Fail(offset_ + begin, Quoted(text_.substr(begin, at_ - begin)),
                      "a number from 1e-307 to 1e308");
  }
  return true;
}

bool SvgScanner::Flag(double* flag) {
  if (Peek() != '0' && Peek() != '1') {
    return Fail("a flag, 0 or 1");
  }
  *flag = Next() - '0';
  return true;
}

std::string_view SvgScanner::Word() {
  const size_t begin = at_;
  while (IsLetter(Peek())) {
    ++at_;
  }
  return text_.substr(begin, at_ - begin);
}

bool SvgScanner::Fail(std::string_view expected) {
  return sink_.Fail(offset(), AtEnd() ? "the end of the attribute" : Quoted(text_.substr(at_, 1)),
                    expected);
}

}  // namespace pheromone::maps
