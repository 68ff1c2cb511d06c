// The two UARTs of an ATmega1284P, driven by interrupts through rings of bytes: 0 is the radio, 1
// the robot. Also keys the radio's transmitter (PTT): high for the lead before the first bit of a
// transmission, and for the tail after its last one, both to the cycle.
//
//   StartUarts();                                // then sei()
//   const int byte = uarts[kRadio].Get();        // -1: none
//   const bool queued = SendRadio(byte);         // false: no room
//
// 8 data bits, no parity, one stop bit. A byte that finds its ring full is lost. For the main loop,
// never for interrupts.
#pragma once

#include <stdint.h>

namespace pheromone {
namespace client {

/// The size of a ring, which holds a byte less; a power of 2.
constexpr uint8_t kRingSize = 64;

/// Two rings. One side of each is the interrupts', the other the main loop's: each writes its own
/// index only, after it is done with the byte, hence volatile.
struct Uart {
  /// The oldest byte received, or -1.
  int Get();
  /// Queues a byte; false if there is no room. The caller must make the UART send.
  bool Put(uint8_t byte);

  volatile uint8_t received_in;   ///< next to be written
  volatile uint8_t received_out;  ///< next to be read
  volatile uint8_t to_send_in;
  volatile uint8_t to_send_out;
  volatile uint8_t framing_errors;  ///< bytes without a stop bit; wraps
  volatile uint8_t overruns;        ///< bytes were lost before this many others; wraps
  volatile uint8_t received[kRingSize];
  volatile uint8_t to_send[kRingSize];
};

enum : uint8_t { kRadio, kRobot };
extern Uart uarts[2];

/// Milliseconds. To be set while PTT is low.
struct Keying {
  uint16_t lead_ms;
  uint16_t tail_ms;
};
extern Keying keying;

void StartUarts();
bool SendRadio(uint8_t byte);
bool SendRobot(uint8_t byte);
/// The robot's bit rate is that of PHEROMONE_ROBOT_BAUDS at `number`, modulo their number. Before
/// the first call it is undefined. To be changed while nothing is being sent.
void SetRobotRate(uint8_t number);

}  // namespace client
}  // namespace pheromone
