// Kinds, weights and token counts as the dialects of PNML write them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <pugixml.hpp>

namespace pheromone::nets {

enum class PnmlArcKind { kNormal, kRead, kInhibitor };

inline constexpr std::string_view kPnmlArcKinds = "normal, read, test or inhibitor";

/// Each word that an arc uses for its kind: of <type value>, <arctype> and its attributes.
std::vector<std::string> ArcKindWords(const pugi::xml_node& arc);

/// Nothing for reset, transport and other arcs.
std::optional<PnmlArcKind> ArcKindOf(std::string_view word);

/// A count, such as "3", or as PIPE writes it, "Default,3": tokens of other colours must be 0.
/// Nothing if it is not a number of 0 to petri::kMaxTokens.
std::optional<uint32_t> ParseCount(std::string_view text);

/// Whether a text of TAPAAL, such as the inscription "[0,inf)" of an arc or the invariant "< inf"
/// of a place, leaves time free.
bool IsFreeOfTime(std::string_view text);

/// Whether this is the name of a net type that can be read: of 2009, of 2003, of PIPE and TAPAAL.
/// Nets of the core model are as well, because ProM and PM4Py write P/T nets under that name.
bool IsPtNetType(std::string_view type);

}  // namespace pheromone::nets
