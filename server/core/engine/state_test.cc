// A restored engine behaves as the saved one: the same answers and hashes to any input.

#include <gtest/gtest.h>

#include <string>

#include "server/core/engine/testing/bench.h"
#include "server/core/engine/testing/random_traffic.h"

namespace pheromone::engine {
namespace {

using testing::RandomTraffic;
using testing::RichConfig;
using testing::Saved;

Result<Engine> Restored(const std::string& bytes) {
  ByteReader reader(bytes);
  Result<Engine> engine = Engine::Restore(&reader);
  reader.ExpectEnd();
  EXPECT_TRUE(reader.ok() || !engine.ok()) << reader.error();
  return engine;
}

void ExpectSame(const std::vector<Outgoing>& a, const std::vector<Outgoing>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].link, b[i].link);
    EXPECT_EQ(a[i].durable_at, b[i].durable_at);
    EXPECT_TRUE(testing::SameMessage(a[i].message, b[i].message));
  }
}

// What a run covered, so that a property that holds only vacuously is noticed.
struct Seen {
  int full = 0;
  int swept = 0;
  int edits_refused = 0;
};

void RestoreInTheMiddle(uint64_t seed, bool tight, Seen* seen) {
  RandomTraffic traffic(seed, RichConfig(tight));
  Engine engine;
  std::vector<Outgoing> out;
  engine.Apply(1, traffic.stamp(), traffic.First(), &out);
  const uint64_t cut = 2 + traffic.Below(600);
  uint64_t sequence = 1;
  while (sequence < cut) {
    const Event event = traffic.Next(engine);
    engine.Apply(++sequence, traffic.stamp(), event, &out);
  }
  const std::string bytes = Saved(engine);
  Result<Engine> restored = Restored(bytes);
  ASSERT_TRUE(restored.ok()) << restored.error();
  Engine& other = restored.value();
  Engine branch = engine;
  EXPECT_EQ(Saved(other), bytes) << "one way to write a state";
  EXPECT_EQ(other.sequence(), cut);
  for (int i = 0; i < 300; ++i) {
    const Event event = traffic.Next(engine);
    ASSERT_TRUE(other.Check(event).ok());
    std::vector<Outgoing> expected;
    std::vector<Outgoing> actual;
    const uint64_t nodes = engine.field().node_count();
    engine.Apply(++sequence, traffic.stamp(), event, &expected);
    other.Apply(sequence, traffic.stamp(), event, &actual);
    ASSERT_NO_FATAL_FAILURE(ExpectSame(expected, actual)) << "seed " << seed << " event " << i;
    ASSERT_EQ(engine.StateHash(), other.StateHash()) << "seed " << seed << " event " << i;
    std::vector<Outgoing> of_branch;
    branch.Apply(sequence, traffic.stamp(), event, &of_branch);
    ASSERT_NO_FATAL_FAILURE(ExpectSame(expected, of_branch)) << "a copy of the engine";
    ASSERT_EQ(engine.field().used_bytes(), other.field().used_bytes());
    ASSERT_EQ(engine.NextDeadline(), other.NextDeadline());
    ASSERT_EQ(engine.finished().size(), other.finished().size());
    for (size_t k = 0; k < engine.finished().size(); ++k) {
      ASSERT_EQ(engine.finished()[k].id, other.finished()[k].id);
      ASSERT_EQ(engine.finished()[k].outcome.ok(), other.finished()[k].outcome.ok());
      seen->edits_refused += engine.finished()[k].outcome.ok() ? 0 : 1;
    }
    expected.clear();
    actual.clear();
    const protocol::Message sense = traffic.AnySense();
    engine.Answer(traffic.stamp(), 0, sense, &expected);
    other.Answer(traffic.stamp(), 0, sense, &actual);
    ASSERT_NO_FATAL_FAILURE(ExpectSame(expected, actual));
    for (const Outgoing& it : out) {
      seen->full += testing::ReasonOf(it.message) == protocol::Reason::kMapFull ? 1 : 0;
    }
    seen->swept += engine.field().node_count() < nodes ? 1 : 0;
    out.clear();
    std::swap(out, expected);
  }
  EXPECT_EQ(Saved(other), Saved(engine));
  EXPECT_EQ(Saved(branch), Saved(engine));
}

TEST(State, ARestoredEngineGoesOnAsTheSavedOneWouldHave) {
  Seen seen;
  for (uint64_t seed = 0; seed < 20; ++seed) {
    ASSERT_NO_FATAL_FAILURE(RestoreInTheMiddle(seed, false, &seen));
  }
  EXPECT_GT(seen.swept, 0);
}

TEST(State, ItDoesWhereMemoryIsShortToo) {
  Seen seen;
  for (uint64_t seed = 100; seed < 130; ++seed) {
    ASSERT_NO_FATAL_FAILURE(RestoreInTheMiddle(seed, true, &seen));
  }
  EXPECT_GT(seen.swept, 0);
  EXPECT_GT(seen.edits_refused, 0);
}

TEST(State, ATableThatOutlivesItsTilesIsPartOfTheState) {
  // A table of the map outlives its last tile, and counts as used memory.
  testing::Bench bench;
  bench.Handle(testing::Hello(1, 1));
  bench.Handle(testing::Deposit(1, 1));
  field::FieldEdit erase;
  erase.shape = field::FieldEdit::Shape::kAll;
  erase.action = field::FieldEdit::Action::kErase;
  bench.Apply(FieldEdited{erase});
  ASSERT_EQ(bench.engine.field().node_count(), 0u);
  ASSERT_GT(bench.engine.field().used_bytes(), 0u);
  const Result<Engine> restored = Restored(Saved(bench.engine));
  ASSERT_TRUE(restored.ok());
  EXPECT_EQ(restored.value().field().used_bytes(), bench.engine.field().used_bytes());
}

// The saved bytes with one part of them replaced.
std::string Replaced(std::string bytes, ByteWriter* from, ByteWriter* to) {
  const std::string before = from->Take();
  const std::string after = to->Take();
  const size_t at = bytes.find(before);
  EXPECT_NE(at, std::string::npos);
  EXPECT_EQ(bytes.find(before, at + 1), std::string::npos);
  EXPECT_EQ(before.size(), after.size());
  return bytes.replace(at, before.size(), after);
}

TEST(State, AHaltToAllOfALinkThatThereIsNotIsRefused) {
  testing::Bench bench;
  bench.Apply(CommandIssued{1, protocol::kBroadcastId, protocol::CommandCode::kHalt, {}});
  const auto broadcast = [&](uint16_t link) {
    ByteWriter writer;
    writer.U16(link);
    writer.U8(0);  // its seq
    writer.U8(RobotsPart::kBroadcastTransmissions - 1);
    writer.U64(bench.now_ms + RobotsPart::kBroadcastIntervalMs);
    return writer;
  };
  ByteWriter good = broadcast(1);
  ByteWriter bad = broadcast(2);
  const Result<Engine> restored = Restored(Replaced(Saved(bench.engine), &good, &bad));
  ASSERT_FALSE(restored.ok());
  EXPECT_EQ(restored.error(), "a broadcast that has ended or has no link");
}

TEST(State, AGoalThatNoMapHasIsRefused) {
  testing::Bench bench;
  bench.Handle(testing::Hello(1, 1));
  Goal goal{.route = {{4'000'000, 5'000'000}, {6'000'000, 7'000'000}}};
  bench.Apply(GoalSet{0, 1, goal});
  ByteWriter good;
  EncodeFields(goal, &good);
  goal.route[0].x = int64_t{1} << 62;
  ByteWriter bad;
  EncodeFields(goal, &bad);
  const Result<Engine> restored = Restored(Replaced(Saved(bench.engine), &good, &bad));
  ASSERT_FALSE(restored.ok());
  EXPECT_EQ(restored.error(), "a route through a point that no map has");
}

TEST(State, BytesThatNoEngineSavedAreRefusedWithWords) {
  RandomTraffic traffic(7);
  Engine engine;
  std::vector<Outgoing> out;
  engine.Apply(1, traffic.stamp(), traffic.First(), &out);
  for (uint64_t sequence = 2; sequence < 200; ++sequence) {
    const Event event = traffic.Next(engine);
    engine.Apply(sequence, traffic.stamp(), event, &out);
  }
  const std::string bytes = Saved(engine);
  for (size_t length = 0; length < bytes.size(); length += 1 + bytes.size() / 300) {
    EXPECT_FALSE(Restored(bytes.substr(0, length)).ok()) << length;
  }
  std::string other = bytes;
  other[0] = 9;
  EXPECT_EQ(
      Restored(other).error(),
      "a state of version 9, but this program reads version 4; use the program that wrote it");
  // A changed byte is refused, unless no answer depends on it and no hash covers it.
  int refused = 0;
  int tried = 0;
  for (size_t at = 1; at < bytes.size(); at += 1 + bytes.size() / 200) {
    other = bytes;
    other[at] = static_cast<char>(other[at] ^ 0x41);
    const Result<Engine> restored = Restored(other);
    refused += restored.ok() ? 0 : 1;
    ++tried;
    if (restored.ok()) {
      EXPECT_EQ(restored.value().StateHash(), engine.StateHash());
    }
  }
  EXPECT_GT(refused, tried * 8 / 10);
}

}  // namespace
}  // namespace pheromone::engine
