#include "server/core/engine/tags_part.h"

#include <gtest/gtest.h>

#include <cstring>
#include <string>

#include "server/core/engine/event_codec.h"
#include "server/core/engine/frozen_state.h"
#include "server/core/engine/testing/bench.h"

namespace pheromone::engine {
namespace {

using protocol::Message;
using protocol::Reason;
using testing::MessageOf;
using testing::ReasonOf;
using testing::Saved;

// Tag 1 at (1 m, 1 m) with a range of 0.5 m, tag 2 beside it, tag 3 far away.
tags::Settings ThreeTags() {
  return {.tags = {{"door", 1'000'000, 1'000'000, 500'000, 8},
                   {"plant", 1'200'000, 1'000'000, 500'000, 2},
                   {"far", 9'000'000, 9'000'000, 500'000, 8}},
          .privileged = {"operator"}};
}

EngineConfig ConfigWith(const tags::Settings& settings) {
  EngineConfig config = testing::SmallConfig();
  config.tags = settings;
  return config;
}

class TagsPartTest : public ::testing::Test {
 protected:
  TagsPartTest() {
    Register(15, "123-233-201");
    Register(12, "00:11:22:33:44:55");
  }

  void Register(uint8_t id, const std::string& unique_id) {
    bench_.Handle(testing::Hello(id, 1));
    bench_.Handle(Symbol(id, protocol::SymbolKind::kRobot, id, unique_id));
  }

  uint8_t NextSeq(uint8_t id) { return ++seqs_[id]; }

  Message Symbol(uint8_t id, protocol::SymbolKind kind, int32_t number, const std::string& text) {
    protocol::SymbolRequest request{
        id, NextSeq(id), kind, number, static_cast<uint8_t>(text.size()), {}};
    std::memcpy(request.text, text.data(), text.size());
    return MessageOf(request);
  }

  // Subject (1, 2), predicate (3, 4), int 244, as robots write it: at the tags.
  protocol::TagWriteRequest WriteRequest(uint8_t id, uint16_t tag) {
    protocol::TagWriteRequest request;
    request.id = id;
    request.seq = NextSeq(id);
    request.x = 1'100;
    request.y = 1'000;
    request.tag = tag;
    request.slot = protocol::kNoSlot;
    request.time = 1'138'458'000;
    const int32_t words[] = {1, 2, 3, 4, -3, 244};
    std::memcpy(request.words, words, sizeof words);
    return request;
  }

  template <typename T>
  T Answered(const Message& request) {
    const std::optional<Message> answer = bench_.Handle(request);
    T decoded;
    EXPECT_TRUE(answer && protocol::Decode(*answer, &decoded))
        << "reason " << (answer ? static_cast<int>(ReasonOf(*answer)) : -1);
    return decoded;
  }

  protocol::TagReadAnswer Read(uint8_t id, uint16_t tag, uint8_t slot) {
    return Answered<protocol::TagReadAnswer>(
        MessageOf(protocol::TagReadRequest{id, 1'100, 1'000, tag, slot}));
  }

  const tags::Store& store() const { return bench_.engine.tags(); }

  testing::Bench bench_{ConfigWith(ThreeTags())};
  std::map<uint8_t, uint8_t> seqs_;
};

TEST_F(TagsPartTest, AScanListsTheTagsInRange) {
  const auto answer =
      Answered<protocol::ScanAnswer>(MessageOf(protocol::ScanRequest{15, 1'100, 900, 0}));
  ASSERT_EQ(answer.count, 2);
  EXPECT_EQ(answer.more, 0);
  EXPECT_EQ(answer.rows[0].tag, 1);
  EXPECT_EQ(answer.rows[0].dx, -100);
  EXPECT_EQ(answer.rows[0].dy, 100);
  EXPECT_EQ(answer.rows[1].tag, 2);
  EXPECT_EQ(answer.rows[1].dx, 100);
  const auto rest =
      Answered<protocol::ScanAnswer>(MessageOf(protocol::ScanRequest{15, 1'100, 900, 1}));
  ASSERT_EQ(rest.count, 1);
  EXPECT_EQ(rest.rows[0].tag, 2);
}

TEST_F(TagsPartTest, ADistanceIsInTheRobotsOwnFrame) {
  EngineConfig config = ConfigWith(ThreeTags());
  // Its x axis points along the map's y axis.
  config.frames = {MakeFrame("radio-a", 15, {1'000'000, 500'000}, 90.0)};
  bench_.Apply(ConfigChanged{config, 7});
  // On the map: (1 m, 0.6 m); the tag is 0.4 m further along the map's y, the robot's x.
  const auto answer =
      Answered<protocol::ScanAnswer>(MessageOf(protocol::ScanRequest{15, 100, 0, 0}));
  ASSERT_EQ(answer.count, 2);
  EXPECT_EQ(answer.rows[0].dx, 400);
  EXPECT_EQ(answer.rows[0].dy, 0);
  EXPECT_EQ(answer.rows[1].dx, 400);
  EXPECT_EQ(answer.rows[1].dy, -200);
}

TEST_F(TagsPartTest, AScanTellsHowManyMoreThereAre) {
  tags::Settings settings;
  for (int i = 0; i < 10; ++i) {
    settings.tags.push_back({"t" + std::to_string(i), 1'000'000, 1'000'000, 500'000, 8});
  }
  bench_.Apply(ConfigChanged{ConfigWith(settings), 7});
  const auto answer =
      Answered<protocol::ScanAnswer>(MessageOf(protocol::ScanRequest{15, 1'000, 1'000, 0}));
  EXPECT_EQ(answer.count, 7);
  EXPECT_EQ(answer.more, 3);
}

TEST_F(TagsPartTest, WhatOneRobotWritesAnotherReads) {
  const auto written = Answered<protocol::TagWritten>(MessageOf(WriteRequest(15, 1)));
  EXPECT_EQ(written.slot, 0);
  EXPECT_EQ(written.slot_generation, 1);
  EXPECT_EQ(written.tag_generation, 1);
  const protocol::TagReadAnswer read = Read(12, 1, 0);
  EXPECT_EQ(read.slot, 0);
  EXPECT_EQ(read.next, protocol::kNoSlot);
  EXPECT_EQ(read.slots, 8);
  EXPECT_EQ(read.tag_generation, 1);
  EXPECT_EQ(read.slot_generation, 1);
  EXPECT_EQ(read.lease_s, 0);
  EXPECT_EQ(read.flags, 0);
  const int32_t words[] = {15, 1'138'458'000, 1, 2, 3, 4, -3, 244};
  EXPECT_EQ(std::memcmp(read.words, words, sizeof words), 0);
}

TEST_F(TagsPartTest, ReadingSkipsEmptySlots) {
  protocol::TagWriteRequest request = WriteRequest(15, 1);
  request.slot = 5;
  bench_.Handle(MessageOf(request));
  request.seq = NextSeq(15);
  request.slot = 2;
  bench_.Handle(MessageOf(request));
  EXPECT_EQ(Read(12, 1, 0).slot, 2);
  EXPECT_EQ(Read(12, 1, 0).next, 5);
  EXPECT_EQ(Read(12, 1, 3).slot, 5);
  EXPECT_EQ(Read(12, 1, 6).slot, protocol::kNoSlot);
  EXPECT_EQ(Read(12, 1, 255).slot, protocol::kNoSlot);
}

TEST_F(TagsPartTest, OutOfRangeIsRefused) {
  protocol::TagWriteRequest request = WriteRequest(15, 3);
  EXPECT_EQ(bench_.HandleForReason(MessageOf(request)), Reason::kNoTagInRange);
  request = WriteRequest(15, 1);
  request.x = 1'501;
  EXPECT_EQ(bench_.HandleForReason(MessageOf(request)), Reason::kNoTagInRange);
  EXPECT_EQ(bench_.HandleForReason(MessageOf(protocol::TagReadRequest{15, 1'100, 1'000, 4, 0})),
            Reason::kNoTagInRange);
  EXPECT_EQ(bench_.HandleForReason(
                MessageOf(protocol::TagEraseRequest{15, NextSeq(15), 9'000, 0, 1, 0, 0, 0})),
            Reason::kNoTagInRange);
}

TEST_F(TagsPartTest, WritesAreDoneOnce) {
  const Message request = MessageOf(WriteRequest(15, 1));
  const auto first = Answered<protocol::TagWritten>(request);
  const auto again = Answered<protocol::TagWritten>(request);
  EXPECT_EQ(again.tag_generation, first.tag_generation);
  EXPECT_EQ(store().Find(1)->tag.used(), 1u);
}

TEST_F(TagsPartTest, OfTwoClaimsTheSecondIsRefused) {
  const uint16_t seen = Read(12, 1, 0).tag_generation;
  for (const uint8_t id : {uint8_t{15}, uint8_t{12}}) {
    protocol::TagWriteRequest claim = WriteRequest(id, 1);
    claim.flags = protocol::kTagExpect;
    claim.expected = seen;
    claim.lease_s = 60;
    EXPECT_EQ(bench_.HandleForReason(MessageOf(claim)),
              id == 15 ? Reason::kNone : Reason::kGenerationChanged);
  }
  EXPECT_EQ(Read(12, 1, 0).words[0], 15);
  EXPECT_EQ(Read(12, 1, 0).lease_s, 60);
}

TEST_F(TagsPartTest, ALeaseEndsByAnEvent) {
  protocol::TagWriteRequest claim = WriteRequest(15, 1);
  claim.lease_s = 60;
  bench_.Handle(MessageOf(claim));
  EXPECT_EQ(bench_.engine.NextDeadline(), bench_.now_ms + 60'000);
  bench_.now_ms += 59'001;
  EXPECT_EQ(Read(12, 1, 0).lease_s, 1);
  bench_.now_ms += 999;
  EXPECT_EQ(Read(12, 1, 0).lease_s, 1) << "it is there until the event";
  bench_.Apply(Advance{});
  EXPECT_EQ(Read(12, 1, 0).slot, protocol::kNoSlot);
  EXPECT_EQ(store().counters().expired, 1u);
}

TEST_F(TagsPartTest, AWriterWithoutAClockGetsTheServers) {
  protocol::TagWriteRequest request = WriteRequest(15, 1);
  request.time = 0;
  std::vector<Outgoing> out;
  bench_.engine.Apply(++bench_.sequence, {bench_.now_ms, 1'700'000'000'999},
                      RequestReceived{0, MessageOf(request)}, &out);
  EXPECT_EQ(Read(15, 1, 0).words[1], 1'700'000'000);
}

TEST_F(TagsPartTest, RefusalsSayWhy) {
  const auto reason_of = [&](auto&& change) {
    protocol::TagWriteRequest request = WriteRequest(15, 1);
    change(request);
    return bench_.HandleForReason(MessageOf(request));
  };
  EXPECT_EQ(reason_of([](auto& it) { it.flags = 4; }), Reason::kBadValue);
  EXPECT_EQ(reason_of([](auto& it) { it.lease_s = 3601; }), Reason::kBadValue);
  EXPECT_EQ(reason_of([](auto& it) { it.slot = 8; }), Reason::kBadValue);
  EXPECT_EQ(reason_of([](auto& it) { it.words[2] = -3; }), Reason::kBadValue);
  bench_.Handle(testing::Hello(9, 1));
  EXPECT_EQ(bench_.HandleForReason(MessageOf(WriteRequest(9, 1))), Reason::kUnknownSymbol);
  EXPECT_EQ(bench_.HandleForReason(MessageOf(WriteRequest(8, 1))), Reason::kSayHello);
  EXPECT_EQ(store().Find(1)->tag.used(), 0u);
}

TEST_F(TagsPartTest, AnothersProtectedBlockIsNotErased) {
  protocol::TagWriteRequest claim = WriteRequest(15, 1);
  claim.lease_s = 60;
  bench_.Handle(MessageOf(claim));
  const auto erase = [&](uint8_t id, uint8_t flags, uint16_t expected) {
    return bench_.HandleForReason(
        MessageOf(protocol::TagEraseRequest{id, NextSeq(id), 1'000, 1'000, 1, 0, flags, expected}));
  };
  EXPECT_EQ(erase(12, 0, 0), Reason::kTagProtected);
  EXPECT_EQ(erase(15, protocol::kTagExpect, 9), Reason::kGenerationChanged);
  EXPECT_EQ(erase(15, protocol::kTagReplace, 1), Reason::kBadValue);
  EXPECT_EQ(erase(15, protocol::kTagExpect, 1), Reason::kNone);
  EXPECT_EQ(store().Find(1)->tag.used(), 0u);
}

TEST_F(TagsPartTest, SymbolsAreDefinedAndResolved) {
  const std::string iri = "http://example.org/ns#";
  const auto defined =
      Answered<protocol::SymbolAnswer>(Symbol(15, protocol::SymbolKind::kString, 3, iri));
  EXPECT_EQ(defined.number, 3);
  const auto resolved = Answered<protocol::ResolveAnswer>(
      MessageOf(protocol::ResolveRequest{12, protocol::SymbolKind::kString, 15, 3, 0}));
  EXPECT_EQ(std::string(reinterpret_cast<const char*>(resolved.text), resolved.count), iri);
  EXPECT_EQ(resolved.rows, 3u);
  const auto row = Answered<protocol::ResolveAnswer>(
      MessageOf(protocol::ResolveRequest{12, protocol::SymbolKind::kRow, 0, 2, 7}));
  EXPECT_EQ(row.kind, protocol::SymbolKind::kString);
  EXPECT_EQ(row.robot, 15);
  EXPECT_EQ(row.number, 3);
  EXPECT_EQ(row.length, iri.size());
  EXPECT_EQ(std::string(reinterpret_cast<const char*>(row.text), row.count), iri.substr(7));
  EXPECT_EQ(bench_.HandleForReason(Symbol(15, protocol::SymbolKind::kString, 3, "other")),
            Reason::kNotPermitted);
  EXPECT_EQ(bench_.HandleForReason(
                MessageOf(protocol::ResolveRequest{12, protocol::SymbolKind::kRow, 0, 3, 0})),
            Reason::kUnknownSymbol);
  EXPECT_EQ(bench_.HandleForReason(
                MessageOf(protocol::ResolveRequest{12, protocol::SymbolKind::kString, 12, 3, 0})),
            Reason::kUnknownSymbol);
}

TEST_F(TagsPartTest, ARobotMayAskForANumber) {
  bench_.Handle(testing::Hello(7, 1));
  EXPECT_EQ(Answered<protocol::SymbolAnswer>(Symbol(7, protocol::SymbolKind::kRobot, 0, "new one"))
                .number,
            1);
  EXPECT_EQ(bench_.HandleForReason(Symbol(7, protocol::SymbolKind::kRobot, 15, "new one")),
            Reason::kNotPermitted);
}

TEST_F(TagsPartTest, AnOperatorWritesAndErases) {
  const auto make = [&](const TagsChanged& change) {
    ASSERT_TRUE(bench_.engine.Check(change).ok());
    bench_.Apply(change);
  };
  make({TagsChanged::Define{{tags::RowKind::kRobot, 1, 1, "operator"}}});
  make({TagsChanged::Write{.tag = 1, .block = {1, 5, {1, 2}, {3, 4}, {-3, 2}}}});
  EXPECT_EQ(Read(12, 1, 0).flags, protocol::kTagPrivileged);
  EXPECT_EQ(bench_.HandleForReason(
                MessageOf(protocol::TagEraseRequest{12, NextSeq(12), 1'000, 1'000, 1, 0, 0, 0})),
            Reason::kTagProtected);
  make({TagsChanged::Erase{.tag = 1, .slot = 0}});
  EXPECT_EQ(store().Find(1)->tag.used(), 0u);
}

TEST_F(TagsPartTest, AnOperatorIsToldWhatIsWrong) {
  const auto error_of = [&](const auto& change) {
    const Status status = bench_.engine.Check(TagsChanged{change});
    return status.ErrorOr("");
  };
  using Write = TagsChanged::Write;
  const tags::Block block = {15, 5, {1, 2}, {3, 4}, {-3, 2}};
  EXPECT_EQ(error_of(Write{.tag = 9, .block = block}), "there is no tag 9");
  EXPECT_EQ(error_of(Write{.tag = 1, .slot = 8, .block = block}),
            "tag \"door\": it has no such slot");
  EXPECT_EQ(error_of(Write{.tag = 1, .expected = 7, .block = block}),
            "tag \"door\": its generation has changed");
  EXPECT_EQ(error_of(Write{.tag = 1, .block = {99, 5, {1, 2}, {3, 4}, {-3, 2}}}),
            "tag \"door\": the author, 99, is unknown");
  EXPECT_EQ(error_of(Write{.tag = 1, .block = {15, 5, {-3, 2}, {3, 4}, {-3, 2}}}),
            "tag \"door\": the subject is (-3, 2), expected a symbol, a robot or a tag");
  EXPECT_EQ(error_of(TagsChanged::Erase{.tag = 2, .slot = 2}),
            "tag \"plant\": it has no such slot");
  EXPECT_EQ(error_of(TagsChanged::Erase{.tag = 9}), "there is no tag 9");
  EXPECT_EQ(error_of(TagsChanged::Define{{tags::RowKind::kString, 99, 1, "x"}}), "unknown robot");
  EXPECT_EQ(error_of(Write{.lease_ms = 3'600'001}),
            "a change of tags: change.lease_ms is 3600001, expected 0 to 3600000");
}

TEST_F(TagsPartTest, NumbersStayWhenTheFileChanges) {
  bench_.Handle(MessageOf(WriteRequest(15, 2)));
  tags::Settings settings = ThreeTags();
  settings.tags = {{"new", 1'000'000, 1'000'000, 500'000, 8}, settings.tags[2]};
  bench_.Apply(ConfigChanged{ConfigWith(settings), 7});
  EXPECT_EQ(store().NumberOf("new"), 1) << "door was empty and is forgotten";
  EXPECT_EQ(store().NumberOf("far"), 3);
  EXPECT_EQ(store().NumberOf("plant"), 2) << "it has a block";
  EXPECT_EQ(bench_.HandleForReason(MessageOf(protocol::TagReadRequest{15, 1'100, 1'000, 2, 0})),
            Reason::kNoTagInRange);
  bench_.Apply(ConfigChanged{ConfigWith(ThreeTags()), 7});
  EXPECT_EQ(Read(12, 2, 0).words[0], 15);
}

TEST_F(TagsPartTest, SlotsInUseAreNotTakenAway) {
  for (const uint8_t slot : {uint8_t{0}, uint8_t{5}}) {
    protocol::TagWriteRequest request = WriteRequest(15, 1);
    request.slot = slot;
    bench_.Handle(MessageOf(request));
  }
  tags::Settings settings = ThreeTags();
  settings.tags[0].slots = 5;
  EXPECT_EQ(bench_.engine.CheckConfig(ConfigWith(settings)).error(),
            "tag \"door\" has a block in slot 5, and would have only 5 slots; erase that block "
            "first");
  settings.tags[0].slots = 6;
  ASSERT_TRUE(bench_.engine.CheckConfig(ConfigWith(settings)).ok());
  bench_.Apply(ConfigChanged{ConfigWith(settings), 7});
  EXPECT_EQ(Read(12, 1, 0).slots, 6);
}

TEST_F(TagsPartTest, AStateIsRestoredAndFrozen) {
  protocol::TagWriteRequest claim = WriteRequest(15, 1);
  claim.lease_s = 60;
  bench_.Handle(MessageOf(claim));
  bench_.Handle(Symbol(15, protocol::SymbolKind::kString, 3, "cleaning"));
  bench_.Handle(Symbol(12, protocol::SymbolKind::kMapping, 15, ""));
  const std::string saved = Saved(bench_.engine);
  const std::unique_ptr<FrozenState> frozen = bench_.engine.Freeze(1 << 20);
  bench_.Handle(MessageOf(WriteRequest(12, 1)));  // while it is copied
  std::string copied;
  while (frozen->CopySome(&copied)) {
  }
  EXPECT_EQ(copied, saved);
  ByteReader reader(saved);
  Result<Engine> restored = Engine::Restore(&reader);
  ASSERT_TRUE(restored.ok()) << restored.error();
  EXPECT_EQ(Saved(restored.value()), saved);
  EXPECT_EQ(restored.value().NextDeadline(), bench_.now_ms + 60'000);
}

TEST_F(TagsPartTest, TheHashIsThatOfTheContents) {
  const uint64_t before = bench_.engine.StateHash();
  const tags::Store copy = store();
  bench_.Handle(MessageOf(WriteRequest(15, 1)));
  EXPECT_NE(store().hash(), copy.hash());
  EXPECT_NE(bench_.engine.StateHash(), before);
  ByteWriter writer;
  store().Save(&writer);
  ByteReader reader(writer.bytes());
  tags::Store recomputed;
  recomputed.Restore(ThreeTags(), &reader);
  ASSERT_TRUE(reader.ok()) << reader.error();
  EXPECT_EQ(recomputed.hash(), store().hash());
}

TEST_F(TagsPartTest, DamagedStatesAreRefused) {
  bench_.Handle(MessageOf(WriteRequest(15, 1)));
  ByteWriter writer;
  store().Save(&writer);
  for (size_t i = 0; i < writer.bytes().size(); ++i) {
    std::string cut = writer.bytes().substr(0, i);
    ByteReader reader(cut);
    tags::Store store;
    store.Restore(ThreeTags(), &reader);
    EXPECT_FALSE(reader.ok()) << i;
  }
}

}  // namespace
}  // namespace pheromone::engine
