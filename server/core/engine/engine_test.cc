#include "server/core/engine/engine.h"

#include <gtest/gtest.h>

#include <random>

#include "server/base/hash.h"
#include "server/core/engine/testing/bench.h"
#include "server/core/engine/wire_units.h"

namespace pheromone::engine {
namespace {

using protocol::Reason;
using testing::Bench;
using testing::Deposit;
using testing::Hello;
using testing::MessageOf;
using testing::Sense;
using testing::Trace;

protocol::SenseAnswer SenseAt(Bench* bench, int32_t x, int32_t y, uint16_t heading) {
  protocol::SenseAnswer answer;
  EXPECT_TRUE(protocol::Decode(bench->Handle(Sense(1, x, y, heading)).value(), &answer));
  return answer;
}

TEST(Engine, AnswersSenseWithTheFieldsIntensities) {
  Bench bench;
  bench.Handle(Hello(1, 1));
  bench.Handle(Deposit(1, 1, 5200, 5100, 8));
  const auto p = bench.engine.field().Sense(1, {{5'000'000, 5'000'000}, 2000}, bench.now_ms);
  const protocol::SenseAnswer answer = SenseAt(&bench, 5000, 5000, 2000);
  EXPECT_EQ(answer.left, p->left);
  EXPECT_EQ(answer.right, p->right);
  EXPECT_GT(answer.left, answer.right);
}

TEST(Engine, SenseWideAnswersTheSameAsSense) {
  Bench bench;
  bench.Handle(Hello(1, 1));
  bench.Handle(Deposit(1, 1, 5200, 5100, 8));
  protocol::SenseAnswer wide;
  const auto request = MessageOf(protocol::SenseRequest{1, 1, true, {5000, 5000, 2000}});
  ASSERT_TRUE(protocol::Decode(*bench.Handle(request), &wide));
  const protocol::SenseAnswer narrow = SenseAt(&bench, 5000, 5000, 2000);
  EXPECT_TRUE(wide.wide);
  EXPECT_EQ(wide.left, narrow.left);
  EXPECT_EQ(wide.right, narrow.right);
}

TEST(Engine, SenseNeedsNoHelloAndChangesNothing) {
  Bench bench;
  const uint64_t hash = bench.engine.StateHash();
  for (int i = 0; i < 1000; ++i) {
    bench.now_ms += 1000;
    EXPECT_EQ(bench.HandleForReason(Sense(static_cast<uint8_t>(1 + i % 254))), Reason::kNone);
  }
  EXPECT_EQ(bench.engine.StateHash(), hash);
}

// Two servers apply the same changes; one of them answers a million queries in between.
TEST(Engine, AMillionSensesLeaveNoTrace) {
  Bench asked;
  Bench left_alone;
  constexpr int kChanges = 100;
  for (int i = 0; i < kChanges; ++i) {
    const auto seq = static_cast<uint8_t>(i);
    const auto x = static_cast<int16_t>(4500 + 10 * i);
    for (Bench* bench : {&asked, &left_alone}) {
      bench->now_ms += 777;
      bench->Handle(Hello(1, 1));
      bench->Handle(Deposit(1, seq, x, 5000, 3));
      bench->Apply(Advance{});
    }
    for (int j = 0; j < 1'000'000 / kChanges; ++j) {
      asked.Handle(Sense(1, 4000 + j % 2000, 5000, static_cast<uint16_t>(j)));
    }
    ASSERT_EQ(asked.engine.StateHash(), left_alone.engine.StateHash());
  }
  EXPECT_EQ(asked.log.size(), left_alone.log.size());
}

TEST(Engine, TraceSensesBeforeItLeavesItsQuantum) {
  Bench bench;
  bench.Handle(Hello(1, 1));
  protocol::TraceAnswer first;
  protocol::TraceAnswer second;
  ASSERT_TRUE(protocol::Decode(*bench.Handle(Trace(1, 1)), &first));
  ASSERT_TRUE(protocol::Decode(*bench.Handle(Trace(1, 2)), &second));
  EXPECT_EQ(first.left, 0);
  EXPECT_GT(second.left, 0);
  EXPECT_EQ(second.seq, 2);
}

TEST(Engine, PingComesBackAsItWasSent) {
  Bench bench;
  for (uint8_t length = 0; length <= protocol::kMaxPing; ++length) {
    protocol::Ping ping;
    ping.id = 9;
    ping.length = length;
    for (uint8_t i = 0; i < length; ++i) {
      ping.payload[i] = static_cast<uint8_t>(0x10 + i);
    }
    protocol::Ping echo;
    ASSERT_TRUE(protocol::Decode(*bench.Handle(MessageOf(ping)), &echo));
    EXPECT_TRUE(echo.answer);
    EXPECT_EQ(echo.length, length);
    EXPECT_TRUE(std::equal(ping.payload, ping.payload + length, echo.payload));
  }
}

TEST(Engine, NeverAnswersEchoesNobodyAndStrangersLinks) {
  Bench bench;
  bench.Handle(Hello(1, 1));
  for (int opcode = 0x80; opcode <= 0xFF; ++opcode) {
    protocol::Message message = Sense(1);
    message.opcode = static_cast<uint8_t>(opcode);
    EXPECT_FALSE(bench.Handle(message).has_value()) << opcode;
  }
  EXPECT_FALSE(bench.Handle(Sense(0)).has_value());
  EXPECT_FALSE(bench.Handle(Sense(0xFF)).has_value());
  EXPECT_FALSE(bench.Handle(Sense(1), 2).has_value());
  protocol::Message zero = Sense(1);
  zero.opcode = 0;
  EXPECT_FALSE(bench.Handle(zero).has_value());
}

TEST(Engine, UnknownOpcodesAreRefusedByName) {
  Bench bench;
  int refused = 0;
  for (int opcode = 1; opcode < 0x80; ++opcode) {
    if (protocol::LengthOf(static_cast<uint8_t>(opcode)).known) {
      continue;
    }
    protocol::Message message;
    message.id = 5;
    message.opcode = static_cast<uint8_t>(opcode);
    protocol::ErrorAnswer error;
    ASSERT_TRUE(protocol::Decode(bench.Handle(message).value(), &error)) << opcode;
    EXPECT_EQ(error.refused_opcode, opcode);
    EXPECT_EQ(error.reason, Reason::kUnknownOpcode);
    ++refused;
  }
  // 0x10, 0x20, 0x30, 0x60 (type 0), 0x40, 0x47-0x4F, 0x50, 0x53-0x5F, 0x70, 0x73-0x7F.
  EXPECT_EQ(refused, 4 + 10 + 14 + 14);
}

TEST(Engine, EveryOtherLengthIsRefused) {
  Bench bench;
  for (int opcode = 1; opcode < 0x80; ++opcode) {
    const protocol::LengthRule rule = protocol::LengthOf(static_cast<uint8_t>(opcode));
    if (!rule.known || opcode == protocol::kCommandAck) {
      continue;  // an ACK is never answered, whatever its length
    }
    for (int length = 0; length <= protocol::kMaxData; ++length) {
      if (length >= rule.least && length <= rule.most) {
        continue;
      }
      protocol::Message message;
      message.id = 5;
      message.opcode = static_cast<uint8_t>(opcode);
      message.length = static_cast<uint8_t>(length);
      message.data[0] = 0x77;
      protocol::ErrorAnswer error;
      ASSERT_TRUE(protocol::Decode(bench.Handle(message).value(), &error));
      EXPECT_EQ(error.reason, Reason::kBadLength);
      const bool has_seq = protocol::IsMutating(message.opcode) && length > 0;
      EXPECT_EQ(error.seq, has_seq ? 0x77 : 0) << opcode << ' ' << length;
    }
  }
}

TEST(Engine, SaysWhyAPoseOrValueIsRefused) {
  Bench bench;
  bench.Handle(Hello(1, 1));
  EXPECT_EQ(bench.HandleForReason(Sense(1, 10'001, 0)), Reason::kOffTheMap);
  EXPECT_EQ(bench.HandleForReason(Sense(1, 0, -1)), Reason::kOffTheMap);
  EXPECT_EQ(bench.HandleForReason(Sense(1, 10'000, 10'000)), Reason::kNone);
  EXPECT_EQ(bench.HandleForReason(Sense(1, 0, 0, 0, 3)), Reason::kUnknownPheromone);
  EXPECT_EQ(bench.HandleForReason(Deposit(1, 1, 0, 0, 1, 3)), Reason::kUnknownPheromone);
  EXPECT_EQ(bench.HandleForReason(Deposit(1, 2, 0, 0, 0)), Reason::kBadValue);
  EXPECT_EQ(bench.HandleForReason(Deposit(1, 5, -1, 0, 0)), Reason::kOffTheMap);  // place first
  EXPECT_EQ(bench.HandleForReason(Deposit(1, 6, -1, 0, 0, 3)), Reason::kUnknownPheromone);
  EXPECT_EQ(bench.HandleForReason(Trace(1, 7, -1, 0)), Reason::kOffTheMap);
  const auto event =
      MessageOf(protocol::EventReport{1, 8, static_cast<protocol::EventCode>(13), 0});
  EXPECT_EQ(bench.HandleForReason(event), Reason::kBadValue);
}

TEST(Engine, AFullMapIsSaid) {
  EngineConfig config = testing::SmallConfig();
  config.field.memory_bytes =
      field::CellMap::kTileBytes + field::CellMap::kLeafBytes +
      field::CellMap::TopBytes(config.field.map.columns(), config.field.map.rows());
  Bench bench(config);
  bench.Handle(Hello(1, 1));
  EXPECT_EQ(bench.HandleForReason(Deposit(1, 1, 0, 0)), Reason::kNone);
  EXPECT_EQ(bench.HandleForReason(Deposit(1, 2, 5000, 5000)), Reason::kMapFull);
  EXPECT_EQ(bench.HandleForReason(Trace(1, 3, 5000, 5000)), Reason::kMapFull);
  EXPECT_EQ(bench.HandleForReason(Sense(1, 5000, 5000)), Reason::kNone);
}

TEST(Engine, KeepsTheLastEventOfARobot) {
  Bench bench;
  bench.Handle(Hello(1, 1));
  const auto event = MessageOf(protocol::EventReport{1, 4, protocol::EventCode::kFailSafeStop, -3});
  protocol::EventAck ack;
  ASSERT_TRUE(protocol::Decode(*bench.Handle(event), &ack));
  EXPECT_EQ(ack.seq, 4);
  const auto& last = bench.engine.robots().Find(0, 1)->last_event;
  ASSERT_TRUE(last.has_value());
  EXPECT_EQ(last->code, protocol::EventCode::kFailSafeStop);
  EXPECT_EQ(last->argument, -3);
}

TEST(Engine, ScalesSaturatedIntensitiesKeepingTheirRatio) {
  EngineConfig config = testing::SmallConfig();
  config.field.pheromones[1].quantum_micro = 1'000'000;
  config.field.pheromones[1].max_count = 60'000;
  Bench bench(config);
  bench.Handle(Hello(1, 1));
  for (int i = 0; i < 100; ++i) {
    bench.Handle(Deposit(1, static_cast<uint8_t>(2 * i), 5200, 5100, 255, 2));
    bench.Handle(Deposit(1, static_cast<uint8_t>(2 * i + 1), 5200, 4700, 100, 2));
  }
  const auto p = bench.engine.field().Sense(2, {{5'000'000, 5'000'000}, 0}, bench.now_ms);
  ASSERT_GT(p->left, 32767);
  protocol::SenseAnswer answer;
  ASSERT_TRUE(protocol::Decode(*bench.Handle(Sense(1, 5000, 5000, 0, 2)), &answer));
  EXPECT_EQ(answer.left, 32767);
  EXPECT_EQ(answer.right, p->right * 32767 / p->left);
}

// Random requests of several robots, with commands, time and changes of the configuration between.
void Drive(Bench* bench, uint32_t seed, int steps) {
  std::mt19937 random(seed);
  for (int i = 0; i < steps; ++i) {
    bench->now_ms += random() % 500;
    const auto id = static_cast<uint8_t>(1 + random() % 6);
    const auto seq = static_cast<uint8_t>(random());
    const auto x = static_cast<int16_t>(random() % 10'200);
    const auto y = static_cast<int16_t>(random() % 10'000);
    const auto type = static_cast<uint8_t>(1 + random() % 3);
    const auto link = static_cast<LinkIndex>(random() % 2);
    switch (random() % 10) {
      case 0:
        bench->Handle(Hello(id, static_cast<uint16_t>(random() % 3)), link);
        break;
      case 1:
      case 2:
        bench->Handle(Deposit(id, seq, x, y, static_cast<uint8_t>(random() % 4), type), link);
        break;
      case 3:
      case 4:
        bench->Handle(Trace(id, seq, x, y, static_cast<uint16_t>(random()), type), link);
        break;
      case 5: {
        CommandIssued issued;
        issued.id = id;
        issued.link = link;
        if (bench->engine.Check(issued).ok()) {
          bench->Apply(issued);
        }
        break;
      }
      case 6:
        bench->Apply(Advance{});
        break;
      case 7: {
        const PoseObserved observed{
            link, id, {{x * int64_t{1000}, y * int64_t{1000}}, seq}, seq * 100u};
        if (bench->engine.SaidHello(link, id)) {
          bench->Apply(observed);
        }
        break;
      }
      case 8: {
        const FieldEdited edited{{.type = type,
                                  .shape = field::FieldEdit::Shape::kStroke,
                                  .action = static_cast<field::FieldEdit::Action>(seq % 3),
                                  .level = seq,
                                  .radius_um = 300'000,
                                  .points = {{x * int64_t{1000}, y * int64_t{1000}}}}};
        if (bench->engine.CheckEdit(edited.edit).ok()) {
          bench->Apply(edited);
        }
        break;
      }
      default:
        if (random() % 50 == 0) {
          EngineConfig config = testing::SmallConfig();
          config.field.pheromones[0].tau_ms = static_cast<int64_t>(1'000 + random() % 30'000);
          config.frames = {MakeFrame("radio-a", id, {x * int64_t{100}, y * int64_t{100}}, seq)};
          bench->Apply(ConfigChanged{config, static_cast<uint16_t>(random())});
        }
    }
  }
}

TEST(StateHash, TheSameEventsGiveTheSameStateAndTheSameAnswers) {
  Bench bench;
  Drive(&bench, 1, 20'000);
  Engine replayed;
  uint64_t sequence = 0;
  size_t answers = 0;
  for (const auto& [now_ms, event] : bench.log) {
    std::vector<Outgoing> out;
    ++sequence;
    replayed.Apply(sequence, {now_ms, 0}, event, &out);
    answers += out.size();
  }
  EXPECT_GT(answers, 1'000u);
  EXPECT_EQ(replayed.StateHash(), bench.engine.StateHash());
}

TEST(StateHash, OneEventLessIsAnotherState) {
  Bench bench;
  Drive(&bench, 2, 2'000);
  const uint64_t before = bench.engine.StateHash();
  bench.Handle(Hello(1, 9));
  bench.Handle(Deposit(1, 1));
  EXPECT_NE(bench.engine.StateHash(), before);
}

// The parts that are kept incrementally, recomputed from a dump of all live objects.
TEST(StateHash, TheKeptSumsEqualThoseOfADump) {
  Bench bench;
  for (uint32_t round = 0; round < 20; ++round) {
    Drive(&bench, 100 + round, 500);
    const Engine& engine = bench.engine;
    uint64_t nodes = 0;
    engine.field().ForEach([&](uint8_t type, field::NodeIndex node, field::NodeState state) {
      nodes += field::Field::NodeHash(*engine.field().FindLaw(type), node, state);
    });
    const field::SweepState& sweep = engine.field().sweep();
    nodes += Hash64({'W', sweep.type, static_cast<uint64_t>(sweep.leaf), sweep.earliest_ms,
                     sweep.cycle_ms, sweep.next_ms}) +
             engine.field().history().Hash();
    EXPECT_EQ(nodes, engine.field().hash());
    uint64_t robots = 0;
    engine.robots().ForEach([&](LinkIndex link, uint8_t id, const RobotState& robot) {
      robots += RobotTable::Hash(engine.config().links[link].name, id, robot);
    });
    EXPECT_EQ(robots, engine.robots().hash());
    size_t count = 0;
    engine.robots().ForEachOf(0, [&](auto&&...) { ++count; });
    EXPECT_GT(count, 0u);
  }
}

TEST(ConfigChange, RefusesAnotherGeometryWithAReason) {
  Bench bench;
  EngineConfig config = testing::SmallConfig();
  config.field.map.cell_um = 50'000;
  const Status status = bench.engine.CheckConfig(config);
  ASSERT_FALSE(status.ok());
  EXPECT_NE(status.error().find("cells of 0.05 m"), std::string::npos);
}

TEST(ConfigChange, ALinkThatReturnsFindsItsRobotsAgain) {
  Bench bench;
  bench.Handle(Hello(1, 1), 1);
  bench.Handle(Deposit(1, 5), 1);
  EngineConfig without = testing::SmallConfig();
  without.links.pop_back();
  bench.Apply(ConfigChanged{without, 8});
  EXPECT_FALSE(bench.Handle(Sense(1), 1).has_value());
  bench.Apply(ConfigChanged{testing::SmallConfig(), 9});
  protocol::HelloAnswer answer;
  ASSERT_TRUE(protocol::Decode(*bench.Handle(Hello(1, 1), 1), &answer));
  EXPECT_EQ(answer.last_seq, 5);
}

}  // namespace
}  // namespace pheromone::engine
