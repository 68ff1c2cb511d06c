// The core gives the same bytes on an ATmega1284P as on the host, for the same events at the same
// times: frames to the server, commands to the Pioneer, settings to be stored, wheel speeds, flags.
#include "proto_tests/avr_core/avr_core.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <iostream>
#include <vector>

#include "proto_tests/avr_core/core_turn.h"
#include "proto_tests/avr_core/random_world.h"

namespace pheromone::core_boundary {
namespace {

using ByteVector = std::vector<uint8_t>;

ByteVector RunOnHost(CoreTurn* core, const ByteVector& request) {
  std::array<uint8_t, kMaxReply> reply{};
  const uint16_t size =
      core->Run(request.data(), static_cast<uint16_t>(request.size()), reply.data());
  return {reply.begin(), reply.begin() + size};
}

TEST(AvrCoreTest, RefusesWhatIsNoRequest) {
  AvrCore avr(PHEROMONE_AVR_CORE_IMAGE);
  CoreTurn host;
  const ByteVector refused{kRefused};
  for (const ByteVector& request :
       {ByteVector{}, ByteVector{'X', 1, 2, 3, 4, 5, 6, 7}, ByteVector{kTurn, 0, 0, 0, 0, 0, 1, 0},
        ByteVector{kTurn, 0, 0, 0, 0, 0, 0, 0, 0}, ByteVector(kMaxRequest + 1, kTurn)}) {
    EXPECT_EQ(avr.Run(request), refused);
    if (request.size() <= kMaxRequest) {
      EXPECT_EQ(RunOnHost(&host, request), refused);
    }
  }
}

TEST(AvrCoreTest, TenThousandExchangesOnALossyChannelGiveTheSameBytesAsOnTheHost) {
  AvrCore avr(PHEROMONE_AVR_CORE_IMAGE);
  uint64_t requests = 0;
  uint64_t answered = 0;
  uint64_t commands = 0;
  uint64_t turns = 0;
  uint64_t cycles = 0;
  uint64_t longest = 0;
  for (uint64_t seed = 1; answered < 10'000; ++seed) {
    ASSERT_LT(seed, 100u) << "the worlds have become silent";
    RandomWorld world(seed);
    CoreTurn host;
    // A run, a warm reset, a second run, and a third one after the power was lost.
    for (const bool keep : {false, true, false}) {
      const ByteVector start = world.Start(keep);
      ASSERT_EQ(RunOnHost(&host, start), ByteVector());
      ASSERT_EQ(avr.Run(start), ByteVector());
      for (int turn = 0; turn < 5'000; ++turn) {
        const ByteVector request = world.NextTurn();
        const ByteVector expected = RunOnHost(&host, request);
        ASSERT_EQ(avr.Run(request), expected) << "seed " << seed << ", turn " << turn;
        ASSERT_NE(expected, ByteVector{kRefused});
        world.Take(expected);
        cycles += avr.cycles();
        longest = std::max(longest, avr.cycles());
        ++turns;
      }
    }
    requests += world.requests();
    answered += world.answered();
    commands += world.commands();
  }
  EXPECT_GT(commands, 200u);
  std::cout << turns << " turns, " << requests << " requests, " << answered << " answers, "
            << commands << " commands; cycles a turn with its transport: mean " << cycles / turns
            << ", most " << longest << '\n';
}

}  // namespace
}  // namespace pheromone::core_boundary
