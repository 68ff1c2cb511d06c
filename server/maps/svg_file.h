// Lines out of an SVG drawing, such as Inkscape saves: its <path>, <line>, <polyline>, <polygon>,
// <rect>, <circle> and <ellipse>, with the transforms of their own and of the <g> and <a> around
// them.
//
// On the map the drawing looks as it does on the screen, its lower left corner in the origin. With
// s = metres_per_unit and the root's viewBox = "min_x min_y width height",
//
//   x_m = s (x - min_x)        y_m = s (min_y + height - y)
//
// where x and y are the drawing's user coordinates, those of the viewBox. Without a viewBox they
// are CSS pixels, min_x = min_y = 0, and the height is the root's `height` (a number, or with one
// of the units px mm cm Q in pt pc, 96 px an inch); the root must have one or the other.
//
// What a line looks like is not asked (stroke, fill, width, marker, clip), nor how a viewer fits
// the viewBox into its window (preserveAspectRatio). Ignored are text, images, style sheets,
// metadata, elements with another namespace prefix than the root's, what SVG does not draw where it
// stands
// (<defs>, <symbol>, <clipPath>, <mask>, <marker>, <pattern>, gradients), and what is hidden by
// `display: none`. Not accepted, rather than lines left out or put elsewhere: <use> and <switch>,
// an <svg> within the drawing, a transform of the root or by CSS, lengths in percent, em or ex,
// elements nested more than 64 deep, and a million tags. Entities are not expanded, but for XML's
// own five and character references, and nothing outside of the text is ever read. The text is
// UTF-8.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/result.h"
#include "server/maps/polyline_file.h"

namespace pheromone::maps {

struct SvgOptions {
  double metres_per_unit = 0.001;
  std::string id;               ///< only this element, hidden or not; empty = the whole drawing
  int64_t tolerance_um = 1000;  ///< svg_pen.h
};

Result<std::vector<Polyline>> ParseSvgLines(std::string_view text, std::string_view name,
                                            const SvgOptions& options);

}  // namespace pheromone::maps
