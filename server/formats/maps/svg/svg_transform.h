// Affine maps of the plane, and the `transform` attribute of SVG (SVG 1.1, section 7.6), which is a
// list of them:
//
//   matrix(a b c d e f)  translate(x [y])  scale(x [y])  rotate(degrees [x y])  skewX(degrees)
//   skewY(degrees)
//
// Internal to server/formats/maps.
#pragma once

#include <cstddef>
#include <string_view>

#include "server/formats/maps/polyline_sink.h"

namespace pheromone::maps {

struct Vector {
  double x = 0;
  double y = 0;
};

/// x' = a x + c y + e, y' = b x + d y + f: the letters and their order are SVG's.
struct Affine {
  double a = 1;
  double b = 0;
  double c = 0;
  double d = 1;
  double e = 0;
  double f = 0;

  Vector operator()(Vector v) const { return {a * v.x + c * v.y + e, b * v.x + d * v.y + f}; }
};

/// First `inner`, then `outer`.
Affine operator*(const Affine& outer, const Affine& inner);

/// The whole of a `transform` attribute, which stands at `offset` of the sink's text. False if the
/// sink was told what is wrong with it.
bool ParseSvgTransform(std::string_view text, size_t offset, PolylineSink* sink, Affine* transform);

}  // namespace pheromone::maps
