#include "server/base/xml_text.h"

#include <gtest/gtest.h>

namespace pheromone {
namespace {

// XML 1.0, 2.4: the characters that markup is made of.
TEST(XmlTextTest, WhatWouldBeMarkupIsEscaped) {
  EXPECT_EQ(EscapeXml("a < b > c & \"d\" 'e' µ"), "a &lt; b &gt; c &amp; &quot;d&quot; 'e' µ");
  EXPECT_EQ(EscapeXml("&lt;"), "&amp;lt;");
  EXPECT_EQ(EscapeXml(""), "");
}

TEST(XmlTextTest, WhatXmlCannotHaveIsEscapedAsWhereItIsPrinted) {
  EXPECT_EQ(EscapeXml("a\x1b\xff\n"), "a\\u001b\\ufffd\n");
}

}  // namespace
}  // namespace pheromone
