// The conformance image on a Cortex-M3 in QEMU.
#include "proto_tests/conformance/target.h"

#include "proto_tests/qemu/qemu_machine.h"

namespace pheromone::conformance {
namespace {

class QemuTarget : public Target {
 public:
  void Send(const std::vector<uint8_t>& bytes) override { machine_.Send(0, bytes); }
  uint8_t Receive() override { return machine_.Receive(0); }

 private:
  QemuMachine machine_{PHEROMONE_QEMU, PHEROMONE_CORTEX_M_IMAGE};
};

}  // namespace

std::unique_ptr<Target> MakeTarget() {
  return std::make_unique<QemuTarget>();
}

std::pair<int, int> TargetSizes() {
  return {4, 4};
}

}  // namespace pheromone::conformance
