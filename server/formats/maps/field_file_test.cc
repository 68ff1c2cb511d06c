#include "server/formats/maps/field_file.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <string>

#include "server/base/file.h"
#include "server/base/testing/temporary_folder.h"
#include "server/core/field/testing/random_field.h"

namespace pheromone::maps {
namespace {

using field::Evaporation;
using field::Field;
using field::FieldConfig;
using field::PheromoneLaw;
using field::PointUm;
using field::Shared;
using field::testing::Between;
using field::testing::OneIn;
using field::testing::Random;

// 5 x 4 nodes; a counter of whole quanta, a permanent type, and a blend of them.
FieldConfig SmallConfig() {
  FieldConfig config;
  config.map = {{-1'000'000, 2'000'000}, 400'000, 300'000, 100'000};
  config.memory_bytes = 1 << 20;
  PheromoneLaw trail;
  trail.type = 1;
  trail.name = "trail";
  trail.tau_ms = 30'000;
  trail.quantum_micro = 125'000;
  trail.max_count = 8;
  PheromoneLaw path = trail;
  path.type = 2;
  path.name = "path";
  path.tau_ms = 0;
  PheromoneLaw guide;
  guide.type = 3;
  guide.name = "guide";
  guide.blend = {{1, 1000}, {2, -500}};
  config.pheromones = {path, trail, guide};
  return config;
}

constexpr std::string_view kSmallFile =
    "# pheromone-field 1\n"
    "# map origin_um -1000000 2000000 size_um 400000 300000 cell_um 100000\n"
    "# type 1 quantum_micro 125000 law counter:30000ms name \"trail\"\n"
    "# type 2 quantum_micro 125000 law permanent name \"path\"\n"
    "# nodes type,column,row,level\n"
    "1,0,0,64\n"
    "1,2,3,128\n"
    "1,3,1,512\n"
    "2,4,3,64\n"
    "# end nodes 4 levels 768\n";

std::string ErrorOf(std::string_view text) {
  const Result<SavedField> parsed = ParseField(text, "lab.field");
  return parsed.ErrorOr("no error");
}

std::string SmallFileWith(std::string_view what, std::string_view instead) {
  std::string text(kSmallFile);
  const size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), instead);
}

TEST(FieldFileTest, IsTheTextThatTheHeaderDescribes) {
  for (const bool the_other_way_round : {false, true}) {
    Field field(SmallConfig());
    const std::vector<std::pair<PointUm, uint16_t>> deposits = {
        {{-1'000'000, 2'000'000}, 1}, {{-800'000, 2'300'000}, 2}, {{-700'000, 2'100'000}, 9}};
    for (size_t i = 0; i < deposits.size(); ++i) {
      const auto& [place, quanta] = deposits[the_other_way_round ? deposits.size() - 1 - i : i];
      ASSERT_EQ(field.Deposit(1, place, quanta, 1000), field::DepositResult::kDone);
    }
    field.Deposit(2, {-600'000, 2'300'000}, 1, 500);
    EXPECT_EQ(EncodeField(TakeFieldSnapshot(field, 30'999)), kSmallFile);
    const std::string later = EncodeField(TakeFieldSnapshot(field, 31'000));
    EXPECT_NE(later.find("\n1,2,3,64\n1,3,1,448\n2,4,3,64\n# end nodes 3 levels 576\n"),
              std::string::npos)
        << later;
  }
}

FieldConfig ConfigOfAllLaws(Random& random) {
  FieldConfig config =
      field::testing::RandomConfig(random, {1, 4, 9}, field::testing::Laws::kRounded);
  PheromoneLaw gas =
      field::testing::RandomLaw(random, 15, config.map.cell_um, field::testing::Laws::kExact);
  gas.evaporation = Evaporation::kExponential;
  gas.tau_ms = OneIn(random, 2) ? 0 : 5000;
  gas.diffusion = {.exchange_q16 = 8000, .step_ms = 100, .keep_q32 = 0, .cutoff_q16 = 30};
  config.pheromones.push_back(gas);
  PheromoneLaw blend;
  blend.type = 5;
  blend.blend = {{1, 500}, {15, -500}};
  config.pheromones.push_back(blend);
  field::ObstacleMask mask(config.map.columns(), config.map.rows());
  mask.BlockRow(static_cast<int32_t>(Between(random, 0, 10)), 3, 9);
  config.obstacles = Shared<field::ObstacleMask>(std::move(mask));
  return config;
}

TEST(FieldFileTest, AFieldMadeOfASavedOneHasTheSameLevelAtEveryNode) {
  int64_t nodes_with_something = 0;
  int64_t broken_levels = 0;
  for (uint64_t seed = 1; seed <= 60; ++seed) {
    Random random(seed);
    const FieldConfig config = ConfigOfAllLaws(random);
    Field field(config);
    uint64_t now_ms = 0;
    for (int i = 0; i < 300; ++i) {
      now_ms += static_cast<uint64_t>(Between(random, 0, 50));
      const uint8_t types[] = {1, 4, 9, 15};
      field.Deposit(types[Between(random, 0, 3)], field::testing::RandomPoint(random, config.map),
                    static_cast<uint16_t>(Between(random, 1, 6)), now_ms);
      field.Advance(now_ms);
    }
    const std::string text = EncodeField(TakeFieldSnapshot(field, now_ms));
    const Result<SavedField> saved = ParseField(text, "lab.field");
    ASSERT_TRUE(saved.ok()) << saved.error();
    EXPECT_EQ(EncodeField(saved.value()), text);
    FieldConfig laid = config;
    const Status fits = LayOnto(saved.value(), &laid);
    ASSERT_TRUE(fits.ok()) << fits.error();
    const Field again(laid);
    for (const PheromoneLaw& law : config.pheromones) {
      for (int32_t column = 0; column < config.map.columns(); ++column) {
        for (int32_t row = 0; row < config.map.rows(); ++row) {
          const uint32_t level = field.LevelOf(law.type, {column, row}, now_ms);
          ASSERT_EQ(again.LevelOf(law.type, {column, row}, 0), level)
              << "seed " << seed << " type " << int{law.type} << " at " << column << ", " << row;
          nodes_with_something += level != 0 ? 1 : 0;
          broken_levels += level % 64 != 0 ? 1 : 0;
        }
      }
    }
    EXPECT_EQ(EncodeField(TakeFieldSnapshot(again, 0)), text);
  }
  EXPECT_GT(nodes_with_something, 10'000);
  EXPECT_GT(broken_levels, 1'000);
}

TEST(FieldFileTest, AReaderBesideTheWriterSeesTheSameFieldAtRest) {
  Random random(7);
  const FieldConfig config = ConfigOfAllLaws(random);
  Field field(config);
  for (int i = 0; i < 200; ++i) {
    field.Deposit(i % 2 == 0 ? 1 : 15, field::testing::RandomPoint(random, config.map), 3, 50);
  }
  const field::FieldReader reader(field);
  ASSERT_TRUE(reader.ok());
  const SavedField beside = TakeFieldSnapshot(reader, config.map, config.pheromones, 60);
  EXPECT_EQ(beside, TakeFieldSnapshot(field, 60));
  EXPECT_EQ(beside.initial_rasters.size(), 2u);
}

TEST(FieldFileTest, AFileThatIsCutOffAnywhereIsRefused) {
  ASSERT_TRUE(ParseField(kSmallFile, "lab.field").ok());
  for (size_t size = 0; size < kSmallFile.size(); ++size) {
    const std::string error = ErrorOf(kSmallFile.substr(0, size));
    EXPECT_TRUE(error.starts_with("lab.field:")) << size << ": " << error;
    EXPECT_NE(error.find(", expected "), std::string::npos) << size << ": " << error;
  }
}

TEST(FieldFileTest, ALineThatIsLostOrThereTwiceIsNoticed) {
  size_t begin = 0;
  for (size_t end = kSmallFile.find('\n'); end != std::string_view::npos;
       begin = end + 1, end = kSmallFile.find('\n', begin)) {
    const std::string before(kSmallFile.substr(0, begin));
    const std::string line(kSmallFile.substr(begin, end + 1 - begin));
    const std::string after(kSmallFile.substr(end + 1));
    EXPECT_NE(ErrorOf(std::string(before).append(after)), "no error") << line;
    EXPECT_NE(ErrorOf(std::string(before).append(line).append(line).append(after)), "no error")
        << line;
  }
}

struct Mistake {
  std::string_view what;
  std::string_view instead;
  std::string_view error;
};

TEST(FieldFileTest, EveryMistakeIsToldWithItsPlace) {
  const Mistake mistakes[] = {
      {"# pheromone-field", "#pheromones", "lab.field:1:1: found \"#pheromones\", expected"},
      {"field 1\n", "field 2\n", "lab.field:1:19: found \"2\", expected version 1"},
      {"field 1\n", "field 11\n", "lab.field:1:19: found \"11\", expected version 1"},
      {" 400000 ", " 0 ", "lab.field:2:42: found \"0\", expected a width from 1 to"},
      {"cell_um 100000", "cell_um 0", "found \"0\", expected a cell from 1 to"},
      {"400000 300000 cell_um 100000", "1 1000000000000 cell_um 59604",
       "lab.field:2:66: found \"59604\", expected a cell from 59605 to"},
      {"400000", "99999999999999999999999", "expected a width from 1 to"},
      {"type 1 ", "type 0 ", "lab.field:3:8: found \"0\", expected a type from 1 to 15"},
      {"type 2 ", "type 1 ", "lab.field:4:8: found \"1\", expected a type from 2 to 15"},
      {"quantum_micro 125000 law c", "quantum_micro 0 law c", "expected a quantum from 1 to"},
      {"\"trail\"", "\"trail", "lab.field:3:57: found \"trail\", expected a name in"},
      {"\"trail\"", "\"tra\x1bil\"", "lab.field:3:57: found \"tra?il\"\", expected a printable"},
      {"1,0,0,64", "1,5,0,64", "lab.field:6:3: found \"5\", expected a column from 0 to 4"},
      {"1,0,0,64", "1,0,4,64", "lab.field:6:5: found \"4\", expected a row from 0 to 3"},
      {"1,0,0,64", "1,-1,0,64", "lab.field:6:3: found \"-1\", expected a column from 0 to 4"},
      {"1,0,0,64", "1,0,0,0", "lab.field:6:7: found \"0\", expected a level from 1 to 4194240"},
      {"1,0,0,64", "1,0,0,4194241", "found \"4194241\", expected a level"},
      {"1,0,0,64", "1,00,0,64", "lab.field:6:3: found \"00\", expected a column"},
      {"1,0,0,64", "1,-0,0,64", "lab.field:6:3: found \"-0\", expected a column"},
      {"1,0,0,64", "1,0,0,64,", "lab.field:6:9: found nothing, expected the end of the line"},
      {"1,0,0,64", "1,0,0,6.4", "lab.field:6:8: found \".4\", expected the end of the line"},
      {"1,0,0,64", "1,0,0", "lab.field:6:6: found the end of the line, expected \",\""},
      {"1,0,0,64", "", "lab.field:6:1: found the end of the line, expected a type"},
      {"1,0,0,64\n", "1,0,0,64\r\n", "lab.field:6:9: found \"?\", expected the end of the line"},
      {"1,2,3,128", "1,0,0,128", "lab.field:7:1: found \"1,0,0,128\", expected nodes in order"},
      {"1,3,1,512", "1,2,2,512", "lab.field:8:1: found \"1,2,2,512\", expected nodes in order"},
      {"1,3,1,512", "2,3,1,512\n1,3,1,5", "lab.field:9:1: found \"1,3,1,5\", expected nodes in"},
      {"2,4,3,64", "3,4,3,64", "lab.field:9:1: found type 3, expected a type that the header"},
      {"nodes 4", "nodes 5", "lab.field:10:13: found \"5\", expected \"4\""},
      {"768", "767", "lab.field:10:22: found \"767\", expected \"768\""},
      {"768\n", "768\n1,1,1,1\n", "lab.field:11:1: found more, expected the end of the file"},
  };
  for (const Mistake& mistake : mistakes) {
    const std::string error = ErrorOf(SmallFileWith(mistake.what, mistake.instead));
    EXPECT_NE(error.find(mistake.error), std::string::npos)
        << mistake.instead << "\n  gives   " << error << "\n  instead " << mistake.error;
  }
}

TEST(FieldFileTest, WhatDoesNotFitTheConfigurationIsRefusedWithWords) {
  const SavedField saved = ParseField(kSmallFile, "lab.field").value();
  ASSERT_TRUE(CheckFits(saved, SmallConfig()).ok());
  const auto refusal = [&saved](const auto& change) {
    FieldConfig config = SmallConfig();
    change(config);
    const FieldConfig before = config;
    const Status laid = LayOnto(saved, &config);
    EXPECT_EQ(config, before);
    return laid.ErrorOr("no error");
  };
  // pheromones[0] is the path, [1] the trail, [2] the blend.
  EXPECT_EQ(refusal([](FieldConfig& it) { it.map.cell_um = 50'000; }),
            "the map was saved with origin (-1000000, 2000000), size 400000 x 300000 and cells of "
            "100000 um, and is configured with origin (-1000000, 2000000), size 400000 x 300000 "
            "and cells of 50000 um");
  EXPECT_NE(refusal([](FieldConfig& it) { it.map.origin.y = 0; }), "no error");
  EXPECT_EQ(refusal([](FieldConfig& it) { it.pheromones.erase(it.pheromones.begin() + 1); }),
            "pheromone type 1 (\"trail\") is not configured");
  EXPECT_EQ(
      refusal([](FieldConfig& it) {
        it.pheromones[1].blend = {{2, 1000}};
      }),
      "pheromone type 1 (\"trail\") is configured as a blend, which has no content of its own");
  EXPECT_EQ(refusal([](FieldConfig& it) { it.pheromones[1].name = "alarm"; }),
            "pheromone type 1 (\"trail\") is configured as \"alarm\"");
  EXPECT_EQ(refusal([](FieldConfig& it) { it.pheromones[0].quantum_micro = 250'000; }),
            "pheromone type 2 (\"path\") was saved in quanta of 125000 millionths, and is "
            "configured with quanta of 250000");
  EXPECT_EQ(refusal([](FieldConfig& it) { it.pheromones[1].max_count = 7; }),
            "pheromone type 1 (\"trail\") has level 512 at node (3, 1), expected at most 448, the "
            "configured maximum");
  EXPECT_NE(refusal([](FieldConfig& it) { it.memory_bytes = 1000; }).find("memory is 1000"),
            std::string::npos);

  const SavedField broken =
      ParseField(
          SmallFileWith("512\n2,4,3,64", "512\n2,4,3,65").replace(kSmallFile.size() - 4, 3, "769"),
          "lab.field")
          .value();
  EXPECT_TRUE(CheckFits(broken, SmallConfig()).ok()) << "a permanent type holds any level";
  FieldConfig counting = SmallConfig();
  counting.pheromones[0].tau_ms = 1000;
  const Status refused = CheckFits(broken, counting);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error(),
            "pheromone type 2 (\"path\") has level 65 at node (4, 3), expected a multiple of 64: "
            "its law counts whole quanta");
}

TEST(FieldFileTest, AnotherEvaporationGoesOnFromTheSavedLevels) {
  FieldConfig config = SmallConfig();
  config.pheromones[1].evaporation = Evaporation::kLinear;
  config.pheromones[1].tau_ms = 64'000;
  ASSERT_TRUE(LayOnto(ParseField(kSmallFile, "lab.field").value(), &config).ok());
  const Field field(config);
  EXPECT_EQ(field.LevelOf(1, {3, 1}, 0), 512u);
  EXPECT_EQ(field.LevelOf(1, {3, 1}, 10'000), 502u);
}

TEST(FieldFileTest, ATypeThatHoldsNothingNeedNotBeConfigured) {
  SavedField saved = ParseField(kSmallFile, "lab.field").value();
  saved.initial_rasters.pop_back();
  FieldConfig config = SmallConfig();
  config.pheromones.erase(config.pheromones.begin());
  EXPECT_TRUE(CheckFits(saved, config).ok());
}

TEST(FieldFileTest, WhatTheConfigurationLaysStaysWhereItIsMoreAndObstaclesStayFree) {
  FieldConfig config = SmallConfig();
  config.paths = {{2, 3, false, {{-600'000, 2'300'000}}}, {1, 1, false, {{-700'000, 2'100'000}}}};
  field::ObstacleMask mask(5, 4);
  mask.Set({2, 3});
  config.obstacles = Shared<field::ObstacleMask>(std::move(mask));
  ASSERT_TRUE(LayOnto(ParseField(kSmallFile, "lab.field").value(), &config).ok());
  const Field field(config);
  EXPECT_EQ(field.LevelOf(2, {4, 3}, 0), 3 * 64u);
  EXPECT_EQ(field.LevelOf(1, {3, 1}, 0), 8 * 64u);
  EXPECT_EQ(field.LevelOf(1, {2, 3}, 0), 0u);
}

TEST(FieldFileTest, ANameThatIsNotPrintableIsKeptPrintableAndStillFits) {
  FieldConfig config = SmallConfig();
  config.pheromones[1].name = "a \"quoted\"\nname";
  Field field(config);
  field.Deposit(1, config.map.origin, 1, 0);
  const std::string text = EncodeField(TakeFieldSnapshot(field, 0));
  EXPECT_NE(text.find("name \"a \"quoted\"?name\"\n"), std::string::npos) << text;
  const Result<SavedField> saved = ParseField(text, "lab.field");
  ASSERT_TRUE(saved.ok()) << saved.error();
  EXPECT_TRUE(CheckFits(saved.value(), config).ok());
}

TEST(FieldFileTest, AnEmptyFieldHasAFileToo) {
  const Field field(SmallConfig());
  const Result<SavedField> saved =
      ParseField(EncodeField(TakeFieldSnapshot(field, 0)), "lab.field");
  ASSERT_TRUE(saved.ok()) << saved.error();
  EXPECT_EQ(saved.value().initial_rasters.size(), 0u);
  EXPECT_EQ(saved.value().types.size(), 2u);
}

TEST(FieldFileTest, IsWrittenAndReadAsAFileWhoseNameErrorsTell) {
  const TemporaryFolder folder;
  const std::string path = folder / "lab.field";
  const SavedField saved = ParseField(kSmallFile, "lab.field").value();
  ASSERT_TRUE(SaveField(path, saved).ok());
  EXPECT_EQ(ReadFile(path).value(), kSmallFile);
  EXPECT_EQ(LoadField(path).value(), saved);
  ASSERT_TRUE(WriteFile(path, "P5 1 1").ok());
  EXPECT_TRUE(LoadField(path).error().starts_with(path + ":1:")) << LoadField(path).error();
  std::filesystem::remove(path);
  EXPECT_TRUE(LoadField(path).error().starts_with(path + ": cannot be opened"));
  EXPECT_FALSE(SaveField("/nowhere/at/all.field", saved).ok());
}

}  // namespace
}  // namespace pheromone::maps
