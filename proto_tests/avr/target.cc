// The conformance image on an ATmega1284P in libsimavr.
#include "proto_tests/conformance/target.h"

#include <algorithm>
#include <deque>
#include <stdexcept>

#include "client_fw/sim/avr/avr_machine.h"

namespace pheromone::conformance {
namespace {

using sim::AvrMachine;

constexpr int64_t kBaud = 2'000'000;
constexpr int64_t kByteNs = 5'000;
constexpr int64_t kStartNs = 10'000'000;  // until it listens
constexpr int64_t kPollNs = 50'000;
constexpr int64_t kPatienceNs = 10'000'000'000;  // a hundred times what a command takes

class AvrTarget : public Target {
 public:
  AvrTarget() : machine_({.image = PHEROMONE_AVR_IMAGE, .radio_baud = kBaud}) {
    machine_.OnSent(AvrMachine::kRadio,
                    [this](uint8_t byte, int64_t /*time_ns*/) { received_.push_back(byte); });
    machine_.RunTo(kStartNs);
  }

  void Send(const std::vector<uint8_t>& bytes) override {
    for (const uint8_t byte : bytes) {
      sent_ns_ = std::max(sent_ns_, machine_.now_ns()) + kByteNs;
      machine_.Send(AvrMachine::kRadio, byte, sent_ns_);
    }
  }

  uint8_t Receive() override {
    const int64_t until = machine_.now_ns() + kPatienceNs;
    while (received_.empty()) {
      if (machine_.now_ns() > until) {
        throw std::runtime_error("the AVR does not answer");
      }
      machine_.RunTo(machine_.now_ns() + kPollNs);
    }
    const uint8_t byte = received_.front();
    received_.pop_front();
    return byte;
  }

 private:
  AvrMachine machine_;
  std::deque<uint8_t> received_;
  int64_t sent_ns_ = 0;
};

}  // namespace

std::unique_ptr<Target> MakeTarget() {
  return std::make_unique<AvrTarget>();
}

std::pair<int, int> TargetSizes() {
  return {2, 2};
}

}  // namespace pheromone::conformance
