// Pictures and arrays as pheromone, checked node by node.
#include <map>

#include "server/config/testing/folder_test.h"

namespace pheromone::config {
namespace {

using Levels = std::map<std::pair<int32_t, int32_t>, uint32_t>;  // by (column, row)

class PrintTest : public FolderTest {
 protected:
  // The only print of a configuration.
  Levels Print(std::string_view more) const {
    const field::FieldConfig field = Field(more);
    Levels levels;
    EXPECT_EQ(field.initial_rasters.size(), 1u);
    for (const field::InitialRaster& print : field.initial_rasters) {
      for (const field::InitialNode& node : *print.nodes) {
        EXPECT_TRUE(levels.emplace(std::pair(node.node.column, node.node.row), node.level).second);
      }
    }
    return levels;
  }
};

// The top row of the file is the upper one on the map; 64 levels to a quantum of 0.25.
TEST_F(PrintTest, WithoutAPlaceAPixelIsANode) {
  Write("p.csv", "1, 0\n2, nan\n4, -1\n");
  EXPECT_EQ(Print("[[print]]\npheromone = \"path\"\nfile = \"p.csv\"\n"),
            (Levels{{{0, 2}, 64}, {{0, 1}, 128}, {{0, 0}, 256}}));
}

TEST_F(PrintTest, TheLargestValueStandsForTheMaximum) {
  Write("p.csv", "10, 5, 1\n");
  // 0.3 of 0.25 a quantum: 76.8 levels; half of it 38.4, a tenth 7.68.
  EXPECT_EQ(Print("[[print]]\npheromone = \"path\"\nfile = \"p.csv\"\nmaximum = 0.3\n"),
            (Levels{{{0, 0}, 77}, {{1, 0}, 38}, {{2, 0}, 8}}));
}

// A counter holds whole quanta: 1.2, 0.6 and 0.12 of them.
TEST_F(PrintTest, ThePapersLawTakesWholeQuanta) {
  Write("p.csv", "10, 5, 1\n");
  EXPECT_EQ(Print("[[print]]\npheromone = \"trail\"\nfile = \"p.csv\"\nmaximum = 0.3\n"),
            (Levels{{{0, 0}, 64}, {{1, 0}, 64}}));
}

// Cells of 0.2 m from (2, 1): each holds two by two nodes, its left and lower edges among them.
TEST_F(PrintTest, APlaceIsTheLowerLeftCornerAndACellItsSide) {
  Write("p.csv", "1, 2\n");
  EXPECT_EQ(Print("[[print]]\nname = \"p\"\npheromone = 2\nfile = \"p.csv\"\nat_m = [2, 1]\n"
                  "cell_m = 0.2\n"),
            (Levels{{{20, 10}, 128},
                    {{21, 10}, 128},
                    {{20, 11}, 128},
                    {{21, 11}, 128},
                    {{22, 10}, 256},
                    {{23, 10}, 256},
                    {{22, 11}, 256},
                    {{23, 11}, 256}}));
}

TEST_F(PrintTest, WhatLiesOffTheMapIsLeftOut) {
  Write("p.csv", "1, 1, 1\n");
  EXPECT_EQ(Print("[[print]]\npheromone = 2\nfile = \"p.csv\"\nat_m = [-0.15, -0.05]\n"),
            (Levels{{{0, 0}, 256}, {{1, 0}, 256}}));
  EXPECT_EQ(Print("[[print]]\npheromone = 2\nfile = \"p.csv\"\nat_m = [9.95, 7.95]\n"),
            (Levels{{{100, 80}, 256}}));
}

// White is the maximum, also if the picture has none.
TEST_F(PrintTest, APicturesWhiteStandsForTheMaximum) {
  Write("p.pgm", "P2 2 1 8\n2 4\n");
  EXPECT_EQ(Print("[[print]]\npheromone = 2\nfile = \"p.pgm\"\n"),
            (Levels{{{0, 0}, 64}, {{1, 0}, 128}}));
}

TEST_F(PrintTest, ARosMapSaysItselfWhereItLies) {
  Write("p.pgm", "P2 2 1 255\n0 254\n");  // occupied, free
  Write("p.yaml",
        "image: p.pgm\nresolution: 0.1\norigin: [0.95, 1.95, 0]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.196\n");
  EXPECT_EQ(Print("[[print]]\npheromone = 2\nfile = \"p.yaml\"\n"), (Levels{{{10, 20}, 256}}));
  EXPECT_EQ(ErrorOf("[[print]]\npheromone = 2\nfile = \"p.yaml\"\ncell_m = 1\n"),
            "f.toml:32:1: print[1].cell_m: not permitted with a file that contains its cell size, "
            "expected no cell_m");
}

TEST_F(PrintTest, MistakesAreTold) {
  Write("p.csv", "1, 2\n");
  Write("zero.csv", "0, nan\n");
  Write("bad.npy", "no array");
  const std::string table = "[[print]]\npheromone = 2\nfile = ";
  EXPECT_EQ(ErrorOf("[[print]]\nfile = \"p.csv\"\n"),
            "f.toml:29:1: print[1].pheromone: missing, expected 1 or \"trail\", 2 or \"path\"");
  EXPECT_EQ(ErrorOf("[[print]]\npheromone = 2\n"),
            "f.toml:29:1: print[1].file: missing, expected a string");
  EXPECT_EQ(ErrorOf(table + "\"p.jpg\"\n"),
            "f.toml:31:8: print[1].file: found the string \"p.jpg\", expected a file whose name "
            "ends in one of .yaml, .yml, .pgm, .png, .npy, .csv");
  EXPECT_EQ(ErrorOf(table + "\"p.csv\"\nmaximum = 1.5\n"),
            "f.toml:32:11: print[1].maximum: found 1.5, expected a number from 0.000001 to 1");
  EXPECT_EQ(ErrorOf(table + "\"p.csv\"\nat_m = 3\n"),
            "f.toml:32:8: print[1].at_m: found 3, expected a point [x, y] in metres");
  EXPECT_EQ(ErrorOf(table + "\"p.csv\"\ncell_m = 0\n"),
            "f.toml:32:10: print[1].cell_m: found 0, expected a number from 0.000001 to 1000000");
  EXPECT_EQ(ErrorOf(table + "\"p.csv\"\nscale = 1\n"),
            "f.toml:32:1: print[1].scale: unknown key, expected one of name, pheromone, file, "
            "maximum, at_m, cell_m");
  EXPECT_EQ(ErrorOf(table + "\"zero.csv\"\n"),
            "f.toml:31:8: print[1].file: zero.csv: no value above 0 at any node of the map");
  EXPECT_EQ(ErrorOf(table + "\"p.csv\"\nat_m = [20, 20]\n"),
            "f.toml:31:8: print[1].file: p.csv: no value above 0 at any node of the map");
  EXPECT_EQ(ErrorOf(table + "\"bad.npy\"\n").substr(0, 45),
            "f.toml:31:8: print[1].file: bad.npy: byte 0: ");
}

// The map has 2001 x 1601 nodes: five prints of all of it are 16 018 005 nodes, and six are too
// many.
TEST_F(PrintTest, PrintsTogetherCoverALimitedNumberOfNodes) {
  Write("p.csv", "1\n");
  const std::string table =
      "[[print]]\npheromone = 2\nfile = \"p.csv\"\nat_m = [-1, -1]\ncell_m = 20\n";
  const std::string five = table + table + table + table + table;
  EXPECT_EQ(ErrorOf(five, "", "0.005"), "");
  EXPECT_EQ(ErrorOf(five + table, "", "0.005"),
            "f.toml:56:8: print[6].file: the initial rasters cover more than 16777216 nodes, "
            "expected smaller rasters or larger map cells");
}

TEST_F(PrintTest, TheirNumberIsLimited) {
  Write("p.csv", "1\n");
  std::string many;
  for (int i = 0; i < 1025; ++i) {
    many += "[[print]]\npheromone = 2\nfile = \"p.csv\"\n";
  }
  EXPECT_NE(ErrorOf(many).find("print: found 1025 tables, expected at most 1024"),
            std::string::npos);
}

}  // namespace
}  // namespace pheromone::config
