#include "client_fw/tracker/annotated.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <span>
#include <vector>

#include "server/base/base64.h"
#include "server/base/xml_text.h"

namespace pheromone::tracker {
namespace {

constexpr char kFloorColour[] = "#0072b2";
constexpr char kSeenColour[] = "#e69f00";
constexpr char kRejectedColour[] = "#d55e00";
constexpr double kGridM = 0.5;
constexpr int kMaxGridLines = 100;

class Annotation {
 public:
  Annotation(const Picture& picture, std::string_view png) {
    fmt::format_to(std::back_inserter(svg_),
                   "<svg xmlns=\"http://www.w3.org/2000/svg\" "
                   "xmlns:xlink=\"http://www.w3.org/1999/xlink\" width=\"{0}\" height=\"{1}\" "
                   "viewBox=\"0 0 {0} {1}\" font-family=\"sans-serif\" font-size=\"{2}\">\n<image "
                   "width=\"{0}\" height=\"{1}\" xlink:href=\"data:image/png;base64,{3}\"/>\n",
                   picture.width, picture.height, std::max(12, picture.width / 70), ToBase64(png));
  }

  // Points that the camera does not see are left out.
  void Line(std::span<const Point> points, const char* colour, double width, bool closed) {
    std::string path;
    for (const Point& it : points) {
      if (it.allFinite()) {
        fmt::format_to(std::back_inserter(path), "{}{:.1f} {:.1f}", path.empty() ? 'M' : 'L',
                       it.x(), it.y());
      }
    }
    fmt::format_to(std::back_inserter(svg_),
                   "<path d=\"{}{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{:.1f}\"/>\n", path,
                   closed ? "Z" : "", colour, width);
  }

  void Text(const Point& at, const char* colour, std::string_view text) {
    fmt::format_to(std::back_inserter(svg_),
                   "<text x=\"{:.1f}\" y=\"{:.1f}\" fill=\"{}\" stroke=\"#fff\" stroke-width=\"3\" "
                   "paint-order=\"stroke\">{}</text>\n",
                   at.x(), at.y(), colour, EscapeXml(text));
  }

  std::string Take() { return std::move(svg_) + "</svg>\n"; }

 private:
  std::string svg_;
};

// The map's lines over the rectangle of the floor tags, each half metre.
void AddGrid(const Settings& settings, const Camera& camera, Annotation* annotation) {
  Point least = settings.floor.front().place;
  Point most = least;
  for (const FloorTag& it : settings.floor) {
    least = least.cwiseMin(it.place);
    most = most.cwiseMax(it.place);
  }
  for (const int axis : {0, 1}) {
    const auto first = static_cast<int>(std::ceil(least[axis] / kGridM));
    const auto last = static_cast<int>(std::floor(most[axis] / kGridM));
    for (int i = first; i <= last && i - first < kMaxGridLines; ++i) {
      std::vector<Point> line;
      for (int step = 0; step <= 20; ++step) {
        Eigen::Vector3d point = Eigen::Vector3d::Zero();
        point[axis] = kGridM * i;
        point[1 - axis] = least[1 - axis] + (most[1 - axis] - least[1 - axis]) * step / 20.0;
        line.push_back(Project(camera, point));
      }
      annotation->Line(line, kFloorColour, i % 2 == 0 ? 1.2 : 0.5, false);
      if (i % 2 == 0 && line.front().allFinite()) {
        annotation->Text(line.front(), kFloorColour,
                         fmt::format("{} = {:.0f} m", axis == 0 ? 'x' : 'y', kGridM * i));
      }
    }
  }
}

}  // namespace

Result<std::string> AnnotatedSvg(const Picture& picture, const Settings& settings,
                                 const View& view) {
  PHEROMONE_TRY(const std::string png, EncodePng(picture));
  Annotation annotation(picture, png);
  const double line = std::max(12, picture.width / 70) * 1.3;
  std::string said = view.why_no_camera;
  if (view.camera) {
    const Camera& camera = view.camera->camera;
    AddGrid(settings, camera, &annotation);
    for (const FloorTag& it : settings.floor) {
      std::vector<Point> outline;
      for (const Point& corner : SquareAt(it.place, it.heading_rad, settings.floor_edge_m)) {
        outline.push_back(Project(camera, {corner.x(), corner.y(), 0}));
      }
      annotation.Line(outline, kFloorColour, 2, true);
      const bool seen = std::find(view.floor_seen.begin(), view.floor_seen.end(), it.tag) !=
                        view.floor_seen.end();
      annotation.Text(outline[1], kFloorColour, fmt::format("{}{}", it.tag, seen ? "" : " hidden"));
    }
    for (const SeenRobot& it : view.seen) {
      annotation.Line(it.corners, kSeenColour, 2, true);
      const Point ahead(std::cos(it.heading_rad), std::sin(it.heading_rad));
      std::vector<Point> arrow;
      for (const double distance : {0.0, 1.5}) {
        const Point point = it.place + distance * settings.robot_edge_m * ahead;
        arrow.push_back(Project(camera, {point.x(), point.y(), it.robot.height_m}));
      }
      annotation.Line(arrow, kSeenColour, 3, false);
      const Point right =
          *std::max_element(it.corners.begin(), it.corners.end(),
                            [](const Point& a, const Point& b) { return a.x() < b.x(); });
      annotation.Text(right + Point(line / 4, line / 4), "#000",
                      fmt::format("{} {}", it.robot.link, it.robot.id));
    }
    said = fmt::format("floor tags {} of {}, {:.2f} px; robots {} of {}", view.floor_seen.size(),
                       settings.floor.size(), view.camera->rms_px, view.seen.size(),
                       settings.robots.size());
  }
  double y = line;
  annotation.Text({line / 2, y}, "#000", said);
  for (const RejectedTag& it : view.rejected) {
    annotation.Line(it.corners, kRejectedColour, 2, true);
    annotation.Text({line / 2, y += line}, kRejectedColour,
                    fmt::format("{} {}: {}", it.robot.link, it.robot.id, it.why));
  }
  for (const RobotTag& it : view.missed) {
    annotation.Text({line / 2, y += line}, "#000",
                    fmt::format("{} {}: tag {} was not found", it.link, it.id, it.tag));
  }
  return annotation.Take();
}

}  // namespace pheromone::tracker
