// The robots' arithmetic on a microcontroller: steering, nets and angles, with the same bits as on
// the host. The same test is linked once for each chip (target.h).
#include <gtest/gtest.h>

#include <cstdint>
#include <numeric>
#include <tuple>
#include <utility>
#include <vector>

#include "client_fw/core/base/angle.h"
#include "client_fw/core/steering/steering.h"
#include "client_fw/core/tasks/robot_net.h"
#include "proto_tests/conformance/chip_test.h"
#include "proto_tests/conformance/client.h"
#include "server/core/petri/net.h"
#include "server/formats/nets/system_file.h"

namespace pheromone::conformance {
namespace {

using ChipClientCore = ChipTest;

TEST_F(ChipClientCore, SteersWithTheSameBitsAsTheHost) {
  Dice dice(6);
  std::vector<SteerInput> inputs;
  for (int i = 0; i < 8000; ++i) {
    inputs.push_back({i % 2 == 0 ? client::Law::kDifferential : client::Law::kPaper,
                      dice.Any<int16_t>(), dice.Any<int16_t>(),
                      static_cast<int16_t>(dice.Below(client::kMaxSpeedMmS + 1u)),
                      static_cast<uint8_t>(dice.OneIn(2) ? client::kUnitGain : dice.Below(65))});
    if (dice.OneIn(4)) {  // as on a real map: near the unit, and near each other
      inputs.back().left = static_cast<int16_t>(dice.Within(2 * client::kIntensityUnit));
      inputs.back().right = static_cast<int16_t>(inputs.back().left + dice.Within(16));
    }
  }
  const std::vector<client::WheelSpeeds> speeds = chip_.Steer(inputs);
  ASSERT_EQ(speeds.size(), inputs.size());
  for (size_t i = 0; i < inputs.size(); ++i) {
    const SteerInput& in = inputs[i];
    ASSERT_EQ(speeds[i], client::Steer(in.law, in.left, in.right, in.k_mm_s, in.gain_16ths))
        << in.left << ' ' << in.right << ' ' << in.k_mm_s << ' ' << int{in.gain_16ths};
  }
}

TEST_F(ChipClientCore, SteersFuzzilyWithTheSameBitsAsTheHost) {
  Dice dice(7);
  std::vector<FuzzyInput> inputs;
  for (int i = 0; i < 8000; ++i) {
    const auto error = static_cast<int16_t>(dice.Within(2 * 2048));
    inputs.push_back({{dice.OneIn(8) ? client::kNoError : error},
                      dice.Any<int16_t>(),
                      dice.Any<int16_t>(),
                      static_cast<int16_t>(dice.Below(client::kMaxSpeedMmS + 1u))});
    if (dice.OneIn(2)) {
      inputs.back().left = static_cast<int16_t>(dice.Within(2 * client::kIntensityUnit));
      inputs.back().right = static_cast<int16_t>(inputs.back().left + dice.Within(512));
    }
  }
  const std::vector<FuzzyOutput> outputs = chip_.SteerFuzzy(inputs);
  ASSERT_EQ(outputs.size(), inputs.size());
  for (size_t i = 0; i < inputs.size(); ++i) {
    const FuzzyInput& in = inputs[i];
    client::FuzzyState state = in.before;
    const client::WheelSpeeds wheels =
        client::SteerFuzzy(in.left, in.right, in.k_mm_s, client::kTunedFuzzy, &state);
    ASSERT_EQ(outputs[i].wheels, wheels) << in.before.error << ' ' << in.left << ' ' << in.right;
    ASSERT_EQ(outputs[i].after.error, state.error);
  }
}

// A net of 0 and 1 tokens as the server has it, and as a robot has it.
struct SafeNet {
  petri::Net net;
  std::vector<client::NetTransition> transitions;
};

SafeNet MakeSafeNet(Dice* dice) {
  SafeNet made;
  const auto places = 1 + dice->Below(client::kMaxNetPlaces);
  for (uint32_t place = 0; place < places; ++place) {
    made.net.places.push_back(
        {.id = "p" + std::to_string(place), .tokens = dice->OneIn(2) ? 1U : 0U});
  }
  const auto count = 1 + dice->Below(client::kMaxNetTransitions);
  for (uint32_t i = 0; i < count; ++i) {
    petri::Transition& transition = made.net.transitions.emplace_back();
    client::NetTransition& bits = made.transitions.emplace_back();
    for (uint32_t place = 0; place < places; ++place) {
      const uint32_t bit = uint32_t{1} << place;
      if (dice->OneIn(places + 1)) {
        transition.takes.push_back({place});
        bits.takes |= bit;
      }
      if (dice->OneIn(places + 1)) {
        transition.gives.push_back({place});
        bits.gives |= bit;
      }
      if (dice->OneIn(4 * places) && (bits.takes & bit) == 0 && (bits.gives & bit) == 0) {
        transition.reads.push_back({place});
        bits.takes |= bit;
        bits.gives |= bit;
      }
      if (dice->OneIn(4 * places)) {
        transition.inhibitors.push_back({place});
        bits.inhibited_by |= bit;
      }
    }
  }
  return made;
}

uint32_t BitsOf(const petri::Marking& marking) {
  uint32_t bits = 0;
  for (Eigen::Index place = 0; place < marking.size(); ++place) {
    bits |= static_cast<uint32_t>(marking[place]) << place;
  }
  return bits;
}

struct Firings {
  int fired = 0;
  int refused = 0;
  int unsafe = 0;
};

// 500 attempts from the initial marking on.
void ExpectSameFirings(ConformanceClient* chip, const SafeNet& made, Dice* dice, Firings* count) {
  petri::Marking marking = petri::InitialMarking(made.net);
  std::vector<uint8_t> tried;
  for (int i = 0; i < 500; ++i) {
    tried.push_back(static_cast<uint8_t>(dice->Below(made.transitions.size())));
  }
  const std::vector<FiringOutput> outputs = chip->FireNet(made.transitions, BitsOf(marking), tried);
  for (size_t i = 0; i < tried.size(); ++i) {
    const bool enabled = petri::IsEnabled(made.net, tried[i], marking);
    const petri::Marking next = petri::Fire(made.net, tried[i], marking);
    const bool legal = enabled && next.maxCoeff() <= 1;
    ++(legal ? count->fired : enabled ? count->unsafe : count->refused);
    if (legal) {
      marking = next;
    }
    ASSERT_EQ(outputs[i].firing == client::Firing::kFired, legal) << i;
    ASSERT_EQ(outputs[i].firing == client::Firing::kUnsafe, enabled && !legal);
    ASSERT_EQ(outputs[i].marking, BitsOf(marking));
  }
}

// 100 000 firings, most of which are refused.
TEST_F(ChipClientCore, FiresNetsAsTheServerDoes) {
  Dice dice(15);
  Firings count;
  for (int run = 0; run < 200; ++run) {
    SCOPED_TRACE(run);
    ExpectSameFirings(&chip_, MakeSafeNet(&dice), &dice, &count);
  }
  EXPECT_GT(count.fired, 10'000);
  EXPECT_GT(count.refused, 10'000);
  EXPECT_GT(count.unsafe, 1'000);
}

TEST_F(ChipClientCore, FiresTheShippedRobotsNetAsTheServerDoes) {
  Result<petri::Net> net =
      nets::LoadSystem(PHEROMONE_SOURCE_DIR "/deploy/examples/nets/robot.toml");
  ASSERT_TRUE(net.ok()) << net.error();
  SafeNet made{std::move(net).value(), {}};
  for (int i = 0; i < client::kRobotNet.transition_count; ++i) {
    made.transitions.push_back(client::kRobotNet.transitions[i].arcs);
  }
  ASSERT_EQ(made.transitions.size(), made.net.transitions.size());
  ASSERT_EQ(client::kRobotNet.marking, BitsOf(petri::InitialMarking(made.net)));
  Dice dice(16);
  Firings count;
  for (int run = 0; run < 20; ++run) {
    SCOPED_TRACE(run);
    ExpectSameFirings(&chip_, made, &dice, &count);
  }
  EXPECT_GT(count.fired, 500);
  EXPECT_EQ(count.fired + count.refused, 10'000);
}

TEST_F(ChipClientCore, SteersCarefullyWithTheSameBitsAsTheHost) {
  using State = client::CarefulState;
  Dice dice(8);
  std::vector<CarefulInput> inputs;
  for (int i = 0; i < 8000; ++i) {
    State before = client::kCarefulStart;
    before.plateau = static_cast<int16_t>(31 + dice.Below(32737));
    before.course = dice.Any<uint16_t>();
    before.turn = static_cast<uint16_t>(dice.Below(client::kAsideAngle + 1u));
    before.mode = static_cast<State::Mode>(dice.Below(3));
    before.aside = static_cast<State::Side>(
        before.mode == State::Mode::kFollowing ? dice.Below(3) : 1 + dice.Below(2));
    before.stronger = static_cast<State::Side>(1 + dice.Below(2));
    before.clear = static_cast<uint8_t>(dice.Below(4));
    inputs.push_back({before, dice.Any<int16_t>(), dice.Any<int16_t>(), dice.Any<uint16_t>(),
                      static_cast<int16_t>(dice.Below(client::kMaxSpeedMmS + 1u))});
    if (dice.OneIn(2)) {  // as on a trail
      inputs.back().left = static_cast<int16_t>(dice.Below(client::kIntensityUnit));
      inputs.back().right = static_cast<int16_t>(inputs.back().left + dice.Within(1024));
    }
  }
  const std::vector<CarefulOutput> outputs = chip_.SteerCareful(inputs);
  ASSERT_EQ(outputs.size(), inputs.size());
  for (size_t i = 0; i < inputs.size(); ++i) {
    const CarefulInput& in = inputs[i];
    State state = in.before;
    client::Notice(in.left, in.right, in.heading, &state);
    ASSERT_EQ(outputs[i].wheels,
              client::SteerCareful(in.left, in.right, in.k_mm_s, client::kUnitGain, state))
        << in.left << ' ' << in.right << ' ' << in.k_mm_s;
    ASSERT_EQ(outputs[i].search, client::Search(in.k_mm_s, state));
    const State& after = outputs[i].after;
    ASSERT_EQ(std::tie(after.plateau, after.course, after.turn, after.mode, after.aside,
                       after.stronger, after.clear),
              std::tie(state.plateau, state.course, state.turn, state.mode, state.aside,
                       state.stronger, state.clear));
  }
}

TEST_F(ChipClientCore, HasTheSameSineOfEveryAngleAsTheHost) {
  std::vector<client::BinaryAngle> angles(65536);
  std::iota(angles.begin(), angles.end(), client::BinaryAngle{0});
  const auto sines = chip_.Sine(angles);
  ASSERT_EQ(sines.size(), angles.size());
  for (const client::BinaryAngle angle : angles) {
    ASSERT_EQ(sines[angle], std::pair(client::SinQ14(angle), client::CosQ14(angle))) << angle;
  }
}

TEST_F(ChipClientCore, PlacesOdometryOnTheSameSpotAsTheHost) {
  Dice dice(5);
  std::vector<PlaceInput> inputs;
  for (int i = 0; i < 4000; ++i) {
    constexpr int32_t kMax = client::kMaxCoordinateMm;
    inputs.push_back({{dice.Within(kMax), dice.Within(kMax), dice.Any<uint16_t>()},
                      {dice.Within(kMax + 100), dice.Within(kMax + 100), dice.Any<uint16_t>()}});
    if (dice.OneIn(8)) {
      inputs.back().odometry.x_mm = dice.Any<int32_t>();
    }
  }
  for (int i = 0; i < 100; ++i) {  // an odd sine or cosine makes half a millimetre: rounded up
    inputs.push_back({{0, 0, dice.Any<uint16_t>()}, {8192, 0, 0}});
    inputs.push_back({{0, 0, dice.Any<uint16_t>()}, {0, -8192, 0}});
  }
  const std::vector<client::Pose> poses = chip_.Place(inputs);
  ASSERT_EQ(poses.size(), inputs.size());
  for (size_t i = 0; i < inputs.size(); ++i) {
    const client::Pose expected = client::StartPose(inputs[i].start).Place(inputs[i].odometry);
    ASSERT_EQ(poses[i].x_mm, expected.x_mm) << i;
    ASSERT_EQ(poses[i].y_mm, expected.y_mm) << i;
    ASSERT_EQ(poses[i].heading, expected.heading) << i;
  }
}

TEST_F(ChipClientCore, ConvertsToTheSamePoseUnitsAsTheHost) {
  Dice dice(4);
  std::vector<UnitsInput> inputs;
  for (int i = 0; i < 4000; ++i) {
    const int32_t mm =
        dice.OneIn(4) ? dice.Any<int32_t>() : dice.Within(client::kMaxCoordinateMm + 100);
    inputs.push_back({mm, dice.Any<uint16_t>()});
  }
  const std::vector<UnitsOutput> outputs = chip_.ToPoseUnits(inputs);
  ASSERT_EQ(outputs.size(), inputs.size());
  for (size_t i = 0; i < inputs.size(); ++i) {
    int32_t units = 0;
    const bool done = client::ToPoseUnits(inputs[i].mm, inputs[i].unit_10um, &units);
    ASSERT_EQ(outputs[i].done, done) << inputs[i].mm << ' ' << inputs[i].unit_10um;
    ASSERT_EQ(outputs[i].units, done ? units : 0) << inputs[i].mm << ' ' << inputs[i].unit_10um;
  }
}

}  // namespace
}  // namespace pheromone::conformance
