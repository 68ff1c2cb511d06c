// Changes in bad air, each at a place of its own: what a robot was told that it was made is there
// once, and nothing is there twice. In virtual time, over the server's and the client's own code,
// with resets and power losses of the robots. The bookkeeping is the test's: it reads what robots
// put on the air, and what they have of it in their memory.
#include <gtest/gtest.h>

#include <deque>
#include <iostream>
#include <map>
#include <random>
#include <set>
#include <utility>

#include "client_fw/core/conversation.h"
#include "client_fw/swarm/channel_model.h"
#include "client_fw/swarm/server_station.h"
#include "protocol/messages.h"
#include "server/core/engine/service/ordered_log.h"

namespace pheromone::swarm {
namespace {

constexpr int64_t kNsPerMillisecond = 1'000'000;
constexpr uint8_t kType = 1;
constexpr int32_t kCellMm = 100;
constexpr int kColumns = 300;
constexpr int kRowsOfARobot = 10;
constexpr int kRobots = 8;

using Node = std::pair<int, int>;  // column, row

engine::EngineConfig ServerConfig(const ChannelTiming& timing) {
  field::PheromoneLaw law;
  law.type = kType;
  law.name = "trail";
  law.core_um = 100'000;
  law.sigma_um = 100'000;
  law.tau_ms = 0;
  law.quantum_micro = 125'000;
  law.max_count = 8;
  engine::EngineConfig config;
  config.field.map = {.origin = {0, 0},
                      .width_um = int64_t{kColumns} * kCellMm * 1000,
                      .height_um = int64_t{kRowsOfARobot} * (kRobots + 1) * kCellMm * 1000,
                      .cell_um = int64_t{kCellMm} * 1000};
  config.field.antennas.distance_um = 300'000;
  config.field.pheromones = {law};
  config.field.memory_bytes = 64 << 20;
  config.links = {timing.Link("radio-a")};
  return config;
}

// A robot that stands where the next change is to be made, and is reset now and then.
class Changer final : public sim::Station {
 public:
  Changer(uint8_t id, bool rounds, sim::RadioMedium* medium) : medium_(medium) {
    parameters_.id = id;
    parameters_.type = kType;
    parameters_.lay_trail = true;
    parameters_.rounds = rounds;
    parameters_.boot_counter = id;
    parameters_.start_released = true;
    station_ = medium->AddStation(this);
    Boot();
  }

  void OnByte(uint8_t byte, int64_t /*time_ns*/) override { heard_.push_back(byte); }
  void OnTransmitted(int64_t /*time_ns*/) override { sent_ = true; }

  void Step() {
    const auto now_ms = static_cast<uint32_t>(medium_->now_ns() / kNsPerMillisecond);
    if (std::exchange(sent_, false)) {
      conversation_->OnSent(now_ms);
    }
    for (; !heard_.empty(); heard_.pop_front()) {
      conversation_->OnByte(heard_.front(), now_ms);
    }
    const client::Odometry odometry = Place();
    conversation_->Poll(now_ms, &odometry, medium_->Busy(station_));
    if (conversation_->tx_size() != 0 && !medium_->Sending(station_)) {
      Note();
      medium_->Transmit(station_, {conversation_->tx(), conversation_->tx_size()});
    }
    // What is no longer pending, and was not given up, has been answered.
    if (open_ && memory_.opcode == 0) {
      if (conversation_->counters().lost_traces == lost_) {
        acknowledged.insert(*open_);
      }
      open_.reset();
    }
    lost_ = conversation_->counters().lost_traces;
  }

  void Reset(bool keeps_memory) {
    heard_.clear();
    if (!keeps_memory || !client::Restore(&memory_)) {
      memory_ = client::RequestMemory();
      parameters_.boot_counter = static_cast<uint16_t>(parameters_.boot_counter + 0x101);
      open_.reset();  // nobody will ever know
    }
    Boot();
  }

  std::set<Node> made;          // sent at least once
  std::set<Node> acknowledged;  // answered

 private:
  void Boot() {
    conversation_ = std::make_unique<client::Conversation>(parameters_, &memory_);
    lost_ = 0;
  }

  Node NextNode() const {
    const int count = static_cast<int>(made.size());
    return {count % kColumns, (parameters_.id - 1) * kRowsOfARobot + count / kColumns};
  }
  client::Odometry Place() const {
    const auto [column, row] = NextNode();
    return {column * kCellMm, row * kCellMm, 0};
  }

  // A change that goes on the air: its place.
  void Note() {
    protocol::FrameDecoder decoder(protocol::kNoGapTimeout);
    decoder.PushBlock(conversation_->tx(), conversation_->tx_size(), 0,
                      [this](const protocol::Message& message) {
                        protocol::TraceRequest trace;
                        if (Decode(message, &trace)) {
                          const Node node{trace.pose.x / kCellMm, trace.pose.y / kCellMm};
                          made.insert(node);
                          open_ = node;
                        }
                      });
  }

  sim::RadioMedium* medium_;
  client::Parameters parameters_;
  client::RequestMemory memory_ = client::RequestMemory();
  std::unique_ptr<client::Conversation> conversation_;
  std::deque<uint8_t> heard_;
  std::optional<Node> open_;  // not answered yet
  uint32_t lost_ = 0;
  int station_ = 0;
  bool sent_ = false;
};

struct Air {
  double byte_error;
  bool rounds;
  int64_t duration_ms;
};

void CheckExactlyOnce(const Air& air) {
  ChannelTiming timing;
  sim::RadioConfig radio;
  radio.byte_error = air.byte_error;
  radio.seed = 5;
  sim::RadioMedium medium(radio);
  engine::VolatileLog log;
  engine::Service service(&log, [&medium] {
    const auto now_ms = medium.now_ns() / kNsPerMillisecond;
    return engine::ClockReading{static_cast<uint64_t>(now_ms), now_ms};
  });
  const engine::EngineConfig config = ServerConfig(timing);
  ASSERT_TRUE(service.Configure(config, 1).ok());
  ServerStation server(&service, 0, config.links[0], &medium, {.delay_ns = timing.server_delay_ns});
  std::deque<Changer> robots;
  for (int i = 0; i < kRobots; ++i) {
    robots.emplace_back(static_cast<uint8_t>(i + 1), air.rounds, &medium);
  }
  std::mt19937_64 random(9);
  for (int64_t ms = 1; ms <= air.duration_ms; ++ms) {
    server.AdvanceTo(ms * kNsPerMillisecond);
    for (Changer& robot : robots) {
      robot.Step();
    }
    if (random() % 2000 == 0) {
      robots[random() % robots.size()].Reset(random() % 4 != 0);
    }
  }
  std::map<Node, uint32_t> times;
  size_t made = 0;
  size_t acknowledged = 0;
  service.Inspect([&](const engine::Engine& engine) {
    for (const Changer& robot : robots) {
      made += robot.made.size();
      acknowledged += robot.acknowledged.size();
      for (const Node& node : robot.made) {
        times[node] =
            engine.field().LevelOf(kType, {node.first, node.second}, engine.field_time_ms()) /
            field::kLevelsPerQuantum;
      }
      for (const Node& node : robot.acknowledged) {
        EXPECT_EQ(times[node], 1u) << node.first << ' ' << node.second;
      }
    }
  });
  for (const auto& [node, count] : times) {
    EXPECT_LE(count, 1u) << node.first << ' ' << node.second;
  }
  std::cout << made << " changes sent, " << acknowledged << " acknowledged\n";
  EXPECT_GT(acknowledged, 2500u);
}

TEST(ExactlyOnce, InRoundsWithOnePercentDamaged) {
  CheckExactlyOnce({0.01, true, 200'000});
}

TEST(ExactlyOnce, InRoundsWithThreePercentDamaged) {
  CheckExactlyOnce({0.03, true, 400'000});
}

TEST(ExactlyOnce, WhereRobotsContendWithOnePercentDamaged) {
  CheckExactlyOnce({0.01, false, 300'000});
}

TEST(ExactlyOnce, WhereRobotsContendWithThreePercentDamaged) {
  CheckExactlyOnce({0.03, false, 700'000});
}

}  // namespace
}  // namespace pheromone::swarm
