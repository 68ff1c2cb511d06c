// Edits of the map are made in portions, between which robots have their turn.

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <variant>

#include "server/core/engine/testing/service_bench.h"

namespace pheromone::engine {
namespace {

using protocol::Reason;
using testing::Deposit;
using testing::HashOfReplay;
using testing::Hello;
using testing::ServiceTest;

TEST_F(ServiceTest, AnEditIsLoggedUnlessItIsClearThatItCannotBeDone) {
  field::FieldEdit edit;
  edit.level = 64;
  edit.points = {{0, 0}, {500'000, 0}};
  ASSERT_TRUE(service_.Edit(edit).ok());
  EXPECT_EQ(log_.events.size(), 2u);
  EXPECT_EQ(std::get<FieldEdited>(log_.events[1].second).edit, edit);
  const uint64_t hash = service_.StateHash();
  field::FieldEdit wrong = edit;
  wrong.type = 7;
  EXPECT_NE(service_.Edit(wrong).error().find("not configured"), std::string::npos);
  log_.admit = Reason::kReadOnly;
  EXPECT_NE(service_.Edit(edit).error().find("log"), std::string::npos);
  EXPECT_EQ(log_.events.size(), 2u);
  EXPECT_EQ(service_.StateHash(), hash);
}

// A lack of memory shows only in Apply: the event is in the log, and a replay fails in the same
// way.
TEST_F(ServiceTest, AnEditWithoutMemoryIsAnErrorHereAndInEveryReplay) {
  EngineConfig config = testing::SmallConfig();
  config.field.memory_bytes = 40'000;
  ASSERT_TRUE(service_.Configure(config, 7).ok());
  field::FieldEdit edit;
  edit.level = 64;
  edit.shape = field::FieldEdit::Shape::kAll;
  EXPECT_NE(service_.Edit(edit).error().find("memory"), std::string::npos);
  EXPECT_EQ(log_.events.size(), 3u);
  Engine replayed;
  EXPECT_EQ(HashOfReplay(log_, &replayed), service_.StateHash());
  ASSERT_EQ(replayed.finished().size(), 1u);
  EXPECT_FALSE(replayed.finished()[0].outcome.ok());
}

// A map of 101 x 101 nodes: three portions, and robots have their turn after each.
TEST_F(ServiceTest, RobotsAreAnsweredBetweenThePortionsOfAnEdit) {
  Handle({Hello(1, 1)});
  int portions = 0;
  uint8_t seq = 0;
  size_t nodes = field::Field::kNodesOfPortion;  // the first one is made with the edit itself
  service_.OnPortion([&](std::span<const Outgoing> /*out*/) {
    ++portions;
    const auto answers = Handle({Deposit(1, ++seq)});
    ASSERT_EQ(answers.size(), 1u);
    EXPECT_EQ(testing::ReasonOf(answers[0].message), Reason::kNone);
    const size_t now = service_.Inspect([](const Engine& it) { return it.field().node_count(); });
    EXPECT_LE(now - nodes, size_t{field::Field::kNodesOfPortion} + 1);
    nodes = now;
  });
  field::FieldEdit edit;
  edit.level = 64;
  edit.shape = field::FieldEdit::Shape::kAll;
  const auto made = service_.Edit(edit);
  ASSERT_TRUE(made.ok());
  EXPECT_EQ(made.value().nodes, 101 * 101);
  EXPECT_EQ(made.value().sequence, log_.events.size());
  EXPECT_EQ(portions, 1 + 101 * 101 / field::Field::kNodesOfPortion);
  Engine replayed;
  EXPECT_EQ(HashOfReplay(log_, &replayed), service_.StateHash());
}

// Three portions, too; robots are answered between them.
TEST_F(ServiceTest, AnUndoingIsLoggedUnlessThereIsNothingToUndo) {
  EXPECT_EQ(service_.Reverse(false).error(), "nothing to undo");
  EXPECT_EQ(log_.events.size(), 1u);
  field::FieldEdit edit;
  edit.level = 64;
  edit.shape = field::FieldEdit::Shape::kAll;
  const auto made = service_.Edit(edit);
  ASSERT_TRUE(made.ok());
  EXPECT_EQ(made.value().changed, 101u * 101u);
  Handle({Hello(1, 1)});
  int portions = 0;
  service_.OnPortion([&](std::span<const Outgoing> /*out*/) {
    ++portions;
    EXPECT_EQ(Handle({Deposit(1, static_cast<uint8_t>(portions))}).size(), 1u);
    EXPECT_FALSE(service_.Reverse(false).ok());  // one at a time
  });
  const size_t logged = log_.events.size();
  const auto undone = service_.Reverse(false);
  ASSERT_TRUE(undone.ok()) << undone.error();
  EXPECT_FALSE(std::get<EditReversed>(log_.events[logged].second).redo);
  EXPECT_EQ(undone.value().edit.id, made.value().edit);
  EXPECT_EQ(undone.value().edit.shape, edit.shape);
  EXPECT_EQ(undone.value().pheromone,
            service_.Inspect([](const Engine& it) { return it.field().FindLaw(1)->name; }));
  EXPECT_GE(portions, 3);
  EXPECT_EQ(service_.Inspect([](const Engine& it) { return it.field().node_count(); }), 1u);
  Engine replayed;
  EXPECT_EQ(HashOfReplay(log_, &replayed), service_.StateHash());
  service_.OnPortion([](std::span<const Outgoing> /*out*/) {});

  log_.admit = Reason::kReadOnly;
  const uint64_t hash = service_.StateHash();
  EXPECT_NE(service_.Reverse(true).error().find("log"), std::string::npos);
  EXPECT_EQ(service_.StateHash(), hash);
  log_.admit = Reason::kNone;
  const auto redone = service_.Reverse(true);
  ASSERT_TRUE(redone.ok());
  EXPECT_EQ(redone.value().edit.id, made.value().edit);
  EXPECT_EQ(service_.Reverse(true).error(), "nothing to redo");
}

TEST_F(ServiceTest, AConfigurationWaitsForTheEditBeforeIt) {
  bool reconfigured = false;
  service_.OnPortion([&](std::span<const Outgoing> /*out*/) {
    if (!std::exchange(reconfigured, true)) {
      EngineConfig next = testing::SmallConfig();
      next.field.pheromones[0].tau_ms += 1'000;
      EXPECT_TRUE(service_.Configure(next, 7).ok());
      service_.Inspect([](const Engine& it) { EXPECT_EQ(it.field().node_count(), 101u * 101u); });
    }
  });
  field::FieldEdit edit;
  edit.level = 64;
  edit.shape = field::FieldEdit::Shape::kAll;
  EXPECT_TRUE(service_.Edit(edit).ok());
  EXPECT_TRUE(reconfigured);
}

}  // namespace
}  // namespace pheromone::engine
