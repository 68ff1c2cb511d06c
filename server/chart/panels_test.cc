#include "server/chart/panels.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

namespace pheromone::chart {
namespace {

Panel Simple() {
  Panel panel;
  panel.title = "a < b";
  panel.series = {{"one", "#111111", {{0, 0}, {10, 100}}}};
  return panel;
}

std::string Draw(const Panel& panel) {
  return DrawPanels("t", {panel}, {});
}

size_t CountOf(const std::string& text, const std::string& part) {
  size_t count = 0;
  for (size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) {
    ++count;
  }
  return count;
}

// A panel is 300 x 220; its axes lie 52, 30, 16 and 42 from its edges, below 66 of title and
// legend. So x goes from 52 to 284, y from 244 up to 96.
double At(double from, double to, double share) {
  return from + (to - from) * share;
}
double LogShare(double value, double from, double to) {
  return std::log10(value / from) / std::log10(to / from);
}

TEST(Panels, MarksLieWhereTheAxesSay) {
  const std::string svg = Draw(Simple());
  EXPECT_EQ(CountOf(svg, R"(points="52.0,244.0 284.0,96.0 ")"), 1u) << svg;
}

TEST(Panels, LinearTicksLieAtTheirValues) {
  const std::string svg = Draw(Simple());
  for (int i = 0; i <= 5; ++i) {
    EXPECT_EQ(CountOf(svg, fmt::format(R"(<text x="47.0" y="{:.1f}" class="t e">{}</text>)",
                                       At(244, 96, i / 5.0) + 4, 20 * i)),
              1u)
        << svg;
    EXPECT_EQ(CountOf(svg, fmt::format(R"(<text x="{:.1f}" y="259.0" class="t m">{}</text>)",
                                       At(52, 284, i / 5.0), 2 * i)),
              1u)
        << svg;
  }
}

// x from 2 to 500 by 1, 2 and 5; y from 1 to 10000 by decades.
TEST(Panels, LogarithmicAxesHaveLogarithmicPlaces) {
  Panel panel;
  panel.x_scale = panel.y_scale = Scale::kLogarithmic;
  panel.series = {{"one", "", {{3, 2}, {40, 700}, {400, 9000}}}};
  const std::string svg = Draw(panel);
  std::string points;
  for (const Mark& mark : panel.series[0].marks) {
    const double x = At(52, 284, LogShare(mark.x, 2, 500));
    const double y = At(244, 96, LogShare(mark.y, 1, 10000));
    points += fmt::format("{:.1f},{:.1f} ", x, y);
    EXPECT_EQ(CountOf(svg, fmt::format(R"(translate({:.1f} {:.1f}) scale)", x, y)), 1u) << svg;
  }
  EXPECT_EQ(CountOf(svg, "points=\"" + points + "\""), 1u) << svg;
  for (const int x : {2, 5, 10, 20, 50, 100, 200, 500}) {
    EXPECT_EQ(CountOf(svg, fmt::format(R"(<text x="{:.1f}" y="259.0" class="t m">{}</text>)",
                                       At(52, 284, LogShare(x, 2, 500)), x)),
              1u)
        << svg;
  }
  for (const int y : {1, 10, 100, 1000, 10000}) {
    EXPECT_EQ(CountOf(svg, fmt::format(R"(y="{:.1f}" class="t e">{}</text>)",
                                       At(244, 96, LogShare(y, 1, 10000)) + 4, y)),
              1u)
        << svg;
  }
}

TEST(Panels, WhatHasNoPlaceIsLeftOut) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  Panel panel = Simple();
  panel.x_scale = panel.y_scale = Scale::kLogarithmic;
  panel.series[0].marks = {{1, 1}, {0, 5}, {5, -1}, {kNan, 5}, {5, kNan}, {10, 100}};
  const std::string svg = Draw(panel);
  EXPECT_EQ(CountOf(svg, R"(points="52.0,244.0 284.0,96.0 ")"), 1u) << svg;
  EXPECT_EQ(CountOf(svg, "scale("), 2u) << svg;
  EXPECT_EQ(CountOf(svg, "nan"), 0u) << svg;
}

TEST(Panels, WhatIsTooHighLiesOnTheEdge) {
  Panel panel = Simple();
  panel.y_most = 50;
  panel.series[0].marks = {{0, 25}, {10, 100}};
  const std::string svg = Draw(panel);
  EXPECT_EQ(CountOf(svg, R"(points="52.0,170.0 284.0,96.0 ")"), 1u) << svg;
  EXPECT_EQ(CountOf(svg, "M284.0 96.0l-4 7h8Z"), 1u) << svg;
}

TEST(Panels, ASharedLabelIsListedOnceAndTextIsEscaped) {
  const std::string svg = DrawPanels("x & y", {Simple(), Simple(), Simple()}, {.columns = 2});
  EXPECT_EQ(CountOf(svg, ">one<"), 1u);
  EXPECT_EQ(CountOf(svg, "a &lt; b"), 3u);
  EXPECT_EQ(CountOf(svg, "x &amp; y"), 1u);
}

// The second panel lacks the first series: what is left keeps its mark and colour.
TEST(Panels, ALabelHasOneMarkAndColourInAllPanels) {
  Panel both;
  both.series = {{"one", "", {{0, 1}}}, {"two", "", {{0, 1}}}};
  Panel second;
  second.series = {both.series[1]};
  const std::string svg = DrawPanels("t", {both, second}, {.columns = 2});
  const std::string circle = R"(d="M-5 0A5 5 0 1 0 5 0A5 5 0 1 0 -5 0Z" fill="#d55e00")";
  const std::string square = R"(d="M-4.5 -4.5H4.5V4.5H-4.5Z" fill="#0072b2")";
  EXPECT_EQ(CountOf(svg, circle), 2u) << svg;  // legend and panel
  EXPECT_EQ(CountOf(svg, square), 3u) << svg;  // legend and both panels
}

TEST(Panels, ALongLegendHasMoreLines) {
  Panel panel = Simple();
  for (const char* label : {"a second series of marks", "a third series of marks"}) {
    panel.series.push_back({label, "", {{0, 1}}});
  }
  const std::string svg = Draw(panel);  // two lines of 20
  EXPECT_EQ(CountOf(svg, R"(height="314")"), 1u) << svg;
  EXPECT_EQ(CountOf(DrawPanels("t", {panel}, {.panel_width = 700}), R"(height="294")"), 1u);
}

TEST(Panels, WhiskersAreDrawnOnlyWhereThereIsASpread) {
  Panel panel = Simple();
  EXPECT_EQ(CountOf(Draw(panel), R"(opacity="0.6")"), 0u);
  panel.series[0].marks[1] = {10, 70, 50, 100};
  EXPECT_EQ(CountOf(Draw(panel), R"(<path d="M284.0 170.0V96.0")"), 1u) << Draw(panel);
  panel.y_scale = Scale::kLogarithmic;  // from 50 to 100
  panel.series[0].marks = {{10, 70, 0, 100}, {0, 50}};
  EXPECT_EQ(CountOf(Draw(panel), R"(<path d="M284.0 244.0V96.0")"), 1u) << Draw(panel);
}

TEST(Panels, CategoriesHaveTheirNames) {
  Panel panel = Simple();
  panel.categories = {"line", "<circle>"};
  panel.series[0].marks = {{0, 100}, {1, 50}};
  const std::string svg = Draw(panel);  // a quarter and three quarters of the way
  EXPECT_EQ(CountOf(svg, R"(<text x="110.0" y="259.0" class="t m">line</text>)"), 1u) << svg;
  EXPECT_EQ(CountOf(svg, R"(<text x="226.0" y="259.0" class="t m">&lt;circle&gt;</text>)"), 1u);
  EXPECT_EQ(CountOf(svg, R"(points="110.0,96.0 226.0,170.0 ")"), 1u) << svg;
}

// A bold letter of 16 pixels is at least 8 wide, on average.
TEST(Panels, ALongTitleHasItsRoom) {
  const std::string svg = DrawPanels(std::string(60, 'm'), {Simple()}, {});
  const size_t width = svg.find("width=\"");
  ASSERT_NE(width, std::string::npos);
  EXPECT_GE(std::stoi(svg.substr(width + 7)), 12 + 60 * 8);
}

// 20 for the label and 6.2 for each letter.
TEST(Panels, LongTicksHaveTheirRoom) {
  Panel panel = Simple();
  panel.y_tick = [](double y) { return fmt::format("{:07} ms", y); };
  const std::string svg = Draw(panel);
  EXPECT_EQ(CountOf(svg, R"(<text x="77.0" y="248.0" class="t e">0000000 ms</text>)"), 1u) << svg;
}

TEST(Panels, EmptyPanelsAreStillAPicture) {
  Panel logarithmic;
  logarithmic.x_scale = logarithmic.y_scale = Scale::kLogarithmic;
  const std::string svg = DrawPanels("t", {Panel{}, logarithmic}, {.columns = 0});
  EXPECT_EQ(CountOf(svg, "nan"), 0u);
  EXPECT_EQ(CountOf(svg, "inf"), 0u);
  EXPECT_NE(svg.find("</svg>"), std::string::npos);
  EXPECT_NE(DrawPanels("t", {}, {.columns = 3}).find("</svg>"), std::string::npos);
}

}  // namespace
}  // namespace pheromone::chart
