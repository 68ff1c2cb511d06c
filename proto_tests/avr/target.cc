// The conformance image on an ATmega1284P in libsimavr.
#include "proto_tests/conformance/target.h"

#include "proto_tests/avr/simulated_avr.h"

namespace pheromone::conformance {
namespace {

class AvrTarget : public Target {
 public:
  void Send(const std::vector<uint8_t>& bytes) override { avr_.Send(bytes); }
  uint8_t Receive() override { return avr_.Receive(); }

 private:
  SimulatedAvr avr_{PHEROMONE_AVR_IMAGE};
};

}  // namespace

std::unique_ptr<Target> MakeTarget() {
  return std::make_unique<AvrTarget>();
}

std::pair<int, int> TargetSizes() {
  return {2, 2};
}

}  // namespace pheromone::conformance
