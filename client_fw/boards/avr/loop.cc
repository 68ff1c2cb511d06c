#include "client_fw/boards/avr/loop.h"

namespace pheromone {
namespace client {

volatile uint16_t clock_ms;

}  // namespace client
}  // namespace pheromone

// A millisecond has passed.
ISR(TIMER1_COMPA_vect) {
  using namespace pheromone::client;
  clock_ms = static_cast<uint16_t>(clock_ms + 1u);
  WakeLoop();
}
