// Blocks as sentences for people: three terms with spaces between them.
//
//   SentenceOf(block, tables, naming);     // "robot:15 lookingfortag 244"
//   ParseSentence("15 lookingfortag 244", author, naming, &tables);
//
// Terms:
//   cleaning                       a symbol of the default namespace (Naming)
//   <http://example.org/ns#book>   any IRI, also those of fact.h
//   robot:15 robot:123-233-201     a robot by its number or unique ID; as a subject, 15 will do
//   tag:7 tag:dock                 a tag by its number or name
// and, as objects,
//   244                            an int
//   0.5 1e10 INF -INF NaN          a float
//   "two words"                    a string; \" and \\ for " and \ in it
//   'c' 'U+000A'                   a character; \' and \\ as above
//   2006-01-28T14:20:00Z           a date and time, in UTC unless +hh:mm follows
//   2006-01-28  14:20:00           a date; a time of day in UTC
//
// Pure; any thread.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "server/base/result.h"
#include "server/tags/block.h"
#include "server/tags/fact.h"
#include "server/tags/symbols.h"

namespace pheromone::tags {

/// Of a block that CheckBlock accepts: what ParseSentence reads as the same terms, but for objects
/// of an unknown type, shown as "(-16, 5)".
std::string SentenceOf(const Block& block, const SymbolTables& tables, const Naming& naming);

/// A block of `author`, who must be in the tables, at time 0; strings that the tables do not have
/// are added, and with <BASE/robot/UNIQUE-ID> robots. On an error the tables are unchanged. Errors:
/// not three terms, and terms that are none of the above, with what was found and expected; a robot
/// or tag that is not known by that number, unique ID or name; full tables.
Result<Block> ParseSentence(std::string_view text, int32_t author, const Naming& naming,
                            SymbolTables* tables);

}  // namespace pheromone::tags
