#include "server/operators/ctl/screen.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "server/formats/maps/colour_map.h"

namespace pheromone::ctl {
namespace {

constexpr maps::Rgb kObstacle = {128, 128, 128};
constexpr maps::Rgb kRobot = {255, 64, 64};
constexpr std::string_view kShades = " .:-=+*%@";
constexpr std::string_view kUpperHalf = "\u2580";
constexpr std::string_view kReset = "\x1b[0m";

// Of the 6 x 6 x 6 cube of xterm's 256 colours, the nearest.
int CubeIndex(maps::Rgb colour) {
  const auto step = [](uint8_t level) {
    return level < 48 ? 0 : level < 115 ? 1 : (level - 35) / 40;
  };
  return 16 + 36 * step(colour.red) + 6 * step(colour.green) + step(colour.blue);
}

// The escape sequence for a colour; `layer` is 38 for the character and 48 for what is behind it.
std::string Paint(maps::Rgb colour, int layer, Colours colours) {
  return colours == Colours::k24Bit
             ? fmt::format("\x1b[{};2;{};{};{}m", layer, colour.red, colour.green, colour.blue)
             : fmt::format("\x1b[{};5;{}m", layer, CubeIndex(colour));
}

class Canvas {
 public:
  Canvas(const MapPicture& picture, ScreenSize size, Colours colours)
      : picture_(picture),
        columns_(std::min(picture.columns, size.columns)),
        lines_(std::min((picture.rows + 1) / 2, size.rows)),
        colours_(colours) {
    markers_.resize(static_cast<size_t>(columns_) * static_cast<size_t>(lines_));
    for (const Marker& marker : picture.markers) {
      Place(marker);
    }
  }

  std::string Text() const {
    std::string text;
    for (int line = 0; line < lines_; ++line) {
      std::string before;
      for (int column = 0; column < columns_; ++column) {
        const std::string style = StyleAt(column, line);
        text += style != before ? style : "";
        text += GlyphAt(column, line);
        before = style;
      }
      text += before.empty() ? "" : kReset;
      text += '\n';
    }
    return text;
  }

 private:
  void Place(const Marker& marker) {
    const double column = std::floor((marker.x_m - picture_.left_m) / picture_.cell_m);
    const double row =
        picture_.rows - 1 - std::floor((marker.y_m - picture_.bottom_m) / picture_.cell_m);
    const double line = std::floor(row / 2);
    if (!(column >= 0 && column < columns_ && row >= 0 && line < lines_)) {
      return;
    }
    Put(static_cast<int>(column), static_cast<int>(line), ArrowOf(marker.heading_deg));
    for (size_t i = 0; i < marker.label.size(); ++i) {
      Put(static_cast<int>(column) + 1 + static_cast<int>(i), static_cast<int>(line),
          marker.label.substr(i, 1));
    }
  }

  void Put(int column, int line, std::string glyph) {
    if (column < columns_) {
      markers_[IndexOf(column, line)] = std::move(glyph);
    }
  }

  size_t IndexOf(int column, int line) const {
    return static_cast<size_t>(line) * static_cast<size_t>(columns_) + static_cast<size_t>(column);
  }

  // Nothing below the last row, if the number of rows is odd; then the outer optional is empty.
  std::optional<std::optional<double>> ValueAt(int column, int row) const {
    const size_t index = static_cast<size_t>(row) * static_cast<size_t>(picture_.columns) +
                         static_cast<size_t>(column);
    return row < picture_.rows && index < picture_.values.size()
               ? std::optional(picture_.values[index])
               : std::nullopt;
  }

  maps::Rgb ColourAt(int column, int row) const {
    const auto value = ValueAt(column, row);
    if (!value) {
      return {};
    }
    return *value ? maps::Viridis(**value / picture_.maximum) : kObstacle;
  }

  std::string StyleAt(int column, int line) const {
    if (colours_ == Colours::kNone) {
      return "";
    }
    const bool robot = !markers_[IndexOf(column, line)].empty();
    return Paint(robot ? kRobot : ColourAt(column, 2 * line), 38, colours_) +
           Paint(robot ? maps::Rgb{} : ColourAt(column, 2 * line + 1), 48, colours_);
  }

  std::string GlyphAt(int column, int line) const {
    const std::string& marker = markers_[IndexOf(column, line)];
    if (!marker.empty()) {
      return marker;
    }
    if (colours_ != Colours::kNone) {
      return std::string(kUpperHalf);
    }
    double most = -1;
    for (const int row : {2 * line, 2 * line + 1}) {
      const auto value = ValueAt(column, row);
      most = std::max(most, value && *value ? **value : -1);
    }
    if (most < 0) {
      return "#";
    }
    const double share = std::clamp(most / picture_.maximum, 0.0, 1.0);
    // Even the smallest content is visible.
    const auto last = static_cast<double>(kShades.size() - 1);
    return std::string(1, kShades[static_cast<size_t>(std::ceil(share * last))]);
  }

  const MapPicture& picture_;
  const int columns_;
  const int lines_;
  const Colours colours_;
  std::vector<std::string> markers_;  // by character; empty: no robot
};

}  // namespace

std::string Draw(const MapPicture& picture, ScreenSize size, Colours colours) {
  return Canvas(picture, size, colours).Text();
}

int NodesPerCell(int map_columns, int map_rows, ScreenSize size) {
  const int across = std::max(size.columns, 1);
  const int down = std::max(size.rows, 1) * 2;
  return std::max({1, (map_columns + across - 1) / across, (map_rows + down - 1) / down});
}

std::string ArrowOf(double heading_deg) {
  static constexpr std::array<std::string_view, 8> kArrows = {
      "\u2192", "\u2197", "\u2191", "\u2196", "\u2190", "\u2199", "\u2193", "\u2198"};
  const auto eighth = static_cast<int64_t>(std::llround(heading_deg / 45));
  return std::string(kArrows[static_cast<size_t>((eighth % 8 + 8) % 8)]);
}

}  // namespace pheromone::ctl
