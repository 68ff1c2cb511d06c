#include "client_fw/boards/avr/uarts.h"

#include <avr/interrupt.h>
#include <avr/io.h>

#include "client_fw/boards/avr/clock.h"
#include "client_fw/boards/avr/loop.h"
#include "client_fw/boards/avr/pins.h"
#include "client_fw/core/base/outlined.h"

namespace pheromone {
namespace client {
namespace {

constexpr uint8_t kEnabled = 1u << RXCIE0 | 1u << RXEN0 | 1u << TXEN0;

constexpr BaudSetting kRadioBaud = SettingFor<F_CPU, PHEROMONE_RADIO_BAUD>();

// All with eight samples a bit.
template <uint32_t... kBauds>
struct Divisors {
  enum : uint8_t { kSize = sizeof...(kBauds) };
  uint16_t of[kSize] = {DoubleSpeedDivisor<F_CPU, kBauds>()...};
};
const Divisors<PHEROMONE_ROBOT_BAUDS> robot_divisors;

uint8_t After(uint8_t index) {
  return static_cast<uint8_t>((index + 1u) & (kRingSize - 1u));
}

// The registers of a UART; those of the second are behind those of the first.
struct Registers {
  uint8_t status;   // UCSRnA
  uint8_t control;  // UCSRnB
  uint8_t others[4];
  uint8_t data;  // UDRn
  uint8_t reserved;
};

void Receive(volatile Registers* registers, Uart* uart) {
  const uint8_t status = registers->status;  // of the byte to be taken next
  if ((status & 1u << RXC0) == 0) {
    return;
  }
  if ((status & 1u << FE0) != 0) {
    uart->framing_errors = static_cast<uint8_t>(uart->framing_errors + 1u);
  }
  if ((status & 1u << DOR0) != 0) {
    uart->overruns = static_cast<uint8_t>(uart->overruns + 1u);
  }
  const uint8_t at = uart->received_in;
  uart->received[at] = registers->data;  // has to be taken even if there is no room
  if (After(at) != uart->received_out) {
    uart->received_in = After(at);  // otherwise the byte is overwritten by the next
  }
}

void Send(volatile Registers* registers, Uart* uart) {
  // Without the second, it is a lead: the interrupt may be the other UART's.
  if ((registers->status & 1u << UDRE0) == 0 || (registers->control & 1u << UDRIE0) == 0) {
    return;
  }
  const uint8_t at = uart->to_send_out;
  if (at == uart->to_send_in) {  // no more interrupts until there is something to send
    registers->control = static_cast<uint8_t>(registers->control & ~(1u << UDRIE0));
    return;
  }
  registers->data = uart->to_send[at];
  // Transmission is complete only once this byte is out: TXC, should it be up, is cleared.
  registers->status = static_cast<uint8_t>((registers->status & 1u << U2X0) | 1u << TXC0);
  uart->to_send_out = After(at);
}

// Of a lead or a tail.
volatile uint16_t left_ms;

// Timer 1's second compare interrupts as long after each millisecond as the wait began after one.
#define PHEROMONE_BEGIN_WAIT()            \
  do {                                    \
    OCR1B = TCNT1;                        \
    TIFR1 = 1u << OCF1B;                  \
    TIMSK1 = 1u << OCIE1A | 1u << OCIE1B; \
  } while (false)

}  // namespace

Uart uarts[2];
Keying keying;

void StartUarts() {
  // U2X before UBRR: the simulator works out a byte's time when UBRR is written.
  if (kRadioBaud.double_speed) {
    UCSR0A = 1u << U2X0;
  }
  UCSR1A = 1u << U2X1;
  if (kRadioBaud.divisor > 0xFFu) {
    UBRR0H = static_cast<uint8_t>(kRadioBaud.divisor >> 8);
  }
  UBRR0L = static_cast<uint8_t>(kRadioBaud.divisor & 0xFFu);
  UCSR0B = kEnabled | 1u << TXCIE0;
  UCSR1B = kEnabled;
}

// Writing the register disturbs a byte that is being received.
void SetRobotRate(uint8_t number) {
  const uint16_t divisor = robot_divisors.of[number % robot_divisors.kSize];
  if (UBRR1 != divisor) {
    UBRR1 = divisor;
  }
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

PHEROMONE_OUTLINED bool Uart::Put(uint8_t byte) {
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
  if ((PORTD & kPtt) == 0) {
    PORTD |= kPtt;  // before the interrupt that sends the first byte
    if (keying.lead_ms != 0) {
      left_ms = keying.lead_ms;
      PHEROMONE_BEGIN_WAIT();
    }
  }
  if ((TIMSK1 & 1u << OCIE1B) == 0) {
    UCSR0B = kEnabled | 1u << TXCIE0 | 1u << UDRIE0;
  }
  return queued;
}

bool SendRobot(uint8_t byte) {
  const bool queued = uarts[kRobot].Put(byte);
  UCSR1B = kEnabled | 1u << UDRIE1;
  return queued;
}

}  // namespace client
}  // namespace pheromone

// Any of four interrupts: a byte came in, or one more can go out, on either UART. One routine for
// all is a quarter of the size of four, and looking twice does no harm.
ISR(USART0_RX_vect) {
  using namespace pheromone::client;
  WakeLoop();
  volatile Registers* registers = reinterpret_cast<volatile Registers*>(&UCSR0A);
  Uart* uart = uarts;
  for (uint8_t left = 2; left != 0; --left) {
    asm("" : "+z"(registers), "+y"(uart));
    Receive(registers, uart);
    Send(registers, uart);
    ++registers;
    ++uart;
  }
}
ISR(USART0_UDRE_vect, ISR_ALIASOF(USART0_RX_vect));
ISR(USART1_RX_vect, ISR_ALIASOF(USART0_RX_vect));
ISR(USART1_UDRE_vect, ISR_ALIASOF(USART0_RX_vect));

// The radio has sent its last stop bit, and the tail begins; or another millisecond has passed of
// the tail, or of a lead, after which there is something to send.
ISR(USART0_TX_vect) {
  using namespace pheromone::client;
  uint16_t left = keying.tail_ms;
  if ((TIMSK1 & 1u << OCIE1B) != 0) {
    left = static_cast<uint16_t>(left_ms - 1u);
  } else if (left != 0) {
    PHEROMONE_BEGIN_WAIT();
  }
  left_ms = left;
  if (left != 0) {
    return;
  }
  TIMSK1 = 1u << OCIE1A;
  if (uarts[kRadio].to_send_in != uarts[kRadio].to_send_out) {
    UCSR0B = kEnabled | 1u << TXCIE0 | 1u << UDRIE0;
  } else {
    PORTD &= static_cast<uint8_t>(~kPtt);
    WakeLoop();
  }
}
ISR(TIMER1_COMPB_vect, ISR_ALIASOF(USART0_TX_vect));
