// A pen that draws SVG's segments as polylines: converts moves, straight sides, Bézier curves and
// elliptical arcs in a drawing's coordinates to points in micrometres, through an affine map.
//
// No point of a curve is further than the tolerance from its polyline (and half a micrometre, for
// the rounding in x and y each), after the map:
//
//   Bézier  n equal steps of t, n from the second differences of the control points: a chord of
//           step 1/n is within max|B''| / (8 n^2) of the curve (Wang 1984; Goldman, "Pyramid
//           Algorithms", 2003, section 5.6.3), and
//             quadratic  |B''| <= 2 |P0 - 2 P1 + P2|
//             cubic      |B''| <= 6 max(|P0 - 2 P1 + P2|, |P1 - 2 P2 + P3|)
//   arc     n equal steps of the parameter, which is an angle: the chord of a unit circle over an
//           angle w is within 1 - cos(w / 2) of it, and the map from the unit circle to the drawn
//           ellipse stretches that by at most its larger singular value. Steps are at most 90
//           degrees. From end points to the centre: SVG 1.1, appendix F.6; SVG 2, section B.2.4.
//
// Internal to server/formats/maps.
#pragma once

#include <cstddef>

#include "server/formats/maps/polyline_sink.h"
#include "server/formats/maps/svg/svg_transform.h"

namespace pheromone::maps {

class SvgPen {
 public:
  /// `to_um` goes from the drawing's coordinates to micrometres on the map. The sink outlives the
  /// pen.
  SvgPen(const Affine& to_um, double tolerance_um, PolylineSink* sink)
      : to_um_(to_um), tolerance_um_(tolerance_um), sink_(*sink) {}

  /// Each draws from the present point to `to`. False if the sink accepts no more; `offset` is the
  /// position for an error.
  bool LineTo(Vector to, size_t offset);
  bool QuadraticTo(Vector control, Vector to, size_t offset);
  bool CubicTo(Vector control1, Vector control2, Vector to, size_t offset);

  /// `radii` with any sign; one that is 0 gives a straight side, ones that are too small are
  /// enlarged. `sweep`: the direction in which x turns to y.
  bool ArcTo(Vector radii, double rotation_deg, bool large, bool sweep, Vector to, size_t offset);

  /// Ends the polyline and begins another.
  void MoveTo(Vector to);
  /// Closes the polyline; the next one begins at its first point.
  void Close();
  /// Ends the polyline. One that is at most a micrometre long is dropped.
  void End();

  Vector current() const { return current_; }

 private:
  bool Begin(size_t offset);
  template <typename PointAt>
  bool Draw(double steps, Vector to, size_t offset, PointAt&& point_at);

  Affine to_um_;
  double tolerance_um_;
  PolylineSink& sink_;
  Vector start_;
  Vector current_;
  bool down_ = false;  // the present line has points
};

}  // namespace pheromone::maps
