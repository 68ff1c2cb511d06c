#include "client_fw/swarm/svg.h"

#include "server/base/xml_text.h"

namespace pheromone::swarm {

Svg::Svg(double width, double height, std::string_view title) {
  Add(R"svg(<svg xmlns="http://www.w3.org/2000/svg" width="{0:.0f}" height="{1:.0f}" viewBox="0 0 {0:.0f} {1:.0f}">)svg",
      width, height);
  Add("<style>text{{font-family:sans-serif;font-size:12px;fill:#333}}.h{{font-size:16px;"
      "font-weight:bold}}.b{{font-weight:bold}}.t{{font-size:11px;fill:#666}}.m{{text-anchor:"
      "middle}}.e{{text-anchor:end}}</style>");
  Add(R"svg(<rect width="100%" height="100%" fill="white"/>)svg");
  Text(12, 24, "h", title);
}

void Svg::Text(double x, double y, const char* classes, std::string_view text) {
  Add(R"svg(<text x="{:.1f}" y="{:.1f}" class="{}">{}</text>)svg", x, y, classes, EscapeXml(text));
}

std::string Svg::Take() {
  Add("</svg>");
  return std::move(svg_);
}

}  // namespace pheromone::swarm
