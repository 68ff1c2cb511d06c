#include "proto_tests/avr_core/avr_core.h"

#include <stdexcept>

namespace pheromone::core_boundary {
namespace {

constexpr int64_t kBaud = 2'000'000;
constexpr int64_t kByteNs = 5'000;
constexpr int64_t kPollNs = 50'000;
constexpr int64_t kPatienceNs = 1'000'000'000;

sim::AvrMachineConfig ConfigOf(const std::string& image) {
  sim::AvrMachineConfig config;
  config.image = image;
  config.radio_baud = kBaud;
  return config;
}

}  // namespace

AvrCore::AvrCore(const std::string& image) : machine_(ConfigOf(image)) {
  machine_.OnSent(sim::AvrMachine::kRadio,
                  [this](uint8_t byte, int64_t /*time_ns*/) { received_.push_back(byte); });
  machine_.RunTo(kPollNs * 200);  // until it listens
}

std::vector<uint8_t> AvrCore::Run(const std::vector<uint8_t>& request) {
  const uint64_t before = machine_.cycles();
  received_.clear();
  int64_t at = machine_.now_ns();
  const auto send = [&](size_t byte) {
    machine_.Send(sim::AvrMachine::kRadio, static_cast<uint8_t>(byte & 0xFF), at += kByteNs);
  };
  send(request.size());
  send(request.size() >> 8);
  for (const uint8_t byte : request) {
    send(byte);
  }
  const int64_t until = at + kPatienceNs;
  while (received_.size() < 2 ||
         received_.size() < 2u + received_[0] + (static_cast<size_t>(received_[1]) << 8)) {
    at += kPollNs;
    if (at > until) {
      throw std::runtime_error("the AVR does not answer");
    }
    machine_.RunTo(at);
  }
  cycles_ = machine_.cycles() - before;
  return {received_.begin() + 2, received_.end()};
}

}  // namespace pheromone::core_boundary
