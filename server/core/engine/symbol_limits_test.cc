// One robot that defines as many names as it can, and what is left to others; an operator removes
// them again.

#include <gtest/gtest.h>

#include <cstring>
#include <map>
#include <string>
#include <utility>

#include "server/core/engine/event_codec.h"
#include "server/core/engine/frozen_state.h"
#include "server/core/engine/testing/bench.h"

namespace pheromone::engine {
namespace {

using protocol::Message;
using protocol::Reason;
using protocol::SymbolKind;
using testing::MessageOf;
using testing::Saved;

constexpr uint8_t kAttacker = 66;
constexpr uint8_t kOther = 15;
constexpr int kAttempts = 65'536;

class SymbolLimitsTest : public ::testing::Test {
 protected:
  SymbolLimitsTest() {
    EngineConfig config = testing::SmallConfig();
    config.tags = {.tags = {{"door", 1'000'000, 1'000'000, 500'000, 8}}, .privileged = {}};
    bench_ = testing::Bench(config);
    bench_.Handle(testing::Hello(kAttacker, 1));
    bench_.Handle(testing::Hello(kOther, 1));
  }

  Reason Symbol(uint8_t id, SymbolKind kind, int32_t number, const std::string& text) {
    protocol::SymbolRequest request{
        id, ++seqs_[id], kind, number, static_cast<uint8_t>(text.size()), {}};
    std::memcpy(request.text, text.data(), text.size());
    return bench_.HandleForReason(MessageOf(request));
  }
  // Every name it can think of, as a robot of its own: none of them reaches its author's limit.
  int DefineAll() {
    int made = 0;
    for (int i = 0; i < kAttempts; ++i) {
      const Reason reason = Symbol(kAttacker, SymbolKind::kRobot, 0, "name " + std::to_string(i));
      EXPECT_TRUE(reason == Reason::kNone || reason == Reason::kTagFull);
      made += reason == Reason::kNone ? 1 : 0;
    }
    return made;
  }
  Status Try(const TagsChanged& change) {
    Status possible = bench_.engine.Check(change);
    if (possible.ok()) {
      bench_.Apply(change);
    }
    return possible;
  }
  static TagsChanged Forget(const std::string& link, uint8_t id) {
    return {TagsChanged::Forget{{link, id}}};
  }
  size_t rows() const { return bench_.engine.tags().symbols().rows().size(); }

  // From the log's bytes, as a recovery does.
  void ExpectSameFromTheLog() {
    Engine again;
    std::vector<Outgoing> out;
    uint64_t sequence = 0;
    for (const auto& [now_ms, event] : bench_.log) {
      ByteWriter writer;
      EncodeEvent(event, &writer);
      ByteReader reader(writer.bytes());
      const Event read = DecodeEvent(&reader);
      ASSERT_TRUE(reader.ok()) << reader.error();
      out.clear();
      again.Apply(++sequence, {now_ms, 0}, read, &out);
    }
    EXPECT_EQ(again.StateHash(), bench_.engine.StateHash());
    EXPECT_TRUE(Saved(again) == Saved(bench_.engine));
    const std::string saved = Saved(bench_.engine);
    ByteReader reader(saved);
    const auto restored = Engine::Restore(&reader);
    ASSERT_TRUE(restored.ok()) << restored.error();
    EXPECT_EQ(restored.value().StateHash(), bench_.engine.StateHash());
  }

  testing::Bench bench_;
  std::map<uint8_t, uint8_t> seqs_;
};

TEST_F(SymbolLimitsTest, OneRobotLeavesRoomForOthersAndAnOperatorClearsItsNames) {
  EXPECT_EQ(DefineAll(), 1'024);
  EXPECT_EQ(Symbol(kOther, SymbolKind::kRobot, 0, "123-233-201"), Reason::kNone);
  EXPECT_EQ(Symbol(kOther, SymbolKind::kString, 1, "cleaning"), Reason::kNone);
  const int32_t author = *bench_.engine.tags().AuthorOn("radio-a", kOther);
  const tags::Row row{tags::RowKind::kRobot, 70'000, 70'000, "operator"};
  EXPECT_TRUE(Try({TagsChanged::Define{row}}).ok());
  EXPECT_EQ(rows(), 1'024u + 3u);
  ExpectSameFromTheLog();

  // It has written a sentence as its first name, about its second one: these two are in use.
  TagsChanged::Write write{.tag = 1};
  write.block = {1, 5, {-17, 2}, {1, 2}, {-3, 244}};
  EXPECT_TRUE(Try({write}).ok());
  const Status done = Try(Forget("radio-a", kAttacker));
  EXPECT_TRUE(done.ok()) << done.error();
  EXPECT_EQ(rows(), 2u + 3u);
  EXPECT_EQ(*bench_.engine.tags().symbols().UniqueIdOf(1), "name 0");
  EXPECT_EQ(*bench_.engine.tags().symbols().UniqueIdOf(2), "name 1");
  EXPECT_EQ(bench_.engine.tags().AuthorOn("radio-a", kOther), author);
  EXPECT_FALSE(bench_.engine.tags().AuthorOn("radio-a", kAttacker)) << "its number is gone";
  EXPECT_EQ(
      Try(Forget("radio-a", kAttacker)).ErrorOr(""),
      "robot 66 on link \"radio-a\" has defined nothing that is not in use, of 2 definitions");
  EXPECT_EQ(Try(Forget("radio-b", 3)).ErrorOr(""),
            "robot 3 on link \"radio-b\" has defined nothing");
  ExpectSameFromTheLog();
  EXPECT_EQ(Symbol(kAttacker, SymbolKind::kRobot, 0, "honest"), Reason::kNone);
  ExpectSameFromTheLog();
}

TEST_F(SymbolLimitsTest, AFrozenStateHasTheDefinitionsThatAreForgottenMeanwhile) {
  for (int i = 0; i < 600; ++i) {
    ASSERT_EQ(Symbol(kAttacker, SymbolKind::kRobot, 0, std::to_string(i)), Reason::kNone);
  }
  const std::string expected = Saved(bench_.engine);
  const auto frozen = bench_.engine.Freeze(FrozenState::kMaxKeptBytes);
  ASSERT_NE(frozen, nullptr);
  std::string copied;
  bool has_forgotten = false;
  while (frozen->CopySome(&copied)) {
    if (!std::exchange(has_forgotten, true)) {
      ASSERT_TRUE(Try(Forget("radio-a", kAttacker)).ok());
      ASSERT_EQ(Symbol(kOther, SymbolKind::kRobot, 0, "another"), Reason::kNone);
    }
  }
  EXPECT_FALSE(frozen->failed());
  EXPECT_TRUE(copied == expected);
  EXPECT_EQ(rows(), 1u);
}

}  // namespace
}  // namespace pheromone::engine
