// From reset to main on a Cortex-M3, and the vector table. No C library is linked: what the
// compiler itself calls (memcpy and its kin) is here too.
//
// An interrupt's handler is a C function of the name in the table; one that an image does not have
// is a fault, as any other fault is: a loop that the watchdog ends.
#include <stddef.h>
#include <stdint.h>

int main();

extern "C" {

extern uint32_t data_image[];
extern uint32_t data_begin[];
extern uint32_t data_end[];
extern uint32_t bss_begin[];
extern uint32_t bss_end[];
extern uint32_t stack_top[];

void Fault() {
  for (;;) {
    __asm volatile("");
  }
}

__attribute__((weak)) void SysTickHandler() {
  Fault();
}
__attribute__((weak)) void Uart0ReceiveHandler() {
  Fault();
}
__attribute__((weak)) void Uart0SendHandler() {
  Fault();
}
__attribute__((weak)) void Uart1ReceiveHandler() {
  Fault();
}
__attribute__((weak)) void Uart1SendHandler() {
  Fault();
}

void Start() {
  const uint32_t* from = data_image;
  for (uint32_t* to = data_begin; to != data_end; ++to) {
    *to = *from++;
  }
  for (uint32_t* to = bss_begin; to != bss_end; ++to) {
    *to = 0;
  }
  main();
  Fault();
}

void* memcpy(void* to, const void* from, size_t size) {
  uint8_t* out = static_cast<uint8_t*>(to);
  const uint8_t* in = static_cast<const uint8_t*>(from);
  while (size-- != 0) {
    *out++ = *in++;
  }
  return to;
}

void* memmove(void* to, const void* from, size_t size) {
  uint8_t* out = static_cast<uint8_t*>(to);
  const uint8_t* in = static_cast<const uint8_t*>(from);
  if (out <= in) {
    return memcpy(to, from, size);
  }
  while (size-- != 0) {
    out[size] = in[size];
  }
  return to;
}

void* memset(void* to, int value, size_t size) {
  uint8_t* out = static_cast<uint8_t*>(to);
  while (size-- != 0) {
    *out++ = static_cast<uint8_t>(value);
  }
  return to;
}

int memcmp(const void* left, const void* right, size_t size) {
  const uint8_t* a = static_cast<const uint8_t*>(left);
  const uint8_t* b = static_cast<const uint8_t*>(right);
  for (; size != 0; --size, ++a, ++b) {
    if (*a != *b) {
      return *a < *b ? -1 : 1;
    }
  }
  return 0;
}

}  // extern "C"

namespace {

// ARMv7-M Architecture Reference Manual, B1.5.2 and B1.5.3: the stack, the handlers of the
// exceptions 1 to 15, then those of the interrupts.
struct Vectors {
  const uint32_t* stack;
  void (*handlers[15 + 4])();
};
__attribute__((section(".vectors"), used)) const Vectors kVectors = {
    stack_top,
    {Start, Fault, Fault, Fault, Fault, Fault, nullptr, nullptr, nullptr, nullptr, Fault, Fault,
     nullptr, Fault, SysTickHandler, Uart0ReceiveHandler, Uart0SendHandler, Uart1ReceiveHandler,
     Uart1SendHandler},
};

}  // namespace
