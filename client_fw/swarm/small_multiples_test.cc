#include "client_fw/swarm/small_multiples.h"

#include <gtest/gtest.h>

#include <string>

namespace pheromone::swarm {
namespace {

Panel Simple() {
  Panel panel;
  panel.title = "a < b";
  panel.series = {{"one", "#111111", {{0, 0}, {10, 100}}}};
  return panel;
}

size_t CountOf(const std::string& text, const std::string& part) {
  size_t count = 0;
  for (size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) {
    ++count;
  }
  return count;
}

// A panel is 300 x 220; its axes lie 52, 30, 16 and 42 from its edges, below 66 of title and
// legend.
TEST(SmallMultiples, MarksLieWhereTheAxesSay) {
  const std::string svg = DrawPanels("t", {Simple()}, 1);
  EXPECT_NE(svg.find(R"(points="52.0,244.0 284.0,96.0 ")"), std::string::npos) << svg;
}

TEST(SmallMultiples, WhatIsTooHighLiesOnTheEdge) {
  Panel panel = Simple();
  panel.y_most = 50;
  panel.series[0].marks = {{0, 25}, {10, 100}};
  const std::string svg = DrawPanels("t", {panel}, 1);
  EXPECT_NE(svg.find(R"(points="52.0,170.0 284.0,96.0 ")"), std::string::npos) << svg;
  EXPECT_EQ(CountOf(svg, "l-4 7h8Z"), 1u);
}

TEST(SmallMultiples, ASharedLabelIsListedOnceAndTextIsEscaped) {
  const std::string svg = DrawPanels("x & y", {Simple(), Simple(), Simple()}, 2);
  EXPECT_EQ(CountOf(svg, ">one<"), 1u);
  EXPECT_EQ(CountOf(svg, "a &lt; b"), 3u);
  EXPECT_EQ(CountOf(svg, "x &amp; y"), 1u);
}

TEST(SmallMultiples, WhiskersAreDrawnOnlyWhereThereIsASpread) {
  Panel panel = Simple();
  const size_t before = CountOf(DrawPanels("t", {panel}, 1), R"(opacity="0.6")");
  panel.series[0].marks[1].low = 90;
  panel.series[0].marks[1].high = 110;
  EXPECT_EQ(CountOf(DrawPanels("t", {panel}, 1), R"(opacity="0.6")"), before + 1);
}

TEST(SmallMultiples, EmptyPanelsAreStillAPicture) {
  const std::string svg = DrawPanels("t", {Panel{}}, 0);
  EXPECT_EQ(CountOf(svg, "nan"), 0u);
  EXPECT_EQ(CountOf(svg, "inf"), 0u);
  EXPECT_NE(svg.find("</svg>"), std::string::npos);
  EXPECT_NE(DrawPanels("t", {}, 3).find("</svg>"), std::string::npos);
}

}  // namespace
}  // namespace pheromone::swarm
