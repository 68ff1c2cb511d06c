#include "server/operators/ctl/map_svg.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string_view>
#include <utility>

#include "server/base/base64.h"
#include "server/base/format.h"
#include "server/base/xml_text.h"
#include "server/formats/maps/png_picture.h"

namespace pheromone::ctl {
namespace {

constexpr double kLongSide = 640;  // of the map, in pixels
constexpr double kLeft = 64;
constexpr double kTop = 40;
constexpr double kBottom = 56;
constexpr double kRight = 150;
constexpr double kBarGap = 24;
constexpr double kBarWidth = 18;
constexpr double kTick = 5;
constexpr int kStops = 32;  // of the colour scale

std::string ColourOf(const maps::Rgb& colour) {
  return fmt::format("#{:02x}{:02x}{:02x}", colour.red, colour.green, colour.blue);
}

// 1, 2 or 5 times a power of ten, for at most about eight steps.
double StepFor(double span) {
  const double power = std::pow(10, std::floor(std::log10(span / 8)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (span <= 8 * factor * power) {
      return factor * power;
    }
  }
  return 10 * power;
}

// A multiple of a step, without what its arithmetic adds.
std::string TickText(double value, double step) {
  const int digits = std::max(0, static_cast<int>(-std::floor(std::log10(step) + 1e-9)));
  return fmt::format("{:.{}f}", std::abs(value) < step / 2 ? 0.0 : value, digits);
}

class Figure {
 public:
  Figure(const maps::Raster& raster, const MapSvgStyle& style)
      : style_(style),
        left_m_(static_cast<double>(raster.origin.x) / 1e6),
        bottom_m_(static_cast<double>(raster.origin.y) / 1e6),
        width_m_(static_cast<double>(raster.cell_um) * raster.columns / 1e6),
        height_m_(static_cast<double>(raster.cell_um) * raster.rows / 1e6),
        scale_(kLongSide / std::max(width_m_, height_m_)),
        width_(width_m_ * scale_),
        height_(height_m_ * scale_),
        has_obstacles_(std::any_of(raster.values.begin(), raster.values.end(),
                                   [](double value) { return std::isnan(value); })) {}

  std::string Draw(std::string_view png) {
    const double page_width = kLeft + width_ + kRight;
    const double page_height = kTop + std::max(height_, 120.0) + kBottom;
    Add("<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.1f}\" height=\"{1:.1f}\" "
        "viewBox=\"0 0 {0:.1f} {1:.1f}\" font-family=\"sans-serif\" font-size=\"13\">",
        page_width, page_height);
    Add("<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>");
    Text(kLeft + width_ / 2, kTop - 16, "middle", style_.title);
    Add("<image x=\"{:.2f}\" y=\"{:.2f}\" width=\"{:.2f}\" height=\"{:.2f}\" "
        "preserveAspectRatio=\"none\" style=\"image-rendering:pixelated\" "
        "href=\"data:image/png;base64,{}\"/>",
        kLeft, kTop, width_, height_, ToBase64(png));
    Box(kLeft, kTop, width_, height_, "none");
    AddAxes();
    AddScale();
    svg_ += "</svg>\n";
    return std::move(svg_);
  }

 private:
  template <typename... Args>
  void Add(fmt::format_string<Args...> format, Args&&... args) {
    fmt::format_to(std::back_inserter(svg_), format, std::forward<Args>(args)...);
    svg_ += '\n';
  }
  void Text(double x, double y, const char* anchor, std::string_view text) {
    Add("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\">{}</text>", x, y, anchor,
        EscapeXml(text));
  }
  // Upwards.
  void TurnedText(double x, double y, std::string_view text) {
    Add("<text transform=\"translate({:.1f} {:.1f}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
        x, y, EscapeXml(text));
  }
  void Line(double x1, double y1, double x2, double y2) {
    Add("<path d=\"M{:.2f} {:.2f}L{:.2f} {:.2f}\" stroke=\"#000\"/>", x1, y1, x2, y2);
  }
  void Box(double x, double y, double width, double height, std::string_view fill) {
    Add("<rect x=\"{:.2f}\" y=\"{:.2f}\" width=\"{:.2f}\" height=\"{:.2f}\" fill=\"{}\" "
        "stroke=\"#000\"/>",
        x, y, width, height, fill);
  }

  // Calls visit(value, text) for the multiples of a step from `first` to `last`.
  template <typename Visit>
  static void ForEachTick(double first, double last, Visit&& visit) {
    const double step = StepFor(last - first);
    for (double i = std::ceil(first / step - 1e-6); i * step <= last + step * 1e-6; ++i) {
      visit(i * step, TickText(i * step, step));
    }
  }

  void AddAxes() {
    const double below = kTop + height_;
    ForEachTick(left_m_, left_m_ + width_m_, [&](double value, const std::string& text) {
      const double x = kLeft + (value - left_m_) * scale_;
      Line(x, below, x, below + kTick);
      Text(x, below + kTick + 14, "middle", text);
    });
    ForEachTick(bottom_m_, bottom_m_ + height_m_, [&](double value, const std::string& text) {
      const double y = below - (value - bottom_m_) * scale_;
      Line(kLeft - kTick, y, kLeft, y);
      Text(kLeft - kTick - 4, y + 4, "end", text);
    });
    Text(kLeft + width_ / 2, below + 42, "middle", "x in m");
    TurnedText(kLeft - 44, kTop + height_ / 2, "y in m");
  }

  void AddScale() {
    const double x = kLeft + width_ + kBarGap;
    const double height = std::max(height_, 120.0) - (has_obstacles_ ? 40 : 0);
    Add("<linearGradient id=\"scale\" x1=\"0\" y1=\"1\" x2=\"0\" y2=\"0\">");
    for (int i = 0; i <= kStops; ++i) {
      const double share = static_cast<double>(i) / kStops;
      Add("<stop offset=\"{:.5f}\" stop-color=\"{}\"/>", share, ColourOf(maps::Viridis(share)));
    }
    Add("</linearGradient>");
    Box(x, kTop, kBarWidth, height, "url(#scale)");
    ForEachTick(0, style_.maximum, [&](double value, const std::string& text) {
      const double y = kTop + height * (1 - value / style_.maximum);
      Line(x + kBarWidth, y, x + kBarWidth + kTick, y);
      Text(x + kBarWidth + kTick + 4, y + 4, "start", text);
    });
    TurnedText(x + kBarWidth + 66, kTop + height / 2, style_.scale_label);
    if (has_obstacles_) {
      Box(x, kTop + height + 22, kBarWidth, kBarWidth, ColourOf(style_.obstacle));
      Text(x + kBarWidth + 8, kTop + height + 36, "start", "obstacle");
    }
  }

  const MapSvgStyle& style_;
  const double left_m_;
  const double bottom_m_;
  const double width_m_;
  const double height_m_;
  const double scale_;  // pixels in a metre
  const double width_;
  const double height_;
  const bool has_obstacles_;
  std::string svg_;
};

}  // namespace

Result<std::string> MapToSvg(const maps::Raster& raster, const MapSvgStyle& style) {
  PHEROMONE_TRY(const std::string png,
                maps::EncodePicture(raster, {.low = 0,
                                             .high = style.maximum,
                                             .unknown = style.obstacle,
                                             .pixels_per_cell = style.pixels_per_cell}));
  return Figure(raster, style).Draw(png);
}

}  // namespace pheromone::ctl
