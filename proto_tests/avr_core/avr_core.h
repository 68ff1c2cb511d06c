// The core on a simulated AVR (core_image.cc), used as CoreTurn is on the host.
//
//   AvrCore core(path);
//   const std::vector<uint8_t> reply = core.Run(request);
//   core.cycles();                                  // of the last request, including the UART
//
// One thread. Throws std::runtime_error if the processor does not answer or crashes.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "client_fw/sim/avr/avr_machine.h"

namespace pheromone::core_boundary {

class AvrCore {
 public:
  explicit AvrCore(const std::string& image);

  std::vector<uint8_t> Run(const std::vector<uint8_t>& request);

  uint64_t cycles() const { return cycles_; }
  const sim::AvrMachine& machine() const { return machine_; }

 private:
  sim::AvrMachine machine_;
  std::vector<uint8_t> received_;
  uint64_t cycles_ = 0;
};

}  // namespace pheromone::core_boundary
