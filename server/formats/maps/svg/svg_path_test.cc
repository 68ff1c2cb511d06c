#include "server/formats/maps/svg/svg_path.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <string>

#include "server/core/field/path.h"

namespace pheromone::maps {
namespace {

constexpr Affine kUnitIsUm{};
constexpr Affine kUnitIsMm{1000, 0, 0, 1000, 0, 0};

Result<std::vector<Polyline>> Read(std::string_view data, int64_t tolerance_um = 10) {
  return ParseSvgPath(data, "d", kUnitIsMm, tolerance_um);
}

std::vector<Polyline> Parse(std::string_view data, int64_t tolerance_um = 10) {
  const auto lines = Read(data, tolerance_um);
  EXPECT_TRUE(lines.ok()) << data << ": " << lines.error();
  return lines.ok() ? lines.value() : std::vector<Polyline>();
}

std::string ErrorOf(std::string_view data) {
  const auto lines = Read(data);
  return lines.ErrorOr("no error");
}

// Points in whole millimetres.
Polyline MakePolyline(std::vector<field::PointUm> points, bool closed = false) {
  for (field::PointUm& point : points) {
    point = {point.x * 1000, point.y * 1000};
  }
  return {std::move(points), closed};
}

double DistanceOf(const Polyline& line, Vector at) {
  double best = std::numeric_limits<double>::infinity();
  const size_t sides = line.points.size() - (line.closed ? 0 : 1);
  for (size_t i = 0; i < sides; ++i) {
    const field::PointUm a = line.points[i];
    const field::PointUm b = line.points[(i + 1) % line.points.size()];
    const auto ax = static_cast<double>(a.x);
    const auto ay = static_cast<double>(a.y);
    const double dx = static_cast<double>(b.x) - ax;
    const double dy = static_cast<double>(b.y) - ay;
    const double along = ((at.x - ax) * dx + (at.y - ay) * dy) / (dx * dx + dy * dy);
    const double t = std::clamp(along, 0.0, 1.0);
    best = std::min(best, std::hypot(at.x - ax - t * dx, at.y - ay - t * dy));
  }
  return best;
}

// The line runs along the curve: no point of the curve is further from the line than the tolerance
// and the rounding.
void ExpectNear(const Polyline& line, const std::function<Vector(double)>& curve_um,
                double tolerance_um) {
  for (int i = 0; i <= 1000; ++i) {
    ASSERT_LE(DistanceOf(line, curve_um(i / 1000.0)), tolerance_um + 0.71) << i;
  }
}

TEST(SvgPath, TheTriangleOfTheSpecification) {
  EXPECT_EQ(Parse("M 100 100 L 300 100 L 200 300 z"),
            (std::vector<Polyline>{MakePolyline({{100, 100}, {300, 100}, {200, 300}}, true)}));
}

TEST(SvgPath, StraightCommandsAbsoluteAndRelativeDrawTheSame) {
  const std::vector<Polyline> expected = {
      MakePolyline({{10, 20}, {30, 20}, {30, 50}, {-10, 50}, {-10, -5}, {0, 0}})};
  for (const char* data : {
           "M10 20L30 20L30 50L-10 50L-10-5L0 0",
           "m10 20l20 0l0 30l-40 0l0-55l10 5",
           "M10,20H30V50H-10V-5L0,0",
           "m10,20h20v30h-40v-55l10,5",
           "M 10 20 30 20 30 50 -10 50 -10 -5 0 0",  // further points of a move are sides
           "m 10 20 20 0 0 30 -40 0 0 -55 10 5",
           "  M\t10\n,\r20 H 30\fV 50 h -40 V -5 L 0 , 0  ",
       }) {
    EXPECT_EQ(Parse(data), expected) << data;
  }
}

TEST(SvgPath, NumbersNeedNoSeparatorWhereTheyCanDoWithout) {
  // SVG 1.1, section 8.3.1: "M 0.6.5" is x = 0.6, y = 0.5, and "M 100-200" needs no space.
  EXPECT_EQ(Parse("M0.6.5L100-200"),
            (std::vector<Polyline>{{{{600, 500}, {100'000, -200'000}}, false}}));
  EXPECT_EQ(Parse("M1.5.5-3e2+.25E1 4.e0-.5e-1"),
            (std::vector<Polyline>{{{{1500, 500}, {-300'000, 2500}, {4000, -50}}, false}}));
}

TEST(SvgPath, SubpathsAreLinesOfTheirOwn) {
  EXPECT_EQ(Parse("M0 0L1 0M5 5L6 5L6 6ZM1 1m2 2l1 1"),
            (std::vector<Polyline>{MakePolyline({{0, 0}, {1, 0}}),
                                   MakePolyline({{5, 5}, {6, 5}, {6, 6}}, true),
                                   MakePolyline({{3, 3}, {4, 4}})}));
}

TEST(SvgPath, AClosedSubpathGoesOnWhereItBegan) {
  EXPECT_EQ(Parse("M5 5h4v4zl-1-1zm-1 0h-1"),
            (std::vector<Polyline>{MakePolyline({{5, 5}, {9, 5}, {9, 9}}, true),
                                   MakePolyline({{5, 5}, {4, 4}}, true),
                                   MakePolyline({{4, 5}, {3, 5}})}));
}

TEST(SvgPath, WhatGoesNowhereLeavesNoLine) {
  for (const char* data : {"", " \n", "M1 1", "M1 1Z", "M1 1L1 1", "M1 1A5 5 0 0 0 1 1",
                           "M1 1Q1 1 1 1", "M 2 2 h0.0000004"}) {
    EXPECT_EQ(ErrorOf(data), "d:1:1: found no line, expected at least one") << data;
  }
}

TEST(SvgPath, CurvesKeepToTheTolerance) {
  std::mt19937 random(1);
  std::uniform_int_distribution<int> coordinate(-100, 100);
  for (int i = 0; i < 60; ++i) {
    std::vector<Vector> p(4);
    std::string cubic = "M0,0C";
    std::string quadratic = "M0,0Q";
    p[0] = {0, 0};
    for (size_t k = 1; k < 4; ++k) {
      p[k] = {static_cast<double>(coordinate(random)), static_cast<double>(coordinate(random))};
      const std::string text = std::to_string(p[k].x) + "," + std::to_string(p[k].y) + " ";
      cubic += text;
      quadratic += k < 3 ? text : "";
    }
    const auto tolerance = static_cast<int64_t>(std::pow(10, i % 4));
    const std::vector<Polyline> lines = Parse(cubic + quadratic, tolerance);
    ASSERT_EQ(lines.size(), 2u);
    // Bernstein's form, where the pen goes by de Casteljau.
    ExpectNear(
        lines[0],
        [&](double t) {
          const double u = 1 - t;
          const double w[4] = {u * u * u, 3 * u * u * t, 3 * u * t * t, t * t * t};
          return Vector{1000 * (w[1] * p[1].x + w[2] * p[2].x + w[3] * p[3].x),
                        1000 * (w[1] * p[1].y + w[2] * p[2].y + w[3] * p[3].y)};
        },
        static_cast<double>(tolerance));
    ExpectNear(
        lines[1],
        [&](double t) {
          const double u = 1 - t;
          return Vector{1000 * (2 * u * t * p[1].x + t * t * p[2].x),
                        1000 * (2 * u * t * p[1].y + t * t * p[2].y)};
        },
        static_cast<double>(tolerance));
  }
}

TEST(SvgPath, ACoarserToleranceTakesFewerSidesAndNoMoreThanNeeded) {
  const std::string circle = "M10 0A10 10 0 0 1-10 0A10 10 0 0 1 10 0Z";
  size_t before = 100'000;
  for (const int64_t tolerance_um : {1, 10, 100, 1000}) {
    const size_t sides = Parse(circle, tolerance_um).at(0).points.size();
    EXPECT_LT(sides, before);
    before = sides;
    // A regular polygon's sagitta is r (1 - cos(pi / n)).
    const double sagitta_um =
        10'000 * (1 - std::cos(std::numbers::pi / static_cast<double>(sides - 2)));
    EXPECT_GT(sagitta_um, static_cast<double>(tolerance_um)) << "two sides fewer would do";
  }
}

// The specification's examples of S and T: the first control point is the last one reflected.
TEST(SvgPath, SmoothCurvesReflectTheControlPointOfTheirOwnKindOnly) {
  EXPECT_EQ(Parse("M100,200 C100,100 250,100 250,200 S400,300 400,200"),
            Parse("M100,200 C100,100 250,100 250,200 C250,300 400,300 400,200"));
  EXPECT_EQ(Parse("M200,300 Q400,50 600,300 T1000,300"),
            Parse("M200,300 Q400,50 600,300 Q800,550 1000,300"));
  EXPECT_EQ(Parse("M200,300 q200-250 400 0 t400 0 400 0"),
            Parse("M200,300 Q400,50 600,300 Q800,550 1000,300 Q1200,50 1400,300"));
  EXPECT_EQ(Parse("M0 0 S10 10 20 0"), Parse("M0 0 C0 0 10 10 20 0"));
  EXPECT_EQ(Parse("M0 0 Q10 10 20 0 S30 10 40 0"), Parse("M0 0 Q10 10 20 0 C20 0 30 10 40 0"));
  EXPECT_EQ(Parse("M0 0 C0 5 10 10 20 0 T40 0"), Parse("M0 0 C0 5 10 10 20 0 Q20 0 40 0"));
  EXPECT_EQ(Parse("M0 0 Q10 10 20 0 L30 0 T40 0"), Parse("M0 0 Q10 10 20 0 L30 0 Q30 0 40 0"));
}

// Properties of the arc that the four flags choose (SVG 1.1, section 8.3.8), in coordinates in
// which its ellipse is a unit circle: all points on one circle, turning as `sweep` says, over more
// than half a turn if `large`.
TEST(SvgPath, AnArcIsTheOneThatItsFlagsChoose) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int i = 0; i < 400; ++i) {
    const double rx = 20 + 200 * unit(random);
    const double ry = 20 + 200 * unit(random);
    const double rotation_deg = 720 * unit(random) - 360;
    const bool large = i % 2 == 1;
    const bool sweep = i / 2 % 2 == 1;
    const Vector to{30 * unit(random) - 15, 4 + 10 * unit(random)};  // in reach
    const std::string data = "M0 0A" + std::to_string(rx) + ' ' + std::to_string(ry) + ' ' +
                             std::to_string(rotation_deg) + (large ? " 1" : " 0") +
                             (sweep ? "1" : "0") + std::to_string(to.x) + ',' +
                             std::to_string(to.y);
    const std::vector<Polyline> lines = Parse(data, 1);
    ASSERT_EQ(lines.size(), 1u) << data;
    ASSERT_FALSE(lines[0].closed);
    EXPECT_EQ(lines[0].points.front(), (field::PointUm{0, 0}));
    EXPECT_NEAR(static_cast<double>(lines[0].points.back().x), to.x * 1000, 0.6);
    EXPECT_NEAR(static_cast<double>(lines[0].points.back().y), to.y * 1000, 0.6);

    const double angle = rotation_deg * std::numbers::pi / 180;
    const auto on_circle = [&](double x, double y) {
      return Vector{(x * std::cos(angle) + y * std::sin(angle)) / rx,
                    (y * std::cos(angle) - x * std::sin(angle)) / ry};
    };
    std::vector<Vector> circle;
    for (const field::PointUm point : lines[0].points) {
      circle.push_back(
          on_circle(static_cast<double>(point.x) / 1000, static_cast<double>(point.y) / 1000));
    }
    // Both unit circles through the ends; the drawn one is that on which the middle point lies.
    const Vector a{0, 0};
    const Vector b = on_circle(to.x, to.y);
    const double half = std::hypot(b.x - a.x, b.y - a.y) / 2;
    const double height = std::sqrt(1 - half * half);
    const auto centre = [&](double side) {
      return Vector{(a.x + b.x) / 2 - side * height * (b.y - a.y) / (2 * half),
                    (a.y + b.y) / 2 + side * height * (b.x - a.x) / (2 * half)};
    };
    const Vector middle = circle[circle.size() / 2];
    const auto off = [&](Vector c, Vector p) {
      return std::abs(std::hypot(p.x - c.x, p.y - c.y) - 1);
    };
    const Vector c = off(centre(1), middle) < off(centre(-1), middle) ? centre(1) : centre(-1);
    double turn = 0;
    for (size_t k = 0; k < circle.size(); ++k) {
      ASSERT_LE(off(c, circle[k]), 1e-4) << data << " point " << k;
      if (k > 0) {
        const Vector u{circle[k - 1].x - c.x, circle[k - 1].y - c.y};
        const Vector v{circle[k].x - c.x, circle[k].y - c.y};
        const double step = std::atan2(u.x * v.y - u.y * v.x, u.x * v.x + u.y * v.y);
        EXPECT_EQ(step > 0, sweep) << data;
        // What the side leaves out, at its worst place, in millimetres.
        EXPECT_LE((1 - std::cos(step / 2)) * std::max(rx, ry), 0.00102) << data;
        turn += step;
      }
    }
    EXPECT_EQ(std::abs(turn) > std::numbers::pi, large) << data;
  }
}

TEST(SvgPath, ArcsWithUnusualRadiiFollowTheSpecification) {
  // F.6.6: radii out of reach grow, keeping their ratio, to the half ellipse around the middle.
  EXPECT_EQ(Parse("M0 0A1 2 0 0 1 20 0"), Parse("M0 0A10 20 0 0 1 20 0"));
  EXPECT_EQ(Parse("M0 0A10 20 0 0 1 20 0"), Parse("M0 0A-10-20 0 1 1 20 0"));
  EXPECT_EQ(Parse("M0 0A0 20 0 0 1 20 0"), Parse("M0 0L20 0"));
  EXPECT_EQ(Parse("M0 0A20 0 0 0 1 20 0"), Parse("M0 0L20 0"));
  EXPECT_EQ(Parse("M0 0A5 5 0 0 1 0 0L20 0"), Parse("M0 0L20 0"));
}

TEST(SvgPath, FlagsNeedNoSeparator) {
  EXPECT_EQ(Parse("M600,350l50,-25a25,25-30 0150-25a25 50-30 1 0,50,-25"),
            Parse("M600,350 l 50,-25 a25,25 -30 0,1 50,-25 a 25 50 -30 1 0 50 -25"));
  EXPECT_EQ(Parse("M0 0a5 5 0 10.5.5"), Parse("M0 0 a 5 5 0 1 0 .5 .5"));
}

// The specification's pie: three quarters of a circle of 150 around (300, 200).
TEST(SvgPath, ThePieOfTheSpecification) {
  const std::vector<Polyline> lines = Parse("M300,200 h-150 a150,150 0 1,0 150,-150 z");
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_TRUE(lines[0].closed);
  ExpectNear(
      lines[0],
      [](double t) {
        const double angle = std::numbers::pi - 1.5 * std::numbers::pi * t;
        return Vector{300'000 + 150'000 * std::cos(angle), 200'000 + 150'000 * std::sin(angle)};
      },
      10);
}

TEST(SvgPath, AnErrorNamesPlaceFoundAndExpected) {
  const std::string command = "expected a command, one of MLHVCSQTAZ or mlhvcsqtaz";
  const std::string move = "expected M or m, with which path data begins";
  const std::string end = "found the end of the attribute, ";
  EXPECT_EQ(ErrorOf("L 1 2"), "d:1:1: found \"L\", " + move);
  EXPECT_EQ(ErrorOf("1 2"), "d:1:1: found \"1\", " + move);
  EXPECT_EQ(ErrorOf("M 1 2\nX 3 4"), "d:2:1: found \"X\", " + command);
  EXPECT_EQ(ErrorOf("M 1 2 L 3"), "d:1:10: " + end + "expected a number");
  EXPECT_EQ(ErrorOf("M 1"), "d:1:4: " + end + "expected a number");
  EXPECT_EQ(ErrorOf("M 1 2,"), "d:1:7: " + end + "expected a number after the comma");
  EXPECT_EQ(ErrorOf("M 1 2,L 3 4"), "d:1:7: found \"L\", expected a number after the comma");
  EXPECT_EQ(ErrorOf("M 1,,2"), "d:1:5: found \",\", expected a number");
  EXPECT_EQ(ErrorOf("M,1 2"), "d:1:2: found \",\", expected a number");
  EXPECT_EQ(ErrorOf("M 1 2 L 3 4 5"), "d:1:14: " + end + "expected a number");
  EXPECT_EQ(ErrorOf("M 1 2 z 3 4"), "d:1:9: found \"3\", " + command);
  EXPECT_EQ(ErrorOf("M 1 2 A 5 5 0 2 0 9 9"), "d:1:15: found \"2\", expected a flag, 0 or 1");
  EXPECT_EQ(ErrorOf("M 1 2 L .e5 4"), "d:1:10: found \"e\", expected a number");
  EXPECT_EQ(ErrorOf("M 1 2 L + 4"), "d:1:10: found \" \", expected a number");
  EXPECT_EQ(ErrorOf("M 1e 2"), "d:1:4: found \"e\", expected a number");
  EXPECT_EQ(ErrorOf("M 0 0 L 1e999 2"),
            "d:1:9: found \"1e999\", expected a number from 1e-307 to 1e308");
  EXPECT_EQ(ErrorOf("M 0 0 L nan inf"), "d:1:9: found \"n\", expected a number");
  EXPECT_EQ(ErrorOf("M 0 0 L 5 1.000001e9"),
            "d:1:9: found a point at x = 0.005 m, y = 1000001 m, expected coordinates of at most "
            "1000 km");
}

TEST(SvgPath, EveryBeginningOfAPathIsReadOrRefusedWhereItEnds) {
  constexpr std::string_view kWhole =
      "M1 2 3-4l.5.5h-1V3e1c1 2,3 4 5 6s1 2 3 4q1 2 3 4T9 9a5,6 30 0150-25A1 2 3 1,0 5 6zm1 1l1 1";
  // Cut anywhere but behind a whole argument list the data is wrong, and nowhere but at its end (an
  // e that has lost its digits is the end's last character).
  size_t refused = 0;
  for (size_t length = 0; length < kWhole.size(); ++length) {
    const auto lines = Read(kWhole.substr(0, length));
    if (!lines.ok() && lines.error() != "d:1:1: found no line, expected at least one") {
      ++refused;
      ASSERT_EQ(lines.error().rfind("d:1:", 0), 0u);
      EXPECT_GE(std::stoul(lines.error().substr(4)), length) << lines.error();
    }
  }
  EXPECT_GT(refused, kWhole.size() / 2);
}

TEST(SvgPath, CurvesThatWouldTakeTooManySidesAreRefused) {
  // 1e6 sides of a circle of 1000 km are more than 6 m long, a sagitta of 5 um.
  const std::string circle = "M0 0A450000000 450000000 0 1 1 1 0";
  EXPECT_TRUE(ParseSvgPath(circle, "d", kUnitIsMm, 100).ok());
  const auto fine = ParseSvgPath(circle, "d", {2e3, 0, 0, 2e3, 0, 0}, 1);
  ASSERT_FALSE(fine.ok());
  EXPECT_EQ(fine.error(),
            "d:1:6: found more than 1000000 points, expected shorter lines or a coarser tolerance");
  EXPECT_FALSE(ParseSvgPath("M0 0C1e200 0 0 1e200 1e300 1e300", "d", kUnitIsMm, 1).ok());
  EXPECT_FALSE(ParseSvgPath("M0 0A1e300 1e-300 45 1 1 1e300 1e300", "d", kUnitIsMm, 1).ok());
  EXPECT_FALSE(ParseSvgPath("M1e308 0L-1e308 0", "d", kUnitIsMm, 1).ok());
}

TEST(SvgPath, TheMapIsAppliedBeforeCurvesAreFlattened) {
  // A circle of 1 um, drawn a million times larger, wide and tall.
  const Affine map{2e6, 0, 0, 1e6, 5e6, 0};
  const auto lines = ParseSvgPath("M1 0A1 1 0 0 1-1 0A1 1 0 0 1 1 0", "d", map, 100);
  ASSERT_TRUE(lines.ok());
  ExpectNear(
      lines.value().at(0),
      [](double t) {
        const double angle = 2 * std::numbers::pi * t;
        return Vector{5e6 + 2e6 * std::cos(angle), 1e6 * std::sin(angle)};
      },
      100);
  const auto one = ParseSvgPath("M0 0L3 4", "d", kUnitIsUm, 1);
  EXPECT_EQ(one.value().at(0).points.at(1), (field::PointUm{3, 4}));
}

}  // namespace
}  // namespace pheromone::maps
