// Polylines from an SVG drawing, for example of Inkscape: its <path>, <line>, <polyline>,
// <polygon>, <rect>, <circle> and <ellipse>, with the transforms of their own and of the <g> and
// <a> around them.
//
// The drawing has the same orientation on the map as on a screen, with its lower left corner at the
// origin. With s = metres_per_unit and the root's viewBox = "min_x min_y width height",
//
//   x_m = s (x - min_x)        y_m = s (min_y + height - y)
//
// where x and y are the drawing's user coordinates, those of the viewBox. Without a viewBox they
// are CSS pixels, min_x = min_y = 0, and the height is the root's `height` (a number, or with one
// of the units px mm cm Q in pt pc, 96 px an inch); the root must have one or the other.
//
// The appearance of lines (stroke, fill, width, marker, clip) is ignored, and so is how a viewer
// fits the viewBox into its window (preserveAspectRatio). Also ignored are text, images, style
// sheets, metadata, elements with another namespace prefix than the root's, definitions that SVG
// does not draw in place (<defs>, <symbol>, <clipPath>, <mask>, <marker>, <pattern>, gradients),
// and what is hidden by `display: none`. Refused, rather than drawn incompletely or elsewhere:
// <use> and <switch>, an <svg> within the drawing, a transform of the root or by CSS, lengths in
// percent, em or ex, elements nested more than 64 deep, and a million tags. Entities are not
// expanded, except the five of XML and character references, and nothing outside the text is ever
// read. The text is UTF-8.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/result.h"
#include "server/formats/maps/polyline_file.h"

namespace pheromone::maps {

struct SvgOptions {
  double metres_per_unit = 0.001;
  std::string id;               ///< only this element, hidden or not; empty = the whole drawing
  int64_t tolerance_um = 1000;  ///< svg_pen.h
};

Result<std::vector<Polyline>> ParseSvgLines(std::string_view text, std::string_view name,
                                            const SvgOptions& options);

}  // namespace pheromone::maps
