#include "server/core/tags/symbols.h"

#include <gtest/gtest.h>

#include <string>

namespace pheromone::tags {
namespace {

using enum DefineOutcome;

SymbolTables TwoRobots() {
  SymbolTables tables;
  tables.DefineRobot(12, "00:11:22:33:44:55");
  tables.DefineRobot(15, "123-233-201");
  return tables;
}

TEST(SymbolTablesTest, NumbersAndIdsAreBoundOneToOne) {
  SymbolTables tables = TwoRobots();
  EXPECT_EQ(*tables.UniqueIdOf(15), "123-233-201");
  EXPECT_EQ(tables.RobotOf("123-233-201"), 15);
  EXPECT_EQ(tables.DefineRobot(15, "123-233-201"), kDone);
  EXPECT_EQ(tables.DefineRobot(15, "another"), kTaken);
  EXPECT_EQ(tables.DefineRobot(16, "123-233-201"), kTaken);
  EXPECT_EQ(tables.rows().size(), 2u);
}

TEST(SymbolTablesTest, ANewRobotGetsTheFirstFreeNumber) {
  SymbolTables tables;
  tables.DefineRobot(1, "a");
  tables.DefineRobot(3, "c");
  int32_t robot = 0;
  EXPECT_EQ(tables.AddRobot("b", &robot), kDone);
  EXPECT_EQ(robot, 2);
  EXPECT_EQ(tables.AddRobot("c", &robot), kDone);
  EXPECT_EQ(robot, 3);
  EXPECT_EQ(tables.AddRobot("d", &robot), kDone);
  EXPECT_EQ(robot, 4);
}

TEST(SymbolTablesTest, StringsAreWrittenOnce) {
  SymbolTables tables = TwoRobots();
  EXPECT_EQ(tables.DefineString(15, 3, "cleaning"), kDone);
  EXPECT_EQ(tables.DefineString(15, 3, "cleaning"), kDone);
  EXPECT_EQ(tables.DefineString(15, 3, "watering"), kTaken);
  EXPECT_EQ(tables.DefineString(16, 3, "cleaning"), kUnknownRobot);
  EXPECT_EQ(*tables.StringOf(15, 3), "cleaning");
  EXPECT_EQ(tables.StringOf(12, 3), nullptr);
  EXPECT_EQ(tables.NumberOf(15, "cleaning"), 3);
  EXPECT_EQ(tables.FreeNumberOf(15), 1);
}

TEST(SymbolTablesTest, AMappedRobotSharesAnothersStrings) {
  SymbolTables tables = TwoRobots();
  tables.DefineString(15, 3, "cleaning");
  EXPECT_EQ(tables.DefineMapping(12, 15), kDone);
  EXPECT_EQ(*tables.StringOf(12, 3), "cleaning");
  EXPECT_EQ(tables.DefineString(12, 4, "own"), kTaken);
  EXPECT_EQ(*tables.UniqueIdOf(12), "00:11:22:33:44:55");
}

TEST(SymbolTablesTest, AMappingIsOneHop) {
  SymbolTables tables = TwoRobots();
  tables.DefineRobot(17, "c");
  tables.DefineString(17, 1, "far");
  EXPECT_EQ(tables.DefineMapping(15, 17), kDone);
  EXPECT_EQ(tables.DefineMapping(12, 15), kDone);
  EXPECT_EQ(tables.StringOf(12, 1), nullptr);
}

TEST(SymbolTablesTest, AMappingComesBeforeStrings) {
  SymbolTables tables = TwoRobots();
  tables.DefineString(15, 3, "cleaning");
  EXPECT_EQ(tables.DefineMapping(15, 12), kTaken);
  EXPECT_EQ(tables.DefineMapping(12, 12), kBadValue);
  EXPECT_EQ(tables.DefineMapping(12, 99), kUnknownRobot);
  tables.DefineMapping(12, 15);
  EXPECT_EQ(tables.DefineMapping(12, 15), kDone);
}

TEST(SymbolTablesTest, TextsArePlainUtf8OfLimitedLength) {
  SymbolTables tables = TwoRobots();
  EXPECT_EQ(tables.DefineString(15, 1, std::string(255, 'x')), kDone);
  EXPECT_EQ(tables.DefineString(15, 2, std::string(256, 'x')), kBadValue);
  EXPECT_EQ(tables.DefineString(15, 2, ""), kBadValue);
  EXPECT_EQ(tables.DefineString(15, 0, "x"), kBadValue);
  EXPECT_EQ(tables.DefineString(15, 2, "p\u00f5rand \u6e05\u6383 \U0001F9F9"), kDone);
  for (const std::string_view bad : {"\xC0\x80", "\xED\xA0\x80", "\xF4\x90\x80\x80", "\xFF",
                                     "a\x80", "\xE2\x82", "a\nb", "\x7F", "\xF0\x80\x80\x80"}) {
    EXPECT_EQ(tables.DefineString(15, 9, bad), kBadValue) << bad;
  }
}

TEST(SymbolTablesTest, ARobotsRowsAreLimited) {
  SymbolTables tables = TwoRobots();
  int32_t number = 0;
  while (tables.DefineString(15, number + 1, "x" + std::to_string(number)) == kDone) {
    ++number;
  }
  EXPECT_EQ(number, 4095);  // and the row of the robot itself
  EXPECT_EQ(tables.DefineString(15, number + 1, "y"), kFull);
  EXPECT_EQ(tables.DefineString(12, 1, "y"), kDone);
}

TEST(SymbolTablesTest, RowsInTheirOrderRestoreTheTables) {
  SymbolTables tables = TwoRobots();
  tables.DefineString(15, 3, "cleaning");
  tables.DefineMapping(12, 15);
  SymbolTables restored;
  const Maker maker{"radio", 7};
  tables.Define({RowKind::kString, 15, 4, "docking"}, maker);
  for (size_t i = 0; i < tables.rows().size(); ++i) {
    ASSERT_TRUE(restored.Restore(tables.rows()[i], tables.makers()[i]));
  }
  EXPECT_EQ(restored.makers().back(), maker);
  EXPECT_EQ(restored.rows(), tables.rows());
  EXPECT_EQ(restored.hash(), tables.hash());
  EXPECT_FALSE(restored.Restore(tables.rows()[0], {}));  // twice
  EXPECT_FALSE(restored.Restore({RowKind::kString, 99, 1, "x"}, {}));
}

TEST(SymbolTablesTest, RobotsLeaveRowsToOperatorsAndNets) {
  SymbolTables tables;
  size_t rows = 0;
  for (Maker maker{"radio", 1}; rows < SymbolTables::kMaxRows; ++maker.id) {
    ASSERT_LT(maker.id, 255);
    size_t its = 0;
    DefineOutcome outcome = kDone;
    while (outcome == kDone) {
      const auto number = static_cast<int32_t>(rows + 1);
      outcome = tables.Define({RowKind::kRobot, number, number, std::to_string(number)}, maker);
      rows += outcome == kDone ? 1 : 0;
      its += outcome == kDone ? 1 : 0;
    }
    if (outcome == kFull) {
      break;
    }
    ASSERT_EQ(outcome, kMakerFull);
    EXPECT_EQ(its, 1'024u);
  }
  EXPECT_EQ(rows, 65'536u - 8'192u);
  for (int32_t number = 100'000; number < 100'000 + 8'192; ++number) {
    ASSERT_EQ(tables.DefineRobot(number, std::to_string(number)), kDone);
  }
  EXPECT_EQ(tables.DefineRobot(200'000, "x"), kFull);
}

// Robots 1 and 2 are in use by blocks; 2 uses the strings of 3, and 3 those of 4, which does not
// count. Others have defined a string of 5, and that 6 uses the strings of 7.
TEST(SymbolTablesTest, WithoutAMakerWhatOthersReferToRemains) {
  const Maker maker{"radio", 7};
  SymbolTables tables;
  for (int32_t robot = 1; robot <= 9; ++robot) {
    tables.Define({RowKind::kRobot, robot, robot, std::to_string(robot)}, maker);
  }
  tables.Define({RowKind::kMapping, 2, 3, {}}, maker);
  tables.Define({RowKind::kMapping, 3, 4, {}}, maker);
  tables.DefineString(5, 1, "five");
  tables.Define({RowKind::kString, 8, 1, "eight"}, maker);
  tables.DefineMapping(6, 7);
  const SymbolTables rest = tables.Without(maker, tables.UsedBeside(maker, {1, 2}));
  EXPECT_EQ(tables.rows().size(), 14u);
  EXPECT_EQ(rest.rows().size(), 11u);
  for (int32_t robot = 1; robot <= 9; ++robot) {
    EXPECT_EQ(rest.HasRobot(robot), robot <= 7) << robot;
  }
  EXPECT_EQ(rest.OwnerOf(2), 3);
  EXPECT_EQ(rest.StringOf(8, 1), nullptr);
  SymbolTables same;
  for (size_t i = 0; i < rest.rows().size(); ++i) {
    ASSERT_TRUE(same.Restore(rest.rows()[i], rest.makers()[i])) << i;
  }
  EXPECT_EQ(same.hash(), rest.hash());
}

TEST(SymbolTablesTest, TheHashTellsOrdersApart) {
  SymbolTables a;
  a.DefineRobot(1, "a");
  a.DefineRobot(2, "b");
  SymbolTables b;
  b.DefineRobot(2, "b");
  b.DefineRobot(1, "a");
  EXPECT_NE(a.hash(), b.hash());
}

TEST(RowKindTest, EachHasAName) {
  EXPECT_EQ(NameOf(RowKind::kRobot), "robot");
  EXPECT_EQ(NameOf(RowKind::kString), "string");
  EXPECT_EQ(NameOf(RowKind::kMapping), "mapping");
  EXPECT_EQ(RowKindNamed("robot"), RowKind::kRobot);
  EXPECT_EQ(RowKindNamed("string"), RowKind::kString);
  EXPECT_EQ(RowKindNamed("mapping"), RowKind::kMapping);
  EXPECT_EQ(RowKindNamed(""), std::nullopt);
  EXPECT_EQ(RowKindNamed("Robot"), std::nullopt);
}

}  // namespace
}  // namespace pheromone::tags
