// The simulator's server and the daemon's link are one implementation of medium access: the same
// seeded swarm, once with swarm::ServerStation and once with the link of a port in virtual time,
// puts the same bytes on the air at the same nanoseconds.
#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <iostream>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include <boost/asio/io_context.hpp>

#include "client_fw/swarm/channel_model.h"
#include "client_fw/swarm/path_experiment.h"
#include "client_fw/swarm/server_station.h"
#include "client_fw/swarm/swarm.h"
#include "server/robots/links/clock.h"
#include "server/robots/links/link_router.h"
#include "server/robots/links/port_link.h"

namespace pheromone {
namespace {

using links::Clock;

constexpr int64_t kMs = 1'000'000;
constexpr int64_t kSeconds = 10;

struct Case {
  std::string name;
  int64_t baud = 9600;
  int64_t turnaround_ms = 2;
  bool rounds = true;
  bool carrier_detect = true;
  bool keyed = false;
  double loss = 0;
};

constexpr int64_t kLeadMs = 5;
constexpr int64_t kTailMs = 1;

// Notes what is on the air: a line for each run of bytes, "begin_ns hex".
class Monitor : public sim::Station {
 public:
  explicit Monitor(int64_t byte_ns) : byte_ns_(byte_ns) {}

  void OnByte(uint8_t byte, int64_t time_ns) override {
    if (lines_.empty() || time_ns - last_ns_ > byte_ns_ + 1) {
      lines_.push_back(fmt::format("{} ", time_ns - byte_ns_));
    }
    last_ns_ = time_ns;
    lines_.back() += fmt::format("{:02x}", byte);
  }
  void OnTransmitted(int64_t /*time_ns*/) override {}

  const std::vector<std::string>& lines() const { return lines_; }

 private:
  int64_t byte_ns_;
  int64_t last_ns_ = 0;
  std::vector<std::string> lines_;
};

// A server on the channel.
class Driver {
 public:
  virtual ~Driver() = default;
  virtual void AdvanceTo(int64_t time_ns) = 0;
  virtual void Send(std::vector<engine::Outgoing> messages) = 0;
  virtual uint64_t rounds() = 0;
  virtual uint64_t late_answers() = 0;
};

class SimulatorsDriver : public Driver {
 public:
  SimulatorsDriver(const Case& it, engine::Service* service, const engine::LinkSettings& announced,
                   sim::RadioMedium* medium)
      : station_(service, 0, announced, medium, TimingOf(it)) {}

  void AdvanceTo(int64_t time_ns) override { station_.AdvanceTo(time_ns); }
  void Send(std::vector<engine::Outgoing> messages) override {
    for (const engine::Outgoing& it : messages) {
      station_.Queue(it);
    }
  }
  uint64_t rounds() override { return station_.counters().rounds.rounds; }
  uint64_t late_answers() override { return station_.counters().late_answers; }

 private:
  static swarm::ServerTiming TimingOf(const Case& it) {
    swarm::ServerTiming timing;
    timing.delay_ns = 0;
    timing.keyed = it.keyed;
    timing.lead_ns = it.keyed ? kLeadMs * kMs : 0;
    timing.tail_ns = it.keyed ? kTailMs * kMs : 0;
    return timing;
  }

  swarm::ServerStation station_;
};

// The line between a link and its modem.
struct Line {
  Line() {
    std::array<int, 2> ends{};
    EXPECT_EQ(socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0, ends.data()), 0);
    server = Descriptor(ends[0]);
    modem = Descriptor(ends[1]);
  }

  Descriptor server;
  Descriptor modem;
};

class DaemonsDriver : public Driver, public sim::Station {
 public:
  DaemonsDriver(const Case& it, engine::Service* service, const engine::LinkSettings& announced,
                sim::RadioMedium* medium)
      : medium_(medium),
        router_(service),
        number_(medium->AddStation(this, it.keyed ? std::optional<int64_t>(0) : std::nullopt)) {
    now_of_ = medium;
    Clock::Set([] { return Clock::time_point(std::chrono::nanoseconds(now_of_->now_ns())); });
    links::LinkConfig config;
    config.name = "radio-a";
    config.gap_timeout_ms = 20;
    config.medium_access = true;
    config.baud = static_cast<uint32_t>(it.baud);
    config.turnaround_ms = static_cast<uint16_t>(it.turnaround_ms);
    config.slot_ms = announced.slot_ms;
    config.response_window_ms = announced.response_window_ms;
    if (it.keyed) {
      config.lines = {links::CarrierSense::kNone, links::Ptt::kRts, kLeadMs, kTailMs};
    }
    link_ = links::MakePortLink(io_, std::make_unique<SocketPort>(this, it), "socketpair", config,
                                {.router = &router_,
                                 .log = [](const links::LinkNotice&) {},
                                 .quiet_start = {}});  // as if it had been there before
    router_.Add(link_.get());
    EXPECT_TRUE(link_->Start().ok());
  }
  ~DaemonsDriver() override {
    link_->Stop();
    io_.poll();
    // It finishes what is on the air.
    Clock::Set([] {
      return Clock::time_point(std::chrono::nanoseconds(now_of_->now_ns()) +
                               std::chrono::seconds(1));
    });
    io_.poll();
    EXPECT_TRUE(io_.stopped());
    Clock::Set(nullptr);
  }

  void AdvanceTo(int64_t time_ns) override {
    Poll();
    for (;;) {
      const int64_t timer_ns = Clock::NextTimer().time_since_epoch().count();
      const int64_t next_ns = std::min(medium_->NextEventTime(), timer_ns);
      medium_->AdvanceTo(std::clamp(next_ns, medium_->now_ns(), time_ns));
      Poll();
      if (next_ns >= time_ns) {
        return;
      }
    }
  }

  void Send(std::vector<engine::Outgoing> messages) override { link_->Send(std::move(messages)); }
  uint64_t rounds() override { return link_->counters().rounds.rounds; }
  uint64_t late_answers() override { return link_->counters().late_answers; }

  void OnByte(uint8_t byte, int64_t /*time_ns*/) override {
    EXPECT_EQ(write(line_.modem.get(), &byte, 1), 1);
  }
  void OnTransmitted(int64_t /*time_ns*/) override {}

 private:
  class SocketPort : public links::Port {
   public:
    SocketPort(DaemonsDriver* driver, const Case& it)
        : driver_(driver), senses_(it.carrier_detect), keyed_(it.keyed) {}

    Result<Descriptor> Open() override {
      return Descriptor(fcntl(driver_->line_.server.get(), F_DUPFD_CLOEXEC, 0));
    }
    void Close() override {}
    bool senses_carrier() const override { return senses_; }
    bool is_keyed() const override { return keyed_; }
    bool carrier() const override {
      return driver_->medium_->Busy(driver_->number_) &&
             !driver_->medium_->Sending(driver_->number_);
    }
    void Key(bool sending) override { driver_->medium_->Key(driver_->number_, sending); }
    std::string Describe() const override { return "socketpair"; }

   private:
    DaemonsDriver* driver_;
    bool senses_;
    bool keyed_;
  };

  // Lets the link do what is due, and puts what it writes on the air.
  void Poll() {
    Clock::ForgetTimers();
    io_.poll();
    std::array<uint8_t, 4096> bytes{};
    const ssize_t size = read(line_.modem.get(), bytes.data(), bytes.size());
    if (size > 0) {
      medium_->Transmit(number_, {bytes.data(), static_cast<size_t>(size)});
    }
  }

  static inline const sim::RadioMedium* now_of_ = nullptr;

  sim::RadioMedium* medium_;
  Line line_;
  boost::asio::io_context io_;
  links::LinkRouter router_;
  std::unique_ptr<links::Link> link_;
  int number_;
};

swarm::SwarmConfig SwarmOf(const Case& it) {
  std::mt19937_64 random(20);
  swarm::SwarmConfig config;
  config.radio.baud = it.baud;
  config.radio.turnaround_ns = it.turnaround_ms * kMs;
  config.radio.carrier_detect = it.carrier_detect;
  config.radio.block_loss = it.loss;
  config.radio.seed = random();
  for (int i = 0; i < 8; ++i) {
    swarm::RobotConfig robot;
    robot.client.id = static_cast<uint8_t>(10 + i);
    robot.client.boot_counter = static_cast<uint16_t>(random());
    robot.client.type = 2;
    robot.client.period_ms = 200;
    robot.client.rounds = it.rounds;
    robot.client.lay_trail = i % 2 == 1;
    robot.start = {1.0 + i, 1.5 + 0.5 * i, 0.4};
    robot.power_on_ms = static_cast<int64_t>(random() % 1000);
    config.robots.push_back(robot);
  }
  config.hidden_pairs = {{0, 1}};
  return config;
}

struct Outcome {
  std::vector<std::string> trace;
  uint64_t state_hash = 0;
  uint64_t rounds = 0;
  uint64_t late_answers = 0;
  uint64_t answers = 0;
  uint64_t acks = 0;
  uint64_t collided = 0;
};

template <typename DriverType>
Outcome Drive(const Case& it) {
  swarm::ChannelTiming timing;
  timing.baud = it.baud;
  timing.turnaround_ns = it.turnaround_ms * kMs;
  timing.server_delay_ns = 0;
  timing.keyed = it.keyed;
  timing.lead_ns = it.keyed ? kLeadMs * kMs : 0;
  timing.carrier_detect = it.carrier_detect;
  engine::EngineConfig config = swarm::EngineConfigOf(swarm::PathExperiment{});
  config.links = {timing.Link("radio-a")};
  std::optional<swarm::Swarm> robots;
  engine::VolatileLog log;
  engine::Service service(&log, [&robots] {
    const int64_t now_ms = robots ? robots->now_ms() : 0;
    return engine::ClockReading{static_cast<uint64_t>(now_ms), now_ms};
  });
  EXPECT_TRUE(service.Configure(config, 1).ok());
  std::optional<DriverType> driver;
  std::optional<Monitor> monitor;
  robots.emplace(SwarmOf(it), [&](size_t /*channel*/, sim::RadioMedium* medium) {
    driver.emplace(it, &service, config.links[0], medium);
    monitor.emplace(medium->byte_ns());
    medium->AddStation(&*monitor);
  });
  uint8_t commanded = 0;
  while (robots->now_ms() < kSeconds * 1000) {
    robots->Step([&](size_t /*channel*/, int64_t time_ns) {
      driver->AdvanceTo(time_ns);
      std::vector<engine::Outgoing> due;
      service.AdvanceIfDue(&due);
      driver->Send(std::move(due));
    });
    if (robots->now_ms() % 1700 == 0) {  // a COMMAND to each, one after the other
      engine::CommandIssued command;
      command.id = static_cast<uint8_t>(10 + commanded++ % 8);
      command.code = protocol::CommandCode::kResume;
      std::vector<engine::Outgoing> out;
      if (service.Issue(command, &out).ok()) {  // otherwise it has not been heard yet
        driver->Send(std::move(out));
      }
    }
  }
  Outcome outcome;
  outcome.trace = monitor->lines();
  outcome.state_hash = service.StateHash();
  outcome.rounds = driver->rounds();
  outcome.late_answers = driver->late_answers();
  for (size_t i = 0; i < robots->robot_count(); ++i) {
    outcome.answers += robots->robot(i).counters().answers;
    outcome.acks += robots->robot(i).counters().acks;
  }
  outcome.collided = robots->medium(0).counters().collided_blocks;
  return outcome;
}

class OneChannel : public testing::TestWithParam<Case> {};

TEST_P(OneChannel, TheSimulatorsServerAndTheDaemonsLinkSendTheSameAtTheSameTime) {
  const Outcome simulators = Drive<SimulatorsDriver>(GetParam());
  const Outcome daemons = Drive<DaemonsDriver>(GetParam());
  for (size_t i = 0; i < std::min(simulators.trace.size(), daemons.trace.size()); ++i) {
    ASSERT_EQ(simulators.trace[i], daemons.trace[i]) << "line " << i;
  }
  EXPECT_EQ(simulators.trace.size(), daemons.trace.size());
  EXPECT_EQ(simulators.state_hash, daemons.state_hash);
  EXPECT_EQ(simulators.late_answers, daemons.late_answers);
  // The end may come while a line is being keyed, where only one of them has counted its ROUND.
  EXPECT_NEAR(static_cast<double>(simulators.rounds), static_cast<double>(daemons.rounds), 1);
  EXPECT_EQ(GetParam().rounds, simulators.rounds != 0);
  EXPECT_GE(simulators.answers, 50u);
  EXPECT_GE(simulators.acks, 3u);  // of 10 COMMANDs
  std::cout << fmt::format(
      "{} runs of bytes, {} answers, {} ACKs, {} rounds, {} late, {} collided\n",
      simulators.trace.size(), simulators.answers, simulators.acks, simulators.rounds,
      simulators.late_answers, simulators.collided);
}

INSTANTIATE_TEST_SUITE_P(
    Cases, OneChannel,
    testing::Values(Case{"Contention9600", 9600, 2, false}, Case{"Rounds9600", 9600, 2, true},
                    Case{"Contention115200", 115'200, 2, false},
                    Case{"Rounds115200", 115'200, 2, true},
                    Case{"ContentionWithoutCarrier", 9600, 2, false, false},
                    Case{"RoundsWithoutCarrier", 9600, 2, true, false},
                    Case{"ContentionOfSlowModems", 9600, 20, false},
                    Case{"RoundsOfSlowModems", 9600, 20, true},
                    Case{"ContentionKeyed", 9600, 2, false, true, true},
                    Case{"RoundsKeyed", 9600, 2, true, true, true},
                    Case{"ContentionWithLosses", 9600, 2, false, true, false, 0.05},
                    Case{"RoundsWithLosses", 9600, 2, true, true, false, 0.05}),
    [](const auto& it) { return it.param.name; });

}  // namespace
}  // namespace pheromone
