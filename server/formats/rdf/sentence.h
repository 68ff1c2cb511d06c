// A block as people write it: subject, predicate and object, such as
//
//   15 lookingfortag 244            robot 15, a word, a number
//   tag:7 note "wet paint"          text between quotation marks
//   15 seen 2006-01-28T14:20:00Z    a time, a date (2006-01-28) or a time of day (14:20:00)
//   <http://robots.org/door> is open
//
// A word is short for the IRI that the default namespace and it make together; any other IRI is
// written in full. What is parsed from a printed sentence is the same block.
//
// Pure; any thread.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "server/base/result.h"
#include "server/core/tags/block.h"
#include "server/core/tags/symbols.h"

namespace pheromone::tags {

constexpr std::string_view kDefaultNamespace = "http://example.org/ns#";

/// One term of a block. A symbol is told by its IRI (IriText). A number of which the tables know
/// nothing is "unknown:NAMESPACE/NUMBER", a value of an unknown type "type-99:NUMBER".
std::string ObjectText(const Term& object, int32_t author, const SymbolTables& tables);
/// An IRI as ObjectText has it, however its maker has split it: a word, or <IRI>.
std::string IriText(std::string_view iri);
/// The same for a subject: a robot is its number alone.
std::string SubjectText(const Term& subject, int32_t author, const SymbolTables& tables);

/// The three terms with a space between them.
std::string SentenceOf(const Block& block, const SymbolTables& tables);

/// A block of that author, who is in the tables, without its time; strings that are missing in the
/// tables are added. Errors say which term is wrong, and what is expected.
Result<Block> ParseSentence(std::string_view sentence, int32_t author, SymbolTables* tables);

}  // namespace pheromone::tags
