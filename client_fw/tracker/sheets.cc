#include "client_fw/tracker/sheets.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "client_fw/tracker/detector.h"
#include "server/base/xml_text.h"

namespace pheromone::tracker {
namespace {

constexpr double kShortMm = 210;  // A4
constexpr double kLongMm = 297;
constexpr double kMarginMm = 5;
constexpr double kFootMm = 22;  // below the tags: ruler and label

std::string Begin(double width, double height) {
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}mm\" height=\"{1}mm\" viewBox=\"0 0 "
      "{0} "
      "{1}\">\n<rect width=\"{0}\" height=\"{1}\" fill=\"#fff\"/>\n",
      width, height);
}

// The black modules of a tag whose middle is there, as runs along rows.
void AddTag(int tag, double x, double y, double edge, std::string* svg) {
  const double module = edge / kEdgeModules;
  const TagModules modules = ModulesOf(tag);
  *svg += "<path shape-rendering=\"crispEdges\" d=\"";
  for (size_t row = 0; row < modules.size(); ++row) {
    for (size_t begin = 0; begin < modules.size(); ++begin) {
      size_t end = begin;
      while (end < modules.size() && !modules[row][end]) {
        ++end;
      }
      if (end > begin) {
        fmt::format_to(std::back_inserter(*svg), "M{:.4f} {:.4f}h{:.4f}v{:.4f}h{:.4f}z",
                       x + module * (static_cast<double>(begin) - kTagModules / 2.0),
                       y + module * (static_cast<double>(row) - kTagModules / 2.0),
                       module * static_cast<double>(end - begin), module,
                       -module * static_cast<double>(end - begin));
        begin = end;
      }
    }
  }
  *svg += "\"/>\n";
}

// 100 mm, and what the sheet is.
void AddFoot(double width, double y, std::string_view label, std::string* svg) {
  const double left = width / 2 - 50;
  fmt::format_to(std::back_inserter(*svg),
                 "<path d=\"M{0:.2f} {1:.2f}v-4m0 2h100m0 -2v4\" fill=\"none\" stroke=\"#000\" "
                 "stroke-width=\"0.3\"/>\n<g font-family=\"sans-serif\" font-size=\"4\" "
                 "text-anchor=\"middle\">\n<text x=\"{2:.2f}\" y=\"{3:.2f}\">100 mm: print without "
                 "scaling</text>\n<text x=\"{2:.2f}\" y=\"{4:.2f}\">{5}</text>\n</g>\n</svg>\n",
                 left, y + 4, width / 2, y + 8, y + 14, EscapeXml(label));
}

}  // namespace

std::string TagSheet(int tag, double edge_m, std::string_view label) {
  const double edge = 1000 * edge_m;
  const double whole = edge * kTagModules / kEdgeModules;
  const double width = std::max(kShortMm, whole + 2 * kMarginMm);
  const double height = std::max(kLongMm, whole + kFootMm + 8 * kMarginMm);
  const double x = width / 2;
  const double y = 6 * kMarginMm + whole / 2;
  std::string svg = Begin(width, height);
  AddTag(tag, x, y, edge, &svg);
  // A frame along which it is cut out, and the arrow outside of it.
  fmt::format_to(
      std::back_inserter(svg),
      "<path d=\"M{:.2f} {:.2f}h{:.2f}v{:.2f}h{:.2f}z\" fill=\"none\" stroke=\"#bbb\" "
      "stroke-width=\"0.2\"/>\n<path d=\"M{:.2f} {:.2f}v-12m-4 5l4 -5l4 5\" fill=\"none\" "
      "stroke=\"#000\" stroke-width=\"0.8\"/>\n",
      x - whole / 2, y - whole / 2, whole, whole, -whole, x, y - whole / 2 - 4);
  AddFoot(width, y + whole / 2 + kMarginMm,
          fmt::format("tag {}, {}; edge of the black square {:.1f} mm", tag, label, edge), &svg);
  return svg;
}

std::string BoardSheet(const Board& board) {
  const double edge = 1000 * board.edge_m;
  const double pitch = 1000 * board.pitch_m;
  const double width = std::max(kLongMm, pitch * board.columns + 2 * kMarginMm);
  const double height = std::max(kShortMm, pitch * board.rows + kFootMm + 2 * kMarginMm);
  const double left = width / 2 - pitch * (board.columns - 1) / 2;
  std::string svg = Begin(width, height);
  for (int i = 0; i < board.tags(); ++i) {
    const Point place = 1000 * board.PlaceOf(i);
    AddTag(board.first_tag + i, left + place.x(), kMarginMm + pitch / 2 - place.y(), edge, &svg);
  }
  AddFoot(width, kMarginMm + pitch * board.rows,
          fmt::format("board for the lens: tags {} to {}", board.first_tag,
                      board.first_tag + board.tags() - 1),
          &svg);
  return svg;
}

}  // namespace pheromone::tracker
