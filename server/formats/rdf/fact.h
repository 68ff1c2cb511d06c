// Blocks as facts of RDF, with their numbers resolved to text, and facts as blocks (Tammet, Vain
// and Kuusik 2006, section 3.3).
//
//   Naming naming;                                              // or with a base of your own
//   Result<Facts> out = FactsOf(blocks, tables, naming);        // for ctl::WriteRdf
//   Result<std::vector<TagBlock>> in = BlocksOf(facts, naming, &tables);   // of ctl::ReadRdf
//
// A term becomes
//   symbol     the IRI string(space) + string(value), or string(value) in space 0
//   -1 string  a literal xsd:string               -5 date and time  xsd:dateTime, UTC
//   -2 char    rob:char: one character, so that   -6 date           xsd:date
//              it differs from a string of one    -7 time of day    xsd:time, UTC
//   -3 int     xsd:int                            -17 robot         BASE/robot/UNIQUE-ID
//   -4 float   xsd:float                          -18 tag           BASE/tag/NAME
// What has no such form is not lost either:
//   BASE/unresolved/UNIQUE-ID/SPACE/NR   a symbol of which the author has not defined all strings
//   BASE/unresolved/UNIQUE-ID/NR         a string that it has not defined
//   BASE/text/SPACE/VALUE                a symbol whose strings are no absolute IRI
//   BASE/robot-number/NR, /tag-number/NR a robot without a row in the table, a tag without a name
//   rob:escaped                          a string that XML cannot represent, as %XX
// UNIQUE-ID, NAME, SPACE and VALUE are percent-encoded (server/base/percent.h). An object of
// another type stays in the store: it is skipped and counted.
//
// A fact's block has the same meaning, and with the same tables the same numbers, unless the tables
// have a text twice or split an IRI in two ways, a symbol's IRI names a robot or a tag, or a NaN
// has a payload.
//
// Pure; any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/result.h"
#include "server/core/tags/block.h"
#include "server/core/tags/symbols.h"

namespace pheromone::tags {

inline constexpr std::string_view kXsd = "http://www.w3.org/2001/XMLSchema#";
/// Of the properties rob:tag, rob:robotId and rob:dtime, and the datatypes rob:char and
/// rob:escaped.
inline constexpr std::string_view kRob = "http://robots.org/ns#";

/// The names of tags, by number.
class TagNames {
 public:
  void Add(int32_t number, const std::string& name) {
    names_.emplace(number, name);
    numbers_.emplace(name, number);
  }
  /// Null if it has none.
  const std::string* NameOf(int32_t number) const {
    const auto found = names_.find(number);
    return found != names_.end() ? &found->second : nullptr;
  }
  std::optional<int32_t> NumberOf(std::string_view name) const {
    const auto found = numbers_.find(name);
    return found != numbers_.end() ? std::optional(found->second) : std::nullopt;
  }

 private:
  std::map<int32_t, std::string> names_;
  std::map<std::string, int32_t, std::less<>> numbers_;
};

/// The IRIs that are not in the tables.
struct Naming {
  std::string base = "http://robots.org/";                   ///< ends with "/" or "#"
  std::string default_namespace = "http://example.org/ns#";  ///< of words in sentences
  TagNames tags{};
};

/// An IRI, or a literal.
struct Node {
  std::string text;      ///< the IRI, or the lexical form
  std::string datatype;  ///< empty: an IRI
  bool operator==(const Node&) const = default;

  bool is_literal() const { return !datatype.empty(); }
};

struct Fact {
  std::string event;     ///< its own IRI; in a file, whatever the file calls it
  std::string tag;       ///< the name of the tag on which it is written
  std::string robot_id;  ///< the unique ID of its author
  uint32_t time_s = 0;   ///< as in Block
  std::string subject;   ///< IRIs
  std::string predicate;
  Node object;
  bool operator==(const Fact&) const = default;
};

struct TagBlock {
  std::string tag;  ///< its name
  Block block;
  bool operator==(const TagBlock&) const = default;
};

struct Facts {
  std::vector<Fact> facts;
  size_t skipped = 0;  ///< blocks whose object is of an unknown type, and records of nets
};

/// A block of a known type (IsKnownType). Errors: those of CheckBlock; an author without a row.
Result<Fact> FactOf(const TagBlock& written, const SymbolTables& tables, const Naming& naming);
/// All of them, without empty slots. An error names the tag.
Result<Facts> FactsOf(std::span<const TagBlock> blocks, const SymbolTables& tables,
                      const Naming& naming);

/// Whether it can become a block of tables that have room. Errors: a name or unique ID that is
/// empty or too long, an IRI that is not absolute or too long, an unknown datatype, a value that
/// its type does not have, a tag without a number; with what was found and expected.
Status CheckFact(const Fact& fact, const Naming& naming);

/// The facts as blocks of their authors; robots and strings that the tables do not have are added.
/// On an error the tables are unchanged. Errors: those of CheckFact; full tables.
Result<std::vector<TagBlock>> BlocksOf(std::span<const Fact> facts, const Naming& naming,
                                       SymbolTables* tables);

/// A term in a block of `author`, of a known type, and back as BlocksOf has it: adds rows even if
/// it fails. `role`, such as "object", is what an error calls it. Only an object may be a literal.
Node NodeOf(const Term& term, int32_t author, const SymbolTables& tables, const Naming& naming);
Result<Term> TermOf(const Node& node, std::string_view role, int32_t author, const Naming& naming,
                    SymbolTables* tables);

/// The symbol of the author's strings that are this IRI together: split behind its last # or / if
/// the author has those, else where the author has split it. Empty if it has no such strings.
std::optional<Term> KnownSymbol(std::string_view iri, int32_t author, const SymbolTables& tables);

/// BASE/tag/NAME, and the name again; empty if it is another IRI.
std::string TagIri(std::string_view name, const Naming& naming);
std::optional<std::string> TagNameOf(std::string_view iri, const Naming& naming);

/// The datatype xsd:NAME.
std::string XsdType(std::string_view name);

/// A text as a literal: xsd:string, or rob:escaped.
Node LiteralOf(std::string_view text);
/// The text of either; empty if it is neither, or not well-formed.
std::optional<std::string> TextOf(const Node& literal);

/// A text in quotation marks for an error, shortened if it is very long.
std::string Quote(std::string_view text);

}  // namespace pheromone::tags
