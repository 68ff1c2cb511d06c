// The hashes of what an engine knows, computed again from the description in server/base/hash.h and
// from what the parts show: a server that hashes otherwise refuses its own snapshots.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "server/core/engine/config_hash.h"
#include "server/core/engine/goal.h"
#include "server/core/engine/testing/live_gate_bench.h"

namespace pheromone::engine {
namespace {

using testing::GateBench;
using Words = std::vector<uint64_t>;

// The finaliser of SplitMix64 (Steele, Lea and Flood 2014), chained over words.
uint64_t Naive(const Words& words) {
  uint64_t hash = 0;
  for (const uint64_t word : words) {
    hash += word + 0x9E3779B97F4A7C15u;
    hash = (hash ^ hash >> 30) * 0xBF58476D1CE4E5B9u;
    hash = (hash ^ hash >> 27) * 0x94D049BB133111EBu;
    hash ^= hash >> 31;
  }
  return hash;
}

uint64_t Text(const std::string& text) {
  Words words{text.size()};
  words.insert(words.end(), text.begin(), text.end());
  return Naive(words);
}

// Its length, then each item as a word.
uint64_t List(const Words& items) {
  Words words{items.size()};
  words.insert(words.end(), items.begin(), items.end());
  return Naive(words);
}

uint64_t Signed(int64_t value) {
  return static_cast<uint64_t>(value);
}
uint64_t Unsigned(int32_t value) {
  return static_cast<uint32_t>(value);
}
uint64_t OrZero(const std::optional<uint64_t>& value) {
  return value ? *value + 1 : 0;
}

uint64_t NaiveMessage(const protocol::Message& message) {
  Words words{message.id, message.opcode, message.length};
  words.insert(words.end(), message.data, message.data + message.length);
  return Naive(words);
}

uint64_t NaiveGoal(const Goal& goal) {
  Words words{'G', goal.tolerance_um, goal.route.size()};
  for (const field::PointUm& point : goal.route) {
    words.push_back(Signed(point.x));
    words.push_back(Signed(point.y));
  }
  return Naive(words);
}

uint64_t NaiveRobot(const std::string& link, uint8_t id, const RobotState& robot) {
  Words words{
      'R',         Text(link),        id,
      robot.epoch, robot.hello.nonce, robot.previous_nonce ? *robot.previous_nonce + 1u : 0u};
  protocol::Message hello;
  Encode(robot.hello, &hello);
  words.insert(words.end(), hello.data + 2, hello.data + hello.length);  // behind the nonce
  protocol::Message command;
  Encode(robot.command.command, &command);
  for (const uint64_t word :
       {uint64_t{robot.last_opcode}, uint64_t{robot.last_seq}, uint64_t{robot.last_crc},
        NaiveMessage(robot.last_answer), robot.last_change, robot.last_activity,
        uint64_t{robot.next_command_seq},
        Naive({static_cast<uint64_t>(robot.command.outcome), NaiveMessage(command),
               static_cast<uint64_t>(robot.command.result), robot.command.sent,
               robot.command.next_retry_ms})}) {
    words.push_back(word);
  }
  words.push_back(robot.last_event ? Naive({1, robot.last_event->seq,
                                            static_cast<uint64_t>(robot.last_event->code),
                                            Signed(robot.last_event->argument)})
                                   : 0);
  words.push_back(robot.observed ? Naive({1, Signed(robot.observed->pose.position.x),
                                          Signed(robot.observed->pose.position.y),
                                          robot.observed->pose.heading, robot.observed->until_ms})
                                 : 0);
  if (robot.goal) {
    words.push_back(NaiveGoal(*robot.goal));
  }
  return Naive(words);
}

uint64_t NaiveTag(const tags::NamedTag& it) {
  Words words{'T', it.number, Text(it.name), it.tag.slots().size(), it.tag.generation()};
  for (const tags::Slot& slot : it.tag.slots()) {
    words.push_back(slot.lease_end_ms * 65'536 + slot.generation);
    const tags::Block& block = slot.block;
    if (block.author != 0) {
      words.push_back(Unsigned(block.author) << 32 | block.time_s);
      for (const tags::Term& term : {block.subject, block.predicate, block.object}) {
        words.push_back(Unsigned(term.space) << 32 | Unsigned(term.value));
      }
    }
  }
  return Naive(words);
}

Words WordsOf(const petri::LiveAck& ack) {
  return {Signed(ack.robot), ack.seq, static_cast<uint64_t>(ack.outcome), ack.amount};
}

// No deposit waits to be read.
uint64_t NaiveNet(const petri::LiveNet& net) {
  Words marking;
  for (const int32_t tokens : net.marking()) {
    marking.push_back(Naive({Signed(tokens)}));
  }
  Words tags;
  for (const petri::LiveTagState& tag : net.tags()) {
    Words words = WordsOf(tag.last);
    const Words waiting = WordsOf(tag.waiting);
    words.insert(words.end(), waiting.begin(), waiting.end());
    tags.push_back(Naive(words));
  }
  Words robots;
  for (const petri::LiveAck& ack : net.robots()) {
    robots.push_back(Naive(WordsOf(ack)));
  }
  Words exceptions;
  for (const petri::LiveException& it : net.exceptions()) {
    exceptions.push_back(Naive(
        {it.at_ms, it.tag, Signed(it.robot), it.seq, it.action, static_cast<uint64_t>(it.why)}));
  }
  const petri::Trails& trails = net.trails();
  const petri::LiveCounts& counts = net.counts();
  return Naive({'N', Text("gate"),
                Naive({List(marking),
                       Signed(trails.a.stored_milli),
                       trails.a.since_ms,
                       Signed(trails.b.stored_milli),
                       trails.b.since_ms,
                       0,
                       0,
                       net.source_left(),
                       net.last_firing_ms(),
                       counts.firings,
                       counts.records,
                       counts.repeats,
                       counts.exceptions,
                       counts.deposits,
                       counts.deposited,
                       counts.taken,
                       counts.restored,
                       counts.blocked,
                       List(tags),
                       List(robots),
                       List(exceptions)})});
}

// Two robots by radio, one with a goal; tags with symbols and blocks; a net that fires and refuses.
class PartHashTest : public ::testing::Test, protected GateBench {
 protected:
  PartHashTest() {
    bench.now_ms = 1'000;
    Register(15);
    Register(16);
    Wait(1'000);
    Write(15, kNorth, protocol::NetAction::kPresent, 101);
    Wait(200);
    Write(15, kNorth, protocol::NetAction::kPass, 102);
    Wait(200);
    Write(15, kPheromone, protocol::NetAction::kTake, 103, 30);
    Wait(200);
    Write(15, kPheromone, protocol::NetAction::kStoreA, 104, 30);
    Wait(200);
    Write(16, kNorth, protocol::NetAction::kPass, 105);  // refused: it has not presented itself
    Wait(200);
    protocol::SymbolRequest text{15, NextSeq(15), protocol::SymbolKind::kString, 7, 2, {}};
    text.text[0] = 'o';
    text.text[1] = 'n';
    bench.Handle(testing::MessageOf(text));
    bench.Apply(GoalSet{0, 15, {{{1'000, -2'000}, {3'000, 4'000}}, 250'000}});
    bench.Handle(testing::Deposit(16, NextSeq(16)));
    bench.Handle(testing::Hello(15, 1));                    // an event that is no change
    Write(16, kNorth, protocol::NetAction::kPresent, 106);  // still to be read
  }
};

TEST_F(PartHashTest, OfRobotsAndTheirGoals) {
  const std::string link = bench.engine.config().links[0].name;
  uint64_t sum = 0;
  for (const uint8_t id : {uint8_t{15}, uint8_t{16}}) {
    const RobotState* const robot = bench.engine.robots().Find(0, id);
    ASSERT_NE(robot, nullptr);
    sum += NaiveRobot(link, id, *robot);
  }
  ASSERT_TRUE(bench.engine.robots().Find(0, 15)->goal);
  EXPECT_EQ(bench.engine.robots().hash(), sum);
}

TEST_F(PartHashTest, OfTagsTheirSymbolsAndAuthors) {
  uint64_t sum = 0;
  size_t blocks = 0;
  for (uint16_t number = 1; number <= store().last_number(); ++number) {
    sum += NaiveTag(*store().Find(number));
    blocks += store().Find(number)->tag.used();
  }
  EXPECT_GT(blocks, 3u);
  const auto& rows = store().symbols().rows();
  const auto& makers = store().symbols().makers();
  ASSERT_GE(rows.size(), 3u);
  EXPECT_EQ(makers.front().id, 15);
  EXPECT_EQ(rows.back().number, 7) << "a string";
  for (size_t i = 0; i < rows.size(); ++i) {
    sum +=
        Naive({'S', i, static_cast<uint64_t>(rows[i].kind), Unsigned(rows[i].robot),
               Unsigned(rows[i].number), Text(rows[i].text), Text(makers[i].link), makers[i].id});
  }
  const std::string link = bench.engine.config().links[0].name;
  for (const uint8_t id : {uint8_t{15}, uint8_t{16}}) {  // the author's number is the ID
    ASSERT_EQ(store().AuthorOn(link, id), id);
    sum += Naive({'A', Text(link), id, id});
  }
  EXPECT_EQ(store().hash(), sum);
}

TEST_F(PartHashTest, OfNets) {
  const NetsPart::Instance& it = nets().nets().find("gate")->second;
  ASSERT_GT(it.net.counts().exceptions, 0u);
  ASSERT_GT(it.net.trails().a.stored_milli, 0);
  ASSERT_TRUE(it.due_ms);
  EXPECT_EQ(it.net.Hash(), NaiveNet(it.net));
  Words seen;
  for (const uint16_t generation : it.seen) {
    seen.push_back(Naive({generation}));
  }
  EXPECT_EQ(nets().Hash(), Naive({'R', NaiveNet(it.net), OrZero(it.due_ms), OrZero(it.change_ms),
                                  Naive({List(seen)})}));
}

// Nothing is waiting for an acknowledgement of a broadcast.
TEST_F(PartHashTest, OfTheEngineIsTheSumOfItsParts) {
  bench.Apply(KeysRevoked{{{15, {1, 2, 3, 4, 5, 6, 7, 8}}, {3, {9}}}});
  bench.Apply(KeysRevoked{{{15, {1, 2, 3, 4, 5, 6, 7, 8}}}});  // again
  const uint64_t revoked =
      Naive({'K', 15, 1, 2, 3, 4, 5, 6, 7, 8}) + Naive({'K', 3, 9, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(bench.engine.StateHash(),
            Naive({'E', bench.engine.epoch()}) + HashConfig(bench.engine.config()) +
                bench.engine.robots().hash() + revoked + Naive({'N', 0}) +
                bench.engine.field().hash() + nets().Hash() + store().hash());
}

}  // namespace
}  // namespace pheromone::engine
