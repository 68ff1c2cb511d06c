#include "server/core/engine/service/held_answers.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <utility>

#include "server/core/engine/testing/bench.h"

namespace pheromone::engine {
namespace {

using testing::SameMessage;

Outgoing AnswerTo(uint8_t id, uint8_t seq, uint64_t durable_at, uint32_t connection = 0,
                  LinkIndex link = 0) {
  Outgoing answer{link, durable_at, testing::MessageOf(protocol::DepositAnswer{id, 1, seq})};
  answer.asker.asked_ns = 1;
  answer.asker.connection = connection;
  return answer;
}

std::vector<Outgoing> Released(HeldAnswers* held, uint64_t durable) {
  std::vector<Outgoing> out;
  held->Release(durable, &out);
  return out;
}

TEST(HeldAnswersTest, ARepeatedRequestJoinsTheAnswerThatWaits) {
  HeldAnswers held;
  EXPECT_FALSE(held.Hold(AnswerTo(1, 1, 10, 1)));
  EXPECT_FALSE(held.Hold(AnswerTo(2, 1, 11, 1)));
  for (uint32_t connection = 2; connection < 100; ++connection) {
    const auto dropped = held.Hold(AnswerTo(1, 1, 10, connection));
    ASSERT_TRUE(dropped);
    EXPECT_TRUE(dropped->repeated);
  }
  EXPECT_EQ(held.answers(), 2u);
  EXPECT_TRUE(Released(&held, 9).empty());
  const auto out = Released(&held, 10);
  ASSERT_EQ(out.size(), 1u);
  EXPECT_EQ(out[0].asker.connection, 99u);
  EXPECT_EQ(Released(&held, 11).size(), 1u);
  EXPECT_EQ(held.answers(), 0u);
}

// Each HELLO is a change of its own: repeated faster than the disk syncs, it would otherwise never
// be answered.
TEST(HeldAnswersTest, AnAnswerThatIsGivenForAnotherChangeTooKeepsItsPlace) {
  HeldAnswers held;
  held.Hold(AnswerTo(1, 1, 10, 1));
  const auto dropped = held.Hold(AnswerTo(1, 1, 20, 2));
  ASSERT_TRUE(dropped);
  EXPECT_TRUE(dropped->repeated);
  const auto out = Released(&held, 10);
  ASSERT_EQ(out.size(), 1u);
  EXPECT_EQ(out[0].asker.connection, 2u);
}

TEST(HeldAnswersTest, AnotherRequestOfTheRobotTakesThePlaceOfTheFirst) {
  HeldAnswers held;
  held.Hold(AnswerTo(1, 1, 10));
  held.Hold(AnswerTo(1, 1, 11, 0, 1));  // of another link: another robot
  const auto dropped = held.Hold(AnswerTo(1, 2, 12));
  ASSERT_TRUE(dropped);
  EXPECT_FALSE(dropped->repeated);
  EXPECT_TRUE(SameMessage(dropped->answer.message, AnswerTo(1, 1, 10).message));
  const auto out = Released(&held, 100);
  ASSERT_EQ(out.size(), 2u);
  EXPECT_EQ(out[0].link, 1u);
  EXPECT_TRUE(SameMessage(out[1].message, AnswerTo(1, 2, 12).message));
}

TEST(HeldAnswersTest, WhatIsLetGoIsNotReleased) {
  HeldAnswers held;
  EXPECT_FALSE(held.Drop(3, 1));
  held.Hold(AnswerTo(1, 1, 10));
  EXPECT_FALSE(held.Drop(0, 2));
  EXPECT_TRUE(held.Drop(0, 1));
  EXPECT_FALSE(held.Drop(0, 1));
  EXPECT_TRUE(Released(&held, 100).empty());
}

TEST(HeldAnswersTest, CommandsKeepTheirOrderAmongThemselvesAndWithAnswers) {
  HeldAnswers held;
  const auto command = [](uint8_t id, uint64_t at) {
    return Outgoing{0, at, testing::MessageOf(protocol::Command{id, 0, {}, {}})};
  };
  held.Hold(AnswerTo(1, 1, 10));
  held.HoldCommand(command(255, 11));
  held.HoldCommand(command(1, 12));
  held.HoldCommand(command(255, 13));
  held.Hold(AnswerTo(2, 1, 14));
  EXPECT_EQ(held.commands(), 3u);
  std::vector<uint64_t> order;
  for (const Outgoing& it : Released(&held, 14)) {
    order.push_back(it.durable_at);
  }
  EXPECT_EQ(order, (std::vector<uint64_t>{10, 11, 12, 13, 14}));
}

// The same, naively, as a list that is searched.
class NaiveAnswers {
 public:
  void Hold(const Outgoing& answer) {
    const auto found = Find(answer.link, answer.message.id);
    if (found != list_.end() && SameMessage(found->first.message, answer.message)) {
      found->first.asker = answer.asker;
      return;
    }
    if (found != list_.end()) {
      list_.erase(found);
    }
    list_.emplace_back(answer,
                       std::max(answer.durable_at, list_.empty() ? 0 : list_.back().second));
  }
  void Drop(LinkIndex link, uint8_t id) {
    const auto found = Find(link, id);
    if (found != list_.end()) {
      list_.erase(found);
    }
  }
  std::vector<Outgoing> Release(uint64_t durable) {
    std::vector<Outgoing> out;
    while (!list_.empty() && list_.front().second <= durable) {
      out.push_back(list_.front().first);
      list_.erase(list_.begin());
    }
    return out;
  }
  size_t size() const { return list_.size(); }

 private:
  using List = std::vector<std::pair<Outgoing, uint64_t>>;
  List::iterator Find(LinkIndex link, uint8_t id) {
    return std::find_if(list_.begin(), list_.end(), [&](const auto& it) {
      return it.first.link == link && it.first.message.id == id;
    });
  }
  List list_;
};

TEST(HeldAnswersTest, WhateverHappensTheSameIsReleasedAsFromAListThatIsSearched) {
  std::mt19937 random(7);
  const auto below = [&random](uint32_t limit) { return static_cast<uint32_t>(random() % limit); };
  HeldAnswers held;
  NaiveAnswers naive;
  uint64_t sequence = 0;
  size_t released = 0;
  for (uint32_t step = 0; step < 100'000; ++step) {
    const auto id = static_cast<uint8_t>(1 + below(5));
    const auto link = static_cast<LinkIndex>(below(3));
    if (const uint32_t what = below(20); what == 0) {
      held.Drop(link, id);
      naive.Drop(link, id);
    } else if (what == 1) {
      const uint64_t durable = sequence - std::min<uint64_t>(sequence, below(8));
      const auto expected = naive.Release(durable);
      const auto found = Released(&held, durable);
      ASSERT_EQ(found.size(), expected.size());
      for (size_t i = 0; i < found.size(); ++i) {
        EXPECT_EQ(found[i].link, expected[i].link);
        EXPECT_EQ(found[i].asker.connection, expected[i].asker.connection);
        EXPECT_TRUE(SameMessage(found[i].message, expected[i].message));
      }
      released += found.size();
    } else {
      // Some depend on an older change than those before them.
      const uint64_t at = sequence + 1 - std::min<uint64_t>(sequence, below(3));
      ++sequence;
      const Outgoing answer = AnswerTo(id, static_cast<uint8_t>(below(3)), at, step, link);
      held.Hold(answer);
      naive.Hold(answer);
    }
    ASSERT_EQ(held.answers(), naive.size());
    ASSERT_LE(held.answers(), 15u);
  }
  EXPECT_GT(released, 10'000u);
}

}  // namespace
}  // namespace pheromone::engine
