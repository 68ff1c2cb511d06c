// The laws of pheromones: what the keys become, and each way to get one wrong.
#include <algorithm>
#include <cmath>
#include <sstream>
#include <vector>

#include "server/config/testing/config_text.h"

namespace pheromone::config {
namespace {

// A map with cells of 0.1 m, and pheromones.
std::string With(std::string_view pheromones) {
  return "[map]\nwidth_m = 10\nheight_m = 8\ncell_m = 0.1\n[antennas]\nbias_m = 0.33\n" +
         std::string(pheromones) + "[[link]]\nname = \"a\"\nkind = \"pty\"\npath = \"a\"\n";
}

field::FieldConfig Read(std::string_view pheromones) {
  const Result<Config> parsed = ParseConfig(With(pheromones), "f.toml");
  EXPECT_TRUE(parsed.ok()) << parsed.error();
  return parsed.ok() ? parsed.value().engine.field : field::FieldConfig{};
}

// One pheromone with the keys of a law; the quantum is 0.25 and the maximum 1.
std::string Law(std::string_view keys) {
  return "[[pheromone]]\ntype = 3\nname = \"x\"\nquantum = 0.25\nmaximum = 1\n" + std::string(keys);
}

field::PheromoneLaw ReadLaw(std::string_view keys) {
  const field::FieldConfig field = Read(Law(keys));
  return field.pheromones.size() == 1 ? field.pheromones[0] : field::PheromoneLaw{};
}

field::PheromoneLaw Expected() {
  field::PheromoneLaw law;
  law.type = 3;
  law.name = "x";
  law.core_um = 100'000;
  law.sigma_um = 200'000;
  law.quantum_micro = 250'000;
  law.max_count = 4;
  return law;
}

constexpr std::string_view kReach = "core_m = 0.1\nsigma_m = 0.2\n";

std::string Reaching(std::string_view keys) {
  return std::string(kReach) + std::string(keys);
}

TEST(LawTest, ThePapersLawIsTheDefault) {
  field::PheromoneLaw law = Expected();
  law.tau_ms = 30'000;
  EXPECT_EQ(ReadLaw(Reaching("tau_s = 30\n")), law);
  EXPECT_EQ(ReadLaw(Reaching("tau_s = 30\nprofile = \"z-shape\"\nevaporation = \"counter\"\n")),
            law);
}

TEST(LawTest, ACounterWithoutTauIsPermanent) {
  EXPECT_EQ(ReadLaw(Reaching("tau_s = 0\n")), Expected());
  EXPECT_EQ(ReadLaw(Reaching("evaporation = \"permanent\"\n")), Expected());
}

TEST(LawTest, EvaporationsAreTold) {
  field::PheromoneLaw law = Expected();
  law.evaporation = field::Evaporation::kLinear;
  law.tau_ms = 1'500;
  EXPECT_EQ(ReadLaw(Reaching("evaporation = \"linear\"\ntau_s = 1.5\n")), law);
  law.evaporation = field::Evaporation::kExponential;
  law.tau_ms = 60'001;
  EXPECT_EQ(ReadLaw(Reaching("evaporation = \"exponential\"\nhalf_life_s = 60.001\n")), law);
}

TEST(LawTest, AConeIsAZShapeWithoutACore) {
  field::PheromoneLaw law = Expected();
  law.core_um = 0;
  law.sigma_um = 700'000;
  EXPECT_EQ(ReadLaw("profile = \"cone\"\nradius_m = 0.7\ntau_s = 0\n"), law);
}

TEST(LawTest, AGaussianEndsAtThreeDeviationsUnlessToldOtherwise) {
  field::PheromoneLaw law = Expected();
  law.profile = field::Profile::kGaussian;
  law.core_um = 0;
  law.cutoff_um = 600'000;
  EXPECT_EQ(ReadLaw("profile = \"gaussian\"\nsigma_m = 0.2\ntau_s = 0\n"), law);
  law.cutoff_um = 250'000;
  EXPECT_EQ(ReadLaw("profile = \"gaussian\"\nsigma_m = 0.2\ncutoff_m = 0.25\ntau_s = 0\n"), law);
}

TEST(LawTest, WeightsAreInThousandthsAndMayBeNegative) {
  field::PheromoneLaw law = Expected();
  law.weight_milli = -1'250;
  law.directional = false;
  EXPECT_EQ(ReadLaw(Reaching("tau_s = 0\nweight = -1.25\ndirectional = false\n")), law);
}

// x = 65 536 * 0.001 m^2/s * 0.1 s / (0.1 m)^2 = 655.36; k = 2^32 * 2^(-0.1 / 60) = 4 290 008
// 420.1.
TEST(LawTest, DiffusionIsInSharesOfADifferenceAndOfWhatIsKept) {
  field::PheromoneLaw law = Expected();
  law.evaporation = field::Evaporation::kExponential;
  law.tau_ms = 60'000;
  law.diffusion = {655, 100, 4'290'008'420, 512};
  EXPECT_EQ(ReadLaw(Reaching("evaporation = \"exponential\"\nhalf_life_s = 60\n"
                             "diffusion = {coefficient_m2_per_s = 0.001}\n")),
            law);
}

// x = 65 536 / 4, just permitted; nothing evaporates; a cut-off of a fifth of a quantum.
TEST(LawTest, APermanentPheromoneMayDiffuse) {
  field::PheromoneLaw law = Expected();
  law.diffusion = {16'384, 250, 0, 13'107};
  EXPECT_EQ(ReadLaw(Reaching("evaporation = \"permanent\"\ndiffusion = {coefficient_m2_per_s = "
                             "0.01, step_s = 0.25, cutoff = 0.05}\n")),
            law);
}

TEST(LawTest, AStepMayTakeAHalfLifeAndNoMore) {
  const std::string keys = Reaching(
      "evaporation = \"exponential\"\nhalf_life_s = 0.05\n"
      "diffusion = {coefficient_m2_per_s = 0.01, step_s = ");
  EXPECT_EQ(ReadLaw(keys + "0.05}\n").diffusion.keep_q32, uint32_t{1} << 31);
  EXPECT_EQ(ErrorOf(With(Law(keys + "0.051}\n"))),
            "f.toml:16:52: pheromone[1].diffusion.step_s: found 0.051, expected a number from "
            "0.001 to 0.05");
}

// A node of a layer holds less than 2^31 / 65 536 quanta.
TEST(LawTest, APheromoneThatDiffusesHasAtMost32767Quanta) {
  const auto with_maximum = [](std::string_view maximum) {
    std::string text =
        Law(Reaching("evaporation = \"permanent\"\ndiffusion = {coefficient_m2_per_s = 0.01}\n"));
    return With(text.replace(text.find("maximum = 1"), 11, maximum));
  };
  EXPECT_EQ(ErrorOf(with_maximum("maximum = 8191.75")), "");
  EXPECT_EQ(
      ErrorOf(with_maximum("maximum = 8192")),
      "f.toml:11:11: pheromone[1].maximum: found 8192 or 32768 quanta, expected at most 32767 "
      "quanta for a pheromone with diffusion");
}

struct LawCase {
  std::string_view keys;
  std::string_view error;  // without the file; the first of the keys is on line 12
};

class LawErrorsTest : public ::testing::TestWithParam<LawCase> {};

TEST_P(LawErrorsTest, NamesPlaceKeyAndExpectation) {
  EXPECT_EQ(ErrorOf(With(Law(GetParam().keys))), "f.toml:" + std::string(GetParam().error));
}

INSTANTIATE_TEST_SUITE_P(
    Profiles, LawErrorsTest,
    ::testing::Values(
        LawCase{"tau_s = 1\nprofile = \"square\"\n",
                "13:11: pheromone[1].profile: found the string \"square\", expected one of "
                "\"z-shape\", \"cone\", \"gaussian\""},
        LawCase{"tau_s = 1\nprofile = \"cone\"\n",
                "7:1: pheromone[1].radius_m: missing, expected a number from 0.000001 to 50"},
        LawCase{"tau_s = 1\nprofile = \"cone\"\nradius_m = 1\ncore_m = 1\n",
                "15:1: pheromone[1].core_m: not permitted with profile = \"cone\", expected only "
                "radius_m"},
        LawCase{"tau_s = 1\nprofile = \"cone\"\nradius_m = 51\n",
                "14:12: pheromone[1].radius_m: found 51, expected a number from 0.000001 to 50"},
        LawCase{"tau_s = 1\nprofile = \"gaussian\"\nradius_m = 1\nsigma_m = 1\n",
                "14:1: pheromone[1].radius_m: not permitted with profile = \"gaussian\", expected "
                "sigma_m and optionally cutoff_m"},
        LawCase{"tau_s = 1\nprofile = \"gaussian\"\ncutoff_m = 1\n",
                "7:1: pheromone[1].sigma_m: missing, expected a number from 0.000001 to 50"},
        LawCase{"tau_s = 1\nprofile = \"gaussian\"\nsigma_m = 17\n",
                "14:11: pheromone[1].sigma_m: 3 sigma_m is 51 m, expected at most 50 m"},
        LawCase{"tau_s = 1\nsigma_m = 0.1\ncore_m = 0\ncutoff_m = 1\n",
                "15:1: pheromone[1].cutoff_m: not permitted with profile = \"z-shape\", expected "
                "core_m and "
                "sigma_m"}));

INSTANTIATE_TEST_SUITE_P(
    Evaporations, LawErrorsTest,
    ::testing::Values(
        LawCase{"core_m = 0\nsigma_m = 1\nevaporation = \"slow\"\n",
                "14:15: pheromone[1].evaporation: found the string \"slow\", expected one of "
                "\"counter\", \"linear\", \"exponential\", \"permanent\""},
        LawCase{"core_m = 0\nsigma_m = 1\n",
                "7:1: pheromone[1].tau_s: missing, expected a number from 0 to 1000000000"},
        LawCase{"core_m = 0\nsigma_m = 1\nhalf_life_s = 3\n",
                "7:1: pheromone[1].evaporation: missing, expected \"exponential\", to which "
                "half_life_s belongs"},
        LawCase{"core_m = 0\nsigma_m = 1\nhalf_life_s = 3\ntau_s = 1\n",
                "14:1: pheromone[1].half_life_s: not permitted with evaporation = \"counter\", "
                "expected "
                "tau_s"},
        LawCase{"core_m = 0\nsigma_m = 1\nevaporation = \"linear\"\ntau_s = 0\n",
                "15:9: pheromone[1].tau_s: found 0, expected a number from 0.001 to 1000000000"},
        LawCase{
            "core_m = 0\nsigma_m = 1\nevaporation = \"exponential\"\ntau_s = 3\n"
            "half_life_s = 2\n",
            "15:1: pheromone[1].tau_s: not permitted with evaporation = \"exponential\", expected "
            "half_life_s"},
        LawCase{"core_m = 0\nsigma_m = 1\nevaporation = \"exponential\"\nhalf_life_s = 0\n",
                "15:15: pheromone[1].half_life_s: found 0, expected a number from 0.001 to "
                "1000000000"},
        LawCase{"core_m = 0\nsigma_m = 1\nevaporation = \"permanent\"\ntau_s = 0\n",
                "15:1: pheromone[1].tau_s: not permitted with evaporation = \"permanent\", "
                "expected neither tau_s nor half_life_s"},
        LawCase{"core_m = 0\nsigma_m = 1\ntau_s = 1\nweight = 1000.001\n",
                "15:10: pheromone[1].weight: found 1000.001, expected a number from -1000 to 1000"},
        LawCase{"core_m = 0\nsigma_m = 1\ntau_s = 1\nweight = 0.0005\n",
                "15:10: pheromone[1].weight: found 0.0005, expected a multiple of 0.001"}));

INSTANTIATE_TEST_SUITE_P(
    Diffusion, LawErrorsTest,
    ::testing::Values(
        LawCase{"core_m = 0\nsigma_m = 1\ntau_s = 1\ndiffusion = {coefficient_m2_per_s = 0.01}\n",
                "7:1: pheromone[1].evaporation: expected \"exponential\" or \"permanent\" for a "
                "pheromone with diffusion"},
        LawCase{"core_m = 0\nsigma_m = 1\nevaporation = \"linear\"\ntau_s = 1\n"
                "diffusion = {coefficient_m2_per_s = 0.01}\n",
                "14:15: pheromone[1].evaporation: expected \"exponential\" or \"permanent\" for a "
                "pheromone with diffusion"},
        LawCase{"core_m = 0\nsigma_m = 1\ntau_s = 0\ndiffusion = 0.01\n",
                "15:13: pheromone[1].diffusion: found 0.01, expected {coefficient_m2_per_s = ...}"},
        LawCase{
            "core_m = 0\nsigma_m = 1\ntau_s = 0\ndiffusion = {}\n",
            "15:13: pheromone[1].diffusion.coefficient_m2_per_s: missing, expected a number from "
            "0.000000001 to 1000"},
        LawCase{"core_m = 0\nsigma_m = 1\ntau_s = 0\ndiffusion = {coefficient_m2_per_s = 0.01, "
                "steps = 1}\n",
                "15:43: pheromone[1].diffusion.steps: unknown key, expected step_s?"},
        LawCase{
            "core_m = 0\nsigma_m = 1\ntau_s = 0\ndiffusion = {coefficient_m2_per_s = 0.01, "
            "cutoff = 0.3}\n",
            "15:52: pheromone[1].diffusion.cutoff: found 0.3, expected a number from 0 to 0.25"},
        // 0.1 m^2/s * 0.1 s is the square of a cell: four times too much.
        LawCase{
            "core_m = 0\nsigma_m = 1\ntau_s = 0\ndiffusion = {coefficient_m2_per_s = 0.1}\n",
            "15:37: pheromone[1].diffusion.coefficient_m2_per_s: found 0.1 with a step of 0.1 s "
            "and cells of 0.1 m, which is unstable, expected at most 0.025, or step_s at most "
            "0.025"},
        // Not a 65 536th of the square of a cell.
        LawCase{
            "core_m = 0\nsigma_m = 1\ntau_s = 0\ndiffusion = {coefficient_m2_per_s = 1e-7}\n",
            "15:37: pheromone[1].diffusion.coefficient_m2_per_s: found 0.0000001 with a step of "
            "0.1 s and cells of 0.1 m, which moves nothing, expected at least "
            "0.00000153"}));

// --- Blends.

constexpr std::string_view kTwo =
    "[[pheromone]]\ntype = 1\nname = \"blend\"\nblend = [{pheromone = \"path\", weight = 0.5}, "
    "{pheromone = 3}]\n"  // before its parts
    "[[pheromone]]\ntype = 2\nname = \"path\"\nprofile = \"cone\"\nradius_m = 0.2\ntau_s = 0\n"
    "quantum = 0.25\nmaximum = 1\n"
    "[[pheromone]]\ntype = 3\nname = \"repellent\"\nprofile = \"cone\"\nradius_m = 0.2\n"
    "tau_s = 0\nquantum = 0.25\nmaximum = 1\nweight = -2.5\n";

TEST(BlendTest, PartsMayStandFurtherDownAndBringTheirOwnWeight) {
  const field::FieldConfig field = Read(kTwo);
  ASSERT_EQ(field.pheromones.size(), 3u);
  field::PheromoneLaw blend;
  blend.type = 1;
  blend.name = "blend";
  blend.blend = {{2, 500}, {3, -2'500}};
  EXPECT_EQ(field.pheromones[0], blend);
}

std::string BlendError(std::string_view blend) {
  std::string text = With(kTwo);
  const size_t at = text.find("blend = [");
  text.replace(at, text.find('\n', at) - at, blend);
  return ErrorOf(text);
}

TEST(BlendTest, MistakesAreTold) {
  const std::string at = "f.toml:10:";
  EXPECT_EQ(BlendError("blend = []"),
            at +
                "9: pheromone[1].blend: found an array of 0, expected an array of parts {pheromone "
                "= ..., weight = ...}");
  EXPECT_EQ(BlendError("blend = \"path\""),
            at + "9: pheromone[1].blend: found the string \"path\", expected an array of parts "
                 "{pheromone = ..., weight = ...}");
  EXPECT_EQ(BlendError("blend = [\"path\"]"),
            at + "10: pheromone[1].blend[1]: found the string \"path\", expected a part {pheromone "
                 "= ..., weight = ...}");
  EXPECT_EQ(BlendError("blend = [{weight = 1}]"),
            at + "10: pheromone[1].blend[1].pheromone: missing, expected 2 or \"path\", 3 or "
                 "\"repellent\"");
  EXPECT_EQ(BlendError("blend = [{pheromone = \"food\"}]"),
            at + "23: pheromone[1].blend[1].pheromone: found the string \"food\", expected 2 or "
                 "\"path\", 3 or \"repellent\"");
  EXPECT_EQ(BlendError("blend = [{pheromone = 1}]"),
            at + "23: pheromone[1].blend[1].pheromone: found 1, expected 2 or \"path\", 3 or "
                 "\"repellent\": a blend has no pheromone of its own");
  EXPECT_EQ(BlendError("blend = [{pheromone = 2}, {pheromone = \"path\"}]"),
            at + "40: pheromone[1].blend[2].pheromone: found \"path\" again, expected each "
                 "pheromone once");
  EXPECT_EQ(BlendError("blend = [{pheromone = 2, weight = 1001}]"),
            at + "35: pheromone[1].blend[1].weight: found 1001, expected a number from -1000 to "
                 "1000");
  EXPECT_EQ(BlendError("blend = [{pheromone = 2, weigh = 1}]"),
            at + "26: pheromone[1].blend[1].weigh: unknown key, expected weight?");
  EXPECT_EQ(BlendError("blend = [{pheromone = 2}]\nquantum = 1"),
            "f.toml:11:1: pheromone[1].quantum: unknown key, expected one of type, name, blend");
}

// A path in a blend would be deposited nowhere.
TEST(BlendTest, NothingCanBeLaidInABlend) {
  EXPECT_EQ(
      ErrorOf(With(std::string(kTwo) + "[[path]]\npheromone = \"blend\"\n"
                                       "points_m = [[1, 1], [2, 2]]\n")),
      "f.toml:29:13: path[1].pheromone: found the string \"blend\", expected 2 or \"path\", 3 "
      "or \"repellent\": a blend has no pheromone of its own");
}

// --- What can hardly be meant.

TEST(LawTest, AReachOfLessThanACellOrOfManyMetresIsAWarning) {
  const auto warnings_of = [](const std::string& law) {
    std::vector<std::string> texts;
    const Result<Config> parsed = ParseConfig(With(Law(law)), "f");
    for (const Warning& it : parsed.value().warnings) {
      texts.push_back(it.text);
    }
    return texts;
  };
  using Texts = std::vector<std::string>;
  EXPECT_EQ(warnings_of("core_m = 0.04\nsigma_m = 0.05\ntau_s = 1\n"),
            Texts{"f:7:1: pheromone[1]: is sensed up to 0.09 m ahead, less than a cell of 0.1 m: "
                  "between nodes, nothing is sensed"});
  EXPECT_EQ(warnings_of("core_m = 1.0\nsigma_m = 4.1\ntau_s = 1\n"),
            Texts{"f:7:1: pheromone[1]: is sensed up to 5.1 m ahead, usual is 0.2 to 2 m: lengths "
                  "are in metres"});
  EXPECT_EQ(warnings_of("core_m = 0.05\nsigma_m = 0.05\ntau_s = 1\n"), Texts{});
  EXPECT_EQ(warnings_of("core_m = 1.0\nsigma_m = 4.0\ntau_s = 1\n"), Texts{});
}

TEST(LawTest, AMaximumThatNoMessageHoldsIsAWarning) {
  EXPECT_TRUE(ParseConfig(Replaced(14, "maximum = 7.5"), "f").value().warnings.empty());
  const auto warnings = ParseConfig(Replaced(14, "maximum = 100.0"), "f").value().warnings;
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_EQ(warnings[0].text,
            "f:14:11: pheromone[1].maximum: found 100, usual is 0.25 to 2: a message can hold only "
            "7.99 units, which one node alone would exceed");
}

TEST(LawTest, AntennasThatAreMetresApartAreAWarning) {
  std::string text = With(Law("core_m = 0.1\nsigma_m = 0.2\ntau_s = 1\n"));
  text.replace(text.find("0.33"), 4, "2.01");
  const auto warnings = ParseConfig(text, "f").value().warnings;
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_EQ(warnings[0].text,
            "f:6:10: antennas.bias_m: found 2.01, usual is 0.1 to 1 m between the antennas of a "
            "robot");
  text.replace(text.find("2.01"), 4, "2.00");
  EXPECT_TRUE(ParseConfig(text, "f").value().warnings.empty());
}

// --- Saturation.

// The pheromone of the text: c = 0.1 m, sigma = 0.4 m, cells of 0.1 m, directional. Naively: each
// node ahead of an antenna that stands on a node, at the maximum times mu of eq. (1).
TEST(LawTest, SaturationIsANoteWithTheStrengthThatCanBeReached) {
  double sum = 0;
  for (int x = 0; x <= 5; ++x) {
    for (int y = -5; y <= 5; ++y) {
      sum += std::clamp((0.5 - std::hypot(x, y) / 10) / 0.4, 0.0, 1.0);
    }
  }
  EXPECT_LT(1.5 * sum, 4 * 7.99);
  EXPECT_TRUE(ParseConfig(Replaced(14, "maximum = 1.5"), "f").value().notes.empty());
  EXPECT_GT(2 * sum, 4 * 8);
  const auto notes = ParseConfig(Replaced(14, "maximum = 2.0"), "f").value().notes;
  ASSERT_EQ(notes.size(), 1u);
  std::ostringstream expected;
  expected << "f:7:1: pheromone[1]: if all nearby nodes are at their maximum, an antenna senses "
           << std::floor(2 * sum * 10) / 10
           << " units, but a message can hold only 7.99; both sides are then scaled down by the "
              "same factor, which does not affect steering. A smaller `maximum` avoids this";
  EXPECT_EQ(notes[0], expected.str());
}

// The most that an antenna on a node senses of what is `most` at each node, by the definition.
double Smell(double most, double sigma_cells, int reach_cells) {
  double sum = 0;
  for (int x = -reach_cells; x <= reach_cells; ++x) {
    for (int y = -reach_cells; y <= reach_cells; ++y) {
      const int d2 = x * x + y * y;
      const double mu = std::exp(-d2 / (2 * sigma_cells * sigma_cells));
      sum += d2 <= reach_cells * reach_cells ? most * mu : 0;
    }
  }
  return sum;
}

std::vector<std::string> NotesOf(std::string_view pheromones) {
  return ParseConfig(With(pheromones), "f").value().notes;
}

std::string Units(double units) {
  std::ostringstream text;
  text << "senses " << std::floor(units * 10) / 10 << " units";
  return text.str();
}

TEST(LawTest, SaturationCountsTheWeightAndTheBell) {
  constexpr std::string_view kBell =
      "profile = \"gaussian\"\nsigma_m = 0.2\ntau_s = 0\ndirectional = false\nweight = ";
  const double one = Smell(1, 2, 6);
  ASSERT_GT(one * 1.6, 4 * 8);
  ASSERT_LT(one * 1.2, 4 * 7.9);
  const auto notes = NotesOf(Law(std::string(kBell) + "-1.6\n"));
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_NE(notes[0].find(Units(one * 1.6)), std::string::npos) << notes[0];
  EXPECT_TRUE(NotesOf(Law(std::string(kBell) + "1.2\n")).empty());
}

// Parts of opposite signs need not lie in the same place: their strengths add up.
TEST(LawTest, SaturationOfABlendIsThatOfItsPartsTogether) {
  double half_disc = 0;  // of a cone of two cells
  for (int x = 0; x <= 2; ++x) {
    for (int y = -2; y <= 2; ++y) {
      half_disc += std::max(0.0, 1 - std::hypot(x, y) / 2);
    }
  }
  ASSERT_LT(10 * half_disc, 4 * 7.99);
  ASSERT_GT(12 * half_disc, 4 * 8);
  std::string four(kTwo);
  for (size_t at = 0; (at = four.find("maximum = 1", at)) != std::string::npos; ++at) {
    four.replace(at, 11, "maximum = 4");
  }
  const auto notes = NotesOf(four);
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_EQ(notes[0].substr(0, 19), "f:7:1: pheromone[1]");
  EXPECT_NE(notes[0].find(Units(12 * half_disc)), std::string::npos) << notes[0];
}

}  // namespace
}  // namespace pheromone::config
