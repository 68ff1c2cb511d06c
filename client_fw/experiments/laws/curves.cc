#include "client_fw/experiments/laws/curves.h"

#include <cmath>
#include <functional>
#include <numbers>

#include "client_fw/swarm/path_experiment.h"

namespace pheromone::swarm {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kSideM = 0.025;
constexpr double kCentreM = 5;

struct Point {
  double x_m;
  double y_m;
};

// The curve at(t), 0 <= t <= 1, `length_m` long, around the centre of the map.
std::vector<field::PointUm> Trace(double length_m, const std::function<Point(double)>& at) {
  const int sides = static_cast<int>(std::ceil(length_m / kSideM));
  std::vector<field::PointUm> points;
  for (int i = 0; i <= sides; ++i) {
    const Point p = at(static_cast<double>(i) / sides);
    points.push_back(
        {std::llround((kCentreM + p.x_m) * 1e6), std::llround((kCentreM + p.y_m) * 1e6)});
  }
  return points;
}

Point Spiral(double t) {
  const double radius_m = 2.6 - 2 * t;
  const double angle = 1.2 * 2 * kPi * t;
  return {radius_m * std::cos(angle), radius_m * std::sin(angle)};
}

// From the right tip upwards.
Point Lemniscate(double t) {
  const double angle = 2 * kPi * t;
  const double scale = 2.4 / (1 + std::sin(angle) * std::sin(angle));
  return {scale * std::cos(angle), scale * std::sin(angle) * std::cos(angle)};
}

// Counter-clockwise, from the middle of the lower side; each quarter is half a side, a corner and
// half a side.
Point RoundedSquare(double t) {
  constexpr double kHalfM = 1.5;
  constexpr double kRadiusM = 0.4;
  constexpr double kStraightM = kHalfM - kRadiusM;
  constexpr double kArcM = kRadiusM * kPi / 2;
  const double quarter = std::min(3.0, std::floor(4 * t));
  const double along_m = (4 * t - quarter) * (2 * kStraightM + kArcM);
  Point p{};
  if (along_m <= kStraightM) {
    p = {along_m, -kHalfM};
  } else if (along_m <= kStraightM + kArcM) {
    const double angle = (along_m - kStraightM) / kRadiusM;
    p = {kStraightM + kRadiusM * std::sin(angle), -kStraightM - kRadiusM * std::cos(angle)};
  } else {
    p = {kHalfM, along_m - 2 * kStraightM - kArcM};
  }
  for (int i = 0; i < static_cast<int>(quarter); ++i) {
    p = {-p.y_m, p.x_m};
  }
  return p;
}

std::vector<field::PointUm> Closed(std::vector<field::PointUm> points) {
  points.pop_back();  // which is the first again
  return points;
}

}  // namespace

const std::vector<Curve>& TuningCurves() {
  static const std::vector<Curve> curves = {Curve::kLine, Curve::kCircle};
  return curves;
}

const std::vector<Curve>& UnseenCurves() {
  static const std::vector<Curve> curves = {Curve::kSCurve, Curve::kSpiral, Curve::kEight,
                                            Curve::kSquare};
  return curves;
}

std::string_view NameOf(Curve curve) {
  switch (curve) {
    case Curve::kLine:
      return "line";
    case Curve::kCircle:
      return "circle";
    case Curve::kSCurve:
      return "s-curve";
    case Curve::kSpiral:
      return "spiral";
    case Curve::kEight:
      return "eight";
    case Curve::kSquare:
      return "square";
  }
  return "";
}

field::Path PathOf(Curve curve) {
  // The line lends the others what they have in common: type and strength.
  field::Path path = PathOf(Shape::kLine);
  switch (curve) {
    case Curve::kLine:
      break;
    case Curve::kCircle:
      return PathOf(Shape::kCircle);
    case Curve::kSCurve:
      return PathOf(Shape::kSCurve);
    case Curve::kSpiral:
      path.points = Trace(12.3, Spiral);
      break;
    case Curve::kEight:
      path.points = Closed(Trace(12.6, Lemniscate));
      path.closed = true;
      break;
    case Curve::kSquare:
      path.points = Closed(Trace(11.3, RoundedSquare));
      path.closed = true;
      break;
  }
  return path;
}

}  // namespace pheromone::swarm
