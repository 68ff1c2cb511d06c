#include "client_fw/swarm/svg.h"

#include <gtest/gtest.h>

namespace pheromone::swarm {
namespace {

TEST(Svg, IsOneDocumentOfItsSize) {
  Svg svg(320, 200.4, "x & y");
  svg.Add(R"svg(<path d="M0 {:.1f}"/>)svg", 2.25);
  svg.Text(1, 2.05, "t m", "a<b");
  const std::string document = svg.Take();
  EXPECT_EQ(document.rfind(R"(<svg xmlns="http://www.w3.org/2000/svg" width="320" height="200" )"
                           R"(viewBox="0 0 320 200">)",
                           0),
            0u)
      << document;
  EXPECT_NE(document.find(R"(class="h">x &amp; y</text>)"), std::string::npos) << document;
  EXPECT_NE(document.find("<path d=\"M0 2.2\"/>\n"), std::string::npos) << document;
  EXPECT_NE(document.find("<text x=\"1.0\" y=\"2.0\" class=\"t m\">a&lt;b</text>\n</svg>\n"),
            std::string::npos)
      << document;
}

}  // namespace
}  // namespace pheromone::swarm
