// Internationalised resource identifiers (RFC 3987): the names of things in RDF.
//
//   IsIri("http://example.org/ns#cleaning");    // absolute, and every RDF format can have it
//   PercentEncode("00:11/22");                  // "00%3A11%2F22": one segment of a path
//
// Pure; any thread.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace pheromone::tags {

/// Whether it is an absolute IRI that reading does not change: without dot segments, which are
/// resolved, and without characters that need escapes.
bool IsIri(std::string_view text);

/// Encodes everything except letters, digits and -._~ of ASCII as %XX. Dots alone are encoded, too:
/// they would be dot segments.
std::string PercentEncode(std::string_view text);
/// Only of what PercentEncode makes.
std::optional<std::string> PercentDecode(std::string_view encoded);

/// Where to split an IRI into namespace and local part, neither of them longer than `most_bytes`:
/// after the last # or / if possible, otherwise between any two characters. 0: it cannot be split,
/// but has at most `most_bytes`. Empty: neither.
std::optional<size_t> SplitOf(std::string_view iri, size_t most_bytes);

}  // namespace pheromone::tags
