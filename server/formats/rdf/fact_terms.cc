// The terms of fact.h: numbers to IRIs and literals, and back.
#include <array>
#include <limits>
#include <utility>

#include "server/base/percent.h"
#include "server/formats/rdf/fact.h"
#include "server/formats/rdf/iri.h"
#include "server/formats/rdf/lexical.h"

namespace pheromone::tags {
namespace {

constexpr std::string_view kRobotFolder = "robot/";
constexpr std::string_view kRobotNumberFolder = "robot-number/";
constexpr std::string_view kTagFolder = "tag/";
constexpr std::string_view kTagNumberFolder = "tag-number/";
constexpr std::string_view kTextFolder = "text/";
constexpr std::string_view kUnresolvedFolder = "unresolved/";

Term TermOfType(TypeCode type, int32_t value) {
  return {static_cast<int32_t>(type), value};
}

std::string Join(std::string_view a, std::string_view b) {
  return std::string(a).append(b);
}

std::string RobType(std::string_view name) {
  return Join(kRob, name);
}

// What follows base and folder; empty if it begins otherwise.
std::optional<std::string_view> After(std::string_view iri, const Naming& naming,
                                      std::string_view folder) {
  if (!iri.starts_with(naming.base) || !iri.substr(naming.base.size()).starts_with(folder)) {
    return std::nullopt;
  }
  return iri.substr(naming.base.size() + folder.size());
}

// Canonical decimal digits.
std::optional<int32_t> ParseNumber(std::string_view text, int32_t least) {
  const std::optional<int32_t> number = ParseInt(text);
  return number && *number >= least && std::to_string(*number) == text ? number : std::nullopt;
}

// The author in the IRIs of what it has not defined.
std::string UnresolvedPrefix(int32_t author, const SymbolTables& tables, const Naming& naming) {
  const std::string* const id = tables.UniqueIdOf(author);
  return naming.base + std::string(kUnresolvedFolder) +
         (id != nullptr ? PercentEncode(*id) : std::to_string(author)) + "/";
}

std::string SymbolIri(const Term& term, int32_t author, const SymbolTables& tables,
                      const Naming& naming) {
  const std::string* const value = tables.StringOf(author, term.value);
  const std::string* const space = term.space == 0 ? nullptr : tables.StringOf(author, term.space);
  if (value == nullptr || (term.space != 0 && space == nullptr)) {
    return UnresolvedPrefix(author, tables, naming) + std::to_string(term.space) + "/" +
           std::to_string(term.value);
  }
  std::string iri = space != nullptr ? *space + *value : *value;
  if (IsIri(iri) && !After(iri, naming, kTextFolder) && !After(iri, naming, kUnresolvedFolder)) {
    return iri;
  }
  iri = naming.base + std::string(kTextFolder);
  if (space != nullptr) {
    iri += PercentEncode(*space) + "/";
  }
  return iri + PercentEncode(*value);
}

std::string RobotIri(int32_t robot, const SymbolTables& tables, const Naming& naming) {
  const std::string* const id = tables.UniqueIdOf(robot);
  return naming.base + (id != nullptr ? Join(kRobotFolder, PercentEncode(*id))
                                      : Join(kRobotNumberFolder, std::to_string(robot)));
}

// --- Text to terms

// A symbol of strings that the author has, split there.
std::optional<Term> KnownAt(std::string_view iri, size_t split, int32_t author,
                            const SymbolTables& tables) {
  const auto value = tables.NumberOf(author, iri.substr(split));
  if (!value || split == 0) {
    return value ? std::optional(Term{0, *value}) : std::nullopt;
  }
  const auto space = tables.NumberOf(author, iri.substr(0, split));
  return space ? std::optional(Term{*space, *value}) : std::nullopt;
}

// Reads the terms of one author, and adds rows.
class Terms {
 public:
  Terms(std::string_view role, int32_t author, const Naming& naming, SymbolTables* tables)
      : role_(role), author_(author), naming_(naming), tables_(*tables) {}

  Result<Term> OfIri(const std::string& iri);
  Result<Term> OfLiteral(const Node& literal);

 private:
  Error Expected(const std::string& found, std::string_view expected) const {
    return Error{Join(Join("the ", role_), " is ") + found + ", expected " + std::string(expected)};
  }
  static std::string Show(const std::string& iri) { return "<" + iri + ">"; }

  Result<int32_t> NumberOf(std::string_view text);
  Result<Term> Symbol(std::string_view space, std::string_view value);
  Result<Term> Robot(const std::string& unique_id);
  Result<Term> Unresolved(const std::string& iri) const;
  std::optional<Result<Term>> OfText(std::string_view path);
  std::optional<Result<Term>> OfThing(const std::string& iri);

  std::string_view role_;
  int32_t author_;
  const Naming& naming_;
  SymbolTables& tables_;
};

Result<int32_t> Terms::NumberOf(std::string_view text) {
  if (const std::optional<int32_t> known = tables_.NumberOf(author_, text)) {
    return *known;
  }
  const int32_t owner = tables_.OwnerOf(author_);
  const int32_t number = tables_.FreeNumberOf(owner);
  switch (tables_.DefineString(owner, number, text)) {
    case DefineOutcome::kDone:
      return number;
    case DefineOutcome::kFull:
      return Error{Join(Join("the ", role_), " needs the string ") + Quote(text) +
                   ", but the string table of robot " + std::to_string(owner) + " is full"};
    default:
      return Expected(Quote(text), "strings of 1 to 255 bytes of UTF-8 without control characters");
  }
}

Result<Term> Terms::Symbol(std::string_view space, std::string_view value) {
  Term term;
  if (!space.empty()) {
    PHEROMONE_TRY(const int32_t number, NumberOf(space));
    term.space = number;
  }
  PHEROMONE_TRY(const int32_t number, NumberOf(value));
  term.value = number;
  return term;
}

Result<Term> Terms::Robot(const std::string& unique_id) {
  int32_t robot = 0;
  switch (tables_.AddRobot(unique_id, &robot)) {
    case DefineOutcome::kDone:
      return TermOfType(TypeCode::kRobot, robot);
    case DefineOutcome::kFull:
      return Error{Join(Join("the ", role_), " is robot ") + Quote(unique_id) +
                   ", but the robot table is full"};
    default:
      return Expected("robot " + Quote(unique_id), "a unique ID of 1 to 255 bytes of UTF-8");
  }
}

// A robot or tag; empty if it is none.
std::optional<Result<Term>> Terms::OfThing(const std::string& iri) {
  if (const auto path = After(iri, naming_, kRobotFolder)) {
    const std::optional<std::string> id = PercentDecode(*path);
    return id && !id->empty() ? std::optional(Robot(*id)) : std::nullopt;
  }
  if (const std::optional<std::string> name = TagNameOf(iri, naming_)) {
    const std::optional<int32_t> number = naming_.tags.NumberOf(*name);
    return number ? Result<Term>(TermOfType(TypeCode::kTag, *number))
                  : Expected(Show(iri), "the name of a known tag, or " + naming_.base +
                                            std::string(kTagNumberFolder) + "NUMBER");
  }
  for (const auto& [folder, type] : {std::pair(kRobotNumberFolder, TypeCode::kRobot),
                                     std::pair(kTagNumberFolder, TypeCode::kTag)}) {
    if (const auto path = After(iri, naming_, folder)) {
      const std::optional<int32_t> number = ParseNumber(*path, 1);
      return number ? Result<Term>(TermOfType(type, *number))
                    : Expected(Show(iri), "a number from 1 to 2147483647 at its end");
    }
  }
  return std::nullopt;
}

Result<Term> Terms::Unresolved(const std::string& iri) const {
  const std::string prefix = UnresolvedPrefix(author_, tables_, naming_);
  if (iri.starts_with(prefix)) {
    std::string_view path = iri;
    path.remove_prefix(prefix.size());
    const size_t slash = path.find('/');
    if (slash == std::string_view::npos && role_ == "object") {
      if (const std::optional<int32_t> number = ParseNumber(path, 1)) {
        return TermOfType(TypeCode::kString, *number);
      }
    } else if (slash != std::string_view::npos) {
      const std::optional<int32_t> space = ParseNumber(path.substr(0, slash), 0);
      const std::optional<int32_t> value = ParseNumber(path.substr(slash + 1), 1);
      if (space && value) {
        return Term{*space, *value};
      }
    }
  }
  return Expected(Show(iri), "numbers of the author's strings, as " + prefix +
                                 (role_ == "object" ? "SPACE/NR or NR" : "SPACE/NR"));
}

// Empty if it is not as SymbolIri makes it.
std::optional<Result<Term>> Terms::OfText(std::string_view path) {
  const size_t slash = path.find('/');
  const bool has_space = slash != std::string_view::npos;
  const auto space = PercentDecode(has_space ? path.substr(0, slash) : "");
  const auto value = PercentDecode(has_space ? path.substr(slash + 1) : path);
  if (!space || !value || value->empty() || (has_space && space->empty())) {
    return std::nullopt;
  }
  return Symbol(*space, *value);
}

Result<Term> Terms::OfIri(const std::string& iri) {
  if (role_ != "predicate") {
    if (std::optional<Result<Term>> thing = OfThing(iri)) {
      return *thing;
    }
  }
  if (After(iri, naming_, kUnresolvedFolder)) {
    return Unresolved(iri);
  }
  if (const auto path = After(iri, naming_, kTextFolder)) {
    if (std::optional<Result<Term>> symbol = OfText(*path)) {
      return *symbol;
    }
  }
  if (!IsIri(iri)) {
    return Expected(Show(iri), "an absolute IRI such as <http://example.org/ns#cleaning>");
  }
  const std::optional<size_t> split = SplitOf(iri, SymbolTables::kMaxTextBytes);
  if (!split) {
    return Expected(
        "an IRI of " + std::to_string(iri.size()) + " bytes, <" + iri.substr(0, 40) + "...>",
        "a namespace and a local part of at most 255 bytes each");
  }
  if (const std::optional<Term> known = KnownSymbol(iri, author_, tables_)) {
    return *known;
  }
  const std::string_view all = iri;
  return Symbol(all.substr(0, *split), all.substr(*split));
}

// Times of day have no time zone in a block; robots' clocks are UTC.
std::optional<int32_t> ParseUtcTime(std::string_view text) {
  for (const std::string_view zone : {"Z", "+00:00"}) {
    if (text.ends_with(zone)) {
      return ParseTime(text.substr(0, text.size() - zone.size()));
    }
  }
  return std::nullopt;
}

std::optional<int32_t> ParseUtcSeconds(std::string_view text) {
  const std::optional<uint32_t> utc_s = ParseDateTime(text);
  return utc_s ? std::optional(static_cast<int32_t>(*utc_s)) : std::nullopt;
}

// Of any datatype that is derived from xsd:integer and within its bounds, and of 32 bits.
std::optional<int32_t> ParseWhole(std::string_view text, int64_t least, int64_t most) {
  const std::optional<int32_t> number = ParseInt(text);
  return number && *number >= least && *number <= most ? number : std::nullopt;
}

struct WholeType {
  std::string_view name;
  int64_t least;
  int64_t most;
};

constexpr int64_t kAny = std::numeric_limits<int64_t>::max();
constexpr std::array kWholeTypes = {
    WholeType{"integer", -kAny, kAny},         WholeType{"long", -kAny, kAny},
    WholeType{"short", -32'768, 32'767},       WholeType{"byte", -128, 127},
    WholeType{"unsignedLong", 0, kAny},        WholeType{"unsignedInt", 0, kAny},
    WholeType{"unsignedShort", 0, 65'535},     WholeType{"unsignedByte", 0, 255},
    WholeType{"nonNegativeInteger", 0, kAny},  WholeType{"positiveInteger", 1, kAny},
    WholeType{"nonPositiveInteger", -kAny, 0}, WholeType{"negativeInteger", -kAny, -1},
};

struct LiteralType {
  std::string_view prefix;
  std::string_view name;
  TypeCode type;
  std::optional<int32_t> (*parse)(std::string_view);
  std::string_view expected;
};

constexpr std::array kLiteralTypes = {
    LiteralType{kXsd, "int", TypeCode::kInt, ParseInt,
                "a whole number from -2147483648 to 2147483647"},
    LiteralType{kXsd, "float", TypeCode::kFloat, ParseFloat,
                "a number that fits in 32 bits, such as 0.5 or 1e10, or INF, -INF, NaN"},
    LiteralType{kXsd, "dateTime", TypeCode::kDateTime, ParseUtcSeconds,
                "whole seconds from 1970 to 2106 with a time zone, such as 2006-01-28T14:20:00Z"},
    LiteralType{kXsd, "date", TypeCode::kDate, ParseDate,
                "a day of the calendar without a time zone, such as 2006-01-28"},
    LiteralType{kXsd, "time", TypeCode::kTime, ParseUtcTime,
                "UTC with at most milliseconds, such as 14:20:00Z"},
    LiteralType{kXsd, "double", TypeCode::kFloat, ParseDoubleAsFloat,
                "a number that 32 bits hold without loss, such as 0.1 or 1e10, or INF, -INF, NaN"},
    LiteralType{kXsd, "boolean", TypeCode::kInt, ParseBoolean, "true, false, 1 or 0"},
    LiteralType{kRob, "char", TypeCode::kChar, ParseChar, "one character, or U+ and its number"},
};

Result<Term> Terms::OfLiteral(const Node& literal) {
  if (literal.datatype == XsdType("string") || literal.datatype == RobType("escaped")) {
    const std::optional<std::string> text = TextOf(literal);
    if (!text) {
      return Expected(Quote(literal.text), "percent-encoded text");
    }
    const Result<int32_t> number = NumberOf(*text);
    return number.ok() ? Result<Term>(TermOfType(TypeCode::kString, number.value()))
                       : number.error();
  }
  for (const LiteralType& type : kLiteralTypes) {
    if (literal.datatype == Join(type.prefix, type.name)) {
      const std::optional<int32_t> value = type.parse(literal.text);
      return value ? Result<Term>(TermOfType(type.type, *value))
                   : Expected(Quote(literal.text), type.expected);
    }
  }
  for (const WholeType& type : kWholeTypes) {
    if (literal.datatype == XsdType(type.name)) {
      const std::optional<int32_t> value = ParseWhole(literal.text, type.least, type.most);
      return value ? Result<Term>(TermOfType(TypeCode::kInt, *value))
                   : Expected(Quote(literal.text) + " of datatype xsd:" + std::string(type.name),
                              "a whole number of that datatype and of 32 bits");
    }
  }
  if (literal.datatype == XsdType("decimal")) {
    if (const std::optional<int32_t> whole = ParseWholeDecimal(literal.text)) {
      return TermOfType(TypeCode::kInt, *whole);
    }
    const bool is_decimal = literal.text.find_first_of("eEIN") == std::string::npos;
    const auto value = is_decimal ? ParseDoubleAsFloat(literal.text) : std::nullopt;
    return value ? Result<Term>(TermOfType(TypeCode::kFloat, *value))
                 : Expected(Quote(literal.text) + " of datatype xsd:decimal",
                            "a decimal number that 32 bits hold without loss, such as 244 or 0.1");
  }
  return Expected(Quote(literal.text) + " of datatype <" + literal.datatype + ">",
                  "xsd:string, boolean, decimal, integer or a type derived from it, float, double, "
                  "dateTime, date or time, or rob:char or escaped");
}

}  // namespace

std::optional<Term> KnownSymbol(std::string_view iri, int32_t author, const SymbolTables& tables) {
  const size_t split = SplitOf(iri, SymbolTables::kMaxTextBytes).value_or(0);
  std::optional<Term> known = KnownAt(iri, split, author, tables);
  for (size_t at = 0; !known && at < iri.size(); ++at) {
    known = KnownAt(iri, at, author, tables);
  }
  return known;
}

std::string XsdType(std::string_view name) {
  return Join(kXsd, name);
}

Node NodeOf(const Term& term, int32_t author, const SymbolTables& tables, const Naming& naming) {
  if (term.is_symbol()) {
    return {SymbolIri(term, author, tables, naming), {}};
  }
  switch (static_cast<TypeCode>(term.space)) {
    case TypeCode::kString: {
      const std::string* const text = tables.StringOf(author, term.value);
      return text != nullptr
                 ? LiteralOf(*text)
                 : Node{UnresolvedPrefix(author, tables, naming) + std::to_string(term.value), {}};
    }
    case TypeCode::kChar:
      return {CharText(term.value), RobType("char")};
    case TypeCode::kInt:
      return {std::to_string(term.value), XsdType("int")};
    case TypeCode::kFloat:
      return {FloatText(term.value), XsdType("float")};
    case TypeCode::kDateTime:
      return {DateTimeText(static_cast<uint32_t>(term.value)), XsdType("dateTime")};
    case TypeCode::kDate:
      return {DateText(term.value), XsdType("date")};
    case TypeCode::kTime:
      return {TimeText(term.value) + "Z", XsdType("time")};
    case TypeCode::kRobot:
      return {RobotIri(term.value, tables, naming), {}};
    case TypeCode::kTag:
      break;
  }
  const std::string* const name = naming.tags.NameOf(term.value);
  return {name != nullptr ? TagIri(*name, naming)
                          : naming.base + Join(kTagNumberFolder, std::to_string(term.value)),
          {}};
}

Result<Term> TermOf(const Node& node, std::string_view role, int32_t author, const Naming& naming,
                    SymbolTables* tables) {
  Terms terms(role, author, naming, tables);
  return node.is_literal() ? terms.OfLiteral(node) : terms.OfIri(node.text);
}

std::string TagIri(std::string_view name, const Naming& naming) {
  return naming.base + Join(kTagFolder, PercentEncode(name));
}

std::optional<std::string> TagNameOf(std::string_view iri, const Naming& naming) {
  const auto path = After(iri, naming, kTagFolder);
  std::optional<std::string> name = path ? PercentDecode(*path) : std::nullopt;
  return name && !name->empty() ? name : std::nullopt;
}

Node LiteralOf(std::string_view text) {
  return IsXmlText(text) ? Node{std::string(text), XsdType("string")}
                         : Node{PercentEncode(text), RobType("escaped")};
}

std::optional<std::string> TextOf(const Node& literal) {
  if (literal.datatype == XsdType("string")) {
    return literal.text;
  }
  return literal.datatype == RobType("escaped") ? PercentDecode(literal.text) : std::nullopt;
}

}  // namespace pheromone::tags
