#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "client_fw/lab/firmware/engine_server.h"
#include "client_fw/lab/firmware/firmware_swarm.h"
#include "client_fw/lab/testing/worlds.h"

namespace pheromone::lab {
namespace {

using testing::Made;
using testing::SmallWorld;

struct Swarm {
  std::shared_ptr<FirmwareSwarm> firmware;
  std::unique_ptr<World> world;
};

// `count` robots side by side that drive along pheromone 2, or lay 1.
Swarm Make(size_t count, const std::optional<RadioModel>& radio, bool lay_trail,
           const std::function<void(field::FieldConfig*)>& change_engine = {},
           std::shared_ptr<Server> server = nullptr) {
  WorldConfig config = SmallWorld();
  config.step_ms = 20;
  config.seed = 9;
  field::Path path;
  path.type = 2;
  path.count = 8;
  path.points = {{500'000, 5'000'000}, {9'500'000, 5'000'000}};
  config.field.paths = {path};
  client::Parameters robot;
  robot.type = lay_trail ? 1 : 2;
  robot.lay_trail = lay_trail;
  robot.lost_trail = client::LostTrail::kStraight;
  FirmwareConfig firmware;
  firmware.engine.field = config.field;
  if (change_engine) {
    change_engine(&firmware.engine.field);
  }
  firmware.robots.assign(count, robot);
  firmware.radio = radio;
  firmware.seed = config.seed;
  firmware.server = std::move(server);
  auto swarm = FirmwareSwarm::Create(std::move(firmware));
  EXPECT_TRUE(swarm.ok()) << swarm.ErrorOr("");
  RobotGroup group;
  group.name = "firmware";
  group.radius_m = 0;
  for (size_t i = 0; i < count; ++i) {
    group.starts.push_back(
        {1, 4.8 + 0.4 * static_cast<double>(i) / static_cast<double>(count), 0.2});
  }
  group.behaviour = swarm.value();
  config.groups = {group};
  return {swarm.value(), Made(std::move(config))};
}

engine::Service& ServiceOf(const Swarm& swarm) {
  return static_cast<EngineServer&>(swarm.firmware->server()).service();
}

void RunTo(int64_t ms, Swarm* swarm) {
  while (static_cast<int64_t>(swarm->world->time().now_ms()) < ms) {
    const Status status = swarm->world->Step();
    ASSERT_TRUE(status.ok()) << status.ErrorOr("");
  }
}

TEST(Firmware, OnAnIdealLinkItFollowsAndIsAnsweredInEachPeriod) {
  Swarm swarm = Make(5, {}, false);
  RunTo(30'000, &swarm);
  EXPECT_NEAR(static_cast<double>(swarm.world->tally().heard.answers), 5 * 5 * 30.0, 25);
  EXPECT_EQ(swarm.world->tally().heard.fail_safe_stops, 0u);
  for (size_t i = 0; i < 5; ++i) {
    EXPECT_NEAR(swarm.world->robots().y_m[i], 5, 0.05);
    EXPECT_NEAR(swarm.world->robots().x_m[i], 1 + 0.2 * 29, 0.3);
  }
}

// The engine has what was laid: as many quanta as TRACEs were answered.
TEST(Firmware, TracesAreLaidOnTheEnginesField) {
  Swarm swarm = Make(3, {}, true);
  RunTo(10'000, &swarm);
  const uint64_t laid = swarm.world->tally().deposited_quanta;
  EXPECT_EQ(laid, swarm.world->tally().heard.answers);
  EXPECT_GE(ServiceOf(swarm).counters().changes, laid);
  EXPECT_GT(swarm.world->field().node_count(), 0u);
}

// T_t and D_s 2 ms: the window is 2 T_t + D_s and two bytes of 10 bits.
TEST(Firmware, ItsChannelIsTheOneOnWhichRoundsWereMeasured) {
  Swarm swarm = Make(1, {}, false);
  ServiceOf(swarm).Inspect([](const engine::Engine& engine) {
    ASSERT_EQ(engine.config().links.size(), 1u);
    EXPECT_EQ(engine.config().links[0].slot_ms, 2);
    EXPECT_EQ(engine.config().links[0].response_window_ms, std::ceil(6 + 2 * 10 / 9.6));
  });
}

// The engine, but as far away as a daemon: what it sends is there three steps later.
class FarServer final : public Server {
 public:
  explicit FarServer(const engine::EngineConfig& config, size_t robots)
      : engine_(EngineServer::Create(config, robots).value()) {}

  size_t robots_of_link() const override { return kMaxRobotsOfLink; }
  Status Exchange(int64_t now_ms, std::span<const RobotMessage> sent,
                  std::vector<RobotMessage>* received) override {
    for (const RobotMessage& message : sent) {
      protocol::CommandAck ack;
      acks_ += Decode(message.message, &ack) && message.robot == 0 && ack.seq == 7 ? 1 : 0;
    }
    under_way_.emplace_back();
    PHEROMONE_TRY_STATUS(engine_->Exchange(now_ms, sent, &under_way_.back()));
    if (now_ms == 5000) {
      protocol::Message halt;
      Encode(protocol::Command{.id = 1, .seq = 7, .code = protocol::CommandCode::kHalt}, &halt);
      under_way_.back().push_back({0, halt});
    }
    if (under_way_.size() == 3) {
      for (RobotMessage& message : under_way_.front()) {
        protocol::HelloAnswer hello;
        if (Decode(message.message, &hello)) {
          hello.response_window_ms = 100;  // as links without a radio announce
          Encode(hello, &message.message);
        }
        traces_ += (message.message.opcode & 0xF0) == (protocol::kTrace | protocol::kFromServer);
        received->push_back(message);
      }
      under_way_.pop_front();
    }
    return Ok();
  }

  int acks() const { return acks_; }
  uint64_t traces() const { return traces_; }

 private:
  std::unique_ptr<EngineServer> engine_;
  std::deque<std::vector<RobotMessage>> under_way_;
  int acks_ = 0;
  uint64_t traces_ = 0;
};

TEST(Firmware, AServerThatIsFarAwayIsHeardAndCommands) {
  WorldConfig world = SmallWorld();
  engine::EngineConfig engine;
  engine.field = world.field;
  const auto server = std::make_shared<FarServer>(engine, 3);
  Swarm swarm = Make(3, {}, true, {}, server);
  RunTo(6000, &swarm);
  const std::vector<double> x_m(swarm.world->robots().x_m.begin(), swarm.world->robots().x_m.end());
  EXPECT_EQ(server->acks(), 1);
  RunTo(10'000, &swarm);
  EXPECT_EQ(swarm.world->robots().x_m[0], x_m[0]);
  EXPECT_NE(swarm.world->robots().x_m[1], x_m[1]);
  EXPECT_GT(server->traces(), 100u);
  EXPECT_EQ(swarm.world->tally().deposited_quanta, server->traces());
  EXPECT_EQ(swarm.world->tally().heard.fail_safe_stops, 0u);
}

// Only the engine knows of the obstacle, so that robots drive on to it.
TEST(Firmware, WhatTheEngineRefusesIsCounted) {
  for (const auto& radio : {std::optional<RadioModel>(), std::optional(RadioModel())}) {
    Swarm swarm = Make(3, radio, true, [](field::FieldConfig* field) {
      field->paths.clear();
      field::ObstacleMask mask(field->map.columns(), field->map.rows());
      for (int32_t row = 0; row < field->map.rows(); ++row) {
        for (int32_t column = 20; column < field->map.columns(); ++column) {
          mask.Set({column, row});
        }
      }
      field->obstacles = field::Shared(std::move(mask));
    });
    RunTo(20'000, &swarm);
    const WorldTally& tally = swarm.world->tally();
    EXPECT_GT(tally.deposited_quanta, 50u);
    EXPECT_GT(tally.refused_deposits, 50u);
    // Three robots at 5 Hz.
    EXPECT_NEAR(static_cast<double>(tally.deposited_quanta + tally.refused_deposits), 300, 15);
    EXPECT_NEAR(static_cast<double>(tally.heard.answers),
                static_cast<double>(tally.deposited_quanta), 3);
  }
}

TEST(Firmware, AFullMapEndsTheRun) {
  Swarm swarm = Make(3, {}, true, [](field::FieldConfig* field) {
    field->paths.clear();
    field->memory_bytes = field::Field(*field).used_bytes();
  });
  Status status = Ok();
  while (status.ok() && swarm.world->time().now_ms() < 10'000) {
    status = swarm.world->Step();
  }
  EXPECT_NE(status.ErrorOr("none").find("the pheromone needs more than the 64 MiB that the map"),
            std::string::npos)
      << status.ErrorOr("none");
}

// Answers and stops are those of the link's exchanges, though the firmware counts the stops itself.
TEST(Firmware, InRoundsItIsAnsweredAsTheLinkSays) {
  for (const int lost : {0, 5}) {
    const RadioModel radio{.robots_per_channel = 40, .lost_percent = lost};
    Swarm swarm = Make(20, radio, lost == 5);
    RunTo(60'000, &swarm);
    const RoundsLink link(20, radio, 9);
    double answers = 0;
    double stops = 0;
    for (size_t robot = 0; robot < 20; ++robot) {
      LinkExchange exchange = link.First(robot);
      while (exchange.answer_ms < 60'000) {
        const LinkExchange next = link.After(robot, exchange);
        ++answers;
        stops += std::min<int64_t>(next.answer_ms, 60'000) - exchange.answer_ms > 480 ? 1 : 0;
        exchange = next;
      }
    }
    // A robot may not have said HELLO before its first turn, and EVENTs take some.
    EXPECT_NEAR(static_cast<double>(swarm.world->tally().heard.answers), answers, 0.02 * answers);
    EXPECT_NEAR(static_cast<double>(swarm.world->tally().heard.fail_safe_stops), stops,
                0.02 * stops + 20);
    EXPECT_GT(stops, 500);
  }
}

}  // namespace
}  // namespace pheromone::lab
