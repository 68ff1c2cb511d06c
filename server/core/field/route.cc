#include "server/core/field/route.h"

#include <algorithm>
#include <cstdlib>
#include <optional>
#include <queue>
#include <string>
#include <unordered_map>
#include <utility>

#include "server/base/format.h"
#include "server/core/field/extent.h"

namespace pheromone::field {
namespace {

// Costs of a step along an axis, and of a diagonal one: 985 / 1393 is the root of 1/2 to 10^-6.
constexpr int64_t kStraight = 985;
constexpr int64_t kDiagonal = 1393;

// The nodes that a robot may visit between two points of the map.
class Ground {
 public:
  Ground(const MapGeometry& map, const ObstacleMask& obstacles, int32_t clearance, PointUm from,
         PointUm to)
      : map_(map),
        obstacles_(obstacles),
        clearance_(clearance),
        from_(map.NearestNode(from)),
        to_(map.NearestNode(to)),
        widened_(map.columns(), map.rows()) {
    obstacles.ForEach([&](NodeIndex node) {
      int64_t half = clearance;
      for (int32_t up = 0; up <= clearance; ++up) {
        while (half * half + int64_t{up} * up > int64_t{clearance} * clearance) {
          --half;
        }
        widened_.BlockRow(node.row + up, node.column - half, node.column + half);
        widened_.BlockRow(node.row - up, node.column - half, node.column + half);
      }
    });
  }

  bool IsFree(NodeIndex node) const {
    if (node.column < 0 || node.row < 0 || node.column >= map_.columns() ||
        node.row >= map_.rows()) {
      return false;
    }
    return !widened_.Blocked(node) || node == from_ ||
           ((IsNear(node, from_) || IsNear(node, to_)) && !obstacles_.Blocked(node));
  }

  // Whether the straight line goes over free nodes only, looked at every half of a cell.
  bool IsFree(PointUm a, PointUm b) const {
    const int64_t longest = std::max(std::abs(b.x - a.x), std::abs(b.y - a.y));
    const int64_t steps = 2 * longest / map_.cell_um + 1;
    for (int64_t i = 0; i <= steps; ++i) {
      const PointUm at{a.x + (b.x - a.x) * i / steps, a.y + (b.y - a.y) * i / steps};
      if (!IsFree(map_.NearestNode(at))) {
        return false;
      }
    }
    return true;
  }

  const MapGeometry& map() const { return map_; }
  NodeIndex from() const { return from_; }
  NodeIndex to() const { return to_; }

 private:
  bool IsNear(NodeIndex node, NodeIndex end) const {
    return std::abs(node.column - end.column) <= clearance_ &&
           std::abs(node.row - end.row) <= clearance_;
  }

  const MapGeometry& map_;
  const ObstacleMask& obstacles_;
  const int32_t clearance_;
  const NodeIndex from_;
  const NodeIndex to_;
  ObstacleMask widened_;
};

struct Visit {
  int64_t cost = 0;
  NodeIndex before;
  bool done = false;
};

struct Open {
  int64_t estimate = 0;
  NodeIndex node;
  bool operator>(const Open& other) const {
    return std::pair(estimate, node) > std::pair(other.estimate, other.node);
  }
};

int64_t LeastCost(NodeIndex a, NodeIndex b) {
  const int64_t columns = std::abs(int64_t{a.column} - b.column);
  const int64_t rows = std::abs(int64_t{a.row} - b.row);
  return kStraight * std::abs(columns - rows) + kDiagonal * std::min(columns, rows);
}

// The nodes from the first to the last; empty if there is no way, nothing if the search became too
// long.
std::optional<std::vector<NodeIndex>> Search(const Ground& ground) {
  const auto key = [&](NodeIndex node) {
    return int64_t{node.row} * ground.map().columns() + node.column;
  };
  std::unordered_map<int64_t, Visit> visits;
  std::priority_queue<Open, std::vector<Open>, std::greater<>> open;
  visits[key(ground.from())] = {0, ground.from()};
  open.push({LeastCost(ground.from(), ground.to()), ground.from()});
  while (!open.empty()) {
    const NodeIndex at = open.top().node;
    open.pop();
    Visit& visit = visits[key(at)];
    if (std::exchange(visit.done, true)) {
      continue;
    }
    if (at == ground.to()) {
      std::vector<NodeIndex> nodes{at};
      while (nodes.back() != ground.from()) {
        nodes.push_back(visits[key(nodes.back())].before);
      }
      std::reverse(nodes.begin(), nodes.end());
      return nodes;
    }
    if (visits.size() > kMaxRouteNodes) {
      return std::nullopt;
    }
    const int64_t cost = visit.cost;
    for (int32_t up = -1; up <= 1; ++up) {
      for (int32_t right = -1; right <= 1; ++right) {
        const NodeIndex next{at.column + right, at.row + up};
        // A diagonal step does not cut the corner of an obstacle.
        if (next == at || !ground.IsFree(next) || !ground.IsFree(NodeIndex{next.column, at.row}) ||
            !ground.IsFree(NodeIndex{at.column, next.row})) {
          continue;
        }
        const int64_t its = cost + (up != 0 && right != 0 ? kDiagonal : kStraight);
        const auto [found, is_new] = visits.try_emplace(key(next), Visit{its, at});
        if (is_new || (!found->second.done && its < found->second.cost)) {
          found->second = {its, at};
          open.push({its + LeastCost(next, ground.to()), next});
        }
      }
    }
  }
  return std::vector<NodeIndex>();
}

// Leaves out the nodes that the straight line between others can do without.
std::vector<PointUm> Straightened(const Ground& ground, const std::vector<NodeIndex>& nodes,
                                  PointUm from, PointUm to) {
  std::vector<PointUm> all{from};
  for (const NodeIndex node : nodes) {
    all.push_back(ground.map().PositionOf(node));
  }
  all.push_back(to);
  std::vector<PointUm> corners{from};
  for (size_t i = 1; i + 1 < all.size(); ++i) {
    if (!ground.IsFree(corners.back(), all[i + 1])) {
      corners.push_back(all[i]);
    }
  }
  corners.push_back(to);
  return corners;
}

std::string TextOf(PointUm point) {
  return "(" + FormatNumber(static_cast<double>(point.x) / 1e6) + ", " +
         FormatNumber(static_cast<double>(point.y) / 1e6) + ") m";
}

}  // namespace

Result<std::vector<PointUm>> FindRoute(const MapGeometry& map,
                                       const Shared<ObstacleMask>& obstacles, PointUm from,
                                       PointUm to, int64_t clearance_um) {
  for (const PointUm end : {from, to}) {
    if (!map.Contains(end)) {
      return Error{TextOf(end) + " is off " + DescribeExtent(map)};
    }
  }
  if (!obstacles || obstacles->empty()) {
    return std::vector<PointUm>{from, to};
  }
  if (obstacles->Blocked(map.NearestNode(to))) {
    return Error{TextOf(to) + " is blocked by an obstacle"};
  }
  constexpr int64_t kWidest = ObstacleMask::kBlockSide;
  auto clearance =
      static_cast<int32_t>(std::min(kWidest, (clearance_um + map.cell_um - 1) / map.cell_um));
  for (;; clearance /= 2) {
    const Ground ground(map, *obstacles, clearance, from, to);
    if (ground.IsFree(from, to)) {
      return std::vector<PointUm>{from, to};
    }
    const std::optional<std::vector<NodeIndex>> nodes = Search(ground);
    if (!nodes) {
      return Error{"found no route from " + TextOf(from) + " to " + TextOf(to) + " within " +
                   std::to_string(kMaxRouteNodes) + " nodes of the map"};
    }
    if (!nodes->empty()) {
      std::vector<PointUm> corners = Straightened(ground, *nodes, from, to);
      if (corners.size() > kMaxRoutePoints) {
        return Error{"the route from " + TextOf(from) + " to " + TextOf(to) + " has " +
                     std::to_string(corners.size()) + " corners, expected at most " +
                     std::to_string(kMaxRoutePoints)};
      }
      return corners;
    }
    if (clearance == 0) {
      return Error{"there is no way around the obstacles from " + TextOf(from) + " to " +
                   TextOf(to)};
    }
  }
}

}  // namespace pheromone::field
