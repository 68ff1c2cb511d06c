#include "client_fw/swarm/simulation.h"

#include <algorithm>
#include <cassert>

namespace pheromone::swarm {
namespace {

constexpr int64_t kNsPerMs = 1'000'000;
constexpr uint16_t kGapTimeoutMs = 20;
constexpr uint16_t kEpoch = 1;

}  // namespace

EngineStation::EngineStation(engine::Service* service, sim::RadioMedium* medium, int64_t baud,
                             const ServerTiming& timing)
    : service_(service),
      medium_(medium),
      timing_(timing),
      byte_ns_(int64_t{10} * 1'000'000'000 / baud),
      decoder_(kGapTimeoutMs),
      number_(medium->AddStation(this)) {}

void EngineStation::OnByte(uint8_t byte, int64_t time_ns) {
  if (!decoder_.Push(byte, static_cast<uint32_t>(time_ns / kNsPerMs))) {
    return;
  }
  std::vector<engine::Outgoing> out;
  service_->Handle(0, {&decoder_.message(), 1}, &out);
  Queue(out, time_ns);
}

void EngineStation::Queue(const std::vector<engine::Outgoing>& out, int64_t time_ns) {
  for (const engine::Outgoing& answer : out) {
    std::vector<uint8_t> frame(protocol::kMaxFrame);
    frame.resize(protocol::EncodeFrame(answer.message, frame.data(), frame.size()));
    pending_.push_back({time_ns + std::max(timing_.delay_ns, byte_ns_),
                        time_ns + timing_.response_window_ns, std::move(frame)});
  }
}

void EngineStation::OnTransmitted(int64_t /*time_ns*/) {}

void EngineStation::Step() {
  const int64_t now_ns = medium_->now_ns();
  std::vector<engine::Outgoing> due;
  service_->AdvanceIfDue(&due);
  Queue(due, now_ns);
  while (!pending_.empty() && pending_.front().not_before_ns <= now_ns) {
    if (pending_.front().not_after_ns < now_ns) {
      ++late_answers_;
      pending_.pop_front();
      continue;
    }
    if (medium_->Busy(number_)) {
      return;
    }
    medium_->Transmit(number_, pending_.front().frame);
    pending_.pop_front();
  }
}

Simulation::Simulation(const SimulationConfig& config)
    : medium_(config.radio),
      service_(&log_,
               [this] {
                 const auto now_ms = static_cast<uint64_t>(medium_.now_ns() / kNsPerMs);
                 return engine::ClockReading{now_ms, static_cast<int64_t>(now_ms)};
               }),
      station_(&service_, &medium_, config.radio.baud, config.server),
      robot_(config.robot, &medium_) {
  const Status configured = service_.Configure(config.engine, kEpoch);
  assert(configured.ok());
  (void)configured;
}

void Simulation::RunTo(int64_t ms) {
  for (int64_t at = now_ms() + 1; at <= ms; ++at) {
    medium_.AdvanceTo(at * kNsPerMs);
    station_.Step();
    robot_.Step();
  }
}

}  // namespace pheromone::swarm
