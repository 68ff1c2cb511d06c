#include "server/formats/maps/polyline_file.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "server/base/testing/temporary_folder.h"

namespace pheromone::maps {
namespace {

const std::vector<Polyline> kLine = {{{{0, 0}, {1'000'000, 2'000'000}}, false}};

class LoadLinesTest : public testing::Test {
 protected:
  std::filesystem::path Write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return folder_ / name;
  }

  const TemporaryFolder folder_;
};

TEST_F(LoadLinesTest, TheExtensionTellsTheFormat) {
  PolylineOptions options;
  options.geojson_unit = GeoJsonUnit::kMetres;
  options.metres_per_unit = 1;
  const std::string json = R"({"type": "LineString", "coordinates": [[0, 0], [1, 2]]})";
  for (const auto& path :
       {Write("a.csv", "0,0\n1,2\n"), Write("b.CSV", "0,0\n1,2\n"), Write("c.geojson", json),
        Write("d.json", json), Write("e.svg", "<svg height='9'><path d='M0 9l1-2'/></svg>")}) {
    const auto lines = LoadPolylines(path, options);
    ASSERT_TRUE(lines.ok()) << lines.error();
    EXPECT_EQ(lines.value(), kLine) << path;
  }
}

TEST_F(LoadLinesTest, ErrorsNameTheFile) {
  const auto path = Write("bad.csv", "0,0\n1;2\n");
  EXPECT_EQ(LoadPolylines(path, {}).error(),
            path.string() + ":2:1: found \"1;2\", expected two columns, x and y in metres");
  EXPECT_EQ(LoadPolylines("course.dxf", {}).error(),
            "course.dxf: found the extension \".dxf\", expected .csv, .geojson, .json or .svg");
  const auto missing = folder_ / "missing.csv";
  EXPECT_NE(LoadPolylines(missing, {}).error().find(missing.string() + ": "), std::string::npos);
  EXPECT_FALSE(LoadPolylines(folder_ / "missing.csv", {}).ok());
  std::filesystem::create_directory(folder_ / "folder.csv");
  EXPECT_FALSE(LoadPolylines(folder_ / "folder.csv", {}).ok());
}

TEST_F(LoadLinesTest, AFileOfMoreThan16MiBIsRefused) {
  const std::string most(kMaxPolylineFileBytes - 8, '\n');
  EXPECT_TRUE(LoadPolylines(Write("most.csv", most + "0,0\n1,2\n"), {}).ok());
  EXPECT_FALSE(LoadPolylines(Write("more.csv", most + "0,0\n1,2\n\n"), {}).ok());
}

TEST(ParsePolylines, ATextOfMoreThan16MiBIsRefused) {
  const std::string text(kMaxPolylineFileBytes + 1, '\n');
  PolylineOptions options;
  options.geojson_unit = GeoJsonUnit::kMetres;
  for (const PolylineFormat format :
       {PolylineFormat::kCsv, PolylineFormat::kGeoJson, PolylineFormat::kSvg}) {
    EXPECT_EQ(ParsePolylines(format, text, "big", options).error(),
              "big: found more than 16 MiB, expected a smaller file");
  }
}

}  // namespace
}  // namespace pheromone::maps
