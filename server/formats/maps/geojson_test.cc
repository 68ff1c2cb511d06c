#include "server/formats/maps/geojson.h"

#include <gtest/gtest.h>

#include <string>

namespace pheromone::maps {
namespace {

constexpr Wgs84 kZurich{47.3769, 8.5417, 408};

Result<std::vector<Polyline>> Metres(std::string_view text) {
  return ParseGeoJsonLines(text, "site.geojson", GeoJsonUnit::kMetres, std::nullopt);
}

std::vector<Polyline> Parse(std::string_view text) {
  const auto lines = Metres(text);
  EXPECT_TRUE(lines.ok()) << lines.error();
  return lines.ok() ? lines.value() : std::vector<Polyline>();
}

std::string ErrorOf(std::string_view text) {
  const auto lines = Metres(text);
  return lines.ErrorOr("no error");
}

std::string ErrorInDegrees(std::string_view text) {
  const auto lines = ParseGeoJsonLines(text, "site.geojson", GeoJsonUnit::kDegrees, kZurich);
  return lines.ErrorOr("no error");
}

Polyline Open(std::vector<field::PointUm> points) {
  return {std::move(points), false};
}

const Polyline kDiagonal = Open({{0, 0}, {1'000'000, 2'000'000}});

TEST(GeoJson, EachGeometryHasItsLines) {
  EXPECT_EQ(Parse(R"({"type": "LineString", "coordinates": [[0, 0], [1, 2]]})"),
            (std::vector<Polyline>{kDiagonal}));
  EXPECT_EQ(Parse(R"({"type": "MultiLineString", "coordinates": [[[0, 0], [1, 2]], [],
                      [[0, 0], [0.5, 0], [1e-6, 2e-6]]]})"),
            (std::vector<Polyline>{kDiagonal, Open({{0, 0}, {500'000, 0}, {1, 2}})}));
  EXPECT_EQ(Parse(R"({"type": "Point", "coordinates": [1, 2]})"),
            (std::vector<Polyline>{Open({{1'000'000, 2'000'000}})}));
  EXPECT_EQ(
      Parse(R"({"type": "MultiPoint", "coordinates": [[1, 2], [3, 4]]})"),
      (std::vector<Polyline>{Open({{1'000'000, 2'000'000}}), Open({{3'000'000, 4'000'000}})}));
}

TEST(GeoJson, RingsAreClosedLinesWithoutTheRepeatedPosition) {
  const Polyline outer{{{0, 0}, {9'000'000, 0}, {9'000'000, 9'000'000}}, true};
  const Polyline hole{{{3'000'000, 1'000'000}, {5'000'000, 1'000'000}, {5'000'000, 2'000'000}},
                      true};
  const std::string rings = "[[[0,0],[9,0],[9,9],[0,0]],[[3,1],[5,1],[5,2],[3,1]]]";
  EXPECT_EQ(Parse(R"({"type": "Polygon", "coordinates": )" + rings + "}"),
            (std::vector<Polyline>{outer, hole}));
  EXPECT_EQ(Parse(R"({"type": "MultiPolygon", "coordinates": [)" + rings + "," + rings + "]}"),
            (std::vector<Polyline>{outer, hole, outer, hole}));
}

TEST(GeoJson, CollectionsAndFeaturesAreReadInOrderAndForeignMembersIgnored) {
  EXPECT_EQ(Parse(R"({"type": "FeatureCollection", "name": "lab", "features": [
      {"type": "Feature", "id": 7, "properties": {"type": "Point", "coordinates": "none"},
       "geometry": {"type": "LineString", "coordinates": [[0, 0, 412.5], [1, 2, 413]]}},
      {"type": "Feature", "properties": null, "geometry": null},
      {"type": "Feature", "properties": null, "geometry":
        {"coordinates": [], "type": "GeometryCollection", "geometries": [
          {"type": "Point", "coordinates": []},
          {"coordinates": [[0, 0], [3, 4]], "type": "LineString"}]}}]})"),
            (std::vector<Polyline>{kDiagonal, Open({{0, 0}, {3'000'000, 4'000'000}})}));
}

// One second of arc of latitude is about 30.9 m, of longitude at 47.4 degrees 20.9 m; to the
// micrometre, what geodesy_test.cc has checked.
TEST(GeoJson, DegreesAreLongitudeFirstAndBecomeMetresAroundTheDatum) {
  const auto lines = ParseGeoJsonLines(
      R"({"type": "LineString", "coordinates": [[8.5417, 47.3769], [8.5418, 47.3779, 9999]]})",
      "site.geojson", GeoJsonUnit::kDegrees, kZurich);
  ASSERT_TRUE(lines.ok()) << lines.error();
  const auto& points = lines.value().at(0).points;
  EXPECT_EQ(points.at(0), (field::PointUm{0, 0}));
  EXPECT_NEAR(static_cast<double>(points.at(1).x), 7.55e6, 0.01e6);
  EXPECT_NEAR(static_cast<double>(points.at(1).y), 111.19e6, 0.02e6);
  const EastNorthUp local = LocalFrame::At(kZurich).value().ToLocal({47.3779, 8.5418, 408});
  EXPECT_NEAR(static_cast<double>(points.at(1).x), local.east_m * 1e6, 0.5);
  EXPECT_NEAR(static_cast<double>(points.at(1).y), local.north_m * 1e6, 0.5);
}

TEST(GeoJson, DegreesNeedADatum) {
  const auto lines =
      ParseGeoJsonLines(R"({"type": "LineString", "coordinates": [[8, 47], [8, 48]]})",
                        "site.geojson", GeoJsonUnit::kDegrees, std::nullopt);
  ASSERT_FALSE(lines.ok());
  EXPECT_EQ(lines.error(),
            "site.geojson: found no datum, expected the geographic position of the map's origin "
            "for GeoJSON in "
            "degrees");
}

TEST(GeoJson, WhatCannotBeDegreesNearTheDatumIsRefused) {
  const auto line = [](const std::string& position) {
    return R"({"type": "LineString", "coordinates": [[8.5417, 47.3769], )" + position + "]}";
  };
  EXPECT_EQ(ErrorInDegrees(line("[47.3769, 98.5417]")),
            "site.geojson:1:69: found 98.5417, expected a latitude of -90 to 90 degrees, after the "
            "longitude");
  EXPECT_EQ(ErrorInDegrees(line("[2683000, 1247000]")),
            "site.geojson:1:60: found 2683000, expected a longitude of -180 to 180 degrees");
  // The other side of the Earth, where x and y are 0 again.
  EXPECT_EQ(ErrorInDegrees(line("[-171.4583, -47.3769]")),
            "site.geojson:1:59: found an array of 2, expected a position at most 1000 km from the "
            "datum");
  EXPECT_NE(ErrorInDegrees(line("[8.5417, 60]")), "no error");
  EXPECT_EQ(ErrorInDegrees(line("[8.5417, 48]")), "no error");
}

TEST(GeoJson, AnotherReferenceSystemIsRefusedInDegreesOnly) {
  const std::string swiss =
      R"({"type": "FeatureCollection",
 "crs": {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::2056"}},
 "features": [{"type": "Feature", "geometry": {"type": "Point", "coordinates": [8.5, 47]}}]})";
  EXPECT_EQ(
      ErrorInDegrees(swiss),
      "site.geojson:2:9: found \"{\"type\":\"name\",\"properties\":{\"na...\", expected WGS-84 "
      "degrees (urn:ogc:def:crs:OGC:1.3:CRS84), or metres = true");
  EXPECT_EQ(ErrorOf(swiss), "no error");
  std::string world = swiss;
  world.replace(world.find("EPSG::2056"), 10, "OGC:1.3:CRS84");
  EXPECT_EQ(ErrorInDegrees(world), "no error");
}

TEST(GeoJson, AnErrorInTheStructureNamesPlaceFoundAndExpected) {
  EXPECT_EQ(ErrorOf("{\"type\": \"LineString\",\n \"coordinates\": [[0, 0], [1, \"2\"]]}"),
            "site.geojson:2:30: found \"2\", expected a number");
  EXPECT_EQ(ErrorOf("{\"type\": \"LineString\", \"coordinates\":\n[[0, 0],\n 7]}"),
            "site.geojson:3:2: found 7, expected a position [x, y] in metres");
  EXPECT_EQ(ErrorOf(R"({"type": "LineString", "coordinates": [[0, 0]]})"),
            "site.geojson:1:39: found an array of 1, expected at least two positions");
  EXPECT_EQ(ErrorOf(R"({"type": "LineString"})"),
            "site.geojson:1:1: found nothing, expected an array of positions");
  EXPECT_EQ(ErrorOf(R"({"type": "Polygon", "coordinates": [[[0,0],[1,0],[1,1],[0,1]]]})"),
            "site.geojson:1:37: found an array of 4, expected a ring whose last position is its "
            "first");
  EXPECT_EQ(ErrorOf(R"({"type": "Polygon", "coordinates": [[[0,0],[1,0],[0,0]]]})"),
            "site.geojson:1:37: found an array of 3, expected a ring of at least four positions");
  EXPECT_EQ(
      ErrorOf(R"({"a": "]}\"", "type": "Curve", "coordinates": []})"),
      "site.geojson:1:23: found \"Curve\", expected \"FeatureCollection\", \"Feature\" or the "
      "type of a geometry, such as \"LineString\"");
  EXPECT_EQ(ErrorOf(R"({"type": "FeatureCollection", "features": [{"type": "Point"}]})"),
            "site.geojson:1:53: found \"Point\", expected \"Feature\"");
  EXPECT_EQ(ErrorOf(R"({"type": "Feature", "geometry": {"type": "Feature"}})"),
            "site.geojson:1:42: found \"Feature\", expected the type of a geometry, such as "
            "\"LineString\"");
  EXPECT_EQ(ErrorOf("[1, 2]"),
            "site.geojson:1:1: found an array of 2, expected a GeoJSON object with a \"type\"");
  EXPECT_EQ(
      ErrorOf("{\"type\": \"LineString\", \"coordinates\":\n [[0, 0], [0, 2e6]]}"),
      "site.geojson:2:11: found a point at x = 0 m, y = 2000000 m, expected coordinates of at "
      "most 1000 km");
}

TEST(GeoJson, TextThatIsNotJsonIsRefusedWhereItCeasesToBe) {
  EXPECT_EQ(ErrorOf("{\"type\": \"LineString\",\n \"coordinates\": [[0, 0], [1, 2]}"),
            "site.geojson:2:32: found \"}\", expected JSON (syntax error)");
  EXPECT_EQ(ErrorOf("{\"type\": NaN}").substr(0, 28), "site.geojson:1:10: found \"N\"");
  EXPECT_EQ(ErrorOf("").substr(0, 43), "site.geojson:1:1: found the end of the file");
  EXPECT_NE(ErrorOf(R"({"type": "Point", "coordinates": [1, 2]} x)"), "no error");
  EXPECT_NE(ErrorOf(R"({"type": "Point", "coordinates": [1, 1e999]})"), "no error");
}

TEST(GeoJson, EveryBeginningOfAFileIsAnError) {
  const std::string whole =
      R"({"type": "FeatureCollection", "features": [{"type": "Feature", "geometry":
         {"type": "Polygon", "coordinates": [[[0,0],[1.5,0],[1,-1e0],[0,0]]]}}]})";
  EXPECT_EQ(ErrorOf(whole), "no error");
  for (size_t length = 0; length < whole.size(); ++length) {
    EXPECT_NE(ErrorOf(whole.substr(0, length)), "no error") << length;
  }
}

TEST(GeoJson, NestingIsLimited) {
  std::string deep;
  for (int i = 0; i < 100'000; ++i) {
    deep += R"({"type":"GeometryCollection","geometries":[)";
  }
  EXPECT_NE(ErrorOf(deep).find("too deep"), std::string::npos) << ErrorOf(deep);
}

TEST(GeoJson, TheNumberOfValuesIsLimited) {
  std::string text = R"({"type": "Point", "coordinates": [1, 2], "data": [0)";
  for (int i = 0; i < 4'000'000; ++i) {
    text += ",0";
  }
  EXPECT_EQ(ErrorOf(text + "]}"),
            "site.geojson:1:1: found more than 4000000 values, expected a smaller file");
}

TEST(GeoJson, AMemberGivenTwiceCountsLast) {
  const std::string twice = R"({"type": "Point", "coordinates": [1, 2], "coordinates": [3, "x"]})";
  EXPECT_EQ(ErrorOf(twice), "site.geojson:1:61: found \"x\", expected a number");
}

}  // namespace
}  // namespace pheromone::maps
