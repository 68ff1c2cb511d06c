#include "client_fw/core/pioneer/pioneer_packet.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "client_fw/core/testing/naive_arcos.h"

namespace pheromone {
namespace client {
namespace {

Bytes Encoded(PioneerCommand command) {
  Bytes packet(kMaxPioneerCommand);
  packet.resize(EncodeCommand(command, packet.data()));
  return packet;
}

Bytes Encoded(PioneerCommand command, int argument) {
  Bytes packet(kMaxPioneerCommand);
  packet.resize(EncodeCommand(command, static_cast<int16_t>(argument), packet.data()));
  return packet;
}

Bytes Vel2(int16_t left_mm_s, int16_t right_mm_s) {
  return Encoded(PioneerCommand::kVel2, WheelWord(left_mm_s, right_mm_s));
}

// How many packets the receiver finds, `step_ms` between two bytes.
int Push(PioneerReceiver* receiver, const Bytes& bytes, uint16_t* now_ms, uint16_t step_ms = 0) {
  int packets = 0;
  for (const uint8_t byte : bytes) {
    *now_ms = static_cast<uint16_t>(*now_ms + step_ms);
    packets += receiver->Push(byte, *now_ms);
  }
  return packets;
}

int Push(PioneerReceiver* receiver, const Bytes& bytes) {
  uint16_t now_ms = 0;
  return Push(receiver, bytes, &now_ms);
}

Bytes Joined(const Bytes& a, const Bytes& b) {
  Bytes both = a;
  both.insert(both.end(), b.begin(), b.end());
  return both;
}

const char kSyncReply[] =
    "fa fb 1d 02 4d 6f 62 69 6c 65 53 69 6d 00 50 69 6f 6e 65 65 72 00 70 33 64 78 2d 73 68 00 06 "
    "da";

// Captured from ARIA and MobileSim; ENABLE 1 is printed in the Pioneer's manual too.
TEST(PioneerPacketTest, CommandsEqualTheGoldenVectors) {
  EXPECT_EQ(Hex("fa fb 03 00 00 00"), Encoded(PioneerCommand::kSync0));
  EXPECT_EQ(Hex("fa fb 03 00 00 00"), Encoded(PioneerCommand::kPulse));
  EXPECT_EQ(Hex("fa fb 03 01 00 01"), Encoded(PioneerCommand::kSync1));
  EXPECT_EQ(Hex("fa fb 03 01 00 01"), Encoded(PioneerCommand::kOpen));
  EXPECT_EQ(Hex("fa fb 03 02 00 02"), Encoded(PioneerCommand::kSync2));
  EXPECT_EQ(Hex("fa fb 03 02 00 02"), Encoded(PioneerCommand::kClose));
  EXPECT_EQ(Hex("fa fb 06 04 3b 01 00 05 3b"), Encoded(PioneerCommand::kEnable, 1));
  EXPECT_EQ(Hex("fa fb 06 20 3b 0a 0a 2a 45"), Vel2(200, 200));
  EXPECT_EQ(Hex("fa fb 06 20 3b 0c 0a 2c 45"), Vel2(200, 240));
  EXPECT_EQ(Hex("fa fb 06 20 3b fb 05 1b 40"), Vel2(100, -100));
  EXPECT_EQ(Hex("fa fb 06 20 1b fb 04 1b 1f"), Vel2(-100, 100));
  EXPECT_EQ(Hex("fa fb 06 20 1b 0a 09 2a 24"), Vel2(-200, -200));
  EXPECT_EQ(Hex("fa fb 06 0b 3b 96 00 a1 3b"), Encoded(PioneerCommand::kVel, 150));
  EXPECT_EQ(Hex("fa fb 06 15 3b 14 00 29 3b"), Encoded(PioneerCommand::kRvel, 20));
  EXPECT_EQ(Hex("fa fb 06 05 1b 2c 01 31 1c"), Encoded(PioneerCommand::kSetAcceleration, -300));
}

TEST(PioneerPacketTest, UnderstandsTheGoldenAnswerToSync2) {
  PioneerReceiver receiver = PioneerReceiver();
  EXPECT_EQ(1, Push(&receiver, Hex(kSyncReply)));
  EXPECT_EQ(2, receiver.id());
  EXPECT_FALSE(receiver.IsSip());
  EXPECT_TRUE(receiver.SubclassIsSh());
}

TEST(PioneerPacketTest, AByteLeftOverIsXoredIntoTheLowByteOfTheChecksum) {
  EXPECT_EQ(0x0101u, NaiveChecksum({1, 2, 3}));  // the description's own example
  PioneerReceiver receiver = PioneerReceiver();
  EXPECT_EQ(1, Push(&receiver, Hex("fa fb 05 01 02 03 01 01")));
  EXPECT_EQ(0, Push(&receiver, Hex("fa fb 05 01 02 03 04 02")));
}

TEST(PioneerPacketTest, EveryArgumentIsEncodedAsDescribed) {
  for (int argument = INT16_MIN; argument <= INT16_MAX; ++argument) {
    const auto size = static_cast<unsigned>(std::abs(argument));
    const Bytes body = {32, static_cast<uint8_t>(argument < 0 ? 0x1B : 0x3B),
                        static_cast<uint8_t>(size % 256), static_cast<uint8_t>(size / 256)};
    ASSERT_EQ(NaivePacket(body), Encoded(PioneerCommand::kVel2, argument)) << argument;
  }
}

TEST(PioneerPacketTest, EveryWheelSpeedGoesToTheNearestUnitAndIsClamped) {
  for (int mm_s = INT16_MIN; mm_s <= INT16_MAX; ++mm_s) {
    // round() takes halves away from zero.
    const int units = static_cast<int>(std::fmax(-127, std::fmin(127, std::round(mm_s / 20.0))));
    const auto speed = static_cast<int16_t>(mm_s);
    ASSERT_EQ(static_cast<int16_t>(units * 256 + 1), WheelWord(speed, 20)) << mm_s;
    ASSERT_EQ(static_cast<int16_t>(-2 * 256 + (units & 0xFF)), WheelWord(-40, speed)) << mm_s;
  }
}

TEST(PioneerReceiverTest, ReadsTheFieldsOfASip) {
  Sip sip;
  sip.x = 0x1234;
  sip.y = 0xFEDC;
  sip.th = 0x0ABC;
  sip.stall = 0x0103;
  sip.flags = 0x047F;
  PioneerReceiver receiver = PioneerReceiver();
  ASSERT_EQ(1, Push(&receiver, NaivePacket(sip.Body())));
  ASSERT_TRUE(receiver.IsSip());
  EXPECT_EQ(0x1234, receiver.X());
  EXPECT_EQ(0xFEDC, receiver.Y());
  EXPECT_EQ(0x0ABC, receiver.Heading());
  ASSERT_TRUE(receiver.HasStallAndFlags());
  EXPECT_EQ(0x0103, receiver.Stall());
  EXPECT_EQ(0x7F, receiver.Flags());
}

TEST(PioneerReceiverTest, AShortSipTellsOnlyWhatItCovers) {
  PioneerReceiver receiver = PioneerReceiver();
  for (size_t size = 1; size <= 38; ++size) {
    Sip sip;
    sip.size = size;
    ASSERT_EQ(1, Push(&receiver, NaivePacket(sip.Body()))) << size;
    EXPECT_EQ(size >= 7, receiver.IsSip()) << size;
    EXPECT_EQ(size >= 18, receiver.HasStallAndFlags()) << size;
  }
}

TEST(PioneerReceiverTest, SipsAreOfTypes30To34) {
  PioneerReceiver receiver = PioneerReceiver();
  for (int type = 0; type < 256; ++type) {
    Sip sip;
    sip.type = static_cast<uint8_t>(type);
    ASSERT_EQ(1, Push(&receiver, NaivePacket(sip.Body())));
    EXPECT_EQ(type >= 0x30 && type <= 0x34, receiver.IsSip()) << type;
  }
}

TEST(PioneerReceiverTest, KnowsTheSubclassesThatCountMillimetres) {
  PioneerReceiver receiver = PioneerReceiver();  // one for all: it forgets the name before
  const auto is_sh = [&receiver](const std::string& names) {
    Bytes body = {2};
    body.insert(body.end(), names.begin(), names.end());
    EXPECT_EQ(1, Push(&receiver, NaivePacket(body)));
    return receiver.SubclassIsSh();
  };
  using std::string_literals::operator""s;
  EXPECT_TRUE(is_sh("a\0Pioneer\0p3dx-sh\0"s));
  EXPECT_TRUE(is_sh("a\0Pioneer\0P3DX-SH\0"s));
  EXPECT_TRUE(is_sh("\0\0peoplebot-sh\0more"s));
  EXPECT_TRUE(is_sh("a\0Pioneer\0peoplebot-Sh"s));  // its NUL is missing
  EXPECT_FALSE(is_sh("a\0Pioneer\0"s));
  for (const char* fine : {"p3dx", "P3DX", "perfpb", "perfpb+", "shp", "h", "s", ""}) {
    EXPECT_FALSE(is_sh("a\0Pioneer\0"s + fine + "\0"s)) << fine;
  }
  EXPECT_FALSE(is_sh("crash\0Pioneer-sh\0p3dx\0p3dx-sh\0"s));  // only the third counts
  EXPECT_FALSE(is_sh("p3dx-sh"s));
  EXPECT_FALSE(is_sh(""s));
}

TEST(PioneerReceiverTest, EveryDamagedByteOfASipIsNoticed) {
  Sip sip;
  sip.x = 0x1234;
  sip.y = 0x00FA;
  sip.th = 0x0FFF;
  for (const size_t size : {size_t{38}, size_t{37}, size_t{7}}) {
    sip.size = size;
    const Bytes good = NaivePacket(sip.Body());
    for (size_t at = 0; at < good.size(); ++at) {
      for (int change = 1; change < 256; ++change) {
        Bytes bad = good;
        bad[at] = static_cast<uint8_t>(bad[at] ^ change);
        PioneerReceiver receiver = PioneerReceiver();
        uint16_t now_ms = 0;
        ASSERT_EQ(0, Push(&receiver, bad, &now_ms, 1)) << at << " " << change;
        now_ms = static_cast<uint16_t>(now_ms + 57);  // until the next SIP begins
        ASSERT_EQ(1, Push(&receiver, good, &now_ms, 1)) << at << " " << change;
      }
    }
  }
}

TEST(PioneerReceiverTest, CountsOf0To2AreSkippedAndOf255IsRead) {
  const Bytes good = NaivePacket(Sip().Body());
  for (const char* runt : {"fa fb 00", "fa fb 01 00", "fa fb 02 00 00", "fa fb 00 00 00"}) {
    PioneerReceiver receiver = PioneerReceiver();
    EXPECT_EQ(1, Push(&receiver, Joined(Hex(runt), good))) << runt;
    EXPECT_TRUE(receiver.IsSip());
  }
  PioneerReceiver receiver = PioneerReceiver();
  Bytes longest = Sip().Body();
  for (int i = 0; longest.size() < 253; ++i) {
    longest.push_back(static_cast<uint8_t>(i * 37));
  }
  ASSERT_EQ(258u, NaivePacket(longest).size());
  EXPECT_EQ(2, Push(&receiver, Joined(NaivePacket(longest), NaivePacket(longest))));
  EXPECT_TRUE(receiver.IsSip());
  EXPECT_TRUE(receiver.HasStallAndFlags());
}

TEST(PioneerReceiverTest, FindsThePacketAfterARepeatedFirstByte) {
  const Bytes good = NaivePacket(Sip().Body());
  for (const char* before : {"fa", "fa fa", "fa 00", "fb", "fa fb 02", "57 4d 53 32 0d"}) {
    PioneerReceiver receiver = PioneerReceiver();
    EXPECT_EQ(1, Push(&receiver, Joined(Hex(before), good))) << before;
  }
}

TEST(PioneerReceiverTest, APauseInsideEndsAPacketAndAShorterOneDoesNot) {
  const Bytes good = NaivePacket(Sip().Body());
  for (size_t cut = 1; cut < good.size(); ++cut) {
    const auto middle = good.begin() + static_cast<std::ptrdiff_t>(cut);
    const Bytes head(good.begin(), middle);
    const Bytes tail(middle, good.end());
    for (const bool too_long : {false, true}) {
      PioneerReceiver receiver = PioneerReceiver();
      uint16_t now_ms = 65530;  // the clock wraps in between
      ASSERT_EQ(0, Push(&receiver, head, &now_ms));
      now_ms = static_cast<uint16_t>(now_ms + kPacketGapMs + (too_long ? 1 : 0));
      ASSERT_EQ(too_long ? 0 : 1, Push(&receiver, tail, &now_ms)) << cut;
      ASSERT_EQ(1, Push(&receiver, good, &now_ms)) << cut;
    }
  }
}

// Streams full of beginnings, small counts and good packets.
TEST(PioneerReceiverTest, FindsWhatTheNaiveReaderFinds) {
  std::mt19937 random(4);
  const auto below = [&random](unsigned bound) { return static_cast<uint8_t>(random() % bound); };
  size_t found = 0;
  for (int round = 0; round < 300; ++round) {
    Bytes stream;
    for (int piece = 0; piece < 40; ++piece) {
      Bytes part;
      if (below(2) == 0) {
        Sip sip;
        sip.type = static_cast<uint8_t>(0x2F + below(7));
        sip.x = static_cast<uint16_t>(random());
        sip.stall = static_cast<uint16_t>(random());
        sip.size = 1u + below(38);
        part = NaivePacket(sip.Body());
      } else {
        const Bytes noise = {0xFA, 0xFB, below(8), below(255)};
        part.push_back(noise[below(4)]);
      }
      stream = Joined(stream, part);
    }
    const std::vector<Bytes> expected = NaiveBodies(stream);
    PioneerReceiver receiver = PioneerReceiver();
    size_t at = 0;
    for (const uint8_t byte : stream) {
      if (!receiver.Push(byte, 0)) {
        continue;
      }
      ASSERT_LT(at, expected.size());
      const Bytes& body = expected[at++];
      ASSERT_EQ(body[0], receiver.id());
      if (receiver.IsSip()) {
        ASSERT_EQ(body[1] + 256 * body[2], receiver.X());
      }
      if (receiver.IsSip() && receiver.HasStallAndFlags()) {
        ASSERT_EQ(body[12] + 256 * body[13], receiver.Stall());
      }
    }
    ASSERT_EQ(expected.size(), at);
    found += at;
  }
  EXPECT_GT(found, 1000u);
}

}  // namespace
}  // namespace client
}  // namespace pheromone
