// The registers of the mps2-an385 that the firmware uses. Sources: ARMv7-M Architecture Reference
// Manual, B3 (system timer, NVIC); Arm Cortex-M System Design Kit, Technical Reference Manual
// (UART, GPIO, watchdog); Arm application note AN385 (addresses, interrupts, 25 MHz).
#pragma once

#include <stdint.h>

namespace pheromone {
namespace client {

constexpr uint32_t kClockHz = 25000000;

struct UartRegisters {
  volatile uint32_t data;
  volatile uint32_t state;      ///< kSendFull, kReceiveFull
  volatile uint32_t control;    ///< kUart...
  volatile uint32_t interrupt;  ///< kSendFull, kReceiveFull; write to clear
  volatile uint32_t divisor;
};
enum : uint32_t { kSendFull = 1, kReceiveFull = 2 };
enum : uint32_t {
  kUartSend = 1,
  kUartReceive = 2,
  kUartSendInterrupt = 4,
  kUartReceiveInterrupt = 8,
};

struct GpioRegisters {
  volatile uint32_t data;
  volatile uint32_t out;
  volatile uint32_t reserved[2];
  volatile uint32_t output_enable_set;
};

struct WatchdogRegisters {
  volatile uint32_t load;
  volatile uint32_t value;
  volatile uint32_t control;  ///< 1: interrupt at the first expiry; 2: reset at the second
  volatile uint32_t interrupt_clear;
};

struct SysTickRegisters {
  volatile uint32_t control;  ///< 7: processor clock, interrupt, on
  volatile uint32_t reload;
  volatile uint32_t value;
};

inline UartRegisters& Uart(uint8_t number) {
  return *reinterpret_cast<UartRegisters*>(0x40004000u + 0x1000u * number);
}
inline GpioRegisters& Gpio() {
  return *reinterpret_cast<GpioRegisters*>(0x40010000u);
}
inline WatchdogRegisters& Watchdog() {
  return *reinterpret_cast<WatchdogRegisters*>(0x40008000u);
}
inline SysTickRegisters& SysTick() {
  return *reinterpret_cast<SysTickRegisters*>(0xE000E010u);
}

/// Interrupts 0 to 3: UART 0 received, UART 0 sent, UART 1 received, UART 1 sent.
inline void EnableUartInterrupts() {
  *reinterpret_cast<volatile uint32_t*>(0xE000E100u) = 0xFu;
}

/// Those that wait while interrupts are disabled.
inline void ForgetUartInterrupts() {
  *reinterpret_cast<volatile uint32_t*>(0xE000E280u) = 0xFu;
}

inline void DisableInterrupts() {
  __asm volatile("cpsid i" ::: "memory");
}
inline void EnableInterrupts() {
  __asm volatile("cpsie i" ::: "memory");
}
inline void WaitForInterrupt() {
  __asm volatile("wfi" ::: "memory");
}

}  // namespace client
}  // namespace pheromone
