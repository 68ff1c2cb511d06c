#include "client_fw/swarm/picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "client_fw/swarm/svg.h"
#include "server/base/xml_text.h"

namespace pheromone::swarm {
namespace {

constexpr double kPixelsPerMetre = 120;
constexpr double kMarginM = 0.7;
constexpr double kTitlePx = 34;
constexpr double kLegendLinePx = 22;
constexpr const char* kObstacleColour = "#777777";

struct Box {
  double left = 1e9;
  double bottom = 1e9;
  double right = -1e9;
  double top = -1e9;

  void Add(double x, double y) {
    left = std::min(left, x);
    right = std::max(right, x);
    bottom = std::min(bottom, y);
    top = std::max(top, y);
  }
};

// A document in the map's metres.
class Canvas : public Svg {
 public:
  Canvas(const Box& box, size_t legend_lines, const std::string& title)
      : Svg(std::max(420.0, (box.right - box.left) * kPixelsPerMetre),
            BottomOf(box) + 16 + kLegendLinePx * static_cast<double>(legend_lines), title),
        box_(box) {}

  double X(double metres) const { return (metres - box_.left) * kPixelsPerMetre; }
  double Y(double metres) const { return kTitlePx + (box_.top - metres) * kPixelsPerMetre; }
  double plot_bottom() const { return BottomOf(box_); }

 private:
  static double BottomOf(const Box& box) {
    return kTitlePx + (box.top - box.bottom) * kPixelsPerMetre;
  }

  Box box_;
};

Box BoxOf(const field::Path& path, const std::vector<Way>& ways) {
  Box box;
  for (const field::PointUm point : path.points) {
    box.Add(static_cast<double>(point.x) / 1e6, static_cast<double>(point.y) / 1e6);
  }
  for (const Way& way : ways) {
    for (const Sample& s : way.track) {
      box.Add(s.pose.x_m, s.pose.y_m);
    }
  }
  return {box.left - kMarginM, box.bottom - kMarginM, box.right + kMarginM, box.top + kMarginM};
}

int FirstMetre(double from) {
  return static_cast<int>(std::ceil(from));
}

void DrawGrid(Canvas* canvas, const Box& box) {
  for (int x = FirstMetre(box.left); x <= box.right; ++x) {
    canvas->Add(
        R"svg(<path d="M{0:.1f} {1:.1f}V{2:.1f}" stroke="#dddddd"/><text x="{3:.1f}" y="{4:.1f}" class="t">{5} m</text>)svg",
        canvas->X(x), kTitlePx, canvas->plot_bottom(), canvas->X(x) + 3, canvas->plot_bottom() - 4,
        x);
  }
  for (int y = FirstMetre(box.bottom); y <= box.top; ++y) {
    canvas->Add(
        R"svg(<path d="M0 {0:.1f}H{1:.1f}" stroke="#dddddd"/><text x="3" y="{2:.1f}" class="t">{3} m</text>)svg",
        canvas->Y(y), canvas->X(box.right), canvas->Y(y) - 3, y);
  }
}

// Each node as a disc that is full up to c and fades over sigma: their overlap shows the sum.
void DrawPheromone(Canvas* canvas, const field::Field& field, const Shade& shade,
                   const field::PheromoneLaw& law, uint64_t now_ms) {
  const double reach = static_cast<double>(law.reach_um());
  canvas->Add(
      R"svg(<defs><radialGradient id="z{0}"><stop offset="{1:.3f}" stop-color="{2}" stop-opacity="1"/><stop offset="1" stop-color="{2}" stop-opacity="0"/></radialGradient></defs><g fill="url(#z{0})">)svg",
      shade.type, static_cast<double>(law.core_um) / reach, shade.colour);
  std::vector<std::pair<field::NodeIndex, double>> nodes;
  field.ForEach([&](uint8_t type, field::NodeIndex node, field::NodeState state) {
    const double share = static_cast<double>(field::LevelAt(law, state, now_ms)) / law.max_level();
    if (type == law.type && share > 0) {
      nodes.emplace_back(node, share);
    }
  });
  std::sort(nodes.begin(), nodes.end());
  for (const auto& [node, share] : nodes) {
    const field::PointUm at = field.config().map.PositionOf(node);
    canvas->Add(R"svg(<circle cx="{:.1f}" cy="{:.1f}" r="{:.1f}" opacity="{:.3f}"/>)svg",
                canvas->X(static_cast<double>(at.x) / 1e6),
                canvas->Y(static_cast<double>(at.y) / 1e6), reach / 1e6 * kPixelsPerMetre,
                shade.opacity * share);
  }
  canvas->Add(R"svg(</g><g fill="{}">)svg", shade.node_colour);
  for (const auto& [node, share] : nodes) {
    const field::PointUm at = field.config().map.PositionOf(node);
    canvas->Add(R"svg(<circle cx="{:.1f}" cy="{:.1f}" r="1.6"/>)svg",
                canvas->X(static_cast<double>(at.x) / 1e6),
                canvas->Y(static_cast<double>(at.y) / 1e6));
  }
  canvas->Add("</g>");
}

// A node stands for the square of side a that is centred on it.
void DrawObstacles(Canvas* canvas, const Box& box, const field::FieldConfig& config) {
  const double side_m = static_cast<double>(config.map.cell_um) / 1e6;
  canvas->Add(R"svg(<g fill="{}">)svg", kObstacleColour);
  config.obstacles->ForEach([&](field::NodeIndex node) {
    const field::PointUm at = config.map.PositionOf(node);
    const double x = static_cast<double>(at.x) / 1e6;
    const double y = static_cast<double>(at.y) / 1e6;
    if (x >= box.left && x <= box.right && y >= box.bottom && y <= box.top) {
      canvas->Add(R"svg(<path d="M{0:.1f} {1:.1f}h{2:.1f}v{2:.1f}h-{2:.1f}z"/>)svg",
                  canvas->X(x - side_m / 2), canvas->Y(y + side_m / 2), side_m * kPixelsPerMetre);
    }
  });
  canvas->Add("</g>");
}

void DrawPath(Canvas* canvas, const field::Path& path) {
  std::string points;
  for (const field::PointUm point : path.points) {
    points += fmt::format("{:.1f},{:.1f} ", canvas->X(static_cast<double>(point.x) / 1e6),
                          canvas->Y(static_cast<double>(point.y) / 1e6));
  }
  canvas->Add(
      R"svg(<{} points="{}" fill="none" stroke="#333333" stroke-width="1.2" stroke-dasharray="6 4"/>)svg",
      path.closed ? "polygon" : "polyline", points);
}

// The robot as a triangle that faces its heading.
void DrawRobot(Canvas* canvas, const sim::PlanePose& pose, const std::string& colour, bool filled) {
  canvas->Add(
      R"svg(<path transform="translate({:.1f} {:.1f}) rotate({:.1f})" d="M13 0L-8 8L-8 -8Z" fill="{}" stroke="{}" stroke-width="1.5"/>)svg",
      canvas->X(pose.x_m), canvas->Y(pose.y_m), -pose.heading_rad * 180 / 3.14159265358979,
      filled ? colour : "white", colour);
}

void DrawWay(Canvas* canvas, const Way& way) {
  std::string points;
  for (const Sample& s : way.track) {
    points += fmt::format("{:.1f},{:.1f} ", canvas->X(s.pose.x_m), canvas->Y(s.pose.y_m));
  }
  canvas->Add(
      R"svg(<polyline points="{}" fill="none" stroke="{}" stroke-width="1.8" opacity="0.85"/>)svg",
      points, way.colour);
  DrawRobot(canvas, way.track.front().pose, way.colour, false);
  DrawRobot(canvas, way.track.back().pose, way.colour, true);
}

void DrawLegend(Canvas* canvas, bool obstacles, const std::vector<const Way*>& ways) {
  double y = canvas->plot_bottom() + 22;
  canvas->Add(
      R"svg(<path d="M10 {0:.1f}h30" stroke="#333333" stroke-width="1.2" stroke-dasharray="6 4"/><text x="48" y="{1:.1f}">target path; dots are nodes with pheromone, the shade its intensity</text>)svg",
      y - 4, y);
  if (obstacles) {
    y += kLegendLinePx;
    canvas->Add(
        R"svg(<path d="M18 {:.1f}h14v-14h-14z" fill="{}"/><text x="48" y="{:.1f}">obstacles</text>)svg",
        y + 3, kObstacleColour, y);
  }
  for (const Way* way : ways) {
    y += kLegendLinePx;
    canvas->Add(
        R"svg(<path d="M10 {0:.1f}h30" stroke="{1}" stroke-width="2.5"/><text x="48" y="{2:.1f}">{3}</text>)svg",
        y - 4, way->colour, y, EscapeXml(way->label));
  }
}

}  // namespace

std::string Draw(const Picture& picture, const field::Field& field, uint64_t now_ms) {
  std::vector<const Way*> listed;
  for (const Way& way : picture.ways) {
    if (way.in_legend) {
      listed.push_back(&way);
    }
  }
  const Box box = BoxOf(picture.path, picture.ways);
  const bool obstacles = picture.with_obstacles && field.config().obstacles;
  Canvas canvas(box, listed.size() + (obstacles ? 2 : 1), picture.title);
  DrawGrid(&canvas, box);
  for (const Shade& shade : picture.shades) {
    if (const field::PheromoneLaw* law = field.FindLaw(shade.type); law != nullptr) {
      DrawPheromone(&canvas, field, shade, *law, now_ms);
    }
  }
  if (obstacles) {
    DrawObstacles(&canvas, box, field.config());
  }
  DrawPath(&canvas, picture.path);
  for (const Way& way : picture.ways) {
    if (way.track.size() >= 2) {
      DrawWay(&canvas, way);
    }
  }
  DrawLegend(&canvas, obstacles, listed);
  return canvas.Take();
}

std::string DrawPathPicture(const std::string& title, const field::Field& field,
                            const field::Path& path, const std::vector<Way>& ways,
                            uint64_t now_ms) {
  Picture picture;
  picture.title = title;
  picture.path = path;
  picture.shades = {{path.type, "#e08214", "#b35806"}};
  picture.ways = ways;
  return Draw(picture, field, now_ms);
}

}  // namespace pheromone::swarm
