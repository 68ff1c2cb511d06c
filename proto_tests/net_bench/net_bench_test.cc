// Robots with a net (client_fw/core/tasks/net_robot.h) and the server's composed net on virtual
// tags, without radio and wheels: both sides of protocol/README.md, section 17, as they are
// shipped. Between tags a robot takes some time. Answers are lost, robots are reset, the server is
// restarted from its saved state; each firing is looked up in the net.
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "client_fw/core/tasks/net_robot.h"
#include "client_fw/core/tasks/robot_net.h"
#include "protocol/byte_order.h"
#include "protocol/tag_messages.h"
#include "server/core/engine/nets_part.h"
#include "server/core/engine/testing/bench.h"
#include "server/formats/nets/robot_tables.h"
#include "server/formats/nets/system_file.h"

namespace pheromone {
namespace {

using client::NetRobot;
using client::NetStage;
using client::TagExchange;

constexpr int kRobots = 5;
constexpr uint64_t kStepMs = 20;
constexpr const char* kName = "bench";
const std::filesystem::path kNets =
    std::filesystem::path(PHEROMONE_SOURCE_DIR) / "deploy" / "examples" / "nets";

petri::Net Load(const char* file, const nets::Parameters& parameters = {}) {
  Result<petri::Net> net = nets::LoadSystem(kNets / file, parameters);
  EXPECT_TRUE(net.ok()) << net.error();
  return std::move(net).value();
}

// Half a metre from each other, with 0.1 m of range.
int32_t PlaceOfTag(size_t index) {
  return 500 + 500 * static_cast<int32_t>(index);
}

struct World {
  petri::LiveSettings settings;
  engine::EngineConfig config;
};

World MakeWorld(const char* file) {
  World world;
  const Result<nets::RobotTables> robot = nets::MakeRobotTables(Load("robot.toml"));
  EXPECT_TRUE(robot.ok()) << robot.error();
  EXPECT_EQ(robot.value().hash, client::kRobotNet.hash);
  world.settings.name = kName;
  world.settings.net = Load(file, {{"robots", kRobots}});
  world.settings.net.claims.clear();
  world.settings.robot_hash = robot.value().hash;
  tags::Settings tags;
  tags.privileged = {engine::NetsPart::AuthorOf(kName)};
  for (const std::string& name : petri::LiveTagsOf(world.settings.net)) {
    world.settings.tags.push_back({name, name, robot.value().CandidatesOf(name)});
    tags.tags.push_back(
        {name, int64_t{1'000} * PlaceOfTag(tags.tags.size()), 1'000'000, 100'000, 8});
  }
  world.config = engine::testing::SmallConfig();
  world.config.nets = {world.settings};
  world.config.tags = std::move(tags);
  return world;
}

// What happens on the way, of a thousand exchanges or steps.
struct Mishaps {
  unsigned dropped = 0;
  unsigned reset = 0;
  unsigned restart = 0;
};

class NetBench {
 public:
  NetBench(const Mishaps& mishaps, uint8_t explore_percent, unsigned seed)
      : world_(MakeWorld(explore_percent == 0 ? "pheromone.toml" : "pheromone_exploring.toml")),
        mishaps_(mishaps),
        random_(seed),
        bench_(world_.config) {
    parameters_.explore_percent = explore_percent;
    replayed_ = petri::InitialMarking(world_.settings.net);
    for (size_t i = 0; i < kRobots; ++i) {
      Rider& it = riders_[i];
      it.id = static_cast<uint8_t>(i + 1);
      bench_.Handle(engine::testing::Hello(it.id, it.id));
      Boot(&it);
      Depart(&it);
    }
  }

  void Step() {
    bench_.now_ms += kStepMs;
    for (Rider& it : riders_) {
      Turn(&it);
    }
    if (Happens(mishaps_.restart)) {
      ByteWriter writer;
      bench_.engine.Save(&writer);
      const std::string bytes = writer.Take();
      ByteReader reader(bytes);
      Result<engine::Engine> restored = engine::Engine::Restore(&reader);
      ASSERT_TRUE(restored.ok()) << restored.error();
      bench_.engine = std::move(restored).value();
      ++restarts;
    }
    for (auto due = bench_.engine.NextDeadline(); due && *due <= bench_.now_ms;
         due = bench_.engine.NextDeadline()) {
      bench_.Apply(engine::Advance{});
      Replay();
    }
    ExpectOneRobotInEachArea();
  }

  const petri::LiveNet& net() const {
    return bench_.engine.nets().nets().find(std::string_view(kName))->second.net;
  }
  const petri::Marking& replayed() const { return replayed_; }
  uint64_t now_ms() const { return bench_.now_ms; }

  int trips = 0;
  uint64_t deposited = 0;
  int firings = 0;
  int exceptions = 0;
  int resets = 0;
  int restarts = 0;
  int dropped = 0;

 private:
  struct Rider {
    uint8_t id = 0;
    std::unique_ptr<NetRobot> robot;
    client::NetMemory memory{};
    uint8_t seq = 0;  // of requests
    size_t lane = 0;  // towards this tag
    uint64_t departed_ms = 0;
    uint64_t arrives_ms = 0;
    bool there = false;
    uint16_t trips = 0;
    uint16_t energy = 0;
  };

  bool Happens(unsigned per_mille) { return random_() % 1000 < per_mille; }

  void Boot(Rider* it) {
    it->robot =
        std::make_unique<NetRobot>(client::kRobotNet, parameters_, it->id, it->id, &it->memory);
  }

  size_t TagNamed(const std::string& name) const {
    for (size_t i = 0; i < world_.settings.tags.size(); ++i) {
      if (world_.settings.tags[i].in_net == name) {
        return i;
      }
    }
    ADD_FAILURE() << name;
    return 0;
  }

  // Where its place's line leads, by Ferreira, Tavares and Silva 2018, Fig. 2 and 3.
  size_t Next(const Rider& it) const {
    static const char* const tags[] = {"",  "N1", "P",  "",    "S1", "Src", "S3", "N2",
                                       "P", "N4", "S2", "Src", "S4", "N3",  "P"};
    const uint8_t place = it.robot->place();
    return TagNamed(place != 3                                                  ? tags[place]
                    : it.robot->state().choice == protocol::NetAction::kChooseA ? "N5"
                                                                                : "N6");
  }

  void Depart(Rider* it) {
    it->there = false;
    it->lane = Next(*it);
    it->departed_ms = bench_.now_ms;
    it->arrives_ms = bench_.now_ms + 300 + random_() % 3'000;
  }

  // Robots of a line keep their order, and stand behind the one that stands at its tag.
  bool IsFirstOfItsLane(const Rider& it) const {
    for (const Rider& other : riders_) {
      const bool before = &other != &it && other.lane == it.lane &&
                          (other.there || other.departed_ms < it.departed_ms ||
                           (other.departed_ms == it.departed_ms && other.id < it.id));
      if (before) {
        return false;
      }
    }
    return true;
  }

  void Turn(Rider* it) {
    if (it->there && it->robot->drives() && Next(*it) != it->lane) {
      Depart(it);
    } else if (!it->there && bench_.now_ms >= it->arrives_ms && IsFirstOfItsLane(*it)) {
      it->there = true;
    }
    if (it->robot->Step({static_cast<uint32_t>(bench_.now_ms), 200, 100, false})) {
      Serve(it);
    }
    uint16_t tag = 0;
    if (it->robot->TakeException(&tag)) {
      ++exceptions;
      ADD_FAILURE() << "robot " << int{it->id} << " at " << world_.settings.tags[it->lane].in_net
                    << ", place " << int{it->robot->place()} << ": fault "
                    << static_cast<int>(it->robot->fault());
    }
    if (it->trips != it->robot->state().trips) {
      it->trips = it->robot->state().trips;
      ++trips;
      deposited += it->energy;
    }
    it->energy = it->robot->state().energy;
    if (Happens(mishaps_.reset)) {
      ++resets;
      Boot(it);
    }
  }

  // What the conversation does with a request, radio apart.
  void Serve(Rider* it) {
    TagExchange* const exchange = it->robot->exchange();
    protocol::Message* const request = &exchange->message;
    request->id = it->id;
    const bool changes = protocol::IsMutating(request->opcode);
    if (request->opcode != protocol::kSymbol) {
      uint8_t* const at = request->data + (changes ? 1 : 0);
      protocol::PutI32(at, it->there ? PlaceOfTag(it->lane) : 0);
      protocol::PutI32(at + 4, 1'000);
    }
    if (changes) {
      request->data[0] = ++it->seq;
    }
    const bool drops = changes && Happens(mishaps_.dropped);
    std::optional<protocol::Message> answer;
    if (!drops || random_() % 2 == 0) {
      answer = bench_.Handle(*request);
    } else {
      --it->seq;
    }
    if (drops) {
      ++dropped;
      exchange->state = TagExchange::kDropped;
      return;
    }
    ASSERT_TRUE(answer);
    exchange->reason = engine::testing::ReasonOf(*answer);
    const bool refused = exchange->reason != protocol::Reason::kNone;
    exchange->state = refused ? TagExchange::kRefused : TagExchange::kAnswered;
    if (!refused) {
      exchange->message = *answer;
    }
  }

  void Replay() {
    const petri::Net& net = world_.settings.net;
    for (const engine::NetFiring& it : bench_.engine.nets().fired()) {
      ++firings;
      ASSERT_TRUE(petri::IsEnabled(net, it.transition, replayed_))
          << net.transitions[it.transition].id;
      replayed_ = petri::Fire(net, it.transition, replayed_);
    }
  }

  // Within a semaphore: from the pass at an entrance to the exit's tag.
  void ExpectOneRobotInEachArea() {
    int in_pheromone = 0;
    int in_source = 0;
    for (const Rider& it : riders_) {
      const uint8_t place = it.robot->place();
      const bool tells = it.robot->state().stage == NetStage::kTelling;
      const protocol::NetAction action = it.robot->state().action;
      const bool waits = it.robot->state().stage == NetStage::kWaiting ||
                         (tells && action == protocol::NetAction::kPass);
      // On the exit's tag, the environment may have let the next one in before it hears of that.
      const bool leaves = tells && action == protocol::NetAction::kLeave;
      const bool inside = !waits && !leaves;
      const bool pheromone = place == 2 || place == 3 || place == 8 || place == 9 || place == 14;
      const bool source = place == 5 || place == 6 || place == 11 || place == 12;
      in_pheromone += pheromone && inside ? 1 : 0;
      in_source += source && inside ? 1 : 0;
    }
    ASSERT_LE(in_pheromone, 1);
    ASSERT_LE(in_source, 1);
  }

  World world_;
  Mishaps mishaps_;
  client::NetRobotParameters parameters_;
  std::mt19937 random_;
  engine::testing::Bench bench_;
  petri::Marking replayed_;
  std::array<Rider, kRobots> riders_;
};

void DriveTrips(const Mishaps& mishaps, uint8_t explore_percent = 0) {
  constexpr int kTrips = 300;
  NetBench bench(mishaps, explore_percent, 1);
  const uint64_t from_ms = bench.now_ms();
  while (bench.trips < kTrips && bench.now_ms() < from_ms + 20'000 * uint64_t{kTrips}) {
    bench.Step();
    if (testing::Test::HasFailure()) {
      return;
    }
  }
  const petri::LiveCounts& counts = bench.net().counts();
  EXPECT_GE(bench.trips, kTrips);
  EXPECT_EQ(bench.exceptions, 0);
  EXPECT_EQ(counts.exceptions, 0u);
  EXPECT_EQ(counts.deposits, static_cast<uint64_t>(bench.trips));
  EXPECT_EQ(counts.deposited, bench.deposited);
  EXPECT_EQ(counts.firings, static_cast<uint64_t>(bench.firings));
  for (size_t i = 0; i < bench.net().marking().size(); ++i) {
    EXPECT_EQ(bench.net().marking()[i], bench.replayed()[static_cast<Eigen::Index>(i)]) << i;
  }
  std::cout << bench.trips << " trips in " << (bench.now_ms() - from_ms) / 1000 << " s, "
            << bench.firings << " firings, " << counts.records << " records, " << counts.repeats
            << " repeated, " << bench.dropped << " requests dropped, " << bench.resets
            << " resets, " << bench.restarts << " restarts\n";
}

TEST(NetBench, RobotsAndServerAgree) {
  DriveTrips({});
}

TEST(NetBench, LostRequestsResetsAndRestartsLoseAndRepeatNothing) {
  DriveTrips({.dropped = 200, .reset = 3, .restart = 5});
}

TEST(NetBench, RobotsThatExploreAreAcceptedByTheNetForThem) {
  DriveTrips({}, 40);
}

}  // namespace
}  // namespace pheromone
