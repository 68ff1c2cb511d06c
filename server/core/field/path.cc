#include "server/core/field/path.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>

namespace pheromone::field {
namespace {

struct Vector {
  double x;
  double y;
};

Vector Mix(Vector a, Vector b, double from, double to, double t) {
  const double w = (t - from) / (to - from);
  return {a.x + (b.x - a.x) * w, a.y + (b.y - a.y) * w};
}

Vector ToVector(PointUm p) {
  return {static_cast<double>(p.x), static_cast<double>(p.y)};
}

PointUm ToPoint(Vector v) {
  return {std::llround(v.x), std::llround(v.y)};
}

double Distance(Vector a, Vector b) {
  return std::hypot(b.x - a.x, b.y - a.y);
}

// Point `t` (0 at p1, 1 at p2) of the centripetal Catmull-Rom segment from p1 to p2.
Vector SplineAt(Vector p0, Vector p1, Vector p2, Vector p3, double t) {
  const double t1 = std::sqrt(Distance(p0, p1));
  const double t2 = t1 + std::sqrt(Distance(p1, p2));
  const double t3 = t2 + std::sqrt(Distance(p2, p3));
  const double at = t1 + (t2 - t1) * t;
  const Vector a1 = Mix(p0, p1, 0, t1, at);
  const Vector a2 = Mix(p1, p2, t1, t2, at);
  const Vector a3 = Mix(p2, p3, t2, t3, at);
  const Vector b1 = Mix(a1, a2, 0, t2, at);
  const Vector b2 = Mix(a2, a3, t1, t3, at);
  return Mix(b1, b2, t1, t2, at);
}

// The sides of a path, the closing one included: calls visit(from, to).
template <typename Visit>
void ForEachSide(const Path& path, Visit&& visit) {
  for (size_t i = 1; i < path.points.size(); ++i) {
    visit(path.points[i - 1], path.points[i]);
  }
  if (path.closed && path.points.size() > 1) {
    visit(path.points.back(), path.points.front());
  }
}

// Two nodes across the corner of one cell.
bool Diagonal(NodeIndex a, NodeIndex b) {
  return std::abs(a.column - b.column) == 1 && std::abs(a.row - b.row) == 1;
}

}  // namespace

std::vector<PointUm> CirclePoints(PointUm centre, int64_t radius_um, int64_t step_um) {
  const double turn = 2 * std::numbers::pi;
  const double sides =
      std::ceil(turn * static_cast<double>(radius_um) / static_cast<double>(step_um));
  const auto count = std::max<int64_t>(8, static_cast<int64_t>(sides));
  std::vector<PointUm> points;
  for (int64_t i = 0; i < count; ++i) {
    const double angle = turn * static_cast<double>(i) / static_cast<double>(count);
    const auto radius = static_cast<double>(radius_um);
    points.push_back({centre.x + std::llround(radius * std::cos(angle)),
                      centre.y + std::llround(radius * std::sin(angle))});
  }
  return points;
}

std::vector<PointUm> SplinePoints(const std::vector<PointUm>& points, bool closed,
                                  int64_t step_um) {
  std::vector<PointUm> knots;
  for (const PointUm point : points) {
    if (knots.empty() || !(knots.back() == point)) {
      knots.push_back(point);
    }
  }
  if (closed && knots.size() > 1 && knots.front() == knots.back()) {
    knots.pop_back();
  }
  const auto count = static_cast<int64_t>(knots.size());
  if (count < 2) {
    return knots;
  }
  // The neighbour of an open curve's end mirrors the first side, so that the curve starts straight.
  const auto knot = [&](int64_t i) {
    if (closed) {
      return ToVector(knots[static_cast<size_t>((i + count) % count)]);
    }
    if (i >= 0 && i < count) {
      return ToVector(knots[static_cast<size_t>(i)]);
    }
    const Vector end = ToVector(i < 0 ? knots.front() : knots.back());
    const Vector inner = ToVector(i < 0 ? knots[1] : knots[static_cast<size_t>(count - 2)]);
    return Vector{2 * end.x - inner.x, 2 * end.y - inner.y};
  };
  std::vector<PointUm> curve;
  const int64_t sides = closed ? count : count - 1;
  for (int64_t i = 0; i < sides; ++i) {
    const double length = Distance(knot(i), knot(i + 1));
    const auto steps = std::max<int64_t>(1, std::llround(length / static_cast<double>(step_um)));
    for (int64_t s = 0; s < steps; ++s) {
      const double t = static_cast<double>(s) / static_cast<double>(steps);
      curve.push_back(ToPoint(SplineAt(knot(i - 1), knot(i), knot(i + 1), knot(i + 2), t)));
    }
  }
  if (!closed) {
    curve.push_back(knots.back());
  }
  return curve;
}

std::vector<NodeIndex> NodesAlong(const MapGeometry& map, const Path& path) {
  std::vector<NodeIndex> line;
  const auto visit = [&line](NodeIndex node) {
    if (!line.empty() && line.back() == node) {
      return;
    }
    // The corner of a step is not needed: the nodes before and after it touch diagonally.
    if (line.size() >= 2 && Diagonal(line[line.size() - 2], node)) {
      line.pop_back();
    }
    line.push_back(node);
  };
  if (path.points.size() == 1) {
    visit(map.NearestNode(path.points.front()));
  }
  ForEachSide(path, [&](PointUm from, PointUm to) {
    const int64_t dx = to.x - from.x;
    const int64_t dy = to.y - from.y;
    const int64_t steps = 1 + 4 * std::max(std::abs(dx), std::abs(dy)) / map.cell_um;
    for (int64_t i = 0; i <= steps; ++i) {
      visit(map.NearestNode({from.x + FloorDiv(dx * i, steps), from.y + FloorDiv(dy * i, steps)}));
    }
  });
  std::set<NodeIndex> seen;
  std::erase_if(line, [&seen](NodeIndex node) { return !seen.insert(node).second; });
  return line;
}

PathPosition Locate(const Path& path, double x_um, double y_um) {
  PathPosition best{std::numeric_limits<double>::infinity(), 0};
  double before = 0;
  if (path.points.size() == 1) {
    return {Distance(ToVector(path.points.front()), {x_um, y_um}), 0};
  }
  ForEachSide(path, [&](PointUm from, PointUm to) {
    const Vector a = ToVector(from);
    const Vector b = ToVector(to);
    const double length = Distance(a, b);
    const double dot = (x_um - a.x) * (b.x - a.x) + (y_um - a.y) * (b.y - a.y);
    const double along = length > 0 ? std::clamp(dot / length, 0.0, length) : 0.0;
    const double w = length > 0 ? along / length : 0.0;
    const double distance = Distance({a.x + (b.x - a.x) * w, a.y + (b.y - a.y) * w}, {x_um, y_um});
    if (distance < best.distance_um) {
      best = {distance, before + along};
    }
    before += length;
  });
  return best;
}

size_t NearestPath(std::span<const Path> paths, double x_um, double y_um) {
  const auto distance_um = [&](const Path& path) { return Locate(path, x_um, y_um).distance_um; };
  const auto nearest = std::min_element(
      paths.begin(), paths.end(),
      [&](const Path& a, const Path& b) { return distance_um(a) < distance_um(b); });
  return static_cast<size_t>(nearest - paths.begin());
}

double LengthOf(const Path& path) {
  double length = 0;
  ForEachSide(path,
              [&](PointUm from, PointUm to) { length += Distance(ToVector(from), ToVector(to)); });
  return length;
}

}  // namespace pheromone::field
