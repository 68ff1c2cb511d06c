// The AVR's image of a robot with a net, between a radio channel with a naive server of a bench on
// it and a simulated Pioneer. Tags come into range when the test says so.
#include <gtest/gtest.h>

#include <iostream>
#include <string>
#include <vector>

#include "client_fw/core/tasks/forager.h"
#include "client_fw/core/testing/naive_server.h"
#include "client_fw/sim/avr/avr_robot.h"
#include "client_fw/sim/avr/avr_settings.h"
#include "client_fw/sim/radio_medium.h"
#include "protocol/decoder.h"
#include "protocol/frame.h"

namespace pheromone::firmware {
namespace {

using client::NaiveServer;
using protocol::NetAction;

constexpr int64_t kMs = 1'000'000;
constexpr int64_t kInstantMs = 200;

class Station final : public sim::Station {
 public:
  Station(NaiveServer* server, sim::RadioMedium* medium)
      : server_(server), medium_(medium), number_(medium->AddStation(this)) {}

  void OnByte(uint8_t byte, int64_t time_ns) override {
    if (!decoder_.Push(byte, static_cast<uint32_t>(time_ns / kMs))) {
      return;
    }
    if (const auto answer = server_->AnswerTo(decoder_.message())) {
      Send(*answer);
    }
  }
  void OnTransmitted(int64_t /*time_ns*/) override {}

  void Send(const protocol::Message& message) {
    uint8_t frame[protocol::kMaxFrame];
    medium_->Transmit(number_, {frame, protocol::EncodeFrame(message, frame, sizeof(frame))});
  }

 private:
  NaiveServer* server_;
  sim::RadioMedium* medium_;
  int number_;
  protocol::FrameDecoder decoder_{20};
};

sim::AvrRobotConfig Config() {
  client::Parameters settings;
  settings.start_released = true;
  settings.lost_after_ms = 0;
  client::PrepareForForaging(client::kRobotNet, &settings);
  sim::AvrRobotConfig config;
  config.machine.image = PHEROMONE_FORAGER_AVR_IMAGE;
  config.machine.eeprom = sim::AvrEepromWith(settings, 1);
  config.id = 7;
  return config;
}

class ForagerImageTest : public testing::Test {
 protected:
  ForagerImageTest() : station_(&server_, &medium_), robot_(Config(), &medium_) {
    server_.hello.protocol_version = protocol::kProtocolVersion;
    server_.hello.epoch = 3;
    server_.hello.pose_unit_10um = 100;
    server_.hello.antenna_distance_mm = 300;
    server_.hello.type_mask = 0x007E;
    server_.hello.slot_ms = 3;
    server_.hello.response_window_ms = 60;
  }

  void TearDown() override {
    const sim::AvrMachine& machine = robot_.machine();
    std::cout << machine.image_size().flash_bytes << " bytes of flash, "
              << machine.image_size().static_ram_bytes << " of RAM, deepest stack "
              << machine.stack_bytes() << " bytes\n";
    EXPECT_LE(machine.image_size().static_ram_bytes + machine.stack_bytes(), 3072u);
  }

  int64_t now_ms() const { return medium_.now_ns() / kMs; }

  void Step() {
    medium_.AdvanceTo((now_ms() + 1) * kMs);
    robot_.Step();
    if (now_ms() % kInstantMs == 0) {
      server_.bench.Act();
    }
    if (reset_every_ms_ != 0 && now_ms() % reset_every_ms_ == 0) {
      robot_.RunAhead(now_ms() * 7919 % kMs);
      robot_.Reset(now_ms() % 2 == 0 ? sim::AvrMachine::Cause::kWatchdog
                                     : sim::AvrMachine::Cause::kExternal);
      ++resets_;
    }
  }
  template <typename Happened>
  bool RunUntil(Happened happened, int64_t ms) {
    for (const int64_t end_ms = now_ms() + ms; now_ms() < end_ms;) {
      if (happened()) {
        return true;
      }
      Step();
    }
    return false;
  }

  void DriveTrip(bool a) {
    client::NaiveBench& bench = server_.bench;
    bench.at("P")->shown.state = a ? protocol::kNetAdviceA : protocol::kNetAdviceB;
    bench.Show(bench.at("P"));
    size_t told = bench.handled.size();
    for (const std::string& tag : a ? client::TripA() : client::TripB()) {
      const bool entrance = tag == "N1" || tag == "N2" || tag == "N3" || tag == "S1" || tag == "S2";
      told += entrance ? 2 : 1;
      bench.in_range = {bench.tag(tag)};
      ASSERT_TRUE(RunUntil([&] { return bench.handled.size() >= told; }, 60'000)) << tag;
      int scans = bench.scans;  // it goes on
      ASSERT_TRUE(RunUntil([&] { return bench.scans > scans; }, 60'000)) << tag;
      bench.in_range.clear();
      scans = bench.scans;
      ASSERT_TRUE(RunUntil([&] { return bench.scans > scans; }, 60'000)) << tag;
    }
  }

  void ExpectTold(bool a, size_t from) const {
    const std::vector<NetAction> expected = {NetAction::kPresent,
                                             NetAction::kPass,
                                             a ? NetAction::kChooseA : NetAction::kChooseB,
                                             NetAction::kLeave,
                                             NetAction::kPresent,
                                             NetAction::kPass,
                                             NetAction::kTake,
                                             NetAction::kLeave,
                                             NetAction::kPresent,
                                             NetAction::kPass,
                                             a ? NetAction::kStoreA : NetAction::kStoreB,
                                             NetAction::kLeave};
    std::vector<NetAction> told;
    for (size_t i = from; i < server_.bench.handled.size(); ++i) {
      told.push_back(server_.bench.handled[i].action);
    }
    EXPECT_EQ(expected, told);
    for (const protocol::EventReport& event : server_.events) {
      EXPECT_NE(protocol::EventCode::kNetException, event.code);
    }
  }

  sim::RadioMedium medium_{sim::RadioConfig{}};
  NaiveServer server_;
  Station station_;
  sim::AvrRobot robot_;
  int64_t reset_every_ms_ = 0;
  int resets_ = 0;
};

TEST_F(ForagerImageTest, MakesRoundTripsOverBothTrails) {
  DriveTrip(true);
  ExpectTold(true, 0);
  EXPECT_EQ((std::set<int>{1, 2, 3, 6}), server_.sensed_types);
  EXPECT_EQ(900, server_.bench.source);
  const size_t told = server_.bench.handled.size();
  DriveTrip(false);
  ExpectTold(false, told);
  EXPECT_EQ((std::set<int>{1, 2, 3, 4, 5, 6}), server_.sensed_types);
  EXPECT_GT(robot_.true_pose().x_m, 0.5) << "it does not drive";
}

TEST_F(ForagerImageTest, WarmResetsLoseAndRepeatNothing) {
  ASSERT_TRUE(RunUntil([&] { return server_.bench.scans > 0; }, 20'000));
  size_t told = 0;
  bool a = false;
  for (const int64_t every_ms : {1'733, 1'291, 1'097, 911, 1'501, 877}) {
    reset_every_ms_ = every_ms;
    a = !a;
    DriveTrip(a);
    ExpectTold(a, told);
    told = server_.bench.handled.size();
  }
  std::cout << resets_ << " resets in " << now_ms() / 1000 << " s\n";
  EXPECT_GT(resets_, 50);
  EXPECT_EQ(400, server_.bench.source);
}

TEST_F(ForagerImageTest, ExceptionIsToldAndStopsIt) {
  server_.bench.in_range = {server_.bench.tag("S3")};
  ASSERT_TRUE(RunUntil([&] { return !server_.events.empty(); }, 20'000));
  EXPECT_EQ(protocol::EventCode::kNetException, server_.events[0].code);
  EXPECT_EQ(server_.bench.tag("S3"), static_cast<uint16_t>(server_.events[0].argument));
  RunUntil([] { return false; }, 3'000);
  const double x_m = robot_.true_pose().x_m;
  RunUntil([] { return false; }, 3'000);
  EXPECT_EQ(x_m, robot_.true_pose().x_m);
  EXPECT_TRUE(server_.bench.handled.empty());
}

}  // namespace
}  // namespace pheromone::firmware
