// The inner loops by themselves, each kernel that this processor can run against whole numbers and
// against the portable kernel.

#include "server/core/field/kernel.h"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <vector>

#include "server/core/field/cell_map.h"
#include "server/core/field/setup.h"
#include "server/core/field/testing/naive_law.h"
#include "server/core/field/testing/random_field.h"

namespace pheromone::field {
namespace {

using testing::Between;
using testing::Laws;
using testing::NaiveDirection;
using testing::NaiveLevel;
using testing::NaiveSpread;
using testing::OneIn;
using testing::Random;
using testing::RandomLaw;

constexpr uint32_t kMaxLevel = (1u << 22) - 1;
constexpr int64_t kFarthestUm = 65'000'000;

std::vector<const Kernel*> AllKernels() {
  const KernelList list = Kernels();
  return {list.kernel, list.kernel + list.count};
}

// What a kernel is asked, in whole numbers.
struct Question {
  PheromoneLaw law;
  uint64_t now_ms = 0;
  PointUm ahead;  // both 0: not directional
  std::array<PointUm, 2> antennas;
  std::vector<NodeState> states;
  std::vector<PointUm> places;  // relative to the robot's centre

  std::array<int64_t, 2> Ask(const Kernel& kernel, int count_of_antennas) const {
    KernelQuery query;
    query.now_ms = now_ms;
    query.cos = static_cast<double>(ahead.x);
    query.sin = static_cast<double>(ahead.y);
    for (size_t a = 0; a < 2; ++a) {
      query.antenna_x[a] = static_cast<double>(antennas[a].x);
      query.antenna_y[a] = static_cast<double>(antennas[a].y);
    }
    std::vector<uint64_t> words;
    for (const NodeState state : states) {
      words.push_back(PackNode(state));
    }
    auto candidates = std::make_unique<Candidates>();
    candidates->count = places.size();
    for (size_t i = 0; i < places.size(); ++i) {
      candidates->word[i] = &words[i];
      candidates->x[i] = static_cast<double>(places[i].x);
      candidates->y[i] = static_cast<double>(places[i].y);
    }
    std::array<int64_t, 2> sums{1'000, 2'000};  // they are added to
    kernel.weigh(ForKernel(law), query, candidates.get(), count_of_antennas, sums.data());
    return sums;
  }

  std::array<int64_t, 2> Expected() const {
    std::array<int64_t, 2> sums{1'000, 2'000};
    for (size_t i = 0; i < places.size(); ++i) {
      const PointUm at = places[i];
      if (at.x * ahead.x + at.y * ahead.y < 0) {
        continue;
      }
      const uint64_t time_ms = states[i].time_ms;
      const int64_t level =
          NaiveLevel(law, states[i].level, now_ms > time_ms ? now_ms - time_ms : 0);
      for (size_t a = 0; a < 2; ++a) {
        const int64_t dx = at.x - antennas[a].x;
        const int64_t dy = at.y - antennas[a].y;
        sums[a] += level * NaiveSpread(law, dx * dx + dy * dy);
      }
    }
    return sums;
  }
};

Question RandomQuestion(Random& random, Laws laws) {
  Question question;
  const int64_t cell_um = OneIn(random, 5) ? 10'000'000 : Between(random, 1'000, 200'000);
  question.law = RandomLaw(random, 1, cell_um, laws);
  PheromoneLaw& law = question.law;
  const bool stepwise = law.tau_ms != 0 && law.evaporation != Evaporation::kExponential;
  if (law.directional) {
    question.ahead = NaiveDirection(Between(random, 0, 65535));
  }
  const int64_t reach = law.reach_um();
  const int64_t span = std::min(kFarthestUm / 2, reach);
  for (PointUm& antenna : question.antennas) {
    antenna = {Between(random, -span, span), Between(random, -span, span)};
  }
  question.now_ms = static_cast<uint64_t>(OneIn(random, 4) ? static_cast<int64_t>(kTimeMask)
                                                           : Between(random, 0, 1'000'000));
  const int64_t count = OneIn(random, 6) ? Between(random, 0, 9) : Between(random, 0, 512);
  for (int64_t i = 0; i < count; ++i) {
    NodeState state;
    // The naive count-down takes as many steps as there are levels: the largest ones seldom.
    const int64_t most = stepwise && !OneIn(random, 100) ? 4'000 : kMaxLevel;
    state.level = static_cast<uint32_t>(OneIn(random, 8) ? most : Between(random, 0, most));
    const auto now = static_cast<int64_t>(question.now_ms);
    state.time_ms = static_cast<uint64_t>(
        OneIn(random, 8)
            ? Between(random, 0, static_cast<int64_t>(kTimeMask))
            : std::clamp<int64_t>(now - Between(random, -10, 8 * std::max<int64_t>(law.tau_ms, 1)),
                                  0, static_cast<int64_t>(kTimeMask)));
    question.states.push_back(state);
    // On the rim, a micrometre beside it, and anywhere.
    const PointUm antenna = question.antennas[random() % 2];
    const int64_t rim = (OneIn(random, 2) ? law.core_um : reach) + Between(random, -1, 1);
    switch (random() % 4) {
      case 0:
        question.places.push_back({antenna.x + (OneIn(random, 2) ? rim : -rim), antenna.y});
        break;
      case 1:
        question.places.push_back({antenna.x, antenna.y + (OneIn(random, 2) ? rim : -rim)});
        break;
      default:
        question.places.push_back({antenna.x + Between(random, -reach, reach),
                                   antenna.y + Between(random, -reach, reach)});
    }
  }
  return question;
}

TEST(Weigh, LawsOfWholeNumbersGiveTheExactSumInEveryKernel) {
  Random random(512);
  int telling = 0;
  constexpr int kCases = 2'000;
  for (int i = 0; i < kCases; ++i) {
    const Question question = RandomQuestion(random, Laws::kExact);
    const std::array<int64_t, 2> expected = question.Expected();
    for (const Kernel* kernel : AllKernels()) {
      ASSERT_EQ(question.Ask(*kernel, 2), expected) << kernel->name << " case " << i;
      ASSERT_EQ(question.Ask(*kernel, 1), (std::array<int64_t, 2>{expected[0], 2'000}))
          << kernel->name << " case " << i;
    }
    telling += expected[0] != 1'000 && expected[1] != 2'000 ? 1 : 0;
  }
  EXPECT_GE(telling, kCases * 80 / 100);
}

// Each node may be off by one level or by one unit of mu, and few are.
TEST(Weigh, ExponentialsAreNearTheExactSumAndTheSameInEveryKernel) {
  Random random(513);
  int telling = 0;
  constexpr int kCases = 4'000;
  for (int i = 0; i < kCases; ++i) {
    const Question question = RandomQuestion(random, Laws::kRounded);
    const std::array<int64_t, 2> expected = question.Expected();
    const std::array<int64_t, 2> portable = question.Ask(*AllKernels().front(), 2);
    for (const Kernel* kernel : AllKernels()) {
      ASSERT_EQ(question.Ask(*kernel, 2), portable) << kernel->name << " case " << i;
    }
    // 2^22 levels times 3e-10 are a thousandth of a level: one node in 500 is rounded otherwise.
    for (size_t a = 0; a < 2; ++a) {
      const auto nodes = static_cast<int64_t>(question.places.size());
      const int64_t tolerance = (1 + nodes / 50) * (65536 + int64_t{kMaxLevel});
      ASSERT_LE(std::abs(portable[a] - expected[a]), tolerance) << "case " << i;
    }
    telling += expected[0] != 1'000 && expected[1] != 2'000 ? 1 : 0;
  }
  EXPECT_GE(telling, kCases * 80 / 100);
}

// The most that a sum can become: 512 nodes at the largest level and full strength.
TEST(Weigh, TheLargestSumIsExact) {
  Question question;
  question.law.core_um = kFarthestUm;
  for (size_t i = 0; i < Candidates::kMax; ++i) {
    question.states.push_back({kMaxLevel, kTimeMask});
    question.places.push_back({static_cast<int64_t>(i), 0});
  }
  const int64_t most = 512 * int64_t{kMaxLevel} * 65536;
  for (const Kernel* kernel : AllKernels()) {
    EXPECT_EQ(question.Ask(*kernel, 2), (std::array<int64_t, 2>{1'000 + most, 2'000 + most}))
        << kernel->name;
  }
}

// How a node stands to a circle and an axle line, in whole micrometres.
struct Boundary {
  int64_t radius_um = 0;
  PointUm ahead;  // Q14; both 0: all around

  bool Keeps(PointUm at, int64_t margin_um) const {
    const int64_t radius = radius_um + margin_um;
    return radius >= 0 && at.x * at.x + at.y * at.y <= radius * radius &&
           (ahead == PointUm{} || at.x * ahead.x + at.y * ahead.y >= -margin_um * 16384);
  }
};

// Tiles in and around the circle, as a query lists them (sense.cc): no node is lost that counts,
// and what is clearly outside goes, with the tiles that have nothing else.
TEST(Mask, LosesNoNodeThatCountsAndDropsWhatIsClearlyOutside) {
  Random random(64);
  int64_t counting = 0;
  int64_t outside = 0;
  int64_t outside_kept = 0;
  for (int i = 0; i < 3'000; ++i) {
    const int64_t cell_um = Between(random, 1'000, 1'000'000);
    const auto cells = static_cast<double>(cell_um);
    const int64_t most_cells = OneIn(random, 10) ? 800 : 30;
    const Boundary boundary{
        Between(random, cell_um / 4, most_cells * cell_um),
        OneIn(random, 4) ? PointUm{} : NaiveDirection(Between(random, 0, 65535))};
    const double radius = static_cast<double>(boundary.radius_um) / cells * 1.00001 + 0.05;
    // Node (0, 0), up to 30 000 cells away.
    const PointUm first{-Between(random, 0, 30'000 * cell_um),
                        -Between(random, 0, 30'000 * cell_um)};
    MaskQuery query;
    query.cos = static_cast<float>(static_cast<double>(boundary.ahead.x) / 16384);
    query.sin = static_cast<float>(static_cast<double>(boundary.ahead.y) / 16384);
    query.margin = static_cast<float>(0.05 + radius * 1e-5);
    query.radius_squared = static_cast<float>(radius * radius);
    query.column = static_cast<double>(first.x) / cells;
    query.row = static_cast<double>(first.y) / cells;

    TileList asked;
    const std::array<uint64_t, 64> words{};
    asked.count = static_cast<size_t>(Between(random, 0, TileList::kMax));
    const auto tile_near = [&](int64_t first_um) {
      const int64_t reach_cells = boundary.radius_um / cell_um + 8;
      const int64_t node = -first_um / cell_um + Between(random, -reach_cells, reach_cells);
      return static_cast<int32_t>(std::max<int64_t>(node, 0) / 8);
    };
    for (size_t t = 0; t < asked.count; ++t) {
      const uint64_t half = random();
      asked.occupied[t] = OneIn(random, 4) ? half & random() : UINT64_MAX;
      asked.words[t] = words.data();
      asked.column[t] = tile_near(first.x);
      asked.row[t] = tile_near(first.y);
    }
    const TileList portable = [&] {
      TileList list = asked;
      AllKernels().front()->mask(query, &list);
      return list;
    }();
    for (const Kernel* kernel : AllKernels()) {
      TileList kept = asked;
      kernel->mask(query, &kept);
      ASSERT_EQ(kept.count, portable.count) << kernel->name;
      size_t at = 0;
      for (size_t t = 0; t < asked.count; ++t) {
        uint64_t left = 0;
        if (at < kept.count && kept.column[at] == asked.column[t] && kept.row[at] == asked.row[t] &&
            (kept.occupied[at] & ~asked.occupied[t]) == 0) {
          left = kept.occupied[at];
          ASSERT_EQ(left, portable.occupied[at]) << kernel->name;
          ASSERT_NE(left, 0u);
          ++at;
        }
        for (int slot = 0; slot < 64; ++slot) {
          const bool kept_it = (left >> slot & 1) != 0;
          if ((asked.occupied[t] >> slot & 1) == 0) {
            ASSERT_FALSE(kept_it) << kernel->name;
            continue;
          }
          const PointUm node{first.x + (int64_t{asked.column[t]} * 8 + slot % 8) * cell_um,
                             first.y + (int64_t{asked.row[t]} * 8 + slot / 8) * cell_um};
          const bool counts = boundary.Keeps(node, 0);
          ASSERT_TRUE(kept_it || !counts) << kernel->name << " case " << i;
          const auto clear_um = static_cast<int64_t>((0.1 + radius * 1e-4) * cells);
          const bool clearly_outside = !boundary.Keeps(node, clear_um);
          counting += counts ? 1 : 0;
          outside += clearly_outside ? 1 : 0;
          outside_kept += clearly_outside && kept_it ? 1 : 0;
        }
      }
      ASSERT_EQ(at, kept.count) << kernel->name;
    }
  }
  EXPECT_GE(counting, 1'000'000);
  EXPECT_GE(outside, 1'000'000);
  EXPECT_EQ(outside_kept, 0);
}

TEST(Kernels, BeginWithThePortableOneAndEndWithTheBest) {
  EXPECT_STREQ(AllKernels().front()->name, "scalar");
  EXPECT_EQ(AllKernels().back(), &BestKernel());
}

}  // namespace
}  // namespace pheromone::field
