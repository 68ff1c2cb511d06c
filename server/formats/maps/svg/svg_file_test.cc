#include "server/formats/maps/svg/svg_file.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace pheromone::maps {
namespace {

constexpr std::string_view kName = "course.svg";

// A drawing of 100 x 50 user units, each a millimetre.
std::string Drawing(const std::string& content) {
  return "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 100 50\">" + content + "</svg>";
}

Result<std::vector<Polyline>> Read(std::string_view text, const std::string& id = "") {
  return ParseSvgLines(text, kName, {.metres_per_unit = 0.001, .id = id, .tolerance_um = 10});
}

std::vector<Polyline> Parse(std::string_view text, const std::string& id = "") {
  const auto lines = Read(text, id);
  EXPECT_TRUE(lines.ok()) << text << ": " << lines.error();
  return lines.ok() ? lines.value() : std::vector<Polyline>();
}

std::string ErrorOf(std::string_view text, const std::string& id = "") {
  const auto lines = Read(text, id);
  return lines.ErrorOr("no error");
}

// Points in whole millimetres of the map: y upwards.
Polyline MakePolyline(std::vector<field::PointUm> points, bool closed = false) {
  for (field::PointUm& point : points) {
    point = {point.x * 1000, point.y * 1000};
  }
  return {std::move(points), closed};
}

TEST(SvgFile, TheLowerLeftCornerOfTheDrawingIsTheOriginOfTheMap) {
  EXPECT_EQ(Parse(Drawing("<path d='M0 50L100 0'/>")),
            (std::vector<Polyline>{MakePolyline({{0, 0}, {100, 50}})}));
  EXPECT_EQ(Parse("<svg viewBox='-10,20 , 100 50'><path d='M-10 70L90 20'/></svg>"),
            (std::vector<Polyline>{MakePolyline({{0, 0}, {100, 50}})}));
  EXPECT_EQ(Parse("<svg height='50'><path d='M0 50L100 0'/></svg>"),
            (std::vector<Polyline>{MakePolyline({{0, 0}, {100, 50}})}));
  // The viewBox goes before the size that the drawing has on paper.
  EXPECT_EQ(Parse("<svg viewBox='0 0 100 50' height='200mm'><path d='M0 50L100 0'/></svg>"),
            (std::vector<Polyline>{MakePolyline({{0, 0}, {100, 50}})}));
}

TEST(SvgFile, AHeightInUnitsOfLengthIsInPixelsOfWhich96AreAnInch) {
  for (const char* height :
       {"96", "96px", " 96 ", "1in", "2.54cm", "25.4mm", "101.6Q", "72pt", "6pc", "9.6e1px"}) {
    EXPECT_EQ(Parse("<svg height='" + std::string(height) + "'><path d='M0 96L1 95'/></svg>"),
              (std::vector<Polyline>{MakePolyline({{0, 0}, {1, 1}})}))
        << height;
  }
}

TEST(SvgFile, TheScaleIsThatOfAUserUnit) {
  SvgOptions options;
  options.metres_per_unit = 0.25;
  const auto lines = ParseSvgLines(Drawing("<path d='M0 50L100 0'/>"), kName, options);
  EXPECT_EQ(lines.value(), (std::vector<Polyline>{{{{0, 0}, {25'000'000, 12'500'000}}, false}}));
}

TEST(SvgFile, ShapesDrawTheirOutlines) {
  EXPECT_EQ(
      Parse(Drawing("<line x1='1' y1='2' x2='3' y2='4'/><line x2='5px'/>")),
      (std::vector<Polyline>{MakePolyline({{1, 48}, {3, 46}}), MakePolyline({{0, 50}, {5, 50}})}));
  EXPECT_EQ(Parse(Drawing("<polyline points='1,2 3 4-5,6'/>")),
            (std::vector<Polyline>{MakePolyline({{1, 48}, {3, 46}, {-5, 44}})}));
  EXPECT_EQ(Parse(Drawing("<polygon points=' 1 2,3 4,9 9 '/>")),
            (std::vector<Polyline>{MakePolyline({{1, 48}, {3, 46}, {9, 41}}, true)}));
  EXPECT_EQ(Parse(Drawing("<rect x='1' y='2' width='10' height='20'/>")),
            (std::vector<Polyline>{MakePolyline({{1, 48}, {11, 48}, {11, 28}, {1, 28}}, true)}));
}

void ExpectEllipse(const Polyline& line, double cx, double cy, double rx, double ry) {
  EXPECT_TRUE(line.closed);
  for (const field::PointUm point : line.points) {
    EXPECT_NEAR(std::hypot((static_cast<double>(point.x) - cx) / rx,
                           (static_cast<double>(point.y) - cy) / ry),
                1, 1e-4);
  }
  EXPECT_GT(line.points.size(), 50u);
}

TEST(SvgFile, CirclesAndEllipsesAreClosedAndRound) {
  const std::vector<Polyline> lines =
      Parse(Drawing("<circle cx='40' cy='20' r='10'/><ellipse cx='40' cy='20' rx='30' ry='10'/>"
                    "<ellipse ry='10' rx='auto'/>"));
  ASSERT_EQ(lines.size(), 3u);
  ExpectEllipse(lines[0], 40'000, 30'000, 10'000, 10'000);
  ExpectEllipse(lines[1], 40'000, 30'000, 30'000, 10'000);
  ExpectEllipse(lines[2], 0, 50'000, 10'000, 10'000);
}

TEST(SvgFile, ARoundedRectangleKeepsItsSidesAndRoundsItsCorners) {
  const auto expect_like_path = [](const std::string& radii, const std::string& path) {
    EXPECT_EQ(Parse(Drawing("<rect x='10' y='10' width='40' height='20' " + radii + "/>")),
              Parse(Drawing("<path d='" + path + "'/>")))
        << radii;
  };
  const std::string five =
      "M15 10H45A5 5 0 0 1 50 15V25A5 5 0 0 1 45 30H15A5 5 0 0 1 10 25V15A5 5 0 0 1 15 10Z";
  expect_like_path("rx='5' ry='5'", five);
  expect_like_path("rx='5'", five);
  expect_like_path("ry='5' rx='auto'", five);
  expect_like_path("rx='5' ry='0'", "M10 10H50V30H10Z");
  // At most half of the sides.
  expect_like_path("rx='100' ry='100'",
                   "M30 10A20 10 0 0 1 50 20A20 10 0 0 1 30 30A20 10 0 0 1 10 20A20 10 0 0 1 30 "
                   "10Z");
}

TEST(SvgFile, ShapesWithoutExtentDrawNothing) {
  EXPECT_EQ(ErrorOf(Drawing("<path/><path d=''/><circle r='0'/><circle/><ellipse rx='5' ry='0'/>"
                            "<rect width='5'/><rect width='0' height='5'/><polyline/>"
                            "<polyline points=' '/><polygon points='1 1'/><line/>")),
            "course.svg:1:1: found no line, expected at least one");
}

TEST(SvgFile, EachTransformMovesPointsAsTheSpecificationSays) {
  // Where the points (0, 0) and (10, 0) come to, in the drawing.
  const auto expect = [](const std::string& transform, Polyline line) {
    EXPECT_EQ(Parse(Drawing("<path transform='" + transform + "' d='M0 0H10'/>")),
              (std::vector<Polyline>{std::move(line)}))
        << transform;
  };
  expect("", MakePolyline({{0, 50}, {10, 50}}));
  expect("translate(3)", MakePolyline({{3, 50}, {13, 50}}));
  expect("translate(3 , 4)", MakePolyline({{3, 46}, {13, 46}}));
  expect("scale(2)", MakePolyline({{0, 50}, {20, 50}}));
  expect("translate(0 1) scale(2,3)", MakePolyline({{0, 49}, {20, 49}}));
  expect("rotate(90)", MakePolyline({{0, 50}, {0, 40}}));
  expect("rotate(-90 10 0)", MakePolyline({{10, 40}, {10, 50}}));
  expect("skewY(45)", MakePolyline({{0, 50}, {10, 40}}));
  expect("skewX(45) translate(0 5)", MakePolyline({{5, 45}, {15, 45}}));
  expect("matrix(1 2 3 4 5 6)", MakePolyline({{5, 44}, {15, 24}}));
  expect(" translate (1 2)scale( 2 ) , rotate(90),\n", MakePolyline({{1, 48}, {1, 28}}));
}

TEST(SvgFile, TransformsOfGroupsApplyFromTheInsideOut) {
  EXPECT_EQ(
      Parse(Drawing("<g transform='translate(10 0)'><g transform='scale(2)'><a>"
                    "<path transform='translate(1 1)' d='M0 0H5'/></a></g>"
                    "<path d='M0 0H5'/></g><path d='M0 0H5'/>")),
      (std::vector<Polyline>{MakePolyline({{12, 48}, {22, 48}}), MakePolyline({{10, 50}, {15, 50}}),
                             MakePolyline({{0, 50}, {5, 50}})}));
}

TEST(SvgFile, AnIdPicksOneElementWithTheTransformsAroundIt) {
  const std::string text = Drawing(
      "<path d='M0 0H1'/><defs transform='scale(2)'><g id='a' display='none'>"
      "<path id='b' d='M0 0H5'/><path d='M1 1H5'/></g></defs><text id='t'/>");
  EXPECT_EQ(Parse(text, "b"), (std::vector<Polyline>{MakePolyline({{0, 50}, {10, 50}})}));
  EXPECT_EQ(Parse(text, "a").size(), 2u);
  EXPECT_EQ(Parse(text).size(), 1u);
  EXPECT_EQ(ErrorOf(text, "c"),
            "course.svg:1:2: found no element with the id \"c\", expected one that has it");
  EXPECT_NE(ErrorOf(text, "t").find("found <text> with the id \"t\", expected a group or a shape"),
            std::string::npos);
}

TEST(SvgFile, WhatIsNotDrawnWhereItStandsIsLeftOut) {
  EXPECT_EQ(Parse(Drawing("<defs><path d='M9 9H1'/></defs><symbol><path d='M9 9H1'/></symbol>"
                          "<clipPath><path d='M9 9H1'/></clipPath><metadata><path/></metadata>"
                          "<sodipodi:namedview><path d='M9 9H1'/></sodipodi:namedview>"
                          "<g display='none'><path d='M9 9H1'/></g>"
                          "<g style='fill:none; display : none'><path d='M9 9H1'/></g>"
                          "<path display='none' d='M9 9H1'/><text>M0 0</text><!-- <path/> -->"
                          "<path display='none' style='display:inline' d='M0 0H5'/>"))
                .size(),
            1u);
}

TEST(SvgFile, APrefixForSvgsElementsMakesNoDifference) {
  EXPECT_EQ(Parse("<?xml version='1.0' encoding='UTF-8'?><!DOCTYPE svg [<!ENTITY x 'M0 0'>]>"
                  "<s:svg viewBox='0 0 9 9'><s:path d='M0 9H1'/><path d='M5 5H7'/></s:svg>"),
            (std::vector<Polyline>{MakePolyline({{0, 0}, {1, 0}})}));
}

TEST(SvgFile, WhatWouldBeDrawnElsewhereIsRefused) {
  EXPECT_NE(ErrorOf(Drawing("<path d='M0 0H1'/><use href='#a'/>")).find("found <use>, expected"),
            std::string::npos);
  EXPECT_NE(ErrorOf(Drawing("<svg><path d='M0 0H1'/></svg>")), "no error");
  EXPECT_NE(ErrorOf(Drawing("<switch><path d='M0 0H1'/></switch>")), "no error");
  EXPECT_NE(ErrorOf(Drawing("<path style='transform: scale(2)' d='M0 0H1'/>")), "no error");
  EXPECT_NE(ErrorOf("<svg viewBox='0 0 9 9' transform='scale(2)'><path d='M0 0H1'/></svg>"),
            "no error");
  EXPECT_EQ(ErrorOf(Drawing("<defs><use href='#a'/></defs><path d='M0 0H1'/>")), "no error");
}

TEST(SvgFile, AnErrorNamesThePlaceInsideOfTheAttribute) {
  EXPECT_EQ(ErrorOf("<svg viewBox='0 0 9 9'>\n <path id='a'\r\n  d='M0 0\n  L 1 x'/>\n</svg>"),
            "course.svg:4:7: found \"x\", expected a number");
  EXPECT_EQ(ErrorOf(Drawing("\n<path d='M0 0H1' transform='scale(1) tilt(2)'/>")),
            "course.svg:2:38: found \"tilt\", expected matrix, translate, scale, rotate, skewX or "
            "skewY");
  EXPECT_EQ(ErrorOf(Drawing("\n<path transform='rotate(1 2)'/>")),
            "course.svg:2:18: found rotate of 2 numbers, expected 1 or 3 of them");
  EXPECT_EQ(ErrorOf(Drawing("\n<path transform='scale(1'/>")),
            "course.svg:2:25: found the end of the attribute, expected \")\"");
  EXPECT_EQ(
      ErrorOf(Drawing("\n<circle r='10%'/>")),
      "course.svg:2:14: found \"%\", expected a length in user units, px, mm, cm, Q, in, pt or "
      "pc");
  EXPECT_EQ(ErrorOf(Drawing("\n<circle r='-1'/>")),
            "course.svg:2:12: found \"-1\", expected a length that is not negative");
  EXPECT_EQ(ErrorOf(Drawing("\n<polyline points='1 2 3'/>")),
            "course.svg:2:24: found the end of the attribute, expected a number");
  EXPECT_EQ(ErrorOf("<svg>\n<path d='M0 0H1'/></svg>"),
            "course.svg:1:2: found no viewBox and no height, expected one of them, to know where "
            "the drawing's lower edge is");
  EXPECT_EQ(ErrorOf("<svg viewBox='0 0 0 9'/>"),
            "course.svg:1:15: found \"0 0 0 9\", expected a viewBox of min-x, min-y and a positive "
            "width and height");
  EXPECT_EQ(ErrorOf("<html/>"), "course.svg:1:2: found \"html\", expected the root element <svg>");
  EXPECT_EQ(ErrorOf("<svg>\n<g></svg>").substr(0, 15), "course.svg:2:6:");
}

TEST(SvgFile, EveryBeginningOfADrawingIsAnError) {
  const std::string whole =
      "<?xml version=\"1.0\"?><!-- c --><svg viewBox=\"0 0 9 9\"><g transform=\"translate(1,2)\">"
      "<path d=\"M0 0C1 2 3 4 5 6z\" style=\"display:inline\"/><![CDATA[x]]></g>&amp;</svg>";
  EXPECT_EQ(ErrorOf(whole), "no error");
  for (size_t length = 0; length < whole.size(); ++length) {
    EXPECT_NE(ErrorOf(whole.substr(0, length)), "no error") << length;
  }
}

TEST(SvgFile, EntitiesAreNotExpanded) {
  const std::string declared =
      "<!DOCTYPE svg [<!ENTITY a 'M0 0H1'><!ENTITY f SYSTEM 'file:///etc/hostname'>]>";
  EXPECT_EQ(ErrorOf(declared + "<svg height='9'><path d='&a;'/></svg>").substr(0, 39),
            "course.svg:1:104: found \"&\", expected M");
  EXPECT_NE(ErrorOf(declared + "<svg height='9'><path d='&f;'/></svg>"), "no error");
  EXPECT_EQ(ErrorOf("<svg height='9'><path d='M0 0&#10;&#x48;1'/></svg>"), "no error");
}

TEST(SvgFile, NestingAndTagsAreLimited) {
  const auto nested = [](size_t groups) {
    std::string open;
    std::string close;
    for (size_t i = 0; i < groups; ++i) {
      open += "<g>";
      close += "</g>";
    }
    return Drawing(open + "<path id='p' d='M0 0H1'/>" + close);
  };
  for (const char* id : {"", "p"}) {
    EXPECT_EQ(ErrorOf(nested(63), id), "no error") << id;
    EXPECT_NE(ErrorOf(nested(64), id).find("found elements nested too deep, expected at most 64"),
              std::string::npos)
        << id;
    EXPECT_NE(ErrorOf(nested(100'000), id), "no error") << id;
  }
  std::string open;
  for (int i = 0; i < 1'000'001; ++i) {
    open += "<g>";
  }
  EXPECT_EQ(ErrorOf(open),
            "course.svg:1:1: found more than 1000000 tags, expected a smaller drawing");
}

TEST(SvgFile, OptionsThatMakeNoSenseAreRefused) {
  const std::string text = Drawing("<path d='M0 0H1'/>");
  SvgOptions options;
  options.metres_per_unit = 0;
  EXPECT_EQ(ParseSvgLines(text, kName, options).error(),
            "course.svg: found 0 metres a user unit, expected a positive number");
  options.metres_per_unit = std::nan("");
  EXPECT_FALSE(ParseSvgLines(text, kName, options).ok());
  options = {};
  options.tolerance_um = 0;
  EXPECT_EQ(ParseSvgLines(text, kName, options).error(),
            "course.svg: found a tolerance of 0 um, expected at least 1");
}

}  // namespace
}  // namespace pheromone::maps
