#include "server/formats/rdf/xml_depth.h"

#include <gtest/gtest.h>

#include <string>

namespace pheromone::ctl {
namespace {

std::string Times(size_t count, const std::string& text) {
  std::string all;
  for (size_t i = 0; i < count; ++i) {
    all += text;
  }
  return all;
}

bool IsTooDeep(const std::string& text) {
  return TooDeepAt(text) < text.size();
}

TEST(XmlDepthTest, SixtyFourElementsMayBeNested) {
  EXPECT_FALSE(IsTooDeep(Times(64, "<a>") + Times(64, "</a>")));
  const std::string deep = Times(65, "<a>");
  EXPECT_EQ(TooDeepAt(deep), 64u * 3);
}

TEST(XmlDepthTest, ElementsBesideEachOtherAreNotNested) {
  EXPECT_FALSE(IsTooDeep(Times(1000, "<a b='c'>d</a>")));
  EXPECT_FALSE(IsTooDeep(Times(1000, "<a b=\"c\"/>")));
  EXPECT_FALSE(IsTooDeep(Times(1000, "<!-- <a> --><![CDATA[<a>]]><?a <a>?>")));
}

TEST(XmlDepthTest, TextAndAttributesHideNoElements) {
  EXPECT_TRUE(IsTooDeep(Times(65, "<a>/>")));
  EXPECT_TRUE(IsTooDeep(Times(65, "<a b='/>'>")));
  EXPECT_TRUE(IsTooDeep(Times(65, "<a b=\"'\" c='</a>'>")));
  EXPECT_TRUE(IsTooDeep(Times(65, "<a><!-- </a> -->")));
}

TEST(XmlDepthTest, EntitiesHaveNoElements) {
  EXPECT_FALSE(IsTooDeep("<!DOCTYPE x [<!ENTITY e \"text\">]><x>&e;</x>"));
  EXPECT_TRUE(IsTooDeep("<!DOCTYPE x [<!ENTITY e \"<a><a>\">]><x>&e;</x>"));
  EXPECT_TRUE(IsTooDeep("<!DOCTYPE x [<!ENTITY e '&#60;a>'>]><x>&e;</x>"));
}

TEST(XmlDepthTest, WhateverIsCutOffEnds) {
  const std::string all =
      "<!DOCTYPE x [<!ENTITY e \"t\">]><?a?><x b='c'><!-- d --><![CDATA[e]]></x>";
  for (size_t size = 0; size <= all.size(); ++size) {
    EXPECT_FALSE(IsTooDeep(all.substr(0, size))) << size;
  }
}

}  // namespace
}  // namespace pheromone::ctl
