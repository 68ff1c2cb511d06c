// Percent-encoding (RFC 3986, section 2.1): any text as one segment of a path or value of a query.
//
//   PercentEncode("00:11/22");        // "00%3A11%2F22"
//   PercentDecode("00%3A11%2F22");    // "00:11/22"
//
// Any thread.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace pheromone {

/// Encodes everything except letters, digits and -._~ of ASCII as %XX. Dots alone are encoded, too:
/// they would be dot segments.
std::string PercentEncode(std::string_view text);

/// Only of what PercentEncode makes.
std::optional<std::string> PercentDecode(std::string_view encoded);

}  // namespace pheromone
