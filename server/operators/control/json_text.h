// Formats JSON with readable numbers: the shortest decimal that reads back the same, and no
// exponent unless needed (Boost.JSON writes 0.1 as 1E-1). Any thread.
#pragma once

#include <string>
#include <string_view>

#include <boost/json/value.hpp>

#include "server/operators/control/notices.h"

namespace pheromone::web {

/// The same text if it is UTF-8; else with U+FFFD for each byte that is not part of a character.
std::string WellFormed(std::string_view text);

/// On one line, with an end of line. A number that JSON cannot hold, such as an infinity, is null;
/// strings come out well-formed.
std::string ToText(const boost::json::value& value);

/// A notice of what an operator did, as a line of its own: {"time": ..., "who": ..., "what": ...,
/// "done": ...}. `time` is a text.
std::string AuditLine(const control::Notice& notice, const std::string& time);

}  // namespace pheromone::web
