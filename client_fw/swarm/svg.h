// An SVG document, and the look that all of our pictures share.
//
//   Svg svg(640, 400, "Robot-step against reach");
//   svg.Add(R"svg(<path d="M0 {:.1f}h{:.1f}" stroke="#ddd"/>)svg", y, width);
//   svg.Text(12, 44, "t", "each swarm's choices");
//   const std::string document = svg.Take();
//
// Lengths are pixels, y grows downwards. Classes of text: h heading, b bold, t small and grey, m
// centred on x, e ending at x; they can be combined, as in "t m". Not thread-safe.
#pragma once

#include <fmt/format.h>

#include <iterator>
#include <string>
#include <string_view>
#include <utility>

namespace pheromone::swarm {

class Svg {
 public:
  /// A white page with its title in the first 30 pixels.
  Svg(double width, double height, std::string_view title);

  /// One line of markup: what is not markup needs EscapeXml.
  template <typename... Args>
  void Add(fmt::format_string<Args...> format, Args&&... args) {
    fmt::format_to(std::back_inserter(svg_), format, std::forward<Args>(args)...);
    svg_ += '\n';
  }

  /// `text` on the baseline y, escaped; `classes` may be empty.
  void Text(double x, double y, const char* classes, std::string_view text);

  /// The complete document; the last call.
  std::string Take();

 private:
  std::string svg_;
};

}  // namespace pheromone::swarm
