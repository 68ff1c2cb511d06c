// What the library and its examples for ESPs use of Arduino's core, without anything of a C++
// library: they are compiled against it for the ESPs' processors, and run on a host (host.cc).
#pragma once

// NOLINTBEGIN: the names are Arduino's

#include <stddef.h>
#include <stdint.h>

#define HIGH 1
#define LOW 0
#define INPUT_PULLUP 2
#define OUTPUT 1
#define CHANGE 3
#define IRAM_ATTR

// Of a NodeMCU.
constexpr uint8_t D0 = 16, D1 = 5, D2 = 4, D4 = 2, D5 = 14, D6 = 12, D7 = 13, D8 = 15, RX = 3;

unsigned long millis();
void delay(unsigned long ms);
long random(long limit);
void pinMode(uint8_t pin, uint8_t mode);
void digitalWrite(uint8_t pin, uint8_t value);
int digitalRead(uint8_t pin);
void analogWrite(uint8_t pin, int value);
void analogWriteRange(uint32_t range);
void attachInterrupt(uint8_t interrupt, void (*handler)(), int mode);
inline uint8_t digitalPinToInterrupt(uint8_t pin) {
  return pin;
}
inline void noInterrupts() {}
inline void interrupts() {}

#ifdef ESP8266
struct rst_info;
#endif

namespace shim {

class Stream {
 public:
  virtual int read() = 0;
  virtual size_t write(uint8_t byte) = 0;
  virtual int availableForWrite() = 0;

 protected:
  ~Stream() = default;
};

#ifdef ESP8266
class EspClass {
 public:
  rst_info* getResetInfoPtr();
};

extern EspClass ESP;
#endif

}  // namespace shim

using namespace shim;

// The sketch's.
void setup();
void loop();

// NOLINTEND
