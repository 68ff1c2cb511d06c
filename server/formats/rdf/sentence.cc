#include "server/formats/rdf/sentence.h"

#include <optional>
#include <vector>

#include "server/formats/rdf/fact.h"
#include "server/formats/rdf/lexical.h"

namespace pheromone::tags {
namespace {

constexpr std::string_view kWordLetters =
    "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_.";
constexpr int32_t kMaxTagNumber = 65'535;

// --- Printing

// Never the text of a whole number.
std::string NumberText(int32_t bits) {
  const std::string shortest = FloatText(bits);
  const bool is_whole = shortest.find_first_not_of("0123456789-") == std::string::npos;
  return shortest + (is_whole ? ".0" : "");
}

std::string Quoted(std::string_view text) {
  std::string quoted = "\"";
  for (const char c : text) {
    quoted += c == '"' || c == '\\' ? std::string{'\\', c} : std::string{c};
  }
  return quoted + '"';
}

bool IsWord(std::string_view text) {
  return !text.empty() && text.find_first_not_of(kWordLetters) == std::string_view::npos &&
         !IsDigit(text.front()) && text.front() != '-' && text.front() != '.';
}

std::string SymbolText(const Term& term, int32_t author, const SymbolTables& tables) {
  const std::string* const local = tables.StringOf(author, term.value);
  const std::string* const space = term.space > 0 ? tables.StringOf(author, term.space) : nullptr;
  if (local == nullptr || (term.space > 0 && space == nullptr)) {
    return "unknown:" + std::to_string(term.space) + '/' + std::to_string(term.value);
  }
  return IriText((space != nullptr ? *space : "") + *local);
}

std::string UnknownText(const Term& term) {
  return "type" + std::to_string(term.space) + ':' + std::to_string(term.value);
}

// --- Parsing

// Without a plus sign: "+7" may be a unique ID.
std::optional<int32_t> NumberIn(std::string_view text) {
  return text.starts_with('+') ? std::nullopt : ParseInt(text);
}

std::optional<Term> TimeIn(std::string_view text) {
  const auto of = [](TypeCode code, int32_t value) {
    return Term{static_cast<int32_t>(code), value};
  };
  if (const auto seconds = ParseDateTime(text)) {
    return of(TypeCode::kDateTime, static_cast<int32_t>(*seconds));
  }
  if (const auto days = ParseDate(text)) {
    return of(TypeCode::kDate, *days);
  }
  if (const auto ms = ParseTime(text)) {
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

class Parser {
 public:
  Parser(int32_t author, SymbolTables* tables)
      : author_(author), owner_(tables->OwnerOf(author)), tables_(tables) {}

  Result<Term> Subject(const std::string& text) {
    if (const auto number = NumberIn(text)) {
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
      return number.ok() ? Result<Term>(of(TypeCode::kString, number.value())) : number.error();
    }
    if (text.size() >= 2 && text.front() == '\'' && text.back() == '\'') {
      const auto scalar = ParseChar(std::string_view(text).substr(1, text.size() - 2));
      return scalar ? Result<Term>(of(TypeCode::kChar, *scalar))
                    : Wrong("object", text, "one character between apostrophes");
    }
    if (const auto number = NumberIn(text)) {
      return of(TypeCode::kInt, *number);
    }
    if (const auto time = TimeIn(text)) {
      return *time;
    }
    if (const auto number = FloatIn(text)) {
      return of(TypeCode::kFloat, *number);
    }
    if (text.starts_with("type-")) {
      const size_t colon = text.find(':');
      const auto code = NumberIn(std::string_view(text).substr(4, colon - 4));
      const auto value = colon != std::string::npos
                             ? NumberIn(std::string_view(text).substr(colon + 1))
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
  static std::optional<int32_t> FloatIn(std::string_view text) {
    const bool is_whole = text.find_first_not_of("0123456789+-") == std::string_view::npos;
    return is_whole ? std::nullopt : ParseFloat(text);
  }

  Result<Term> Thing(std::string_view term, const std::string& text, std::string_view expected) {
    if (text.starts_with("robot:")) {
      const std::string id = text.substr(6);
      const auto number = NumberIn(id);
      const auto robot = number ? number : tables_->RobotOf(id);
      return robot && *robot > 0
                 ? Result<Term>(Term{static_cast<int32_t>(TypeCode::kRobot), *robot})
                 : Wrong(term, text, "robot: and the number or unique ID of a known robot");
    }
    if (text.starts_with("tag:")) {
      const auto number = NumberIn(std::string_view(text).substr(4));
      return number && *number > 0 && *number <= kMaxTagNumber
                 ? Result<Term>(Term{static_cast<int32_t>(TypeCode::kTag), *number})
                 : Wrong(term, text, "tag: and the number of a tag");
    }
    if (text.starts_with("unknown:")) {
      const size_t slash = text.find('/');
      const auto space =
          NumberIn(std::string_view(text).substr(8, slash == std::string::npos ? 0 : slash - 8));
      const auto value = slash != std::string::npos
                             ? NumberIn(std::string_view(text).substr(slash + 1))
                             : std::nullopt;
      return space && value && *space >= 0 && *value > 0
                 ? Result<Term>(Term{*space, *value})
                 : Wrong(term, text, "unknown:NAMESPACE/NUMBER");
    }
    if (text.size() > 2 && text.front() == '<' && text.back() == '>') {
      return Iri(term, text.substr(1, text.size() - 2));
    }
    return IsWord(text) ? Iri(term, std::string(kDefaultNamespace) + text)
                        : Wrong(term, text, expected);
  }

  Result<Term> Iri(std::string_view term, const std::string& iri) {
    const size_t end = iri.find_last_of("#/");
    if (iri.find_first_of(" \"<>{}|\\^`") != std::string::npos ||
        iri.find(':') == std::string::npos) {
      return Wrong(term, '<' + iri + '>', "an absolute IRI");
    }
    if (const std::optional<Term> known = KnownSymbol(iri, author_, *tables_)) {
      return *known;
    }
    if (end == std::string::npos || end + 1 == iri.size()) {
      const Result<int32_t> number = NumberOf(term, iri);
      return number.ok() ? Result<Term>(Term{0, number.value()}) : number.error();
    }
    // Split behind the last # or /, so that IRIs of one namespace share its string.
    PHEROMONE_TRY(const int32_t space, NumberOf(term, iri.substr(0, end + 1)));
    const Result<int32_t> number = NumberOf(term, iri.substr(end + 1));
    return number.ok() ? Result<Term>(Term{space, number.value()}) : number.error();
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

std::string IriText(std::string_view iri) {
  if (iri.starts_with(kDefaultNamespace)) {
    const std::string_view local = iri.substr(kDefaultNamespace.size());
    if (IsWord(local) && local != "NaN" && local != "INF") {
      return std::string(local);
    }
  }
  return '<' + std::string(iri) + '>';
}

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
      return '\'' + CharText(object.value) + '\'';
    case TypeCode::kInt:
      return std::to_string(object.value);
    case TypeCode::kFloat:
      return NumberText(object.value);
    case TypeCode::kDateTime:
      return DateTimeText(static_cast<uint32_t>(object.value));
    case TypeCode::kDate:
      return DateText(object.value);
    case TypeCode::kTime:
      return TimeText(object.value);
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
  PHEROMONE_TRY(const Term subject, parser.Subject((*terms)[0]));
  PHEROMONE_TRY(const Term predicate, parser.Predicate((*terms)[1]));
  PHEROMONE_TRY(const Term object, parser.Object((*terms)[2]));
  const Block block{author, 0, subject, predicate, object};
  const Status good = CheckBlock(block);
  return good.ok() ? Result<Block>(block) : good.error();
}

}  // namespace pheromone::tags
