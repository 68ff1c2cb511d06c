// How deep the elements of an XML document are nested, told before it is parsed: Raptor's time
// grows with the square of the depth.
//
// Pure; any thread.
#pragma once

#include <cstddef>
#include <string_view>

namespace pheromone::ctl {

inline constexpr size_t kMaxXmlDepth = 64;  ///< a fact has three

/// The offset of the first element that is nested deeper than kMaxXmlDepth, or of an entity's
/// declaration that has elements, which could be; the text's size if there is neither. Says nothing
/// of whether the text is XML.
size_t TooDeepAt(std::string_view text);

}  // namespace pheromone::ctl
