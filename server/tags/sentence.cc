#include "server/tags/sentence.h"

#include <bit>
#include <charconv>
#include <chrono>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

namespace pheromone::tags {
namespace {

constexpr int32_t kSecondsADay = 86'400;
constexpr std::string_view kWordLetters =
    "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_.";

// --- Printing

std::string Digits(int64_t number, size_t width) {
  std::string text = std::to_string(number);
  return text.size() < width ? std::string(width - text.size(), '0') + text : text;
}

std::string DateText(int64_t days) {
  const std::chrono::year_month_day date{std::chrono::sys_days(std::chrono::days(days))};
  const int year = static_cast<int>(date.year());
  return (year < 0 ? "-" : "") + Digits(std::abs(year), 4) + '-' +
         Digits(static_cast<unsigned>(date.month()), 2) + '-' +
         Digits(static_cast<unsigned>(date.day()), 2);
}

std::string ClockText(int64_t seconds) {
  return Digits(seconds / 3600, 2) + ':' + Digits(seconds / 60 % 60, 2) + ':' +
         Digits(seconds % 60, 2);
}

std::string TimeOfDayText(int64_t ms) {
  return ClockText(ms / 1000) + (ms % 1000 != 0 ? '.' + Digits(ms % 1000, 3) : "");
}

// The shortest text that reads back as the same number; never that of a whole number.
std::string FloatText(float number) {
  if (std::isnan(number)) {
    return "NaN";
  }
  if (std::isinf(number)) {
    return number < 0 ? "-INF" : "INF";
  }
  char text[64];
  const auto end = std::to_chars(text, text + sizeof text, number).ptr;
  const std::string_view shortest(text, static_cast<size_t>(end - text));
  const bool is_whole = shortest.find_first_of(".e") == std::string_view::npos;
  return std::string(shortest) + (is_whole ? ".0" : "");
}

void AppendUtf8(uint32_t scalar, std::string* text) {
  const auto put = [&](uint32_t byte) { *text += static_cast<char>(byte); };
  if (scalar < 0x80) {
    put(scalar);
  } else if (scalar < 0x800) {
    put(0xC0 | scalar >> 6);
    put(0x80 | (scalar & 0x3F));
  } else if (scalar < 0x10000) {
    put(0xE0 | scalar >> 12);
    put(0x80 | (scalar >> 6 & 0x3F));
    put(0x80 | (scalar & 0x3F));
  } else {
    put(0xF0 | scalar >> 18);
    put(0x80 | (scalar >> 12 & 0x3F));
    put(0x80 | (scalar >> 6 & 0x3F));
    put(0x80 | (scalar & 0x3F));
  }
}

std::string Quoted(std::string_view text) {
  std::string quoted = "\"";
  for (const char c : text) {
    quoted += c == '"' || c == '\\' ? std::string{'\\', c} : std::string{c};
  }
  return quoted + '"';
}

// Control characters, which no terminal should get, by their numbers.
std::string CharText(int32_t scalar) {
  if (scalar < 0x20 || (scalar >= 0x7F && scalar < 0xA0)) {
    return "char:" + std::to_string(scalar);
  }
  std::string text = "'";
  AppendUtf8(static_cast<uint32_t>(scalar), &text);
  return text + '\'';
}

std::string SymbolText(const Term& term, int32_t author, const SymbolTables& tables) {
  const std::string* const local = tables.StringOf(author, term.value);
  const std::string* const space = term.space > 0 ? tables.StringOf(author, term.space) : nullptr;
  if (local == nullptr || (term.space > 0 && space == nullptr)) {
    return "unknown:" + std::to_string(term.space) + '/' + std::to_string(term.value);
  }
  const bool is_word = space != nullptr && *space == kDefaultNamespace &&
                       local->find_first_not_of(kWordLetters) == std::string::npos &&
                       !(local->front() >= '0' && local->front() <= '9') && local->front() != '-' &&
                       local->front() != '.' && *local != "NaN" && *local != "INF";
  return is_word ? *local : '<' + (space != nullptr ? *space : "") + *local + '>';
}

std::string UnknownText(const Term& term) {
  return "type" + std::to_string(term.space) + ':' + std::to_string(term.value);
}

// --- Parsing

template <typename Number>
std::optional<Number> NumberIn(std::string_view text) {
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size() ? std::optional(number)
                                                                  : std::nullopt;
}

std::optional<int64_t> FixedDigits(std::string_view text, size_t at, size_t width) {
  if (text.size() < at + width ||
      text.substr(at, width).find_first_not_of("0123456789") != std::string_view::npos) {
    return std::nullopt;
  }
  return NumberIn<int64_t>(text.substr(at, width));
}

// YYYY-MM-DD, days since 1970-01-01.
std::optional<int64_t> DaysIn(std::string_view text) {
  const bool is_negative = text.starts_with('-');
  text.remove_prefix(is_negative ? 1 : 0);
  const size_t digits = text.find('-');
  if (digits == std::string_view::npos || digits < 4 || digits > 7 || text.size() != digits + 6 ||
      text[digits + 3] != '-') {
    return std::nullopt;
  }
  const auto year = FixedDigits(text, 0, digits);
  const auto month = FixedDigits(text, digits + 1, 2);
  const auto day = FixedDigits(text, digits + 4, 2);
  if (!year || !month || !day || *year > 32'767) {
    return std::nullopt;
  }
  const std::chrono::year_month_day date(
      std::chrono::year(static_cast<int>(is_negative ? -*year : *year)),
      std::chrono::month(static_cast<unsigned>(*month)),
      std::chrono::day(static_cast<unsigned>(*day)));
  return date.ok() ? std::optional<int64_t>(std::chrono::sys_days(date).time_since_epoch().count())
                   : std::nullopt;
}

// hh:mm:ss or hh:mm:ss.sss, in milliseconds.
std::optional<int64_t> TimeOfDayIn(std::string_view text) {
  const auto hours = FixedDigits(text, 0, 2);
  const auto minutes = FixedDigits(text, 3, 2);
  const auto seconds = FixedDigits(text, 6, 2);
  const bool has_ms = text.size() == 12 && text[8] == '.';
  const auto ms = has_ms ? FixedDigits(text, 9, 3) : std::optional<int64_t>(0);
  if (!hours || !minutes || !seconds || !ms || (text.size() != 8 && !has_ms) || text[2] != ':' ||
      text[5] != ':' || *hours > 23 || *minutes > 59 || *seconds > 59) {
    return std::nullopt;
  }
  return ((*hours * 60 + *minutes) * 60 + *seconds) * 1000 + *ms;
}

std::optional<Term> TimeIn(std::string_view text) {
  const auto of = [](TypeCode code, int64_t value) {
    return Term{static_cast<int32_t>(code), static_cast<int32_t>(value)};
  };
  if (text.size() == 20 && text[10] == 'T' && text.back() == 'Z') {
    const auto days = DaysIn(text.substr(0, 10));
    const auto ms = TimeOfDayIn(text.substr(11, 8));
    const int64_t seconds = days && ms ? *days * kSecondsADay + *ms / 1000 : -1;
    return seconds >= 0 && seconds <= std::numeric_limits<uint32_t>::max()
               ? std::optional(
                     of(TypeCode::kDateTime, static_cast<int32_t>(static_cast<uint32_t>(seconds))))
               : std::nullopt;
  }
  if (const auto days = DaysIn(text)) {
    return of(TypeCode::kDate, *days);
  }
  if (const auto ms = TimeOfDayIn(text)) {
    return of(TypeCode::kTime, *ms);
  }
  return std::nullopt;
}

// The terms of a sentence. Nothing if a quotation mark or an angle bracket is not closed.
std::optional<std::vector<std::string>> Split(std::string_view sentence) {
  std::vector<std::string> terms;
  char closes = '\0';
  bool is_inside = false;
  for (size_t i = 0; i < sentence.size(); ++i) {
    const char c = sentence[i];
    if (closes == '\0' && c == ' ') {
      is_inside = false;
      continue;
    }
    if (!is_inside) {
      terms.emplace_back();
      is_inside = true;
      closes = c == '"' || c == '\'' ? c : c == '<' ? '>' : '\0';
      terms.back() += c;
      continue;
    }
    terms.back() += c;
    if (closes == '"' && c == '\\' && i + 1 < sentence.size()) {
      terms.back() += sentence[++i];
    } else if (c == closes && !(closes == '\'' && terms.back().size() == 2)) {
      closes = '\0';
    }
  }
  return closes == '\0' ? std::optional(terms) : std::nullopt;
}

std::string Unquoted(std::string_view text) {
  std::string plain;
  for (size_t i = 0; i < text.size(); ++i) {
    plain += text[i] == '\\' && i + 1 < text.size() ? text[++i] : text[i];
  }
  return plain;
}

// The one character between apostrophes; nothing if there is another number of them.
std::optional<int32_t> ScalarIn(std::string_view text) {
  if (text.empty() || !IsPlainUtf8(text)) {
    return std::nullopt;
  }
  const auto first = static_cast<unsigned char>(text.front());
  const size_t length = first < 0x80 ? 1 : first < 0xE0 ? 2 : first < 0xF0 ? 3 : 4;
  uint32_t scalar = length == 1 ? first : first & (0xFFu >> (length + 1));
  for (size_t i = 1; i < length; ++i) {
    scalar = scalar << 6 | (static_cast<unsigned char>(text[i]) & 0x3Fu);
  }
  return text.size() == length ? std::optional(static_cast<int32_t>(scalar)) : std::nullopt;
}

class Parser {
 public:
  Parser(int32_t author, SymbolTables* tables)
      : author_(author), owner_(tables->OwnerOf(author)), tables_(tables) {}

  Result<Term> Subject(const std::string& text) {
    if (const auto number = NumberIn<int32_t>(text)) {
      return *number > 0 ? Result<Term>(Term{static_cast<int32_t>(TypeCode::kRobot), *number})
                         : Wrong("subject", text, "a robot's number from 1 on");
    }
    return Thing("subject", text, "a robot's number, robot:ID, tag:NUMBER, a word or <IRI>");
  }

  Result<Term> Predicate(const std::string& text) {
    if (text.starts_with("robot:") || text.starts_with("tag:")) {
      return Wrong("predicate", text, "a word or <IRI>");
    }
    return Thing("predicate", text, "a word or <IRI>");
  }

  Result<Term> Object(const std::string& text) {
    const auto of = [](TypeCode code, int32_t value) {
      return Term{static_cast<int32_t>(code), value};
    };
    if (text.size() >= 2 && text.front() == '"' && text.back() == '"') {
      const Result<int32_t> number =
          NumberOf("object", Unquoted(std::string_view(text).substr(1, text.size() - 2)));
      return number.ok() ? Result<Term>(of(TypeCode::kString, number.value()))
                         : Error{number.error()};
    }
    if (text.size() >= 2 && text.front() == '\'' && text.back() == '\'') {
      const auto scalar = ScalarIn(std::string_view(text).substr(1, text.size() - 2));
      return scalar ? Result<Term>(of(TypeCode::kChar, *scalar))
                    : Wrong("object", text, "one character between apostrophes");
    }
    if (text.starts_with("char:")) {
      const auto scalar = NumberIn<int32_t>(std::string_view(text).substr(5));
      return scalar ? Result<Term>(of(TypeCode::kChar, *scalar))
                    : Wrong("object", text, "char: and the number of a character");
    }
    if (const auto number = NumberIn<int32_t>(text)) {
      return of(TypeCode::kInt, *number);
    }
    if (const auto time = TimeIn(text)) {
      return *time;
    }
    if (const auto number = FloatIn(text)) {
      return of(TypeCode::kFloat, std::bit_cast<int32_t>(*number));
    }
    if (text.starts_with("type-")) {
      const size_t colon = text.find(':');
      const auto code = NumberIn<int32_t>(std::string_view(text).substr(4, colon - 4));
      const auto value = colon != std::string::npos
                             ? NumberIn<int32_t>(std::string_view(text).substr(colon + 1))
                             : std::nullopt;
      if (code && value) {
        return Term{*code, *value};
      }
    }
    return Thing("object", text,
                 "a number, \"text\", 'c', a time, robot:ID, tag:NUMBER, a word or <IRI>");
  }

 private:
  static Result<Term> Wrong(std::string_view term, const std::string& text,
                            std::string_view expected) {
    return Error{"the " + std::string(term) + " is " + text + ", expected " +
                 std::string(expected)};
  }

  // Numbers of more digits than an integer has are no float either.
  static std::optional<float> FloatIn(std::string_view text) {
    if (text == "NaN") {
      return std::numeric_limits<float>::quiet_NaN();
    }
    if (text == "INF" || text == "-INF") {
      return text.front() == '-' ? -std::numeric_limits<float>::infinity()
                                 : std::numeric_limits<float>::infinity();
    }
    const bool is_numeric = text.find_first_not_of("0123456789.eE+-") == std::string_view::npos &&
                            text.find_first_of(".eE") != std::string_view::npos;
    return is_numeric ? NumberIn<float>(text) : std::nullopt;
  }

  Result<Term> Thing(std::string_view term, const std::string& text, std::string_view expected) {
    if (text.starts_with("robot:")) {
      const std::string id = text.substr(6);
      const auto number = NumberIn<int32_t>(id);
      const auto robot = number ? number : tables_->RobotOf(id);
      return robot && *robot > 0
                 ? Result<Term>(Term{static_cast<int32_t>(TypeCode::kRobot), *robot})
                 : Wrong(term, text, "robot: and the number or unique ID of a known robot");
    }
    if (text.starts_with("tag:")) {
      const auto number = NumberIn<uint16_t>(std::string_view(text).substr(4));
      return number && *number > 0
                 ? Result<Term>(Term{static_cast<int32_t>(TypeCode::kTag), *number})
                 : Wrong(term, text, "tag: and the number of a tag");
    }
    if (text.starts_with("unknown:")) {
      const size_t slash = text.find('/');
      const auto space = NumberIn<int32_t>(
          std::string_view(text).substr(8, slash == std::string::npos ? 0 : slash - 8));
      const auto value = slash != std::string::npos
                             ? NumberIn<int32_t>(std::string_view(text).substr(slash + 1))
                             : std::nullopt;
      return space && value && *space >= 0 && *value > 0
                 ? Result<Term>(Term{*space, *value})
                 : Wrong(term, text, "unknown:NAMESPACE/NUMBER");
    }
    if (text.size() > 2 && text.front() == '<' && text.back() == '>') {
      return Iri(term, text.substr(1, text.size() - 2));
    }
    const bool is_word = text.find_first_not_of(kWordLetters) == std::string::npos &&
                         !(text.front() >= '0' && text.front() <= '9') && text.front() != '-' &&
                         text.front() != '.';
    return is_word ? InNamespace(term, std::string(kDefaultNamespace), text)
                   : Wrong(term, text, expected);
  }

  // Split behind the last # or /, so that IRIs of one namespace share its string.
  Result<Term> Iri(std::string_view term, const std::string& iri) {
    const size_t end = iri.find_last_of("#/");
    if (iri.find_first_of(" \"<>{}|\\^`") != std::string::npos ||
        iri.find(':') == std::string::npos) {
      return Wrong(term, '<' + iri + '>', "an absolute IRI");
    }
    if (end == std::string::npos || end + 1 == iri.size()) {
      const Result<int32_t> number = NumberOf(term, iri);
      return number.ok() ? Result<Term>(Term{0, number.value()}) : Error{number.error()};
    }
    return InNamespace(term, iri.substr(0, end + 1), iri.substr(end + 1));
  }

  Result<Term> InNamespace(std::string_view term, const std::string& space,
                           const std::string& local) {
    const Result<int32_t> space_number = NumberOf(term, space);
    if (!space_number.ok()) {
      return Error{space_number.error()};
    }
    const Result<int32_t> number = NumberOf(term, local);
    return number.ok() ? Result<Term>(Term{space_number.value(), number.value()})
                       : Error{number.error()};
  }

  Result<int32_t> NumberOf(std::string_view term, const std::string& text) {
    if (const auto known = tables_->NumberOf(author_, text)) {
      return *known;
    }
    const int32_t number = tables_->FreeNumberOf(owner_);
    switch (tables_->DefineString(owner_, number, text)) {
      case DefineOutcome::kDone:
        return number;
      case DefineOutcome::kBadValue:
        return Error{"the " + std::string(term) + " has a text of " + std::to_string(text.size()) +
                     " bytes, expected 1 to " + std::to_string(SymbolTables::kMaxTextBytes) +
                     " of UTF-8 without control characters"};
      default:
        return Error{"the symbol tables have no room for \"" + text + "\""};
    }
  }

  int32_t author_;
  int32_t owner_;
  SymbolTables* tables_;
};

}  // namespace

std::string ObjectText(const Term& object, int32_t author, const SymbolTables& tables) {
  if (object.is_symbol()) {
    return SymbolText(object, author, tables);
  }
  switch (static_cast<TypeCode>(object.space)) {
    case TypeCode::kString: {
      const std::string* const text = tables.StringOf(author, object.value);
      return text != nullptr ? Quoted(*text) : UnknownText(object);
    }
    case TypeCode::kChar:
      return CharText(object.value);
    case TypeCode::kInt:
      return std::to_string(object.value);
    case TypeCode::kFloat:
      return FloatText(std::bit_cast<float>(object.value));
    case TypeCode::kDateTime: {
      const auto seconds = static_cast<uint32_t>(object.value);
      return DateText(seconds / kSecondsADay) + 'T' + ClockText(seconds % kSecondsADay) + 'Z';
    }
    case TypeCode::kDate:
      // Beyond the calendar of <chrono>, as the number of days.
      return std::abs(int64_t{object.value}) < 11'000'000 ? DateText(object.value)
                                                          : UnknownText(object);
    case TypeCode::kTime:
      return TimeOfDayText(object.value);
    case TypeCode::kRobot:
      return "robot:" + std::to_string(object.value);
    case TypeCode::kTag:
      return "tag:" + std::to_string(object.value);
  }
  return UnknownText(object);
}

std::string SubjectText(const Term& subject, int32_t author, const SymbolTables& tables) {
  return subject.is(TypeCode::kRobot) ? std::to_string(subject.value)
                                      : ObjectText(subject, author, tables);
}

std::string SentenceOf(const Block& block, const SymbolTables& tables) {
  return SubjectText(block.subject, block.author, tables) + ' ' +
         ObjectText(block.predicate, block.author, tables) + ' ' +
         ObjectText(block.object, block.author, tables);
}

Result<Block> ParseSentence(std::string_view sentence, int32_t author, SymbolTables* tables) {
  const auto terms = Split(sentence);
  if (!terms) {
    return Error{"a quotation mark or angle bracket is not closed"};
  }
  if (terms->size() != 3) {
    return Error{"found " + std::to_string(terms->size()) +
                 " terms, expected subject, predicate and object"};
  }
  Parser parser(author, tables);
  const Result<Term> subject = parser.Subject((*terms)[0]);
  if (!subject.ok()) {
    return Error{subject.error()};
  }
  const Result<Term> predicate = parser.Predicate((*terms)[1]);
  if (!predicate.ok()) {
    return Error{predicate.error()};
  }
  const Result<Term> object = parser.Object((*terms)[2]);
  if (!object.ok()) {
    return Error{object.error()};
  }
  const Block block{author, 0, subject.value(), predicate.value(), object.value()};
  const Status good = CheckBlock(block);
  return good.ok() ? Result<Block>(block) : Error{good.error()};
}

}  // namespace pheromone::tags
