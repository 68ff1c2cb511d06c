#include "server/core/engine/nets_part.h"

#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

#include "server/core/engine/event_codec.h"
#include "server/core/engine/frozen_state.h"
#include "server/core/engine/testing/bench.h"
#include "server/core/engine/testing/live_gate_bench.h"

namespace pheromone::engine {
namespace {

using petri::LiveGateSettings;
using protocol::EnvironmentRecord;
using protocol::NetAction;
using protocol::NetOutcome;
using protocol::Reason;
using testing::GateBench;
using testing::Saved;

Engine Restored(const std::string& bytes) {
  ByteReader reader(bytes);
  Result<Engine> engine = Engine::Restore(&reader);
  EXPECT_TRUE(engine.ok()) << engine.error();
  return std::move(engine).value();
}

class NetsPartTest : public ::testing::Test, protected GateBench {
 protected:
  NetsPartTest() {
    bench.now_ms = 1'000;
    Register(15);
    Register(16);
    Wait(1'000);
  }

  uint64_t Now() const { return bench.now_ms; }
  const petri::LiveCounts& counts() const { return net().counts(); }
  int32_t author() const { return *store().symbols().RobotOf("net:gate"); }

  void ExpectAck(uint16_t tag, NetOutcome outcome, uint8_t robot, uint8_t seq,
                 uint16_t amount = 0) {
    const auto record = Read(15, tag);
    ASSERT_TRUE(record);
    EXPECT_EQ(record->outcome, outcome);
    EXPECT_EQ(record->robot, robot);
    EXPECT_EQ(record->seq, seq);
    EXPECT_EQ(record->amount, amount);
  }

  void GoInside(uint8_t id = 15) {
    Write(id, kNorth, NetAction::kPresent, 101);
    Wait(200);
    Write(id, kNorth, NetAction::kPass, 102);
    Wait(200);
    ExpectAck(kNorth, NetOutcome::kAccepted, id, 102);
  }
};

TEST_F(NetsPartTest, ItsTagsTellWhatACaptureFires) {
  protocol::TriggerRecord trigger;
  const auto statement = StatementIn(15, kPheromone, protocol::kTriggerSlot);
  ASSERT_EQ(protocol::Decode(statement.data(), kHash, &trigger), protocol::NetRecordFault::kNone);
  EXPECT_EQ(trigger.count, 3);
  EXPECT_EQ(trigger.candidates[0], 2);
  EXPECT_EQ(trigger.candidates[1], 3);
  EXPECT_EQ(trigger.candidates[2], 7);
  ExpectAck(kNorth, NetOutcome::kNone, 0, 0);
  EXPECT_TRUE(store().IsPrivileged(author()));
  EXPECT_GE(author(), NetsPart::kFirstAuthor) << "robots keep the low numbers";
}

TEST_F(NetsPartTest, WithoutRecordsNothingIsDue) {
  EXPECT_EQ(bench.engine.NextDeadline(), std::nullopt);
}

TEST_F(NetsPartTest, ARecordIsReadAtTheNextInstantAndErased) {
  bench.now_ms = 2'050;
  EXPECT_EQ(Write(15, kNorth, NetAction::kPresent, 1), Reason::kNone);
  EXPECT_FALSE(tag(kNorth).slots()[2].block.is_empty());
  EXPECT_EQ(bench.engine.NextDeadline(), 2'100u) << "half a period after a multiple of 200 ms";
  bench.now_ms = 2'090;
  Write(16, kExit, NetAction::kLeave, 1);
  EXPECT_EQ(bench.engine.NextDeadline(), 2'100u) << "later records do not put it off";
  Wait(10);
  EXPECT_TRUE(tag(kNorth).slots()[2].block.is_empty());
  ExpectAck(kNorth, NetOutcome::kAccepted, 15, 1);
  EXPECT_EQ(Read(15, kNorth)->state, protocol::kNetGreen);
  ExpectAck(kExit, NetOutcome::kRefused, 16, 1);
  EXPECT_EQ(bench.engine.NextDeadline(), std::nullopt);
  const auto& fired = nets().fired();
  ASSERT_EQ(fired.size(), 3u);
  EXPECT_EQ(fired[0].net, "gate");
  EXPECT_EQ(fired[1].robot, 15);
  EXPECT_EQ(fired[2].robot, 0);
}

TEST_F(NetsPartTest, AWholeTripIsDoneByRecords) {
  GoInside();
  Write(15, kPheromone, NetAction::kTake, 103, 30);
  Wait(200);
  ExpectAck(kPheromone, NetOutcome::kAccepted, 15, 103, 30);
  EXPECT_EQ(Read(15, kPheromone)->left, 65'535) << "an endless source";
  Write(15, kPheromone, NetAction::kStoreA, 104, 30);
  Wait(200);
  ExpectAck(kPheromone, NetOutcome::kAccepted, 15, 104, 30);
  EXPECT_EQ(Read(15, kPheromone)->state, protocol::kNetAdviceA);
  Write(15, kPheromone, NetAction::kChooseA, 105);
  Wait(200);
  Write(15, kExit, NetAction::kLeave, 106);
  Wait(200);
  ExpectAck(kExit, NetOutcome::kAccepted, 15, 106);
  EXPECT_EQ(counts().exceptions, 0u);
  // 30 units at one a second.
  const uint64_t gone_ms = net().trails().a.since_ms + 30'000;
  EXPECT_EQ(bench.engine.NextDeadline(), gone_ms);
  Wait(gone_ms - Now());
  EXPECT_EQ(Read(15, kPheromone)->state, 0) << "it has evaporated";
  EXPECT_EQ(bench.engine.NextDeadline(), std::nullopt);
}

TEST_F(NetsPartTest, OfTwoRobotsOneGetsGreen) {
  Write(15, kNorth, NetAction::kPresent, 1);
  Write(16, kNorth, NetAction::kPresent, 1);
  Wait(200);
  ExpectAck(kNorth, NetOutcome::kAccepted, 15, 1);
  EXPECT_FALSE(tag(kNorth).slots()[3].block.is_empty()) << "one record at an instant";
  Wait(200);
  EXPECT_TRUE(tag(kNorth).slots()[3].block.is_empty());
  EXPECT_EQ(counts().exceptions, 1u) << "there is no room at the tag for another one";
  ExpectAck(kNorth, NetOutcome::kAccepted, 15, 1);
}

TEST_F(NetsPartTest, ARecordIsReadBeforeItsLeaseEnds) {
  uint8_t statement[protocol::kNetStatementSize];
  protocol::Encode(protocol::RobotRecord{kHash, 1, NetAction::kPresent, 1, 0, 0}, statement);
  bench.Handle(testing::MessageOf(WriteRequest(15, kNorth, statement, 1)));
  bench.now_ms += 5'000;  // nobody advanced: the log was not writable
  bench.Apply(Advance{});
  ExpectAck(kNorth, NetOutcome::kAccepted, 15, 1);
}

TEST_F(NetsPartTest, DamagedRecordsAreRefusedAndNamed) {
  struct Damage {
    petri::Refusal why;
    void (*damage)(uint8_t* statement);
    uint8_t seq;
  };
  const Damage damages[] = {
      {petri::Refusal::kCrc, [](uint8_t* it) { it[22] ^= 1; }, 0},
      {petri::Refusal::kVersion, [](uint8_t* it) { it[4] = 2; }, 0},
      {petri::Refusal::kKind,
       [](uint8_t* it) {
         protocol::Encode(protocol::TriggerRecord{kHash, 0, {}}, it);
       },
       0},
      {petri::Refusal::kHash,
       [](uint8_t* it) {
         protocol::Encode(protocol::RobotRecord{99, 7, NetAction::kPresent, 1, 0, 0}, it);
       },
       7},
      {petri::Refusal::kValue,
       [](uint8_t* it) {
         protocol::Encode(protocol::RobotRecord{kHash, 7, static_cast<NetAction>(99), 1, 0, 0}, it);
       },
       7},
  };
  const std::vector<int32_t> before = net().marking();
  for (const Damage& it : damages) {
    uint8_t statement[protocol::kNetStatementSize];
    protocol::Encode(protocol::RobotRecord{kHash, 7, NetAction::kPresent, 1, 0, 0}, statement);
    it.damage(statement);
    bench.Handle(testing::MessageOf(WriteRequest(15, kNorth, statement)));
    Wait(200);
    EXPECT_EQ(net().exceptions().back().why, it.why);
    EXPECT_EQ(net().exceptions().back().robot, 15);
    ExpectAck(kNorth, it.seq != 0 ? NetOutcome::kRefused : NetOutcome::kNone, it.seq != 0 ? 15 : 0,
              it.seq);
    EXPECT_TRUE(tag(kNorth).slots()[2].block.is_empty());
  }
  EXPECT_EQ(net().marking(), before);
  EXPECT_EQ(counts().exceptions, 5u);
}

TEST_F(NetsPartTest, ForeignBlocksInItsSlotsAreReplaced) {
  bench.Apply(TagsChanged{TagsChanged::Define{{tags::RowKind::kRobot, 99, 99, "operator"}}});
  for (const uint8_t slot : {protocol::kTriggerSlot, protocol::kEnvironmentSlot}) {
    const TagsChanged write{
        TagsChanged::Write{.tag = kNorth, .slot = slot, .block = {99, 0, {1, 1}, {1, 1}, {1, 1}}}};
    ASSERT_TRUE(bench.engine.Check(write).ok());
    bench.Apply(write);
  }
  EXPECT_TRUE(bench.engine.NextDeadline().has_value());
  Wait(200);
  EXPECT_EQ(tag(kNorth).slots()[0].block.author, author());
  ExpectAck(kNorth, NetOutcome::kNone, 0, 0);
  EXPECT_EQ(counts().restored, 2u);
  bench.Apply(TagsChanged{TagsChanged::Erase{.tag = kNorth, .slot = protocol::kEnvironmentSlot}});
  Wait(200);
  ExpectAck(kNorth, NetOutcome::kNone, 0, 0);
}

TEST_F(NetsPartTest, FourLeasedNotesLeaveRoomForARobotsRecord) {
  for (int i = 0; i < 5; ++i) {
    auto note = WriteRequest(16, kNorth, StatementIn(15, kNorth, 7).data());
    const int32_t words[] = {1, 2 + i, 3, 4, -3, 244};
    std::copy(std::begin(words), std::end(words), note.words);
    EXPECT_EQ(bench.HandleForReason(testing::MessageOf(note)),
              i < 4 ? Reason::kNone : Reason::kTagFull);
  }
  GoInside();
}

TEST_F(NetsPartTest, AFullTagIsTriedAgainWhenItChanges) {
  // Six leased blocks of others, before the net comes to this tag.
  tags::Settings settings = testing::GateTags();
  testing::Bench other(testing::ConfigWith({}, settings));
  std::swap(bench, other);
  seqs.clear();
  Register(15);
  for (int i = 0; i < 6; ++i) {
    auto request = WriteRequest(15, kNorth, StatementIn(15, kNorth, 7).data(), 10);
    const int32_t words[] = {1, 2 + i, 3, 4, -3, 244};
    std::copy(std::begin(words), std::end(words), request.words);
    request.slot = static_cast<uint8_t>(2 + i);
    ASSERT_EQ(bench.HandleForReason(testing::MessageOf(request)), Reason::kNone);
  }
  bench.Apply(ConfigChanged{testing::GateConfig(), 7});
  Wait(1'000);
  EXPECT_EQ(tag(kNorth).slots()[0].block.author, author()) << "the slot that notes leave";
  EXPECT_EQ(counts().blocked, 2u) << "not at each instant";
  EXPECT_EQ(tag(kExit).slots()[0].block.author, author());
  Wait(20'000);
  EXPECT_EQ(tag(kNorth).slots()[1].block.author, author()) << "the leases have ended";
}

TEST_F(NetsPartTest, ACrashBetweenWritingAndReadingLosesNothing) {
  Write(15, kNorth, NetAction::kPresent, 1);
  const std::string bytes = Saved(bench.engine);
  const auto frozen = bench.engine.Freeze(FrozenState::kMaxKeptBytes);
  std::string copied;
  while (frozen->CopySome(&copied)) {
  }
  EXPECT_EQ(copied, bytes);
  Engine restored = Restored(bytes);
  EXPECT_EQ(restored.StateHash(), bench.engine.StateHash());
  EXPECT_EQ(restored.NextDeadline(), bench.engine.NextDeadline());
  bench.engine = std::move(restored);
  Wait(200);
  ExpectAck(kNorth, NetOutcome::kAccepted, 15, 1);
  EXPECT_EQ(Read(15, kNorth)->state, protocol::kNetGreen);
}

TEST_F(NetsPartTest, ItsLogLeadsToTheSameStateFromAnywhere) {
  std::mt19937_64 random(1);
  std::vector<std::pair<size_t, std::string>> states;  // how much of the log, and what came of it
  for (int step = 0; step < 3'000; ++step) {
    const auto id = static_cast<uint8_t>(15 + random() % 2);
    constexpr std::pair<uint16_t, NetAction> kSensible[] = {
        {kNorth, NetAction::kPresent},    {kNorth, NetAction::kPass},
        {kExit, NetAction::kLeave},       {kPheromone, NetAction::kTake},
        {kPheromone, NetAction::kStoreA}, {kPheromone, NetAction::kStoreB},
        {kPheromone, NetAction::kChooseA}};
    const auto& [where, action] = kSensible[random() % std::size(kSensible)];
    const bool is_odd = random() % 8 == 0;
    Write(id, is_odd ? kNorth : where, is_odd ? static_cast<NetAction>(1 + random() % 8) : action,
          static_cast<uint8_t>(step), static_cast<uint16_t>(random() % 50));
    Wait(random() % 300);
    if (random() % 1'000 == 0) {
      bench.Apply(NetsChanged{"gate"});
    }
    if (random() % 100 == 0) {
      states.emplace_back(bench.log.size(), Saved(bench.engine));
    }
  }
  EXPECT_GT(counts().firings, 50u) << "since the last reset";
  EXPECT_GT(counts().exceptions, 50u);
  const std::string at_end = Saved(bench.engine);
  states.emplace_back(0, "");
  for (const auto& [from, state] : states) {
    Engine engine = state.empty() ? Engine() : Restored(state);
    uint64_t sequence = from;
    for (size_t i = from; i < bench.log.size(); ++i) {
      ByteWriter writer;
      EncodeEvent(bench.log[i].second, &writer);
      ByteReader reader(writer.bytes());
      std::vector<Outgoing> out;
      engine.Apply(++sequence, {bench.log[i].first, 0}, DecodeEvent(&reader), &out);
    }
    ASSERT_EQ(Saved(engine), at_end);
    ASSERT_EQ(engine.StateHash(), bench.engine.StateHash());
  }
}

TEST_F(NetsPartTest, AResetBeginsAnew) {
  GoInside();
  Write(16, kNorth, NetAction::kPresent, 1);
  bench.Apply(NetsChanged{"gate"});
  Wait(200);
  EXPECT_EQ(net().marking(), petri::LiveNet(net().shared_rules()).marking());
  EXPECT_EQ(counts().firings, 0u) << "what robots had left is erased";
  ExpectAck(kNorth, NetOutcome::kNone, 0, 0);
  EXPECT_EQ(bench.engine.Check(NetsChanged{"get"}).error(), "there is no net \"get\"");
}

TEST_F(NetsPartTest, AnotherLawGoesOnWithWhatThereIs) {
  GoInside();
  Write(15, kPheromone, NetAction::kStoreA, 103, 30);
  Wait(200);
  const uint64_t since_ms = net().trails().a.since_ms;
  petri::LiveSettings settings = LiveGateSettings();
  settings.rate_milli = 4'000;
  Wait(since_ms + 10'000 - Now());
  const EngineConfig config = testing::ConfigWith({settings});
  ASSERT_TRUE(bench.engine.CheckConfig(config).ok());
  bench.Apply(ConfigChanged{config, 7});
  EXPECT_EQ(net().trails().a, (petri::Trail{20'000, since_ms + 10'000}));
  EXPECT_EQ(counts().deposits, 1u);
  Wait(4'900);
  EXPECT_EQ(Read(15, kPheromone)->state, protocol::kNetAdviceA);
  Wait(400);
  EXPECT_EQ(Read(15, kPheromone)->state, 0);
}

TEST_F(NetsPartTest, AnotherNetOfThatNameIsRefusedAndOneOfAnotherNameBegins) {
  petri::LiveSettings settings = LiveGateSettings();
  settings.net.places[0].tokens = 3;
  EXPECT_EQ(bench.engine.CheckConfig(testing::ConfigWith({settings})).error(),
            "net \"gate\" is running, and robots are on their way in it, but its file, its "
            "parameters or the robots' net are others now; undo that, or give it another name to "
            "begin anew");
  settings.name = "other";
  tags::Settings tags = testing::GateTags();
  tags.privileged.emplace_back("net:other");
  const EngineConfig config = testing::ConfigWith({settings}, tags);
  ASSERT_TRUE(bench.engine.CheckConfig(config).ok());
  bench.Apply(ConfigChanged{config, 7});
  EXPECT_EQ(tag(kNorth).used(), 0u) << "the blocks of the first one are gone";
  Wait(200);
  EXPECT_EQ(nets().nets().count("gate"), 0u);
  EXPECT_EQ(tag(kNorth).slots()[0].block.author, *store().symbols().RobotOf("net:other"));
}

TEST_F(NetsPartTest, AConfigurationThatItCannotHaveIsRefused) {
  const auto error = [&](const std::vector<petri::LiveSettings>& nets, const tags::Settings& tags) {
    const Status status = bench.engine.CheckConfig(testing::ConfigWith(nets, tags));
    return status.ErrorOr("");
  };
  const petri::LiveSettings gate = LiveGateSettings();
  tags::Settings tags = testing::GateTags();
  tags.tags.pop_back();
  EXPECT_EQ(error({gate}, tags),
            "net \"gate\": there is no tag \"pheromone\", which it calls \"P\"");
  tags = testing::GateTags();
  tags.tags[1].slots = 3;
  EXPECT_EQ(error({gate}, tags), "net \"gate\": tag \"exit\" has 3 slots, expected at least 4");
  tags = testing::GateTags();
  tags.privileged = {"operator"};
  EXPECT_EQ(error({gate}, tags), "net \"gate\": its author \"net:gate\" is not privileged");
  tags = testing::GateTags();
  EXPECT_EQ(error({gate, gate}, tags), "net \"gate\": expected a name that no other net has");
  petri::LiveSettings second = gate;
  second.name = "second";
  tags.privileged.emplace_back("net:second");
  EXPECT_EQ(error({gate, second}, tags),
            "net \"second\": tag \"north\" is used by net \"gate\" already");
  second = gate;
  second.net.transitions[0].owner = "";
  EXPECT_EQ(error({second}, testing::GateTags()),
            "net \"gate\": transition \"arrive\": owner: found \"\", expected robot or "
            "environment");
  second = gate;
  second.period_ms = 1;
  EXPECT_EQ(error({second}, testing::GateTags()), "nets[0].period_ms is 1, expected 2 to 60000");
}

TEST_F(NetsPartTest, AStateOfOtherNetsIsRefused) {
  const std::string bytes = Saved(bench.engine);
  std::string other = bytes;
  other.replace(other.rfind("\4\0\0\0gate", std::string::npos, 8), 8, "\4\0\0\0gote", 8);
  ByteReader reader(other);
  EXPECT_EQ(Engine::Restore(&reader).error(), "net \"gate\" is missing in the state");
}

}  // namespace
}  // namespace pheromone::engine
