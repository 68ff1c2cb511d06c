#include "server/formats/maps/svg/svg_pen.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace pheromone::maps {
namespace {

constexpr size_t kLeastPoints = 2;

Vector operator+(Vector u, Vector v) {
  return {u.x + v.x, u.y + v.y};
}

Vector operator*(double s, Vector v) {
  return {s * v.x, s * v.y};
}

Vector Mix(Vector u, Vector v, double t) {
  return (1 - t) * u + t * v;
}

double SecondDifference(Vector p, Vector q, Vector r) {
  return std::hypot(p.x - 2 * q.x + r.x, p.y - 2 * q.y + r.y);
}

// The larger singular value of the linear part.
double Stretch(const Affine& map) {
  // Of [[a c] [b d]]: half the sum of two lengths.
  return (std::hypot(map.a + map.d, map.b - map.c) + std::hypot(map.a - map.d, map.b + map.c)) / 2;
}

// An arc of an ellipse: `ellipse` maps the unit circle to it.
struct Arc {
  Affine ellipse;
  double from = 0;
  double turn = 0;
};

// SVG 1.1, appendix F.6.5 and F.6.6; radii not 0, the ends apart. In the unit circle's coordinates
// there are no radii and no rotation: the ends are u and v, and the centre is on their
// perpendicular bisector.
Arc ArcBetween(Vector from, Vector to, Vector radii, double rotation_deg, bool large, bool sweep) {
  const double angle = std::remainder(rotation_deg, 360.0) * (std::numbers::pi / 180);
  const double cosine = std::cos(angle);
  const double sine = std::sin(angle);
  const Vector half = 0.5 * (from + -1.0 * to);
  // Half the way from v to u, by the radii: F.6.5.1.
  double ux = (cosine * half.x + sine * half.y) / radii.x;
  double uy = (cosine * half.y - sine * half.x) / radii.y;
  const double length = std::hypot(ux, uy);
  double grow = 1;
  double distance = 0;  // of the centre from the middle, in lengths of (ux, uy)
  if (length > 1) {     // F.6.6.2: out of reach, so the radii grow until the middle is the centre
    grow = length;
    ux /= length;
    uy /= length;
  } else {
    distance = std::sqrt(1 - length * length) / length;
  }
  const double side = large == sweep ? -1 : 1;  // F.6.5.2
  const Vector centre{side * distance * uy, -side * distance * ux};
  Arc arc;
  const double rx = radii.x * grow;
  const double ry = radii.y * grow;
  const Vector middle = 0.5 * (from + to);
  arc.ellipse = {cosine * rx, sine * rx, -sine * ry, cosine * ry, 0, 0};
  const Vector offset = arc.ellipse(centre);
  arc.ellipse.e = middle.x + offset.x;  // F.6.5.3
  arc.ellipse.f = middle.y + offset.y;
  arc.from = std::atan2(uy - centre.y, ux - centre.x);
  const double end = std::atan2(-uy - centre.y, -ux - centre.x);
  arc.turn = end - arc.from;  // F.6.5.6
  if (sweep && arc.turn < 0) {
    arc.turn += 2 * std::numbers::pi;
  } else if (!sweep && arc.turn > 0) {
    arc.turn -= 2 * std::numbers::pi;
  }
  return arc;
}

}  // namespace

bool SvgPen::Begin(size_t offset) {
  if (down_) {
    return true;
  }
  down_ = true;
  const Vector at = to_um_(current_);
  return sink_.Add(at.x, at.y, offset);
}

// `steps` sides from the present point to `to`; those between end at point_at(t), 0 < t < 1.
template <typename PointAt>
bool SvgPen::Draw(double steps, Vector to, size_t offset, PointAt&& point_at) {
  if (!Begin(offset)) {
    return false;
  }
  // Written so that Add refuses NaN.
  const double sides = std::ceil(steps);
  if (sides > static_cast<double>(sink_.room())) {
    return sink_.FailTooMany(offset);
  }
  const auto count = static_cast<size_t>(sides >= 1 ? sides : 1);
  for (size_t i = 1; i < count; ++i) {
    const Vector at = point_at(static_cast<double>(i) / static_cast<double>(count));
    if (!sink_.Add(at.x, at.y, offset)) {
      return false;
    }
  }
  current_ = to;
  const Vector end = to_um_(to);
  return sink_.Add(end.x, end.y, offset);
}

bool SvgPen::LineTo(Vector to, size_t offset) {
  return Draw(1, to, offset, [](double) { return Vector{}; });
}

bool SvgPen::QuadraticTo(Vector control, Vector to, size_t offset) {
  const Vector p0 = to_um_(current_);
  const Vector p1 = to_um_(control);
  const Vector p2 = to_um_(to);
  const double bend = 2 * SecondDifference(p0, p1, p2);
  return Draw(std::sqrt(bend / (8 * tolerance_um_)), to, offset,
              [&](double t) { return Mix(Mix(p0, p1, t), Mix(p1, p2, t), t); });
}

bool SvgPen::CubicTo(Vector control1, Vector control2, Vector to, size_t offset) {
  const Vector p0 = to_um_(current_);
  const Vector p1 = to_um_(control1);
  const Vector p2 = to_um_(control2);
  const Vector p3 = to_um_(to);
  const double bend = 6 * std::max(SecondDifference(p0, p1, p2), SecondDifference(p1, p2, p3));
  return Draw(std::sqrt(bend / (8 * tolerance_um_)), to, offset, [&](double t) {
    const Vector middle = Mix(p1, p2, t);
    return Mix(Mix(Mix(p0, p1, t), middle, t), Mix(middle, Mix(p2, p3, t), t), t);
  });
}

bool SvgPen::ArcTo(Vector radii, double rotation_deg, bool large, bool sweep, Vector to,
                   size_t offset) {
  if (to.x == current_.x && to.y == current_.y) {
    return true;  // F.6.2: no arc at all
  }
  if (radii.x == 0 || radii.y == 0) {
    return LineTo(to, offset);
  }
  const Arc arc =
      ArcBetween(current_, to, {std::abs(radii.x), std::abs(radii.y)}, rotation_deg, large, sweep);
  const Affine map = to_um_ * arc.ellipse;
  // 1 - cos(w / 2) = 2 sin^2(w / 4), which keeps its digits where w is small.
  const double share = std::min(1.0, tolerance_um_ / Stretch(map));
  const double step = std::min(std::numbers::pi / 2, 4 * std::asin(std::sqrt(share / 2)));
  return Draw(std::abs(arc.turn) / step, to, offset, [&](double t) {
    const double angle = arc.from + t * arc.turn;
    return map(Vector{std::cos(angle), std::sin(angle)});
  });
}

void SvgPen::MoveTo(Vector to) {
  End();
  start_ = to;
  current_ = to;
}

void SvgPen::Close() {
  sink_.End(/*closed=*/true, kLeastPoints);
  down_ = false;
  current_ = start_;
}

void SvgPen::End() {
  sink_.End(/*closed=*/false, kLeastPoints);
  down_ = false;
}

}  // namespace pheromone::maps
