// Events and configurations as bytes.

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <set>
#include <string>

#include "server/base/hex.h"
#include "server/core/engine/config_codec.h"
#include "server/core/engine/config_hash.h"
#include "server/core/engine/event_codec.h"
#include "server/core/engine/testing/random_traffic.h"

namespace pheromone::engine {
namespace {

std::string Encoded(const Event& event) {
  ByteWriter writer;
  EncodeEvent(event, &writer);
  return writer.Take();
}

std::string ErrorOf(const std::string& bytes) {
  ByteReader reader(bytes);
  DecodeEvent(&reader);
  reader.ExpectEnd();
  return reader.error();
}

// Written by hand from server/store/journal/README.md, so that a changed layout is noticed.
TEST(EventCodec, TheBytesAreThoseOfTheDescription) {
  EXPECT_EQ(HexText(Encoded(RequestReceived{0x0201, testing::Hello(7, 0x0403)})),
            "0401"
            "0102"
            "07"
            "71"
            "04"
            "03040100");
  EXPECT_EQ(HexText(Encoded(Advance{})), "0402");
  CommandIssued command{1, 9, protocol::CommandCode::kSpeed, {}};
  command.arguments[0] = 0xAB;
  EXPECT_EQ(HexText(Encoded(command)),
            "0404"
            "0100"
            "09"
            "03"
            "ab00000000");
  field::FieldEdit edit;
  edit.type = 2;
  edit.shape = field::FieldEdit::Shape::kStroke;
  edit.action = field::FieldEdit::Action::kAdd;
  edit.level = 64;
  edit.radius_um = 3;
  edit.points = {{-1, 2}};
  edit.continues = 4;
  EXPECT_EQ(HexText(Encoded(FieldEdited{edit})),
            "0405"
            "02"
            "01"
            "01"
            "40000000"
            "0300000000000000"
            "01000000"
            "ffffffffffffffff"
            "0200000000000000"
            "0400000000000000");
  EXPECT_EQ(HexText(Encoded(EditReversed{true})), "040b01");
  EXPECT_EQ(HexText(Encoded(KeysRevoked{{{7, {1, 2, 3, 4, 5, 6, 7, 8}}, {9, {}}}})),
            "040c"
            "02000000"
            "07"
            "0102030405060708"
            "09"
            "0000000000000000");
  EXPECT_EQ(HexText(Encoded(TagsChanged{TagsChanged::Write{
                1, 2, std::nullopt, true, 3, {4, 5, {6, 7}, {8, 9}, {-3, 11}}}})),
            "0409"
            "00"
            "0100"
            "0102"
            "00"
            "01"
            "03000000"
            "04000000"
            "05000000"
            "06000000"
            "07000000"
            "08000000"
            "09000000"
            "fdffffff"
            "0b000000");
  EXPECT_EQ(HexText(Encoded(TagsChanged{TagsChanged::Erase{1, 2, 3}})),
            "0409"
            "01"
            "0100"
            "02"
            "010300");
  EXPECT_EQ(
      HexText(Encoded(TagsChanged{TagsChanged::Define{{tags::RowKind::kString, 1, 2, "ab"}}})),
      "0409"
      "02"
      "02"
      "01000000"
      "02000000"
      "02000000"
      "6162");
  EXPECT_EQ(HexText(Encoded(TagsChanged{TagsChanged::Forget{{"ab", 7}}})),
            "0409"
            "03"
            "02000000"
            "6162"
            "07");
  EXPECT_EQ(HexText(Encoded(NetsChanged{"ab"})),
            "040a"
            "02000000"
            "6162");
  EXPECT_EQ(HexText(Encoded(PoseObserved{1, 2, {{3, 4}, 5}, 6})),
            "0406"
            "0100"
            "02"
            "0300000000000000"
            "0400000000000000"
            "0500"
            "06000000");
  EXPECT_EQ(HexText(Encoded(GoalSet{1, 2, {{{3, 4}}, 100'000}})),
            "0407"
            "0100"
            "02"
            "01000000"
            "0300000000000000"
            "0400000000000000"
            "a0860100");
  EXPECT_EQ(HexText(Encoded(GoalEnded{1, 2, true, {3, 4}})),
            "0408"
            "0100"
            "02"
            "01"
            "0300000000000000"
            "0400000000000000");
}

TEST(EventCodec, EveryEventComesBack) {
  std::set<EventKind> kinds;
  for (uint64_t seed = 0; seed < 6; ++seed) {
    testing::RandomTraffic traffic(seed);
    Engine engine;
    std::vector<Outgoing> out;
    Event event = traffic.First();
    for (uint64_t sequence = 1; sequence < 700; ++sequence) {
      const std::string bytes = Encoded(event);
      ByteReader reader(bytes);
      const Event same = DecodeEvent(&reader);
      reader.ExpectEnd();
      ASSERT_TRUE(reader.ok()) << reader.error();
      ASSERT_EQ(Encoded(same), bytes);
      kinds.insert(KindOf(event));
      // The decoded one is applied: its effect is the same too.
      engine.Apply(sequence, traffic.stamp(), same, &out);
      event = traffic.Next(engine);
    }
  }
  EXPECT_EQ(kinds.size(), std::variant_size_v<Event>);
}

TEST(EventCodec, AnUnknownVersionOrKindIsNamed) {
  EXPECT_EQ(ErrorOf("\xC8\x03").find("an event of version 200, but this program reads version 4"),
            0u);
  EXPECT_EQ(ErrorOf(std::string("\0\x03", 2))
                .find("an event of version 0, but this program reads version 4"),
            0u);
  EXPECT_EQ(ErrorOf("\x04\x0D"), "unknown event kind 13");
  EXPECT_EQ(ErrorOf(std::string("\x04\0", 2)), "unknown event kind 0");
  EXPECT_EQ(ErrorOf("\x04\x02\x03"), "trailing bytes");
  EXPECT_EQ(ErrorOf(""), "unexpected end of data");
}

TEST(EventCodec, HowLongAnEventCanBeIsKnownBeforeItIsWritten) {
  for (uint64_t seed = 0; seed < 4; ++seed) {
    testing::RandomTraffic traffic(seed);
    Engine engine;
    std::vector<Outgoing> out;
    Event event = traffic.First();
    for (uint64_t sequence = 1; sequence < 400; ++sequence) {
      const size_t bytes = Encoded(event).size();
      EXPECT_GE(EncodedBytesAtMost(event), bytes);
      const auto* changed = std::get_if<ConfigChanged>(&event);
      if (changed == nullptr || !changed->config->field.obstacles) {
        EXPECT_LE(EncodedBytesAtMost(event), bytes + bytes / 4 + 100);
      }
      engine.Apply(sequence, traffic.stamp(), event, &out);
      event = traffic.Next(engine);
    }
  }
}

TEST(EventCodec, CutBytesAreRefused) {
  testing::RandomTraffic traffic(3);
  Engine engine;
  std::vector<Outgoing> out;
  engine.Apply(1, traffic.stamp(), traffic.First(), &out);
  for (uint64_t sequence = 2; sequence < 200; ++sequence) {
    const Event event = traffic.Next(engine);
    const std::string bytes = Encoded(event);
    for (size_t length = 0; length < bytes.size(); length += 1 + bytes.size() / 64) {
      EXPECT_NE(ErrorOf(bytes.substr(0, length)), "");
    }
    engine.Apply(sequence, traffic.stamp(), event, &out);
  }
}

TEST(EventCodec, ChangedBytesAreRefusedOrMeanSomethingElse) {
  const EngineConfig config = testing::RichConfig(false);
  const std::string bytes = Encoded(ConfigChanged{config, 3, false});
  for (size_t at = 0; at < bytes.size(); ++at) {
    for (const int change : {0x01, 0x80, 0xFF}) {
      std::string other = bytes;
      other[at] = static_cast<char>(other[at] ^ change);
      ByteReader reader(other);
      const Event event = DecodeEvent(&reader);
      reader.ExpectEnd();
      if (reader.ok()) {
        ASSERT_EQ(Encoded(event), other) << "at " << at;
      }
    }
  }
}

TEST(ConfigCodec, AConfigurationComesBackWhole) {
  for (const EngineConfig& config :
       {testing::SmallConfig(), testing::RichConfig(false), testing::RichConfig(true)}) {
    ByteWriter writer;
    EncodeConfig(config, &writer);
    ByteReader reader(writer.bytes());
    const EngineConfig same = DecodeConfig(&reader);
    reader.ExpectEnd();
    ASSERT_TRUE(reader.ok()) << reader.error();
    EXPECT_EQ(same, config);
    EXPECT_EQ(HashConfig(same), HashConfig(config));
  }
}

// Meaningless values, but a sum of two of them would overflow.
TEST(ConfigCodec, ABlendWithNumbersThatNoLawHasIsRefused) {
  EngineConfig config = testing::RichConfig(false);
  field::PheromoneLaw& blend = config.field.pheromones.back();
  ASSERT_TRUE(blend.is_blend());
  blend.core_um = INT64_MAX;
  blend.sigma_um = INT64_MAX;
  ByteWriter writer;
  EncodeConfig(config, &writer);
  ByteReader reader(writer.bytes());
  DecodeConfig(&reader);
  EXPECT_EQ(reader.error(),
            "field.pheromones[5].core_um is 9223372036854775807, expected 0 to 50000000");
}

TEST(ConfigCodec, ObstaclesOfAnyShapeComeBack) {
  for (int32_t side : {1, 63, 64, 65, 200}) {
    EngineConfig config = testing::SmallConfig();
    config.field.map.width_um = side * int64_t{100'000};
    config.field.map.height_um = (side + 3) * int64_t{100'000};
    field::ObstacleMask mask(config.field.map.columns(), config.field.map.rows());
    std::mt19937_64 random(static_cast<uint64_t>(side));
    for (int i = 0; i < side * side / 2; ++i) {
      mask.Set({static_cast<int32_t>(random() % static_cast<uint64_t>(mask.columns())),
                static_cast<int32_t>(random() % static_cast<uint64_t>(mask.rows()))});
    }
    mask.BlockRow(0, 0, mask.columns() - 1);
    config.field.obstacles = field::Shared(std::move(mask));
    ByteWriter writer;
    EncodeConfig(config, &writer);
    ByteReader reader(writer.bytes());
    EXPECT_EQ(DecodeConfig(&reader), config);
    EXPECT_TRUE(reader.ok()) << reader.error();
  }
}

// server/store/journal/README.md has the layout for people who read the files without us.
std::string LayoutOfEverything() {
  std::string text = "1 RequestReceived\n" + DescribeFields<RequestReceived>("  ");
  text += "2 Advance\n" + DescribeFields<Advance>("  ");
  text += "3 ConfigChanged\n" + DescribeFields<ConfigChanged>("  ");
  text += "4 CommandIssued\n" + DescribeFields<CommandIssued>("  ");
  text += "5 FieldEdited\n" + DescribeFields<FieldEdited>("  ");
  text += "6 PoseObserved\n" + DescribeFields<PoseObserved>("  ");
  text += "7 GoalSet\n" + DescribeFields<GoalSet>("  ");
  text += "8 GoalEnded\n" + DescribeFields<GoalEnded>("  ");
  text += "9 TagsChanged\n" + DescribeFields<TagsChanged>("  ");
  text += "10 NetsChanged\n" + DescribeFields<NetsChanged>("  ");
  text += "11 EditReversed\n" + DescribeFields<EditReversed>("  ");
  text += "12 KeysRevoked\n" + DescribeFields<KeysRevoked>("  ");
  return text + "configuration\n" + DescribeFields<EngineConfig>("  ");
}

TEST(Documentation, HasEachFieldOfEventsAndConfiguration) {
  std::ifstream file(std::string(PHEROMONE_SOURCE_DIR) + "/server/store/journal/README.md");
  const std::string readme((std::istreambuf_iterator<char>(file)),
                           std::istreambuf_iterator<char>());
  EXPECT_NE(readme.find(LayoutOfEverything()), std::string::npos)
      << "the layout in server/store/journal/README.md should be:\n"
      << LayoutOfEverything();
}

}  // namespace
}  // namespace pheromone::engine
