// Internationalised resource identifiers (RFC 3987): the names of things in RDF.
//
//   IsIri("http://example.org/ns#cleaning");    // absolute, and every RDF format can have it
//
// Pure; any thread.
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>

namespace pheromone::tags {

/// Whether it is an absolute IRI that reading does not change: without dot segments, which are
/// resolved, and without characters that need escapes.
bool IsIri(std::string_view text);

/// Where to split an IRI into namespace and local part, neither of them longer than `most_bytes`:
/// after the last # or / if possible, otherwise between any two characters. 0: it cannot be split,
/// but has at most `most_bytes`. Empty: neither.
std::optional<size_t> SplitOf(std::string_view iri, size_t most_bytes);

}  // namespace pheromone::tags
