#include "client_fw/boards/avr/uarts.h"

#include <avr/io.h>

#include "client_fw/boards/avr/clock.h"
#include "client_fw/boards/avr/pins.h"

namespace pheromone {
namespace client {
namespace {

constexpr uint8_t kEnabled = 1u << RXCIE0 | 1u << RXEN0 | 1u << TXEN0;

constexpr BaudSetting kRadioBaud = SettingFor<F_CPU, PHEROMONE_RADIO_BAUD>();
constexpr BaudSetting kRobotBaud = SettingFor<F_CPU, PHEROMONE_ROBOT_BAUD>();

uint8_t After(uint8_t index) {
  return static_cast<uint8_t>((index + 1u) & (UART_RING_SIZE - 1u));
}

}  // namespace

extern "C" {
Uart uarts[2] __attribute__((used));  // by uart_interrupt.S
}

void StartUarts() {
  // U2X before UBRR: the simulator works out a byte's time when UBRR is written.
  if (kRadioBaud.double_speed) {
    UCSR0A = 1u << U2X0;
  }
  if (kRobotBaud.double_speed) {
    UCSR1A = 1u << U2X1;
  }
  if (kRadioBaud.divisor > 0xFFu) {
    UBRR0H = static_cast<uint8_t>(kRadioBaud.divisor >> 8);
  }
  if (kRobotBaud.divisor > 0xFFu) {
    UBRR1H = static_cast<uint8_t>(kRobotBaud.divisor >> 8);
  }
  UBRR0L = static_cast<uint8_t>(kRadioBaud.divisor & 0xFFu);
  UBRR1L = static_cast<uint8_t>(kRobotBaud.divisor & 0xFFu);
  UCSR0B = kEnabled | 1u << TXCIE0;
  UCSR1B = kEnabled;
}

int Uart::Get() {
  const uint8_t at = received_out;
  if (at == received_in) {
    return -1;
  }
  const uint8_t byte = received[at];
  received_out = After(at);
  return byte;
}

bool Uart::Put(uint8_t byte) {
  const uint8_t at = to_send_in;
  if (After(at) == to_send_out) {
    return false;
  }
  to_send[at] = byte;
  to_send_in = After(at);
  return true;
}

bool SendRadio(uint8_t byte) {
  const bool queued = uarts[kRadio].Put(byte);
  PORTD |= kPtt;  // before the interrupt that sends the first byte
  UCSR0B = kEnabled | 1u << TXCIE0 | 1u << UDRIE0;
  return queued;
}

bool SendRobot(uint8_t byte) {
  const bool queued = uarts[kRobot].Put(byte);
  UCSR1B = kEnabled | 1u << UDRIE1;
  return queued;
}

}  // namespace client
}  // namespace pheromone
