#include "proto_tests/attacked_channel/attacked_channel.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "client_fw/sim/pioneer/pioneer_models.h"
#include "client_fw/swarm/channel_model.h"
#include "client_fw/swarm/robots.h"
#include "server/base/bytes.h"

namespace pheromone::attack {
namespace {

constexpr int64_t kNsPerMs = 1'000'000;
constexpr int64_t kUm = 1'000'000;  // a metre
constexpr uint8_t kPath = 1;
constexpr uint8_t kNothing = 2;  // the type of which there is nothing
constexpr double kRadiusM = 1.5;
constexpr uint32_t kPathQuanta = 100;

// The modem of an image keys with the first byte: for the image every answer is later by a
// turnaround.
constexpr swarm::ChannelTiming kTiming{.server_delay_ns = 4'000'000};

sim::PlanePose OnCircle(double angle_rad) {  // the lowest point is the origin
  return {kRadiusM * std::sin(angle_rad), kRadiusM * (1 - std::cos(angle_rad)), angle_rad};
}

field::Path Circle() {
  field::Path path;
  path.type = kPath;
  path.count = kPathQuanta;
  constexpr int kSteps = 96;
  for (int i = 0; i <= kSteps; ++i) {
    const sim::PlanePose at = OnCircle(2 * std::numbers::pi * i / kSteps);
    path.points.push_back({std::llround(at.x_m * 1e6), std::llround(at.y_m * 1e6)});
  }
  return path;
}

// A trail's quanta are small, so that the path stays the path.
engine::EngineConfig Engine() {
  field::PheromoneLaw law;
  law.type = kPath;
  law.name = "path";
  law.core_um = kUm / 10;
  law.sigma_um = kUm * 4 / 10;
  law.tau_ms = 0;
  law.quantum_micro = 10'000;
  law.max_count = 60'000;
  engine::EngineConfig config;
  config.field.map = {.origin = {-4 * kUm, -3 * kUm},
                      .width_um = 8 * kUm,
                      .height_um = 8 * kUm,
                      .cell_um = kUm / 10};
  config.field.antennas.distance_um = kUm * 33 / 100;
  config.field.pheromones = {law, law};
  config.field.pheromones[1].type = kNothing;
  config.field.pheromones[1].name = "nothing";
  config.field.paths = {Circle()};
  config.field.memory_bytes = 16 << 20;
  config.links = {kTiming.Link("radio-a")};
  return config;
}

engine::Engine Reloaded(const engine::Service& service) {
  ByteWriter writer;
  service.Inspect([&](const engine::Engine& engine) { engine.Save(&writer); });
  const std::string state = writer.Take();
  ByteReader reader(state);
  Result<engine::Engine> engine = engine::Engine::Restore(&reader);
  if (!engine.ok()) {
    throw std::runtime_error(engine.error());
  }
  return std::move(engine.value());
}

}  // namespace

uint64_t AttackedChannel::Log::Append(const engine::Stamp& /*stamp*/, const engine::Event& event) {
  const auto* request = std::get_if<engine::RequestReceived>(&event);
  protocol::EventReport report;
  if (request != nullptr && Decode(request->message, &report)) {
    forged_events += report.argument == kForgedArgument ? 1 : 0;
  }
  return ++sequence;
}

AttackedChannel::Server::Server(AttackedChannel* channel, uint64_t start_ms, engine::Engine engine)
    : log(engine.sequence()),
      service(
          &log,
          [channel] {
            return engine::ClockReading{static_cast<uint64_t>(channel->now_ms()),
                                        channel->now_ms()};
          },
          start_ms, std::move(engine)) {
  const auto configured = service.Configure(Engine(), 1);
  if (!configured.ok()) {
    throw std::runtime_error(configured.error());
  }
  if (channel->options_.is_signed) {
    signing = std::make_unique<signing::Signing>(
        signing::Security::kRequire, channel->keys_,
        swarm::SeededRandom(channel->options_.seed + 1000 * channel->servers_.size()));
  }
  station = std::make_unique<swarm::ServerStation>(
      &service, 0, Engine().links[0], &channel->medium_, swarm::ServerTiming{}, signing.get());
}

AttackedChannel::AttackedChannel(const ChannelOptions& options)
    : options_(options), medium_({.seed = options.seed}), attacker_(options.seed, &medium_) {
  for (uint8_t id = 1; id <= kRobots && options.is_signed; ++id) {
    swarm::SeededRandom(options.seed * 100 + id)(keys_[id]);
  }
  servers_.emplace_back(this, 0, engine::Engine{});
  path_ = Levels();
  AddRobots();
}

void AttackedChannel::AddRobots() {
  constexpr std::array<double, kRobots> kAngles = {0, 0.3, 2.1, 3.6, 4.2};
  for (size_t i = 0; i < kRobots; ++i) {
    const auto id = static_cast<uint8_t>(i + 1);
    swarm::RobotConfig robot;
    robot.client.id = id;
    robot.client.boot_counter = static_cast<uint16_t>(100 + id);
    robot.client.type = id % 2 == 1 ? kPath : kNothing;
    robot.client.lay_trail = id == 1 || id == 3;
    robot.client.lost_after_ms = 100;
    robot.client.lost_trail = client::LostTrail::kStop;
    robot.client.key = options_.is_signed ? keys_[id].data() : nullptr;
    robot.start = OnCircle(kAngles[i]);
    if (id <= 3) {
      robot.pioneer = sim::FindPioneerModel("p3dx");
    }
    if (id <= 2) {
      robot.image = swarm::BuiltAvrImage();
    }
    robots_.push_back(swarm::MakeRobot(robot, &medium_));
    observers_.emplace_back(options_.is_signed).Join(&medium_);
  }
  HideObservers();
}

// From all that are not the robot beside which they are.
void AttackedChannel::HideObservers() {
  for (size_t i = 0; i < kRobots; ++i) {
    const int last = std::max(servers_.back().station->station(), observers_.back().station());
    for (int station = 0; station <= last; ++station) {
      if (station != robots_[i]->station() && station != observers_[i].station()) {
        medium_.Hide(observers_[i].station(), station);
      }
    }
  }
}

void AttackedChannel::Step() {
  const int64_t next_ns = (now_ms() + 1) * kNsPerMs;
  servers_.back().station->AdvanceTo(next_ns);
  std::vector<engine::Outgoing> due;
  service().AdvanceIfDue(&due);
  for (const engine::Outgoing& outgoing : due) {
    servers_.back().station->Queue(outgoing);
  }
  for (const auto& robot : robots_) {
    robot->Step();
  }
  if (is_attacked_) {
    attacker_.set_way(jams() ? Attacker::Way::kJams : Attacker::Way::kSneaks);
  }
  attacker_.Step();
  if (callback_) {
    callback_();
  }
}

void AttackedChannel::Run(int64_t ms) {
  RunUntil([] { return false; }, now_ms() + ms);
}

bool AttackedChannel::RunUntil(const std::function<bool()>& happened, int64_t end_ms) {
  while (now_ms() < end_ms) {
    if (happened()) {
      return true;
    }
    Step();
  }
  return happened();
}

void AttackedChannel::LosePower() {
  auto& image = dynamic_cast<sim::AvrRobot&>(*robots_.front());
  image.Reset(sim::AvrMachine::Cause::kPowerOn);
}

void AttackedChannel::Restart() {
  const int gone = servers_.back().station->station();
  servers_.emplace_back(this, static_cast<uint64_t>(now_ms()), Reloaded(service()));
  for (int station = 0; station <= servers_.back().station->station(); ++station) {
    medium_.Hide(gone, station);
  }
  HideObservers();
}

bool AttackedChannel::HasSessions() const {
  const signing::Signing* const signing = servers_.back().signing.get();
  for (uint8_t id = 1; id <= kRobots; ++id) {
    if (signing != nullptr && !signing->has_session(id)) {
      return false;
    }
  }
  return true;
}

Status AttackedChannel::Issue(uint8_t id, protocol::CommandCode code) {
  std::vector<engine::Outgoing> out;
  PHEROMONE_TRY_STATUS(service().Issue({0, id, code, {}}, &out));
  for (const engine::Outgoing& outgoing : out) {
    servers_.back().station->Queue(outgoing);
  }
  if (id != protocol::kBroadcastId) {
    issued_[id].push_back(service().Inspect([&](const engine::Engine& engine) {
      return engine.robots().Find(0, id)->command.command;
    }));
  }
  return Ok();
}

uint16_t AttackedChannel::Nonce(uint8_t id) {
  return service().Inspect([&](const engine::Engine& engine) {
    const engine::RobotState* robot = engine.robots().Find(0, id);
    return robot != nullptr ? robot->hello.nonce : uint16_t{0};
  });
}

bool AttackedChannel::Accepted(uint8_t id) {
  return service().Inspect([&](const engine::Engine& engine) {
    const engine::RobotState* robot = engine.robots().Find(0, id);
    return robot != nullptr && robot->command.outcome == engine::CommandOutcome::kAccepted;
  });
}

std::map<Node, int64_t> AttackedChannel::Levels() {
  std::map<Node, int64_t> levels;
  service().Inspect([&](const engine::Engine& engine) {
    engine.field().VisitLevels(
        kPath, static_cast<uint64_t>(now_ms()), [&](field::NodeIndex node, uint32_t level) {
          const field::PointUm at = engine.config().field.map.PositionOf(node);
          levels[NodeNear(at.x / 1000, at.y / 1000)] += level >> field::kLevelBits;
        });
  });
  return levels;
}

std::map<Node, int64_t> AttackedChannel::Deposits() {
  std::map<Node, int64_t> deposits = Levels();
  for (const auto& [node, quanta] : path_) {
    deposits[node] -= quanta;
  }
  return deposits;
}

int AttackedChannel::forged_events() const {
  int sum = 0;
  for (const Server& server : servers_) {
    sum += server.log.forged_events;
  }
  return sum;
}

signing::SigningCounters AttackedChannel::Refused() const {
  signing::SigningCounters sum;
  for (const Server& server : servers_) {
    if (server.signing != nullptr) {
      sum.unsigned_frames += server.signing->counters().unsigned_frames;
      sum.unknown_robots += server.signing->counters().unknown_robots;
      sum.wrong_tags += server.signing->counters().wrong_tags;
    }
  }
  return sum;
}

}  // namespace pheromone::attack
