#include "client_fw/sim/pioneer/pioneer_packets.h"

#include <gtest/gtest.h>

#include <random>
#include <string>

#include "client_fw/sim/testing/pioneer_client.h"

namespace pheromone::sim {
namespace {

using testing::Bytes;
using testing::Command;
using testing::Framed;
using testing::Hex;
using testing::operator+;  // NOLINT(misc-unused-using-decls): it is used

// Captured from unmodified ARIA and MobileSim; ENABLE is printed in the manual too.
struct Golden {
  const char* hex = "";
  uint8_t id = 0;
  std::optional<int> argument;
};
const Golden kGolden[] = {
    {"fa fb 03 00 00 00", 0, {}},
    {"fa fb 03 01 00 01", 1, {}},
    {"fa fb 03 02 00 02", 2, {}},
    {"fa fb 06 04 3b 01 00 05 3b", 4, 1},
    {"fa fb 06 20 3b 0a 0a 2a 45", 32, 0x0A0A},
    {"fa fb 06 20 3b 0c 0a 2c 45", 32, 0x0A0C},
    {"fa fb 06 20 3b fb 05 1b 40", 32, 0x05FB},
    {"fa fb 06 20 1b fb 04 1b 1f", 32, -0x04FB},
    {"fa fb 06 20 1b 0a 09 2a 24", 32, -0x090A},
    {"fa fb 06 0b 3b 96 00 a1 3b", 11, 150},
    {"fa fb 06 15 3b 14 00 29 3b", 21, 20},
    {"fa fb 06 05 1b 2c 01 31 1c", 5, -300},
    {"fa fb 1d 02 4d 6f 62 69 6c 65 53 69 6d 00 50 69 6f 6e 65 65 72 00 70 33 64 78 2d 73 68 00 "
     "06 da",
     2,
     {}},
};

std::vector<Packet> ReadAll(PacketReader* reader) {
  std::vector<Packet> packets;
  while (std::optional<Packet> packet = reader->Next()) {
    packets.push_back(std::move(*packet));
  }
  return packets;
}

std::vector<Packet> Read(const Bytes& bytes) {
  PacketReader reader;
  reader.Push(bytes);
  return ReadAll(&reader);
}

TEST(PacketChecksumTest, AnOddLastByteIsXoredIntoTheLowByte) {
  EXPECT_EQ(PacketChecksum(Hex("01 02 03")), 0x0101);
  EXPECT_EQ(PacketChecksum(Hex("05")), 0x0005);
  EXPECT_EQ(PacketChecksum(Hex("ff ff 00 02")), 0x0001);  // modulo 65536
}

TEST(PacketReaderTest, TheGoldenVectorsAreReadAndMadeAgain) {
  for (const Golden& golden : kGolden) {
    SCOPED_TRACE(golden.hex);
    const Bytes bytes = Hex(golden.hex);
    const std::vector<Packet> packets = Read(bytes);
    ASSERT_EQ(packets.size(), 1u);
    EXPECT_EQ(packets[0].id, golden.id);
    EXPECT_EQ(PacketArgument(packets[0]), golden.argument);
    EXPECT_EQ(MakePacket(packets[0].id, packets[0].data), bytes);
  }
}

TEST(PacketReaderTest, ThePiecesOfAPacketMayBeOfAnySize) {
  const Bytes bytes = Hex(kGolden[3].hex) + Hex(kGolden[0].hex) + Hex(kGolden[4].hex);
  for (size_t size = 1; size <= bytes.size(); ++size) {
    PacketReader reader;
    std::vector<int> ids;
    for (size_t at = 0; at < bytes.size(); at += size) {
      reader.Push(std::span(bytes).subspan(at, std::min(size, bytes.size() - at)));
      for (const Packet& packet : ReadAll(&reader)) {
        ids.push_back(packet.id);
      }
    }
    EXPECT_EQ(ids, (std::vector<int>{4, 0, 32})) << size;
  }
}

TEST(PacketReaderTest, RubbishBetweenPacketsIsSkipped) {
  const Bytes modem = {'W', 'M', 'S', '2', '\r'};
  const std::vector<Packet> packets =
      Read(modem + Command(0) + Hex("fa 00 fb fa") + Command(11, 150) + Hex("fa fb"));
  ASSERT_EQ(packets.size(), 2u);
  EXPECT_EQ(packets[0].id, 0);
  EXPECT_EQ(packets[1].id, 11);
}

TEST(PacketReaderTest, AWrongChecksumDropsThePacketAlone) {
  Bytes bad = Command(11, 150);
  bad.back() ^= 1;
  PacketReader reader;
  reader.Push(bad + Command(29));
  const std::vector<Packet> packets = ReadAll(&reader);
  ASSERT_EQ(packets.size(), 1u);
  EXPECT_EQ(packets[0].id, 29);
  EXPECT_EQ(reader.bad_checksums(), 1u);
}

TEST(PacketReaderTest, ACutPacketDoesNotTakeTheNextOneWithIt) {
  const Bytes whole = Command(11, 150);
  for (size_t kept = 1; kept < whole.size(); ++kept) {
    const Bytes cut(whole.begin(), whole.begin() + static_cast<ptrdiff_t>(kept));
    const std::vector<Packet> packets = Read(cut + Command(29) + Command(29) + Command(29));
    ASSERT_EQ(packets.size(), 3u) << kept;
    EXPECT_EQ(packets[0].id, 29);
  }
}

TEST(PacketReaderTest, CountsFrom3To200ArePackets) {
  for (size_t count = 0; count <= 255; ++count) {
    Bytes frame = {0xFA, 0xFB, static_cast<uint8_t>(count)};
    if (count >= 3) {
      frame = Framed(Bytes(count - 2, 0x11));
    }
    const std::vector<Packet> packets = Read(frame + Command(29));
    const bool good = count >= 3 && count <= 200;
    ASSERT_EQ(packets.size(), good ? 2u : 1u) << count;
    EXPECT_EQ(packets.back().id, 29) << count;
  }
}

// Oracle: look at every place of the whole text, and jump over what is good.
std::vector<Bytes> ReadNaively(const Bytes& text) {
  std::vector<Bytes> found;
  for (size_t at = 0; at + 6 <= text.size();) {
    const size_t count = text[at + 2];
    size_t step = 1;
    if (text[at] == 0xFA && text[at + 1] == 0xFB && count >= 3 && count <= 200) {
      if (at + 3 + count > text.size()) {
        break;  // the reader waits here for the rest
      }
      const auto from = text.begin() + static_cast<ptrdiff_t>(at);
      const auto end = from + 3 + static_cast<ptrdiff_t>(count);
      const Bytes body(from + 3, end - 2);
      if (Framed(body) == Bytes(from, end)) {
        found.push_back(body);
        step = 3 + count;
      }
    }
    at += step;
  }
  return found;
}

TEST(PacketReaderTest, AnyBytesInAnyPiecesAreReadAsANaiveScanReadsThem) {
  std::mt19937 random(1);
  const auto below = [&](size_t n) { return random() % n; };
  size_t all = 0;
  for (int round = 0; round < 500; ++round) {
    Bytes text;
    for (int part = 0; part < 30; ++part) {
      Bytes piece = Command(static_cast<int>(below(60)), static_cast<int>(below(65536)) - 32768);
      if (below(3) == 0) {
        piece[below(piece.size())] = static_cast<uint8_t>(below(256));
      }
      if (below(4) == 0) {
        piece.resize(below(piece.size()));
      }
      if (below(4) == 0) {
        piece.insert(piece.begin(), {0xFA, 0xFB, static_cast<uint8_t>(below(20))});
      }
      text = text + piece;
    }
    const std::vector<Bytes> expected = ReadNaively(text);
    PacketReader reader;
    std::vector<Bytes> got;
    for (size_t at = 0; at < text.size();) {
      const size_t size = std::min(text.size() - at, 1 + below(25));
      reader.Push(std::span(text).subspan(at, size));
      at += size;
      for (const Packet& packet : ReadAll(&reader)) {
        got.push_back(Bytes{packet.id} + packet.data);
      }
    }
    ASSERT_EQ(got, expected) << round;
    all += got.size();
  }
  EXPECT_GT(all, 5000u);  // the test is about something
}

TEST(PacketArgumentTest, HalvesAndOtherTypesAreNone) {
  EXPECT_EQ(PacketArgument({11, {}}), std::nullopt);
  EXPECT_EQ(PacketArgument({7, {0x3B}}), 0);  // as P2OS drivers send SETO
  EXPECT_EQ(PacketArgument({11, {0x3B, 1}}), std::nullopt);
  EXPECT_EQ(PacketArgument({15, {0x2B, 1, 'x'}}), std::nullopt);
  EXPECT_EQ(PacketArgument({11, {0x00, 1, 0}}), std::nullopt);
  EXPECT_EQ(PacketArgument({11, {0x1B, 0xFF, 0xFF}}), -65535);
  EXPECT_EQ(PacketArgument({11, {0x3B, 2, 1, 99}}), 258);
}

}  // namespace
}  // namespace pheromone::sim
