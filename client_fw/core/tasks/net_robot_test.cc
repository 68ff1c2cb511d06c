// What a robot with a net tells and awaits at tags, without radio.
#include "client_fw/core/tasks/net_robot.h"

#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "client_fw/core/testing/net_robot_harness.h"
#include "protocol/byte_order.h"
#include "protocol/crc16.h"

namespace pheromone {
namespace client {
namespace {

using protocol::NetAction;
using protocol::NetRecordFault;
using protocol::Reason;

TEST_F(NetRobotTest, RoundTripsOverBothTrailsTellWhatTheNetSays) {
  Advise(protocol::kNetAdviceA);
  const std::vector<std::string> a = TripA();
  const std::vector<uint32_t> places_a = {At(2), At(3), At(4), At(5), At(6),
                                          At(7), At(8), At(9), At(1)};
  const std::vector<uint8_t> lines_a = {1, 2, 2, 2, 3, 3, 3, 6, 1};
  Run(1000);
  EXPECT_EQ(1, robot_->line());
  for (size_t i = 0; i < a.size(); ++i) {
    Visit(a[i]);
    EXPECT_EQ(places_a[i], robot_->marking()) << a[i];
    EXPECT_EQ(places_a[i], At(robot_->place())) << a[i];
    EXPECT_EQ(lines_a[i], robot_->line()) << a[i];
    EXPECT_TRUE(robot_->drives()) << a[i];
    const bool carries = i >= 4 && i < 7;
    EXPECT_EQ(carries ? 100 : 0, robot_->state().energy) << a[i];
  }
  EXPECT_EQ(kToldOfA, Told());
  EXPECT_EQ(1, robot_->state().trips);
  EXPECT_EQ(900, bench_.source);

  bench_.handled.clear();
  Advise(protocol::kNetAdviceB);
  const std::vector<std::string> b = TripB();
  const std::vector<uint32_t> places_b = {At(2),  At(3),  At(10), At(11), At(12),
                                          At(13), At(14), At(9),  At(1)};
  const std::vector<uint8_t> lines_b = {1, 4, 4, 4, 5, 5, 5, 6, 1};
  for (size_t i = 0; i < b.size(); ++i) {
    Visit(b[i]);
    EXPECT_EQ(places_b[i], robot_->marking()) << b[i];
    EXPECT_EQ(lines_b[i], robot_->line()) << b[i];
  }
  EXPECT_EQ(kToldOfB, Told());
  EXPECT_EQ(2, robot_->state().trips);
  const NetCounters& counters = robot_->counters();
  for (const int trail : {0, 1}) {
    EXPECT_EQ(1u, counters.chosen[trail]);
    EXPECT_EQ(1u, counters.stored[trail]);
    EXPECT_EQ(100u, counters.amount[trail]);
  }
  EXPECT_EQ(200u, counters.taken);
  EXPECT_EQ(0u, robot_->counters().exceptions);
  EXPECT_EQ(1, bench_.names);
  std::set<uint8_t> seqs;
  for (const NaiveRecord& it : bench_.handled) {
    seqs.insert(it.seq);
  }
  EXPECT_EQ(bench_.handled.size(), seqs.size());
}

TEST_F(NetRobotTest, RecordsHaveAmountAndEnergy) {
  Advise(protocol::kNetAdviceA);
  bench_.source = 70;
  VisitAll(TripA());
  std::vector<std::vector<int>> figures;
  for (const NaiveRecord& it : bench_.handled) {
    figures.push_back({it.amount, it.energy});
  }
  const std::vector<std::vector<int>> expected = {{0, 0},  {0, 0},  {0, 0},   {0, 0},
                                                  {0, 0},  {0, 0},  {100, 0}, {0, 70},
                                                  {0, 70}, {0, 70}, {70, 70}, {0, 0}};
  EXPECT_EQ(expected, figures);
}

TEST_F(NetRobotTest, RefusalIsAnExceptionThatCanBeTriedAgain) {
  Advise(protocol::kNetAdviceA);
  // The place before each record of trail A, and where the robot is told to.
  const std::vector<uint32_t> before = {At(1), At(2), At(3), At(3), At(4), At(5),
                                        At(5), At(6), At(7), At(8), At(8), At(9)};
  for (size_t refused = 0; refused < kToldOfA.size(); ++refused) {
    SCOPED_TRACE(kToldOfA[refused]);
    bench_ = NaiveBench();
    memory_ = NetMemory();
    Start();
    Advise(protocol::kNetAdviceA);
    bench_.accepts = [&](const NaiveRecord&) { return bench_.handled.size() != refused + 1; };
    for (const std::string& tag : TripA()) {
      Visit(tag);
      if (held_) {
        ExpectException(NetFault::kRefused, tag, before[refused]);
        if (tag == "P") {
          Advise(protocol::kNetAdviceA);
        }
        Release();
        if (bench_.handled.back().action == NetAction::kPass) {
          bench_.tags[bench_.tag(tag)].shown.state = protocol::kNetGreen;
          bench_.Show(bench_.at(tag));
        }
        Visit(tag);
      }
    }
    std::vector<std::string> expected = kToldOfA;
    expected.insert(expected.begin() + static_cast<std::ptrdiff_t>(refused), kToldOfA[refused]);
    EXPECT_EQ(expected, Told());
    EXPECT_EQ(At(1), robot_->marking());
    EXPECT_EQ(1u, robot_->counters().exceptions);
    EXPECT_EQ(1, robot_->state().trips);
  }
}

// Candidates that are not enabled: all pairs of a place and a tag but those of the net.
TEST_F(NetRobotTest, OnlyTheFifteenTransitionsOfTheNetAreFired) {
  const std::vector<std::string> trips[] = {TripA(), TripB()};
  int legal = 0;
  int exceptions = 0;
  std::set<std::pair<uint32_t, std::string>> pairs;
  for (int trail = 0; trail < 2; ++trail) {
    for (size_t way = 0; way < trips[trail].size(); ++way) {
      for (const auto& [number, tag] : NaiveBench().tags) {
        bench_ = NaiveBench();
        memory_ = NetMemory();
        Start();
        held_ = false;
        exception_tags_.clear();
        Advise(trail == 0 ? protocol::kNetAdviceA : protocol::kNetAdviceB);
        for (size_t i = 0; i < way; ++i) {
          Visit(trips[trail][i]);
        }
        const uint32_t place = robot_->marking();
        // At p3 the choice decides which one is enabled.
        const bool other = !pairs.insert({place, tag.name}).second && place != At(3);
        Visit(tag.name);
        if (robot_->marking() != place) {
          EXPECT_EQ(trips[trail][way], tag.name);
          legal += other ? 0 : 1;
        } else {
          ExpectException(NetFault::kNotEnabled, tag.name, place);
          exceptions += other ? 0 : 1;
        }
      }
    }
  }
  EXPECT_EQ(15, legal);
  // p3 is tried with each choice: 10 tags twice, and N5 and N6 where the other was chosen.
  EXPECT_EQ(153 + 12, exceptions);
}

TEST_F(NetRobotTest, TagsThatAreNoneOfTheBenchAreIgnoredAndReadOnce) {
  NaiveTag* const empty = &bench_.tags[90];
  empty->name = "empty";
  NaiveTag* const fact = &bench_.tags[91];
  fact->name = "fact";
  const uint8_t statement[protocol::kNetStatementSize] = {1, 0, 0, 0, 2};
  fact->Put(0, kOtherRobot, statement);
  fact->Put(3, kOtherRobot, statement);
  bench_.in_range = {90, 91};
  Run(3000);
  EXPECT_TRUE(robot_->drives());
  EXPECT_EQ(3, bench_.reads);  // one of the empty tag, two of the other
  EXPECT_EQ(0u, robot_->counters().exceptions);
  bench_.in_range = {90, 91, bench_.tag("N1")};
  Run(2000);
  EXPECT_EQ(At(2), robot_->marking());
}

TEST_F(NetRobotTest, BadTriggerVectorsStopTheRobot) {
  struct Damage {
    std::string name;
    NetRecordFault fault;
    std::function<void(uint8_t*)> make;
  };
  const auto with_crc = [](uint8_t* statement) {
    const uint16_t crc = protocol::Crc16(statement + 4, 18);
    protocol::PutU16(statement + 22, crc);
  };
  const std::vector<Damage> damages = {
      {"a bit", NetRecordFault::kCrc, [](uint8_t* it) { it[11] ^= 1; }},
      {"version", NetRecordFault::kVersion, [](uint8_t* it) { it[4] = 2; }},
      {"kind", NetRecordFault::kKind,
       [&](uint8_t* it) {
         it[5] = 2;
         with_crc(it);
       }},
      {"hash", NetRecordFault::kHash,
       [&](uint8_t* it) {
         it[6] ^= 0x80;
         with_crc(it);
       }},
      {"count", NetRecordFault::kValue,
       [&](uint8_t* it) {
         it[10] = 12;
         with_crc(it);
       }},
      {"no such transition", NetRecordFault::kValue, [&](uint8_t* it) {
         it[11] = 16;
         with_crc(it);
       }}};
  for (const Damage& damage : damages) {
    SCOPED_TRACE(damage.name);
    bench_ = NaiveBench();
    held_ = false;
    Run(400);
    damage.make(bench_.at("N1")->slots[0].statement);
    Visit("N1");
    EXPECT_EQ(damage.fault, robot_->record_fault());
    ExpectException(NetFault::kRecord, "N1", At(1));
    EXPECT_TRUE(bench_.handled.empty());
    bench_.in_range.clear();
    Release();
  }
}

TEST_F(NetRobotTest, BadOutcomesStopTheRobot) {
  for (const int byte : {4, 5, 6, 12, 23}) {
    SCOPED_TRACE(byte);
    bench_ = NaiveBench();
    memory_ = NetMemory();
    Start();
    held_ = false;
    bench_.in_range = {bench_.tag("N1")};
    ASSERT_TRUE(RunUntilAsked(protocol::kTagWrite));
    bench_.Serve(robot_->exchange());
    bench_.at("N1")->slots[1].statement[byte] ^= 1;
    // Until the environment has written it again.
    for (int i = 0; i < 100; ++i) {
      Turn();
      if (Asks()) {
        bench_.Serve(robot_->exchange());
      }
    }
    ExpectException(NetFault::kRecord, "N1", At(1));
    bench_.Act();
    Release();
    Run(2000);
    EXPECT_EQ(At(2), robot_->marking());
    EXPECT_EQ((std::vector<std::string>{"N1 present 1", "N1 pass 1"}), Told());
  }
}

TEST_F(NetRobotTest, MissingTriggerVectorIsAwaited) {
  bench_.at("N1")->Erase(0);
  bench_.in_range = {bench_.tag("N1")};
  Run(3000);
  EXPECT_FALSE(robot_->drives());
  EXPECT_EQ(NetFault::kNone, robot_->fault());
  bench_.at("N1")->Put(0, kNaiveReader, NaiveBench().at("N1")->slots[0].statement);
  Run(1000);
  EXPECT_EQ(At(2), robot_->marking());

  Visit("N1");
  bench_.at("P")->Erase(0);
  bench_.in_range = {bench_.tag("P")};
  Run(20000);
  ExpectException(NetFault::kMissing, "P", At(2));
}

TEST_F(NetRobotTest, WaitsForItsOwnGreen) {
  bench_.shows_green = false;
  Visit("N1");
  Run(20000);
  EXPECT_EQ(At(2), robot_->marking());
  EXPECT_EQ((std::vector<std::string>{"N1 present 1"}), Told());
  protocol::EnvironmentRecord* const shown = &bench_.at("N1")->shown;
  shown->state = protocol::kNetGreen;
  shown->robot = kOtherRobot;
  Run(5000);
  EXPECT_FALSE(robot_->drives());
  shown->robot = kNaiveRobot;
  Run(2000);
  EXPECT_TRUE(robot_->drives());
  EXPECT_EQ((std::vector<std::string>{"N1 present 1", "N1 pass 1"}), Told());
}

TEST_F(NetRobotTest, ChoosesForTheAdviceThatIsThereWhenItWrites) {
  Advise(protocol::kNetAdviceA);
  Visit("N1");
  bench_.in_range = {bench_.tag("P")};
  int times = 0;
  bench_.before_write = [&] {
    if (++times == 1) {
      Advise(protocol::kNetAdviceB);
    }
  };
  Run(3000);
  EXPECT_EQ(2, times);
  EXPECT_EQ("P choose B 2", Told().back());
  EXPECT_EQ(4, robot_->line());
}

TEST_F(NetRobotTest, WithoutAdviceItTakesEitherTrail) {
  std::map<NetAction, int> taken;
  for (int i = 0; i < 40; ++i) {
    Advise(0);
    VisitAll({"N1", "P"});
    const NetAction choice = robot_->state().choice;
    ++taken[choice];
    const std::vector<std::string> trip = choice == NetAction::kChooseA ? TripA() : TripB();
    VisitAll({trip.begin() + 2, trip.end()});
  }
  EXPECT_EQ(40, robot_->state().trips);
  EXPECT_GT(taken[NetAction::kChooseA], 8);
  EXPECT_GT(taken[NetAction::kChooseB], 8);
}

TEST_F(NetRobotTest, ExplorationDisregardsTheAdvice) {
  for (const uint8_t percent : std::vector<uint8_t>{0, 25, 100}) {
    parameters_.explore_percent = percent;
    memory_ = NetMemory();
    Start();
    int against = 0;
    for (int i = 0; i < 100; ++i) {
      Advise(protocol::kNetAdviceA);
      VisitAll({"N1", "P"});
      const bool a = robot_->state().choice == NetAction::kChooseA;
      against += a ? 0 : 1;
      const std::vector<std::string> trip = a ? TripA() : TripB();
      VisitAll({trip.begin() + 2, trip.end()});
    }
    EXPECT_GE(against, percent * 30 / 100) << int{percent};
    EXPECT_LE(against, percent * 70 / 100) << int{percent};
  }
}

TEST_F(NetRobotTest, DepositsWhatItHasNotBurned) {
  Advise(protocol::kNetAdviceA);
  parameters_.rule = DepositRule::kScaled;
  parameters_.burn_per_s = 3;
  Start();
  VisitAll({"N1", "P", "N5", "S1"});
  bench_.in_range = {bench_.tag("Src")};
  while (robot_->state().energy == 0) {
    Run(20);
  }
  bench_.in_range.clear();
  const uint32_t from_ms = now_ms_;
  Run(400);
  VisitAll({"S3", "N2"});
  bench_.in_range = {bench_.tag("P")};
  ASSERT_TRUE(RunUntilAsked(protocol::kTagWrite));
  const uint32_t seconds = (now_ms_ - from_ms) / 1000;
  Run(2000);
  ASSERT_EQ(NetAction::kStoreA, bench_.handled.back().action);
  EXPECT_EQ(100 - 3 * seconds, bench_.handled.back().amount);

  // A loop that stands still for a while has burned, too.
  Visit("N4");
  Advise(protocol::kNetAdviceA);
  VisitAll({"N1", "P", "N5", "S1", "Src"});
  ASSERT_LT(robot_->state().carried_s, 5);
  now_ms_ += 20000;
  VisitAll({"S3", "N2", "P"});
  EXPECT_LT(bench_.handled.back().amount, 100 - 3 * 20);
  EXPECT_GT(bench_.handled.back().amount, 1);

  // At least something of anything.
  Visit("N4");
  Advise(protocol::kNetAdviceA);
  VisitAll({"N1", "P", "N5", "S1", "Src"});
  Run(60000);
  VisitAll({"S3", "N2", "P"});
  EXPECT_EQ(1, bench_.handled.back().amount);
  bench_.source = 0;
  Visit("N4");
  Advise(protocol::kNetAdviceA);
  VisitAll({"N1", "P", "N5", "S1", "Src", "S3", "N2", "P"});
  ASSERT_EQ(NetAction::kStoreA, bench_.handled.back().action);
  EXPECT_EQ(0, bench_.handled.back().amount);
}

TEST_F(NetRobotTest, NearestTagIsCapturedAndNotAgainUntilItIsLeft) {
  bench_.in_range = {bench_.tag("N1"), bench_.tag("S1"), bench_.tag("N6"), bench_.tag("P")};
  bench_.distance = {{bench_.tag("N1"), -150},
                     {bench_.tag("S1"), 151},
                     {bench_.tag("N6"), 1000},
                     {bench_.tag("P"), -160}};
  for (const uint8_t page_size : std::vector<uint8_t>{1, 2, 7}) {
    SCOPED_TRACE(int{page_size});
    bench_.page_size = page_size;
    memory_ = NetMemory();
    Start();
    ASSERT_TRUE(RunUntilAsked(protocol::kTagRead));
    protocol::TagReadRequest read;
    ASSERT_TRUE(Decode(robot_->exchange()->message, &read));
    EXPECT_EQ(bench_.tag("N1"), read.tag);
  }
  bench_.in_range = {bench_.tag("N1")};
  bench_.Serve(robot_->exchange());
  Run(10000);
  EXPECT_EQ(At(2), robot_->marking());
  EXPECT_EQ(0u, robot_->counters().exceptions);
  EXPECT_TRUE(robot_->drives());
  EXPECT_EQ(bench_.tag("N1"), robot_->state().tag);
  bench_.in_range.clear();
  Run(1000);
  EXPECT_EQ(0, robot_->state().tag);
  Visit("N1");
  ExpectException(NetFault::kNotEnabled, "N1", At(2));
}

TEST_F(NetRobotTest, StopsAsNearAsItIsTold) {
  parameters_.capture_mm = 50;
  Start();
  bench_.in_range = {bench_.tag("N1")};
  bench_.distance[bench_.tag("N1")] = 51;
  Run(2000);
  EXPECT_EQ(At(1), robot_->marking());
  bench_.distance[bench_.tag("N1")] = 50;
  Run(2000);
  EXPECT_EQ(At(2), robot_->marking());
}

TEST_F(NetRobotTest, AHeldRobotBeginsNothing) {
  Run(1000);
  held_ = true;
  bench_.in_range = {bench_.tag("N1")};
  Run(400);
  const int requests = bench_.requests;
  Run(5000);
  EXPECT_EQ(requests, bench_.requests);
  held_ = false;
  Run(2000);
  EXPECT_EQ(At(2), robot_->marking());
}

TEST_F(NetRobotTest, FullTagIsTriedUntilThereIsRoom) {
  bench_.refuses_writes = Reason::kTagFull;
  Visit("N1");
  Run(5000);
  EXPECT_EQ(NetFault::kNone, robot_->fault());
  bench_.refuses_writes = Reason::kNone;
  Run(2000);
  EXPECT_EQ((std::vector<std::string>{"N1 present 1", "N1 pass 1"}), Told());
}

TEST_F(NetRobotTest, NamesItselfAgainToAServerThatDoesNotKnowIt) {
  Run(1000);
  bench_.refuses_writes = Reason::kUnknownSymbol;
  bench_.before_write = [&] {
    if (bench_.names == 2) {
      bench_.refuses_writes = Reason::kNone;
    }
  };
  bench_.in_range = {bench_.tag("N1")};
  Run(3000);
  EXPECT_EQ(2, bench_.names);
  EXPECT_EQ((std::vector<std::string>{"N1 present 1", "N1 pass 1"}), Told());
}

TEST_F(NetRobotTest, OtherRefusalsOfTheServerAreExceptions) {
  bench_.refuses_writes = Reason::kNotPermitted;
  Visit("N1");
  EXPECT_EQ(Reason::kNotPermitted, robot_->reason());
  ExpectException(NetFault::kServer, "N1", At(1));
  bench_.refuses_writes = Reason::kNone;
  Release();
  Run(2000);
  EXPECT_EQ(At(2), robot_->marking());

  // It has rolled on, and was brought back.
  bench_.in_range = {bench_.tag("P")};
  ASSERT_TRUE(RunUntilAsked(protocol::kTagRead));
  bench_.in_range.clear();
  Run(1000);
  EXPECT_EQ(Reason::kNoTagInRange, robot_->reason());
  ExpectException(NetFault::kServer, "P", At(2));
  bench_.in_range = {bench_.tag("P")};
  Release();
  Run(2000);
  EXPECT_EQ(At(3), robot_->marking());
}

// Another robot's outcome takes the place of ours before we have read it.
TEST_F(NetRobotTest, LostOutcomeIsAskedForByRepeatingTheRecord) {
  bench_.in_range = {bench_.tag("N1")};
  ASSERT_TRUE(RunUntilAsked(protocol::kTagWrite));
  bench_.Serve(robot_->exchange());
  bench_.Act();
  ASSERT_EQ((std::vector<std::string>{"N1 present 1"}), Told());
  bench_.at("N1")->shown.robot = kOtherRobot;
  bench_.at("N1")->shown.state = 0;
  Run(10000);
  EXPECT_EQ(At(2), robot_->marking());
  EXPECT_EQ((std::vector<std::string>{"N1 present 1"}), Told());
  EXPECT_EQ(2, bench_.writes);
}

TEST_F(NetRobotTest, MemoryOfAnotherBootOrNetDoesNotCount) {
  Visit("N1");
  ASSERT_EQ(At(2), robot_->marking());
  NetMemory memory = memory_;
  EXPECT_EQ(At(2), NetRobot(kRobotNet, parameters_, kId, kBoot, &memory).marking());
  memory = memory_;
  EXPECT_EQ(At(1), NetRobot(kRobotNet, parameters_, kId, kBoot + 1, &memory).marking());
  memory = memory_;
  NetTables other = kRobotNet;
  other.hash ^= 1;
  EXPECT_EQ(At(1), NetRobot(other, parameters_, kId, kBoot, &memory).marking());
  memory = memory_;
  memory.states[0].marking ^= 4;
  memory.states[1].marking ^= 4;
  EXPECT_EQ(At(1), NetRobot(kRobotNet, parameters_, kId, kBoot, &memory).marking());
}

}  // namespace
}  // namespace client
}  // namespace pheromone
