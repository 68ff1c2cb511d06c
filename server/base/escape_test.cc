#include "server/base/escape.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <cstdio>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace pheromone {
namespace {

using namespace std::string_literals;

TEST(EscapeControlsTest, WhatATerminalWouldObeyIsWrittenOut) {
  const std::vector<std::pair<std::string, std::string>> table = {
      {"", ""},
      {"trail 7, 0.5 m", "trail 7, 0.5 m"},
      {"one\ntwo", "one\ntwo"},
      {"one\r\ntwo\tthree", "one\\u000d\ntwo\\u0009three"},
      {"nul\0nul"s, "nul\\u0000nul"},
      {"\x1b[2J\x1b]0;title\x07", "\\u001b[2J\\u001b]0;title\\u0007"},
      {"\x7f", "\\u007f"},
      {"\xc2\x80\xc2\x9b"
       "31m\xc2\x9f",
       "\\u0080\\u009b31m\\u009f"},
      {"user\xe2\x80\xaetxt.exe\xe2\x80\xac", "user\\u202etxt.exe\\u202c"},
      {"\xe2\x81\xa6x\xe2\x81\xa9", "\\u2066x\\u2069"},
      {"\xd8\x9c\xe2\x80\x8e\xe2\x80\x8f", "\\u061c\\u200e\\u200f"},
      // The neighbours of these, and letters of any script.
      {"\xc2\xa0\xd8\x9b\xe2\x80\x8d\xe2\x80\x90\xe2\x80\xa9\xe2\x80\xaf\xe2\x81\xa5\xe2\x81\xaa",
       "\xc2\xa0\xd8\x9b\xe2\x80\x8d\xe2\x80\x90\xe2\x80\xa9\xe2\x80\xaf\xe2\x81\xa5\xe2\x81\xaa"},
      {"K\xc3\xbc"
       "che \xe5\x8f\xb0\xe6\x89\x80 \xf0\x9f\xa4\x96",
       "K\xc3\xbc"
       "che \xe5\x8f\xb0\xe6\x89\x80 \xf0\x9f\xa4\x96"},
  };
  for (const auto& [text, expected] : table) {
    EXPECT_EQ(EscapeControls(text), expected);
  }
}

// Table 3-8 of Unicode 15 and what Python's decode("utf-8", "replace") makes of these.
TEST(EscapeControlsTest, WhatIsNotUtf8IsAReplacementForEachMaximalPart) {
  const std::vector<std::pair<std::string, std::string>> table = {
      {"\x9b"
       "31m",
       "\\ufffd31m"},
      {"M\xfcnchen", "M\\ufffdnchen"},
      {"\xc0\xaf\xe0\x80\xbf\xf0\x81\x82"
       "A",
       "\\ufffd\\ufffd\\ufffd\\ufffd\\ufffd\\ufffd\\ufffd\\ufffdA"},
      {"\xed\xa0\x80", "\\ufffd\\ufffd\\ufffd"},
      {"\xf4\x90\x80\x80", "\\ufffd\\ufffd\\ufffd\\ufffd"},
      {"\xf5\xff", "\\ufffd\\ufffd"},
      {"\xe2\x80"
       "A",
       "\\ufffdA"},
      {"\xf0\x9f\xa4"
       "\x1b",
       "\\ufffd\\u001b"},
      {"\xe2\x80", "\\ufffd"},
  };
  for (const auto& [text, expected] : table) {
    EXPECT_EQ(EscapeControls(text), expected);
  }
}

TEST(EscapeControlsTest, OfAllCharactersTheseAndNoOthers) {
  std::set<uint32_t> controls = {0x061C, 0x200E, 0x200F, 0x202A, 0x202B, 0x202C,
                                 0x202D, 0x202E, 0x2066, 0x2067, 0x2068, 0x2069};
  for (uint32_t c = 0; c < 0x20; ++c) {
    controls.insert({c, c + 0x80});
  }
  controls.insert(0x7F);
  controls.erase('\n');
  for (uint32_t c = 0; c <= 0x10FFFF; ++c) {
    if (c >= 0xD800 && c <= 0xDFFF) {
      continue;
    }
    const auto byte = [&](uint32_t lead, uint32_t shift) {
      return static_cast<char>(lead | (c >> shift & (lead == 0x80 ? 0x3FU : 0x1FFFFFU)));
    };
    const std::string text =
        c < 0x80      ? std::string{byte(0, 0)}
        : c < 0x800   ? std::string{byte(0xC0, 6), byte(0x80, 0)}
        : c < 0x10000 ? std::string{byte(0xE0, 12), byte(0x80, 6), byte(0x80, 0)}
                      : std::string{byte(0xF0, 18), byte(0x80, 12), byte(0x80, 6), byte(0x80, 0)};
    char escape[8] = "";
    std::snprintf(escape, sizeof escape, "\\u%04x", c & 0xFFFFU);
    ASSERT_EQ(EscapeControls(text), controls.contains(c) ? escape : text) << std::hex << c;
  }
}

TEST(EscapeControlsTest, ALineHasNoNewline) {
  EXPECT_EQ(EscapeControls("7 links\n8", ""), "7 links\\u000a8");
  EXPECT_EQ(EscapeControls("a\tb\nc", "\n\t"), "a\tb\nc");
}

TEST(UnfinishedAtEndTest, ACharacterWhoseRestMayFollow) {
  const std::vector<std::pair<std::string, size_t>> table = {
      {"", 0},         {"a", 0},        {"\xc3\xbc", 0},     {"a\xc3", 1},
      {"\xe2\x82", 2}, {"\xf0\x9f", 2}, {"\xf0\x9f\xa4", 3}, {"\xf0\x9f\xa4\x96", 0},
      {"\xe0\x80", 0}, {"\x82", 0},     {"\xf0\xe2\x82", 2}, {"\xff", 0},
      {"\xed\xa0", 0}, {"\xc3\xc3", 1},
  };
  for (const auto& [text, expected] : table) {
    EXPECT_EQ(UnfinishedAtEnd(text), expected) << testing::PrintToString(text);
  }
}

}  // namespace
}  // namespace pheromone
