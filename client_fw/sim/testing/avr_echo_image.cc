// A small image for the tests of the AVR machine. UART0 sends back what it gets, with PTT on PD4
// from the first byte queued to the last stop bit; between interrupts the processor sleeps. At its
// start it reports on UART1:
//
//   'R', MCUSR, how often it started since RAM was lost (arbitrary at first), PINA
//
// and then it obeys single letters on UART1, and answers each with the letter when it is done:
//
//   'b'  keeps interrupts off for 5 ms
//   'm'  masks UART0's receive interrupt for 5 ms
//   'e'  adds one to byte 7 of the EEPROM
//   's'  uses kDeepStack bytes of stack
//   'c'  answers with the level of PD5 instead, '0' or '1'
//   'd'  writes two bytes to UART0 at once, without waiting, and a third when there is room
//   'o'  writes three without ever waiting
//   'w'  lets the watchdog, 16 ms, reset it
//   'x'  jumps into erased flash
//   'z'  sleeps with interrupts off
#include "client_fw/sim/testing/avr_echo_image.h"

#include <avr/eeprom.h>
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <avr/wdt.h>
#include <stdint.h>
#include <util/delay.h>

namespace {

constexpr uint8_t kPtt = 1u << PD4;
constexpr uint8_t kControl = 1u << RXEN0 | 1u << TXEN0 | 1u << RXCIE0;

uint8_t starts __attribute__((section(".noinit")));
volatile uint8_t ring[64];
volatile uint8_t in;
volatile uint8_t out;
volatile uint8_t command;

uint8_t After(uint8_t index) {
  return static_cast<uint8_t>((index + 1u) & 63u);
}

void Say(uint8_t byte) {
  while ((UCSR1A & 1u << UDRE1) == 0) {
  }
  UDR1 = byte;
}

__attribute__((noinline)) uint8_t UseStack() {
  volatile uint8_t room[pheromone::sim::kDeepStack];
  for (uint8_t i = 0; i < sizeof(room); ++i) {
    room[i] = i;
  }
  return room[3];
}

void Obey(uint8_t letter) {
  switch (letter) {
    case 'b':
      cli();
      _delay_ms(5);
      sei();
      break;
    case 'm':
      UCSR0B = static_cast<uint8_t>(UCSR0B & ~(1u << RXCIE0));
      _delay_ms(5);
      UCSR0B |= 1u << RXCIE0;
      break;
    case 'e':
      eeprom_write_byte(reinterpret_cast<uint8_t*>(7),
                        static_cast<uint8_t>(eeprom_read_byte(reinterpret_cast<uint8_t*>(7)) + 1));
      eeprom_busy_wait();
      break;
    case 's':
      UseStack();
      break;
    case 'c':
      letter = (PIND & 1u << PD5) != 0 ? '1' : '0';
      break;
    case 'd':
      UDR0 = 'A';
      UDR0 = 'B';
      while ((UCSR0A & 1u << UDRE0) == 0) {
      }
      UDR0 = 'C';
      break;
    case 'o':
      UDR0 = 'A';
      UDR0 = 'B';
      UDR0 = 'C';
      break;
    case 'w':
      wdt_enable(WDTO_15MS);
      for (;;) {
      }
    case 'x':
      asm volatile("jmp 0x1F000");
      break;
    default:  // 'z'
      cli();
      sleep_cpu();
  }
  Say(letter);
}

}  // namespace

ISR(USART0_RX_vect) {
  ring[in] = UDR0;
  in = After(in);
  PORTD |= kPtt;
  UCSR0B |= 1u << UDRIE0;
}

ISR(USART0_UDRE_vect) {
  UDR0 = ring[out];
  UCSR0A = 1u << TXC0;
  out = After(out);
  if (out == in) {
    UCSR0B = static_cast<uint8_t>(UCSR0B & ~(1u << UDRIE0));
  }
}

ISR(USART0_TX_vect) {
  PORTD = static_cast<uint8_t>(PORTD & ~kPtt);
}

ISR(USART1_RX_vect) {
  command = UDR1;
}

int main() {
  const uint8_t cause = MCUSR;
  MCUSR = 0;
  wdt_disable();
  ++starts;
  DDRD = kPtt;
  PORTA = 0xFF;
  UBRR0L = 103;  // 9600 at 16 MHz
  UBRR1L = 103;
  UCSR1B = 1u << RXEN1 | 1u << TXEN1 | 1u << RXCIE1;
  UCSR0B = kControl | 1u << TXCIE0;
  SMCR = 1u << SE;
  const uint8_t report[] = {'R', cause, starts, PINA};
  for (const uint8_t byte : report) {
    Say(byte);
  }
  sei();
  for (;;) {
    cli();
    const uint8_t letter = command;
    command = 0;
    if (letter == 0) {
      sei();
      sleep_cpu();
    }
    sei();
    if (letter != 0) {
      Obey(letter);
    }
  }
}
