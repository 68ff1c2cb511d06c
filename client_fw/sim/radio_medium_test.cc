#include "client_fw/sim/radio_medium.h"

#include <gtest/gtest.h>

#include <bit>
#include <cstdint>
#include <functional>
#include <vector>

namespace pheromone::sim {
namespace {

constexpr int64_t kMs = 1'000'000;

struct Heard {
  uint8_t byte;
  int64_t time_ns;
  bool operator==(const Heard&) const = default;
};

struct Recorder : Station {
  void OnByte(uint8_t byte, int64_t time_ns) override {
    heard.push_back({byte, time_ns});
    if (on_byte) {
      on_byte();
    }
  }
  void OnTransmitted(int64_t time_ns) override { transmitted.push_back(time_ns); }

  std::vector<uint8_t> Bytes() const {
    std::vector<uint8_t> bytes;
    for (const Heard& h : heard) {
      bytes.push_back(h.byte);
    }
    return bytes;
  }

  std::vector<Heard> heard;
  std::vector<int64_t> transmitted;
  std::function<void()> on_byte;
};

// A medium with three recording stations.
struct Channel {
  explicit Channel(const RadioConfig& config) : medium(config) {
    for (Recorder& station : stations) {
      medium.AddStation(&station);
    }
  }

  void Send(int station, std::vector<uint8_t> bytes) { medium.Transmit(station, bytes); }

  Recorder stations[3];
  RadioMedium medium;
};

RadioConfig Config(int64_t turnaround_ns = 2 * kMs) {
  RadioConfig config;
  config.turnaround_ns = turnaround_ns;
  return config;
}

TEST(RadioMediumTest, ByteTimesAreExactAt9600Baud) {
  Channel channel(Config());
  channel.Send(0, {1, 2, 3, 4});
  channel.medium.AdvanceTo(100 * kMs);
  // Multiples of 10/9600 s, rounded down to the ns, after 2 ms.
  const std::vector<Heard> expected = {{1, 2'000'000 + 1'041'666},
                                       {2, 2'000'000 + 2'083'333},
                                       {3, 2'000'000 + 3'125'000},
                                       {4, 2'000'000 + 4'166'666}};
  EXPECT_EQ(expected, channel.stations[1].heard);
  EXPECT_EQ(expected, channel.stations[2].heard);
  EXPECT_TRUE(channel.stations[0].heard.empty());
  EXPECT_EQ(std::vector<int64_t>{6'166'666}, channel.stations[0].transmitted);
}

TEST(RadioMediumTest, ByteTimesDoNotDrift) {
  Channel channel(Config(0));
  channel.Send(0, std::vector<uint8_t>(9600, 0x55));
  channel.medium.AdvanceTo(11'000 * kMs);
  EXPECT_EQ(10'000 * kMs, channel.stations[1].heard.back().time_ns);  // 96 000 bits: 10 s
}

TEST(RadioMediumTest, AdvanceStopsAtItsTime) {
  Channel channel(Config());
  channel.Send(0, {1, 2});
  EXPECT_EQ(2 * kMs, channel.medium.NextEventTime());
  channel.medium.AdvanceTo(3'041'665);
  EXPECT_TRUE(channel.stations[1].heard.empty());
  EXPECT_EQ(3'041'666, channel.medium.NextEventTime());
  channel.medium.AdvanceTo(3'041'666);
  EXPECT_EQ(1u, channel.stations[1].heard.size());
  channel.medium.AdvanceTo(10 * kMs);
  EXPECT_EQ(10 * kMs, channel.medium.now_ns());
  EXPECT_EQ(RadioMedium::kNever, channel.medium.NextEventTime());
}

TEST(RadioMediumTest, BlocksGivenWhileSendingFollowDirectly) {
  Channel channel(Config());
  channel.Send(0, {1});
  channel.medium.AdvanceTo(kMs);
  channel.Send(0, {2});
  channel.medium.AdvanceTo(10 * kMs);
  const std::vector<Heard> expected = {{1, 3'041'666}, {2, 3'041'666 + 1'041'666}};
  EXPECT_EQ(expected, channel.stations[1].heard);
  EXPECT_EQ(1u, channel.stations[0].transmitted.size());
  EXPECT_EQ(2u, channel.medium.counters().blocks);
}

TEST(RadioMediumTest, OneAfterTheOtherIsClean) {
  Channel channel(Config());
  channel.Send(0, {1, 2});
  channel.medium.AdvanceTo(2 * kMs + 2'083'333);
  channel.Send(1, {3, 4});
  channel.medium.AdvanceTo(20 * kMs);
  EXPECT_EQ((std::vector<uint8_t>{1, 2, 3, 4}), channel.stations[2].Bytes());
  EXPECT_EQ(0u, channel.medium.counters().collided_bytes);
}

TEST(RadioMediumTest, BackToBackAtTheSameInstantIsClean) {
  for (const int first : {0, 1}) {  // whichever of the two events is handled first
    Channel channel(Config());
    channel.Send(first, {1, 2});  // ends at 4 083 333
    channel.medium.AdvanceTo(2'083'333);
    channel.Send(1 - first, {3, 4});  // begins then
    channel.medium.AdvanceTo(20 * kMs);
    EXPECT_EQ((std::vector<uint8_t>{1, 2, 3, 4}), channel.stations[2].Bytes());
    EXPECT_EQ(0u, channel.medium.counters().collided_bytes);
  }
}

TEST(RadioMediumTest, OverlapMangles) {
  Channel channel(Config());
  channel.Send(0, {1, 2, 3, 4});  // bytes begin at 2.000, 3.042, 4.083, 5.125 ms, end at 6.167
  channel.medium.AdvanceTo(2'500'000);
  channel.Send(1, {5, 6, 7});  // bytes begin at 4.500, 5.542, 6.583 ms, end at 7.625
  channel.medium.AdvanceTo(20 * kMs);
  const std::vector<uint8_t> bytes = channel.stations[2].Bytes();
  ASSERT_EQ(7u, bytes.size());
  // In the order of their ends: 1 2 3 5 4 6 7; those from 4.5 to 6.167 ms met another.
  EXPECT_EQ(1, bytes[0]);
  EXPECT_EQ(2, bytes[1]);
  EXPECT_NE(3, bytes[2]);
  EXPECT_NE(5, bytes[3]);
  EXPECT_NE(4, bytes[4]);
  EXPECT_NE(6, bytes[5]);
  EXPECT_EQ(7, bytes[6]);
  EXPECT_EQ(4u, channel.medium.counters().collided_bytes);
  EXPECT_EQ(2u, channel.medium.counters().collided_blocks);
}

TEST(RadioMediumTest, SimultaneousStationsMangleEachOthersEveryByte) {
  Channel channel(Config());
  channel.Send(0, {1, 2, 3});
  channel.Send(1, {4, 5, 6});
  channel.medium.AdvanceTo(20 * kMs);
  EXPECT_EQ(6u, channel.medium.counters().collided_bytes);
  EXPECT_EQ(2u, channel.medium.counters().collided_blocks);
  EXPECT_EQ(6u, channel.stations[2].heard.size());
}

TEST(RadioMediumTest, ShorterOfTwoSimultaneousLeavesTheRestClean) {
  Channel channel(Config());
  channel.Send(0, {1});
  channel.Send(1, {4, 5, 6});
  channel.medium.AdvanceTo(20 * kMs);
  EXPECT_EQ(2u, channel.medium.counters().collided_bytes);
  const std::vector<uint8_t> bytes = channel.stations[2].Bytes();
  EXPECT_EQ(5, bytes[2]);
  EXPECT_EQ(6, bytes[3]);
}

TEST(RadioMediumTest, SendingStationHearsNothing) {
  Channel channel(Config());
  channel.Send(0, {1, 2, 3, 4});
  channel.medium.AdvanceTo(2'500'000);
  channel.Send(1, {5});  // keys its modem within byte 1, and has sent at 5 541 666
  channel.medium.AdvanceTo(20 * kMs);
  EXPECT_TRUE(channel.stations[1].heard.empty());  // byte 4 began while it was sending
  EXPECT_TRUE(channel.stations[0].heard.empty());
}

TEST(RadioMediumTest, HearsAgainTheFirstWholeByteAfterSending) {
  Channel channel(Config());
  channel.Send(0, {1, 2, 3, 4, 5});
  channel.medium.AdvanceTo(2'500'000);
  channel.Send(1, {9});
  channel.medium.AdvanceTo(20 * kMs);
  EXPECT_EQ((std::vector<Heard>{{5, 7'208'333}}), channel.stations[1].heard);
}

TEST(RadioMediumTest, CallbackMayAnswer) {
  Channel channel(Config());
  channel.stations[1].on_byte = [&] { channel.Send(1, {9}); };
  channel.Send(0, {1});
  channel.medium.AdvanceTo(20 * kMs);
  EXPECT_EQ((std::vector<Heard>{{9, 3'041'666 + 2'000'000 + 1'041'666}}),
            channel.stations[0].heard);
}

TEST(RadioMediumTest, CarrierIsOfTheAirAndOfOneselfFromTheKeyOn) {
  Channel channel(Config());
  EXPECT_FALSE(channel.medium.Busy(0));
  channel.Send(0, {1});
  EXPECT_TRUE(channel.medium.Busy(0));
  EXPECT_FALSE(channel.medium.Busy(1));  // nothing on the air yet: the vulnerable time
  channel.medium.AdvanceTo(2 * kMs);
  EXPECT_TRUE(channel.medium.Busy(1));
  channel.medium.AdvanceTo(3'041'665);
  EXPECT_TRUE(channel.medium.Busy(1));
  channel.medium.AdvanceTo(3'041'666);
  EXPECT_FALSE(channel.medium.Busy(1));
  EXPECT_FALSE(channel.medium.Busy(0));
}

TEST(RadioMediumTest, ModemWithoutCarrierDetectKnowsOnlyItself) {
  RadioConfig config = Config();
  config.carrier_detect = false;
  Channel channel(config);
  channel.Send(0, {1, 2});
  channel.medium.AdvanceTo(3 * kMs);
  EXPECT_TRUE(channel.medium.Busy(0));
  EXPECT_FALSE(channel.medium.Busy(1));
}

TEST(RadioMediumTest, UtilisationIsTheShareOfTimeOnTheAir) {
  Channel channel(Config(0));
  channel.Send(0, std::vector<uint8_t>(96, 1));  // 100 ms
  channel.medium.AdvanceTo(50 * kMs);
  EXPECT_DOUBLE_EQ(1, channel.medium.Utilisation());
  channel.medium.AdvanceTo(200 * kMs);
  EXPECT_DOUBLE_EQ(0.5, channel.medium.Utilisation());
  channel.Send(0, std::vector<uint8_t>(96, 1));  // 200 to 300 ms
  channel.medium.AdvanceTo(250 * kMs);
  channel.Send(1, std::vector<uint8_t>(96, 1));  // 250 to 350 ms
  channel.medium.AdvanceTo(500 * kMs);
  EXPECT_DOUBLE_EQ(0.5, channel.medium.Utilisation());  // 100 + 150 of 500
  EXPECT_EQ(300 * kMs, channel.medium.counters().airtime_ns);
}

std::vector<Heard> Noisy(uint64_t seed) {
  RadioConfig config;
  config.seed = seed;
  config.byte_error = 0.1;
  config.block_loss = 0.3;
  Channel channel(config);
  for (int i = 0; i < 100; ++i) {
    channel.Send(i % 2, std::vector<uint8_t>(10, 7));
    if (i % 5 == 0) {
      channel.Send(2, {1, 2, 3});
    }
    channel.medium.AdvanceTo(channel.medium.now_ns() + 20 * kMs);
  }
  return channel.stations[0].heard;
}

TEST(RadioMediumTest, SameSeedSameBits) {
  EXPECT_EQ(Noisy(1), Noisy(1));
  EXPECT_NE(Noisy(1), Noisy(2));
}

TEST(RadioMediumTest, DamageIsAsFrequentAsAsked) {
  RadioConfig config;
  config.byte_error = 0.05;
  config.block_loss = 0.2;
  Channel channel(config);
  for (int i = 0; i < 2000; ++i) {
    channel.Send(0, {7, 7, 7, 7, 7});
    channel.medium.AdvanceTo(channel.medium.now_ns() + 20 * kMs);
  }
  // Two listeners: 4000 chances of losing a block, 20 000 of a damaged byte in those that come.
  EXPECT_NEAR(800, static_cast<double>(channel.medium.counters().lost_blocks), 130);
  EXPECT_NEAR(800, static_cast<double>(channel.medium.counters().damaged_bytes), 150);
  const size_t heard = channel.stations[1].heard.size() + channel.stations[2].heard.size();
  EXPECT_EQ(5 * (4000 - channel.medium.counters().lost_blocks), heard);
}

// Stations 0 and 1 do not hear each other; 2 hears both.
struct HiddenPair : Channel {
  HiddenPair() : Channel(Config()) { medium.Hide(0, 1); }
};

TEST(RadioMediumTest, HiddenStationsHearNeitherBytesNorCarrierOfEachOther) {
  HiddenPair channel;
  channel.Send(0, {1, 2});
  channel.medium.AdvanceTo(3 * kMs);
  EXPECT_FALSE(channel.medium.Busy(1));
  EXPECT_TRUE(channel.medium.Busy(2));
  channel.medium.AdvanceTo(20 * kMs);
  EXPECT_TRUE(channel.stations[1].heard.empty());
  EXPECT_EQ((std::vector<uint8_t>{1, 2}), channel.stations[2].Bytes());
  channel.Send(1, {3});
  channel.medium.AdvanceTo(40 * kMs);
  EXPECT_TRUE(channel.stations[0].heard.empty());
}

TEST(RadioMediumTest, HiddenStationsCollideAtTheOneThatHearsBoth) {
  HiddenPair channel;
  channel.Send(0, {1, 2, 3});
  channel.medium.AdvanceTo(3 * kMs);
  channel.Send(1, {4, 5, 6});  // on the air at 5 ms: during byte 3, which ends at 5 125 000
  channel.medium.AdvanceTo(20 * kMs);
  const std::vector<uint8_t> bytes = channel.stations[2].Bytes();
  ASSERT_EQ(6u, bytes.size());
  EXPECT_EQ(1, bytes[0]);
  EXPECT_EQ(2, bytes[1]);
  EXPECT_NE(3, bytes[2]);
  EXPECT_NE(4, bytes[3]);
  EXPECT_EQ(5, bytes[4]);
  EXPECT_EQ(6, bytes[5]);
}

// 0 and 2 send at the same time. 1 hears only 2, so that nothing disturbs it there.
TEST(RadioMediumTest, CollisionIsOnlyWhereBothAreHeard) {
  Recorder fourth;
  HiddenPair channel;
  channel.medium.AddStation(&fourth);
  channel.Send(0, {1, 2});
  channel.Send(2, {3, 4});
  channel.medium.AdvanceTo(20 * kMs);
  EXPECT_EQ((std::vector<uint8_t>{3, 4}), channel.stations[1].Bytes());
  const std::vector<uint8_t> mixed = fourth.Bytes();
  ASSERT_EQ(4u, mixed.size());
  EXPECT_NE(1, mixed[0]);
  EXPECT_NE(3, mixed[1]);
}

TEST(RadioMediumTest, BytesAndCarrierArriveAfterThePropagationDelay) {
  RadioConfig config = Config();
  config.propagation_ns = 500'000;
  Channel channel(config);
  channel.Send(0, {1, 2});
  channel.medium.AdvanceTo(2'499'999);
  EXPECT_FALSE(channel.medium.Busy(1));
  channel.medium.AdvanceTo(2'500'000);
  EXPECT_TRUE(channel.medium.Busy(1));
  channel.medium.AdvanceTo(20 * kMs);
  EXPECT_EQ((std::vector<Heard>{{1, 3'541'666}, {2, 4'583'333}}), channel.stations[1].heard);
  EXPECT_EQ(std::vector<int64_t>{4'083'333}, channel.stations[0].transmitted);
}

TEST(RadioMediumTest, DeafnessCountsAtTheListenersEndOfTheWay) {
  RadioConfig config = Config(0);
  config.propagation_ns = 3 * kMs;
  Channel channel(config);
  channel.Send(0, {1});  // at the listener from 3 000 000 to 4 041 666
  channel.medium.AdvanceTo(2 * kMs);
  channel.Send(1, {9});  // deaf from 2 000 000 to 3 041 666
  channel.medium.AdvanceTo(20 * kMs);
  EXPECT_TRUE(channel.stations[1].heard.empty());
  EXPECT_EQ(2u, channel.stations[2].heard.size());  // who was silent hears both
}

TEST(RadioMediumTest, CarrierShowsAndVanishesAfterTheDetectionDelay) {
  RadioConfig config = Config();
  config.carrier_delay_ns = 1'500'000;
  Channel channel(config);
  channel.Send(0, {1});  // on the air from 2 000 000 to 3 041 666
  channel.medium.AdvanceTo(3'499'999);
  EXPECT_FALSE(channel.medium.Busy(1));
  channel.medium.AdvanceTo(3'500'000);
  EXPECT_TRUE(channel.medium.Busy(1));
  EXPECT_EQ(1u, channel.stations[1].heard.size());  // bytes do not wait for it
  channel.medium.AdvanceTo(4'541'665);
  EXPECT_TRUE(channel.medium.Busy(1));
  channel.medium.AdvanceTo(4'541'666);
  EXPECT_FALSE(channel.medium.Busy(1));
  EXPECT_FALSE(channel.medium.Busy(0));  // one's own key needs no detecting
}

TEST(RadioMediumTest, EachStationHasItsOwnTurnaround) {
  Recorder slow;
  Channel channel(Config());
  const int number = channel.medium.AddStation(&slow, 20 * kMs);
  EXPECT_EQ(20 * kMs, channel.medium.turnaround_ns(number));
  EXPECT_EQ(2 * kMs, channel.medium.turnaround_ns(0));
  channel.Send(number, {1});
  channel.medium.AdvanceTo(40 * kMs);
  EXPECT_EQ((std::vector<Heard>{{1, 21'041'666}}), channel.stations[0].heard);
}

TEST(RadioMediumTest, BitErrorsFlipSingleBitsAsOftenAsAsked) {
  RadioConfig config;
  config.bit_error = 0.01;
  Channel channel(config);
  for (int i = 0; i < 1000; ++i) {
    channel.Send(0, {0x55, 0x55, 0x55, 0x55, 0x55});
    channel.medium.AdvanceTo(channel.medium.now_ns() + 20 * kMs);
  }
  int flipped = 0;
  int damaged = 0;
  for (const Recorder* station : {&channel.stations[1], &channel.stations[2]}) {
    for (const uint8_t byte : station->Bytes()) {
      flipped += std::popcount(static_cast<unsigned>(byte ^ 0x55));
      damaged += byte != 0x55 ? 1 : 0;
    }
  }
  EXPECT_NEAR(800, flipped, 130);  // of 80 000 bits; 4.6 standard deviations
  EXPECT_EQ(static_cast<uint64_t>(damaged), channel.medium.counters().damaged_bytes);
}

}  // namespace
}  // namespace pheromone::sim
