// A robot with an Arduino Mega 2560: the modem has a UART of its own, and USB tells what is sensed.
//
//   18 (TX1), 19 (RX1)   modem
//   22                   PTT of a modem that has to be keyed, high
//   2, 4                 left encoder, channels A and B
//   3, 7                 right encoder, channels A and B
//   5, 8                 left motor's driver: PWM, direction (phase and enable)
//   6, 9                 right motor's driver
//   13                   LED: steady while it drives, else flashes
#include <Pheromone.h>
#if __has_include("key.h")  // then it signs its frames: the library's README, "Signed links"
#include "key.h"
#endif

// --- Your robot: an ID of its own, and its measures.

constexpr uint8_t kId = 1;
constexpr double kWheelMm = 65;
constexpr double kTrackMm = 150;      // between the planes of the wheels
constexpr double kTicksPerTurn = 720;  // of a wheel, both edges of channel A
constexpr int16_t kFullSpeedMmS = 500;
constexpr uint32_t kBaud = 9600;

// ---

constexpr WheelConfig kWheels = {RollNm(kWheelMm, kTicksPerTurn), TrackUm(kTrackMm), kFullSpeedMmS};

volatile int16_t left_ticks;
volatile int16_t right_ticks;

void onLeft() {
  left_ticks += digitalRead(2) == digitalRead(4) ? -1 : 1;
}

void onRight() {
  right_ticks += digitalRead(3) == digitalRead(7) ? -1 : 1;
}

void ticks(int16_t* left, int16_t* right) {
  noInterrupts();
  *left = left_ticks;
  *right = right_ticks;
  interrupts();
}

void power(int16_t left, int16_t right) {
  digitalWrite(8, left < 0 ? HIGH : LOW);
  analogWrite(5, left < 0 ? -left : left);
  digitalWrite(9, right < 0 ? HIGH : LOW);
  analogWrite(6, right < 0 ? -right : right);
}

PheromoneSerial modem(Serial1, kBaud, 22);
TwoWheels wheels(power, ticks, kWheels);
Pheromone robot(kId);

void setup() {
  pinMode(5, OUTPUT);
  pinMode(6, OUTPUT);
  pinMode(8, OUTPUT);
  pinMode(9, OUTPUT);
  pinMode(2, INPUT_PULLUP);
  pinMode(3, INPUT_PULLUP);
  pinMode(4, INPUT_PULLUP);
  pinMode(7, INPUT_PULLUP);
  attachInterrupt(digitalPinToInterrupt(2), onLeft, CHANGE);
  attachInterrupt(digitalPinToInterrupt(3), onRight, CHANGE);
  Serial.begin(115200);
  Serial1.begin(kBaud);
  robot.led(LED_BUILTIN);
#ifdef PHEROMONE_KEY_H
  robot.key(pheromone_key);
#endif
  robot.begin(modem, wheels, {0, 0, 0});  // where it stands: x mm, y mm, heading of 65 536 a turn
}

void loop() {
  robot.step();
  static uint32_t told_ms = 0;
  // 40 bytes: no more than its ring holds, or printing would wait, and the modem's bytes be lost.
  if (millis() - told_ms >= 1000 && Serial.availableForWrite() >= 40) {
    told_ms = millis();
    Serial.print(robot.sensed().left);
    Serial.print(' ');
    Serial.print(robot.sensed().right);
    Serial.print(F(" stands because of "));
    Serial.println(robot.stop_flags());
  }
}
