// What a robot of the Arduino library talks through: PheromoneSerial (serial_link.h) or
// PheromoneUdp (udp_link.h). For loop(), never for interrupts.
#pragma once

#include <stdint.h>

#include "client_fw/core/steering/parameters.h"

namespace pheromone {
namespace arduino {

class PheromoneLink {
 public:
  /// Sets what the conversation has to know of this kind of link; then settings 16 and 17 are
  /// known.
  virtual void begin(client::Parameters* parameters) = 0;
  virtual void set_keying(uint16_t /*lead_ms*/, uint16_t /*tail_ms*/) {}

  // As of client_fw/core/robot.h.
  virtual int get() = 0;
  virtual bool put(uint8_t byte) = 0;
  virtual bool idle() = 0;
  /// Bytes of our own are still leaving.
  virtual bool busy() = 0;

 protected:
  ~PheromoneLink() = default;
};

}  // namespace arduino
}  // namespace pheromone
