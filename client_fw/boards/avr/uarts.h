// The two UARTs of an ATmega1284P, driven by interrupts through rings of bytes: 0 is the radio, 1
// the robot. Also controls the radio's PTT line: high before the first bit of a transmission, low
// after its last.
//
//   StartUarts();                                // then sei()
//   const int byte = uarts[kRadio].Get();        // -1: none
//   const bool queued = SendRadio(byte);         // false: no room
//
// 8 data bits, no parity, one stop bit. A byte that finds its ring full is lost. For the main loop,
// never for interrupts.
#pragma once

// The layout of a Uart, for uart_interrupt.S.
#define UART_RECEIVED_IN 0
#define UART_RECEIVED_OUT 1
#define UART_TO_SEND_IN 2
#define UART_TO_SEND_OUT 3
#define UART_FRAMING_ERRORS 4
#define UART_OVERRUNS 5
#define UART_RECEIVED 6
#define UART_RING_SIZE 64
#define UART_TO_SEND (UART_RECEIVED + UART_RING_SIZE)
#define UART_SIZE (UART_TO_SEND + UART_RING_SIZE)

#ifndef __ASSEMBLER__
#include <stddef.h>
#include <stdint.h>

namespace pheromone {
namespace client {

/// Two rings of UART_RING_SIZE - 1 bytes. One side of each is the interrupts', the other the main
/// loop's: each writes its own index only, after it is done with the byte, hence volatile.
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
  volatile uint8_t received[UART_RING_SIZE];
  volatile uint8_t to_send[UART_RING_SIZE];
};
static_assert(offsetof(Uart, received_in) == UART_RECEIVED_IN, "");
static_assert(offsetof(Uart, received_out) == UART_RECEIVED_OUT, "");
static_assert(offsetof(Uart, to_send_in) == UART_TO_SEND_IN, "");
static_assert(offsetof(Uart, to_send_out) == UART_TO_SEND_OUT, "");
static_assert(offsetof(Uart, framing_errors) == UART_FRAMING_ERRORS, "");
static_assert(offsetof(Uart, overruns) == UART_OVERRUNS, "");
static_assert(offsetof(Uart, received) == UART_RECEIVED, "");
static_assert(offsetof(Uart, to_send) == UART_TO_SEND, "");
static_assert(sizeof(Uart) == UART_SIZE, "");

enum : uint8_t { kRadio, kRobot };
extern "C" Uart uarts[2];

void StartUarts();
bool SendRadio(uint8_t byte);
bool SendRobot(uint8_t byte);

}  // namespace client
}  // namespace pheromone
#endif
