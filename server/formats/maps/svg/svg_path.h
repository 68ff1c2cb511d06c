// SVG path data, the `d` of a <path>: "M 0 0 C 10,0 10,10 20,10 a5 5 0 0 1 5-5z". The complete
// grammar of SVG 1.1, section 8.3, and SVG 2, section 9.3: M L H V C S Q T A Z, absolute and
// relative, arguments that repeat, and numbers that need no separator where they can do without.
//
// An error in the data is an error here; SVG would draw the part before it. Empty data draws
// nothing. A subpath without length gives no polyline.
#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

#include "server/base/result.h"
#include "server/formats/maps/polyline_file.h"
#include "server/formats/maps/svg/svg_pen.h"

namespace pheromone::maps {

/// Draws path data with `pen`, and ends its last line. `offset` is the position of `data` in the
/// text of the pen's sink. False if an error was reported to the sink.
bool DrawSvgPath(std::string_view data, size_t offset, PolylineSink* sink, SvgPen* pen);

/// The polylines of path data alone. Without a drawing, y is that of the map, upwards, unless
/// `to_um` specifies otherwise (x' = a x + c y + e, y' = b x + d y + f).
Result<std::vector<Polyline>> ParseSvgPath(std::string_view data, std::string_view name,
                                           const Affine& to_um, int64_t tolerance_um);

}  // namespace pheromone::maps
