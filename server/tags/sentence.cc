#include "server/tags/sentence.h"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "server/tags/lexical.h"

namespace pheromone::tags {
namespace {

constexpr std::string_view kRobot = "robot:";
constexpr std::string_view kTag = "tag:";

bool IsNumberOfThing(std::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), IsDigit);
}

// Whether it begins as numbers and times do.
bool IsNumeric(std::string_view token) {
  return IsDigit(token.front()) ||
         (token.size() > 1 &&
          (token.front() == '-' || token.front() == '+' || token.front() == '.'));
}

bool IsNamedFloat(std::string_view token) {
  return token == "NaN" || token == "INF" || token == "-INF" || token == "+INF";
}

bool IsWord(std::string_view token) {
  const auto is_letter = [](char c) {
    return IsLetter(c) || c == '_' || (static_cast<unsigned char>(c) & 0x80u) != 0;
  };
  return is_letter(token.front()) && std::all_of(token.begin(), token.end(), [&](char c) {
           return is_letter(c) || IsDigit(c) || c == '-';
         });
}

std::string Quoted(std::string_view text, char quote) {
  std::string quoted(1, quote);
  for (const char c : text) {
    if (c == quote || c == '\\') {
      quoted += '\\';
    }
    quoted += c;
  }
  return quoted + quote;
}

// --- Blocks to sentences

std::string Show(const Term& term, bool is_object, int32_t author, const SymbolTables& tables,
                 const Naming& naming) {
  if (!IsKnownType(term)) {
    return "(" + std::to_string(term.space) + ", " + std::to_string(term.value) + ")";
  }
  if (term.is(TypeCode::kRobot) && tables.HasRobot(term.value)) {
    return std::string(kRobot) + std::to_string(term.value);
  }
  if (term.is(TypeCode::kTag)) {
    return std::string(kTag) + std::to_string(term.value);
  }
  if (term.is(TypeCode::kString)) {
    if (const std::string* const text = tables.StringOf(author, term.value)) {
      return Quoted(*text, '"');
    }
  }
  if (term.is(TypeCode::kChar)) {
    return Quoted(CharText(term.value), '\'');
  }
  if (term.is(TypeCode::kTime)) {
    return TimeText(term.value);
  }
  const Node node = NodeOf(term, author, tables, naming);
  if (term.is(TypeCode::kFloat) && IsNumeric(node.text) &&
      node.text.find_first_of(".eI") == std::string::npos) {
    return node.text + ".0";
  }
  if (node.is_literal()) {
    return node.text;
  }
  if (node.text.starts_with(naming.default_namespace)) {
    const std::string word = node.text.substr(naming.default_namespace.size());
    if (!word.empty() && IsWord(word) && !(is_object && IsNamedFloat(word))) {
      return word;
    }
  }
  return "<" + node.text + ">";
}

// --- Sentences to blocks

// One term as it is written. Of quoted ones, `text` is what the quotation marks enclose.
struct Token {
  char quote = 0;  // ", ' or <; 0: none
  std::string text;
};

Result<Token> TakeQuoted(std::string_view* text) {
  const char quote = text->front();
  const char end = quote == '<' ? '>' : quote;
  Token token{quote, {}};
  for (size_t i = 1; i < text->size(); ++i) {
    char c = (*text)[i];
    if (c == end) {
      const std::string_view rest = text->substr(i + 1);
      if (!rest.empty() && rest.front() != ' ' && rest.front() != '\t') {
        return Error{"found " + Quote(rest) + " after " + std::string(text->substr(0, i + 1)) +
                     ", expected a space"};
      }
      *text = rest;
      return token;
    }
    if (c == '\\' && quote != '<') {
      if (i + 1 == text->size()) {
        break;
      }
      c = (*text)[++i];
      if (c != quote && c != '\\') {
        return Error{"found \\" + std::string(1, c) + " in " + std::string(*text) +
                     ", expected \\" + std::string(1, quote) + " or \\\\"};
      }
    }
    token.text += c;
  }
  return Error{"found " + std::string(*text) + ", expected " + std::string(1, end) + " at its end"};
}

Result<std::vector<Token>> TokensOf(std::string_view text) {
  constexpr std::string_view kSpaces = " \t";
  std::vector<Token> tokens;
  for (;;) {
    text.remove_prefix(std::min(text.find_first_not_of(kSpaces), text.size()));
    if (text.empty()) {
      return tokens;
    }
    if (text.front() == '"' || text.front() == '\'' || text.front() == '<') {
      Result<Token> token = TakeQuoted(&text);
      if (!token.ok()) {
        return Error{token.error()};
      }
      tokens.push_back(std::move(token).value());
      continue;
    }
    const size_t end = std::min(text.find_first_of(kSpaces), text.size());
    tokens.push_back({0, std::string(text.substr(0, end))});
    text.remove_prefix(end);
  }
}

class Reader {
 public:
  Reader(int32_t author, const Naming& naming, SymbolTables* tables)
      : author_(author), naming_(naming), tables_(*tables) {}

  Result<Term> Subject(const Token& token);
  Result<Term> Predicate(const Token& token);
  Result<Term> Object(const Token& token);

 private:
  static Error Expected(std::string_view role, const Token& token, std::string_view expected);
  Result<Term> Symbol(std::string_view role, const std::string& iri) {
    return TermOf({iri, {}}, role, author_, naming_, &tables_);
  }
  Result<Term> Literal(const std::string& text, std::string_view datatype) {
    return TermOf({text, std::string(datatype)}, "object", author_, naming_, &tables_);
  }
  static std::string Xsd(std::string_view name) { return std::string(kXsd).append(name); }
  Result<Term> Robot(std::string_view role, const Token& token, std::string_view name) const;
  Result<Term> Tag(std::string_view role, const Token& token, std::string_view name) const;
  // A robot, a tag, a word or an IRI; empty if it is none of these.
  std::optional<Result<Term>> Thing(std::string_view role, const Token& token);
  Result<Term> Number(const std::string& text);

  int32_t author_;
  const Naming& naming_;
  SymbolTables& tables_;
};

Error Reader::Expected(std::string_view role, const Token& token, std::string_view expected) {
  const std::string found = token.quote == 0     ? token.text
                            : token.quote == '<' ? "<" + token.text + ">"
                                                 : Quoted(token.text, token.quote);
  return {"the " + std::string(role) + " is " + found + ", expected " + std::string(expected)};
}

Result<Term> Reader::Robot(std::string_view role, const Token& token, std::string_view name) const {
  std::optional<int32_t> robot = IsNumberOfThing(name) ? ParseInt(name) : tables_.RobotOf(name);
  if (!robot || !tables_.HasRobot(*robot)) {
    return Expected(role, token, "the number or unique ID of a robot in the table");
  }
  return Term{static_cast<int32_t>(TypeCode::kRobot), *robot};
}

Result<Term> Reader::Tag(std::string_view role, const Token& token, std::string_view name) const {
  const std::optional<int32_t> tag =
      IsNumberOfThing(name) ? ParseInt(name) : naming_.tags.NumberOf(name);
  if (!tag || *tag < 1) {
    return Expected(role, token, "the number or name of a tag");
  }
  return Term{static_cast<int32_t>(TypeCode::kTag), *tag};
}

std::optional<Result<Term>> Reader::Thing(std::string_view role, const Token& token) {
  const std::string_view text = token.text;
  if (token.quote == '<') {
    return Symbol(role, token.text);
  }
  if (token.quote != 0) {
    return std::nullopt;
  }
  if (text.starts_with(kRobot)) {
    return Robot(role, token, text.substr(kRobot.size()));
  }
  if (text.starts_with(kTag)) {
    return Tag(role, token, text.substr(kTag.size()));
  }
  if (IsWord(text)) {
    return Symbol(role, naming_.default_namespace + token.text);
  }
  return std::nullopt;
}

Result<Term> Reader::Subject(const Token& token) {
  if (std::optional<Result<Term>> thing = Thing("subject", token)) {
    return *thing;
  }
  return token.quote == 0 && IsNumberOfThing(token.text)
             ? Robot("subject", token, token.text)
             : Expected("subject", token, "a robot's number, robot:ID, tag:NAME, a word or <IRI>");
}

Result<Term> Reader::Predicate(const Token& token) {
  const bool is_thing = token.text.starts_with(kRobot) || token.text.starts_with(kTag);
  if (token.quote == '<' || !is_thing) {
    if (std::optional<Result<Term>> thing = Thing("predicate", token)) {
      return *thing;
    }
  }
  return Expected("predicate", token, "a word or <IRI>");
}

Result<Term> Reader::Number(const std::string& text) {
  const auto has = [&](char c) { return text.find(c) != std::string::npos; };
  if (has('T')) {
    return Literal(text, Xsd("dateTime"));
  }
  if (has(':')) {
    return Literal(text.ends_with('Z') ? text : text + "Z", Xsd("time"));
  }
  const size_t hyphen = text.find('-', 1);
  if (hyphen != std::string::npos && text[hyphen - 1] != 'e' && text[hyphen - 1] != 'E') {
    return Literal(text, Xsd("date"));
  }
  return Literal(text, has('.') || has('e') || has('E') ? Xsd("float") : Xsd("int"));
}

Result<Term> Reader::Object(const Token& token) {
  if (token.quote == '"') {
    return Literal(token.text, Xsd("string"));
  }
  if (token.quote == '\'') {
    return Literal(token.text, std::string(kRob).append("char"));
  }
  if (token.quote == 0 && IsNamedFloat(token.text)) {
    return Literal(token.text, Xsd("float"));
  }
  if (token.quote == 0 && IsNumeric(token.text)) {
    return Number(token.text);
  }
  if (std::optional<Result<Term>> thing = Thing("object", token)) {
    return *thing;
  }
  return Expected("object", token,
                  "a number, a date or time, \"text\", 'c', robot:ID, tag:NAME, a word or <IRI>");
}

Result<Block> Parse(std::string_view text, int32_t author, const Naming& naming,
                    SymbolTables* tables) {
  const Result<std::vector<Token>> tokens = TokensOf(text);
  if (!tokens.ok()) {
    return Error{tokens.error()};
  }
  const std::vector<Token>& terms = tokens.value();
  if (terms.size() != 3) {
    return Error{"found " + std::to_string(terms.size()) +
                 (terms.size() == 1 ? " term" : " terms") +
                 ", expected three: a subject, a predicate and an object (text with spaces in "
                 "quotation marks)"};
  }
  Reader reader(author, naming, tables);
  const std::array<Result<Term>, 3> found = {reader.Subject(terms[0]), reader.Predicate(terms[1]),
                                             reader.Object(terms[2])};
  for (const Result<Term>& term : found) {
    if (!term.ok()) {
      return Error{term.error()};
    }
  }
  const Block block{.author = author,
                    .subject = found[0].value(),
                    .predicate = found[1].value(),
                    .object = found[2].value()};
  const Status good = CheckBlock(block);
  return good.ok() ? Result<Block>(block) : Error{good.error()};
}

}  // namespace

std::string SentenceOf(const Block& block, const SymbolTables& tables, const Naming& naming) {
  return Show(block.subject, false, block.author, tables, naming) + " " +
         Show(block.predicate, false, block.author, tables, naming) + " " +
         Show(block.object, true, block.author, tables, naming);
}

Result<Block> ParseSentence(std::string_view text, int32_t author, const Naming& naming,
                            SymbolTables* tables) {
  if (!tables->HasRobot(author)) {
    return Error{"the author is " + std::to_string(author) +
                 ", expected a number of the robot table"};
  }
  SymbolTables next = *tables;
  Result<Block> block = Parse(text, author, naming, &next);
  if (block.ok()) {
    *tables = std::move(next);
  }
  return block;
}

}  // namespace pheromone::tags
