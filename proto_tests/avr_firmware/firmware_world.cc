#include "proto_tests/avr_firmware/firmware_world.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "client_fw/core/conversation.h"
#include "client_fw/sim/avr/avr_settings.h"
#include "protocol/byte_order.h"

namespace pheromone::firmware {
namespace {

constexpr int64_t kNsPerMs = 1'000'000;
constexpr uint8_t kType = 1;
constexpr int64_t kUm = 1'000'000;  // a metre

engine::EngineConfig Engine() {
  field::PheromoneLaw law;
  law.type = kType;
  law.name = "path";
  law.core_um = kUm / 10;
  law.sigma_um = kUm * 4 / 10;
  law.tau_ms = 0;
  law.quantum_micro = 125'000;
  law.max_count = 30'000;
  engine::EngineConfig config;
  config.field.map = {.origin = {-2 * kUm, -5 * kUm},
                      .width_um = 12 * kUm,
                      .height_um = 10 * kUm,
                      .cell_um = kUm / 10};
  config.field.antennas.distance_um = kUm * 33 / 100;
  config.field.pheromones = {law};
  config.field.paths = {FirmwareWorld::Path()};
  config.field.memory_bytes = 16 << 20;
  config.links = {{"radio-a", 3, 20}};
  return config;
}

sim::AvrRobotConfig Robot(uint64_t seed, const std::vector<uint8_t>& eeprom,
                          const sim::PioneerConfig& pioneer) {
  sim::AvrRobotConfig config;
  config.machine.image = PHEROMONE_CLIENT_AVR_IMAGE;
  config.machine.seed = seed;
  config.machine.eeprom = eeprom;
  config.pioneer = pioneer;
  config.id = kRobotId;
  return config;
}

}  // namespace

field::Path FirmwareWorld::Path() {
  field::Path path;
  path.type = kType;
  path.count = 8;
  path.points = {{0, kUm / 10}, {2 * kUm, kUm / 10}};
  constexpr int kSteps = 32;
  constexpr double kRadiusM = 1.2;
  for (int i = 1; i <= kSteps; ++i) {  // a quarter of a circle to the left
    const double angle = std::numbers::pi / 2 * i / kSteps;
    path.points.push_back({2 * kUm + std::llround(kRadiusM * std::sin(angle) * 1e6),
                           kUm / 10 + std::llround(kRadiusM * (1 - std::cos(angle)) * 1e6)});
  }
  path.points.push_back({path.points.back().x, 4 * kUm});
  return path;
}

FirmwareWorld::Server::Server(uint16_t epoch, sim::RadioMedium* medium)
    : service(&log,
              [medium] {
                const int64_t now_ms = medium->now_ns() / kNsPerMs;
                return engine::ClockReading{static_cast<uint64_t>(now_ms), now_ms};
              }),
      station(&service, 0, Engine().links[0], medium, swarm::ServerTiming{}) {
  const auto configured = service.Configure(Engine(), epoch);
  if (!configured.ok()) {
    throw std::runtime_error(configured.error());
  }
  quanta_of_path = QuantaOf(service);
}

void FirmwareWorld::Ear::OnByte(uint8_t byte, int64_t time_ns) {
  if (decoder.Push(byte, static_cast<uint32_t>(time_ns / kNsPerMs))) {
    heard.push_back({time_ns / kNsPerMs, decoder.message()});
  }
}

FirmwareWorld::FirmwareWorld(uint64_t seed, const sim::RadioConfig& radio,
                             const std::vector<uint8_t>& eeprom, const sim::PioneerConfig& pioneer)
    : medium_(radio), robot_(Robot(seed, eeprom, pioneer), &medium_) {
  medium_.AddStation(&ear_);
  servers_.emplace_back(epoch_, &medium_);
}

void FirmwareWorld::StartServer() {
  servers_.emplace_back(++epoch_, &medium_);
  running_ = true;
}

void FirmwareWorld::RunFor(int64_t ms) {
  RunUntil([] { return false; }, ms);
}

void FirmwareWorld::ResetAfter(int64_t ns, sim::AvrMachine::Cause cause) {
  robot_.RunAhead(ns);
  robot_.Reset(cause);
}

bool FirmwareWorld::RunUntil(const std::function<bool()>& happened, int64_t ms) {
  for (const int64_t end_ms = now_ms() + ms; now_ms() < end_ms;) {
    const int64_t next_ns = (now_ms() + 1) * kNsPerMs;
    if (!running_) {
      medium_.AdvanceTo(next_ns);
    } else {
      servers_.back().station.AdvanceTo(next_ns);
      std::vector<engine::Outgoing> due;
      service().AdvanceIfDue(&due);
      for (const engine::Outgoing& outgoing : due) {
        servers_.back().station.Queue(outgoing);
      }
    }
    robot_.Step();
    if (happened()) {
      return true;
    }
  }
  return false;
}

std::vector<uint8_t> FirmwareWorld::Released() {
  client::Settings settings;
  settings.start_released = true;
  return sim::AvrEepromWith(settings, 1);
}

bool FirmwareWorld::Set(client::SettingId setting, int32_t value) {
  std::vector<uint8_t> arguments(5);
  arguments[0] = setting;
  protocol::PutI32(arguments.data() + 1, value);
  return Command(protocol::CommandCode::kSetParameter, arguments);
}

bool FirmwareWorld::GivePose(int32_t x_mm, int32_t y_mm, uint16_t heading) {
  return Set(static_cast<client::SettingId>(client::kPoseX), x_mm) &&
         Set(static_cast<client::SettingId>(client::kPoseY), y_mm) &&
         Set(static_cast<client::SettingId>(client::kPoseHeading), heading);
}

bool FirmwareWorld::Command(protocol::CommandCode code, std::vector<uint8_t> arguments) {
  engine::CommandIssued command;
  command.id = kRobotId;
  command.code = code;
  std::copy(arguments.begin(), arguments.end(), command.arguments.begin());
  std::vector<engine::Outgoing> out;
  if (!service().Issue(command, &out).ok()) {
    return false;
  }
  for (const engine::Outgoing& outgoing : out) {
    servers_.back().station.Queue(outgoing);
  }
  const size_t before = heard().size();
  protocol::CommandAck ack;
  return RunUntil([&] { return CountHeard(protocol::kCommandAck, before) != 0; }, 5000) &&
         Decode(LastHeard(protocol::kCommandAck)->message, &ack) && ack.result == 0;
}

size_t FirmwareWorld::CountEvents(protocol::EventCode code, size_t from) const {
  size_t count = 0;
  for (size_t i = from; i < heard().size(); ++i) {
    protocol::EventReport event;
    count += Decode(heard()[i].message, &event) && event.code == code ? 1u : 0u;
  }
  return count;
}

const HeardFrame* FirmwareWorld::LastHeard(uint8_t opcode) const {
  const auto last =
      std::find_if(heard().rbegin(), heard().rend(),
                   [opcode](const HeardFrame& frame) { return frame.message.opcode == opcode; });
  return last == heard().rend() ? nullptr : &*last;
}

size_t FirmwareWorld::CountHeard(uint8_t opcode, size_t from) const {
  size_t count = 0;
  for (size_t i = from; i < heard().size(); ++i) {
    count += heard()[i].message.opcode == opcode ? 1u : 0u;
  }
  return count;
}

uint64_t FirmwareWorld::QuantaOf(const engine::Service& service) {
  return service.Inspect([](const engine::Engine& engine) {
    uint64_t levels = 0;
    engine.field().VisitLevels(kType, 0,
                               [&](field::NodeIndex /*node*/, uint32_t level) { levels += level; });
    return levels >> field::kLevelBits;
  });
}

uint64_t FirmwareWorld::Deposits() const {
  return QuantaOf(servers_.back().service) - servers_.back().quanta_of_path;
}

FirmwareWorld::Place FirmwareWorld::WhereIsTheRobot() const {
  const auto points = Path().points;
  const sim::PlanePose& pose = robot_.true_pose();
  Place place{std::numeric_limits<double>::max(), 0};
  double passed_m = 0;
  for (size_t i = 1; i < points.size(); ++i) {
    const double ax = static_cast<double>(points[i - 1].x) / 1e6;
    const double ay = static_cast<double>(points[i - 1].y) / 1e6;
    const double dx = static_cast<double>(points[i].x) / 1e6 - ax;
    const double dy = static_cast<double>(points[i].y) / 1e6 - ay;
    const double length = std::hypot(dx, dy);
    const double t =
        std::clamp(((pose.x_m - ax) * dx + (pose.y_m - ay) * dy) / (length * length), 0.0, 1.0);
    const double off_m = std::hypot(ax + t * dx - pose.x_m, ay + t * dy - pose.y_m);
    if (off_m < place.off_path_m) {
      place = {off_m, passed_m + t * length};
    }
    passed_m += length;
  }
  return place;
}

}  // namespace pheromone::firmware
