// Paths out of files. What the files may hold is server/formats/maps' matter, and tested there.
#include <cmath>

#include "server/config/testing/folder_test.h"

namespace pheromone::config {
namespace {

using Points = std::vector<field::PointUm>;

class PathFileTest : public FolderTest {};

constexpr std::string_view kTwoLines = "1,1\n2,2\n3,1.5\n\n5,5\n6,5\n6,6\n5,5\n";

TEST_F(PathFileTest, EachLineOfAFileIsAPath) {
  Write("lines.csv", kTwoLines);
  const field::FieldConfig field =
      Field("[[path]]\npheromone = \"path\"\nfile = \"lines.csv\"\nintensity = 0.5\n");
  ASSERT_EQ(field.paths.size(), 2u);
  const Points open = {{1'000'000, 1'000'000}, {2'000'000, 2'000'000}, {3'000'000, 1'500'000}};
  EXPECT_EQ(field.paths[0], (field::Path{2, 2, false, open}));
  const Points closed = {{5'000'000, 5'000'000}, {6'000'000, 5'000'000}, {6'000'000, 6'000'000}};
  EXPECT_EQ(field.paths[1], (field::Path{2, 2, true, closed}));
}

TEST_F(PathFileTest, ADrawingHasAScaleAndMayHaveManyElements) {
  Write("d.SVG",
        "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 100 80'>"
        "<line id='a' x1='10' y1='80' x2='20' y2='70'/>"
        "<line id='b' x1='0' y1='0' x2='100' y2='80'/></svg>");
  const std::string table = "[[path]]\npheromone = 1\nfile = \"d.SVG\"\nmetres_per_unit = 0.1\n";
  EXPECT_EQ(Field(table).paths.size(), 2u);
  const field::FieldConfig field = Field(table + "id = \"a\"\n");
  ASSERT_EQ(field.paths.size(), 1u);
  // The drawing's lower edge, y = 80, is the map's y = 0.
  EXPECT_EQ(field.paths[0].points, (Points{{1'000'000, 0}, {2'000'000, 1'000'000}}));
  EXPECT_EQ(field.paths[0].count, 4);
}

TEST_F(PathFileTest, DegreesAreCountedFromTheDatum) {
  // A thousandth of a degree of latitude is 111 m near 45 degrees; a hundred-thousandth 1.11 m.
  Write("g.geojson", R"({"type": "LineString", "coordinates": [[8.0, 45.0], [8.0, 45.00001]]})");
  const field::FieldConfig field = Field("[[path]]\npheromone = 1\nfile = \"g.geojson\"\n",
                                         "datum = {latitude_deg = 45.0, longitude_deg = 8.0}\n");
  ASSERT_EQ(field.paths.size(), 1u);
  ASSERT_EQ(field.paths[0].points.size(), 2u);
  EXPECT_EQ(field.paths[0].points[0], (field::PointUm{0, 0}));
  EXPECT_NEAR(static_cast<double>(field.paths[0].points[1].x), 0, 1);
  EXPECT_NEAR(static_cast<double>(field.paths[0].points[1].y), 1'111'300, 1'000);
}

TEST_F(PathFileTest, GeoJsonInMetresNeedsNoDatum) {
  Write("g.json", R"({"type": "LineString", "coordinates": [[1, 2], [3, 4.5]]})");
  const field::FieldConfig field =
      Field("[[path]]\npheromone = 1\nfile = \"g.json\"\nmetres = true\n");
  ASSERT_EQ(field.paths.size(), 1u);
  EXPECT_EQ(field.paths[0].points, (Points{{1'000'000, 2'000'000}, {3'000'000, 4'500'000}}));
}

TEST_F(PathFileTest, MistakesAreTold) {
  Write("lines.csv", kTwoLines);
  Write("bad.csv", "1,1\n2,two\n");
  Write("far.csv", "1,1\n2,8.5\n");
  Write("g.geojson", R"({"type": "LineString", "coordinates": [[8, 45], [8, 45.1]]})");
  std::filesystem::create_directory(folder_ / "folder.csv");
  const std::string table = "[[path]]\npheromone = \"path\"\nfile = ";
  EXPECT_EQ(ErrorOf(table + "\"lines.txt\"\n"),
            "f.toml:31:8: path[1].file: found the string \"lines.txt\", expected a file whose name "
            "ends in one of .svg, .geojson, .json, .csv");
  EXPECT_EQ(ErrorOf(table + "7\n"),
            "f.toml:31:8: path[1].file: found 7, expected a string that is not empty");
  EXPECT_EQ(ErrorOf(table + "\"none.csv\"\n"),
            "f.toml:31:8: path[1].file: none.csv: No such file or directory, expected a file");
  EXPECT_EQ(ErrorOf(table + "\"folder.csv\"\n"),
            "f.toml:31:8: path[1].file: folder.csv: is not a regular file, expected a file");
  EXPECT_EQ(ErrorOf(table + "\"far.csv\"\n"),
            "f.toml:31:8: path[1].file: far.csv leaves the map at (2, 8.5), expected points from "
            "(0, 0) to (10, 8)");
  EXPECT_EQ(ErrorOf(table + "\"g.geojson\"\n"),
            "f.toml:31:8: path[1].file: has coordinates in degrees, expected a datum in [map] or "
            "metres = true");
  EXPECT_EQ(
      ErrorOf(table + "\"lines.csv\"\nmetres_per_unit = 1\n"),
      "f.toml:32:1: path[1].metres_per_unit: not permitted with a file other than .svg, expected "
      "a .svg file");
  EXPECT_EQ(ErrorOf(table + "\"lines.csv\"\nmetres = true\n"),
            "f.toml:32:1: path[1].metres: not permitted with a file other than GeoJSON, expected a "
            ".geojson file");
  EXPECT_EQ(ErrorOf(table + "\"lines.csv\"\npoints_m = [[1, 1], [2, 2]]\n"),
            "f.toml:32:1: path[1].points_m: unknown key, expected one of name, pheromone, file, "
            "metres_per_unit, id, metres, intensity");
}

TEST_F(PathFileTest, TheLoadersOwnWordsComeThrough) {
  Write("bad.csv", "1,1\n2,two\n");
  const std::string error = ErrorOf("[[path]]\npheromone = \"path\"\nfile = \"bad.csv\"\n");
  EXPECT_EQ(error.substr(0, 43), "f.toml:31:8: path[1].file: bad.csv:2:3: fou") << error;
}

TEST_F(PathFileTest, ADrawingWithoutAScaleIsRefused) {
  Write("d.svg", "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 9 9'/>");
  EXPECT_EQ(ErrorOf("[[path]]\npheromone = 1\nfile = \"d.svg\"\n"),
            "f.toml:29:1: path[1].metres_per_unit: missing, expected a number from 0.000000001 to "
            "1000000");
}

// 400 000 points within a cell, three times: the length alone would not tell.
TEST_F(PathFileTest, FilesTogetherHaveAMillionPointsAtTheMost) {
  std::string points;
  for (int i = 0; i < 400'000; ++i) {
    points += i % 2 == 0 ? "1,1\n" : "1,1.0001\n";
  }
  Write("dense.csv", points);
  const std::string table = "[[path]]\npheromone = 1\nfile = \"dense.csv\"\n";
  EXPECT_EQ(Field(table + table).paths.size(), 2u);
  EXPECT_EQ(ErrorOf(table + table + table),
            "f.toml:37:8: path[3].file: the files of all paths have more than 1000000 points, "
            "expected fewer");
}

TEST_F(PathFileTest, ATextWithoutAFolderMayNameNoFiles) {
  const Result<Config> parsed = ParseConfig(
      "[map]\nwidth_m = 1\nheight_m = 1\ncell_m = 0.1\n[antennas]\nbias_m = 0.1\n"
      "[[pheromone]]\ntype = 1\nprofile = \"cone\"\nradius_m = 0.2\ntau_s = 0\n"
      "quantum = 1\nmaximum = 1\n[[path]]\npheromone = 1\nfile = \"/etc/x.csv\"\n",
      "f");
  ASSERT_FALSE(parsed.ok());
  EXPECT_EQ(parsed.error(),
            "f:16:8: path[1].file: found the string \"/etc/x.csv\", expected no file, since this "
            "configuration was not read from a file");
}

TEST_F(PathFileTest, NamesAreRelativeToTheFolderOfTheConfiguration) {
  Write("lines.csv", kTwoLines);
  Write("c.toml",
        "[map]\nwidth_m = 10\nheight_m = 8\ncell_m = 0.1\n[antennas]\nbias_m = 0.1\n[[pheromone]]\n"
        "type = 1\nprofile = \"cone\"\nradius_m = 0.2\ntau_s = 0\nquantum = 1\nmaximum = 1\n"
        "[[path]]\npheromone = 1\nfile = \"lines.csv\"\n");
  const Result<Config> loaded = LoadConfig((folder_ / "c.toml").string());
  ASSERT_TRUE(loaded.ok()) << loaded.error();
  EXPECT_EQ(loaded.value().engine.field.paths.size(), 2u);
}

}  // namespace
}  // namespace pheromone::config
