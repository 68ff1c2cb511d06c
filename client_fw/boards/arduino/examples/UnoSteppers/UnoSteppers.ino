// A robot with an Arduino Uno or Nano, a radio modem, and two stepper motors (A4988, DRV8825, TMC2208).
//
//   0 (RX), 1 (TX)   modem; unplug it for flashing, since USB uses the same UART
//   12               PTT of a modem that has to be keyed, high
//   2, 3             left motor's driver: STEP, DIR
//   4, 5             right motor's driver: STEP, DIR
//   13               LED: steady while it drives, else flashes
//
// Timer 1 makes the steps, so Servo and analogWrite on 9 and 10 cannot be used.
#include <Pheromone.h>
#if __has_include("key.h")  // then it signs its frames: the library's README, "Signed links"
#include "key.h"
#endif

// --- Your robot: an ID of its own, and its measures.

constexpr uint8_t kId = 1;
constexpr double kWheelMm = 65;
constexpr double kTrackMm = 150;         // between the planes of the wheels
constexpr double kStepsPerTurn = 200 * 8;  // of a wheel, with the driver's microsteps
constexpr uint32_t kBaud = 9600;

// ---

constexpr StepperConfig kWheels = {RollNm(kWheelMm, kStepsPerTurn),
                                   TrackUm(kTrackMm),
                                   400,     // mm/s
                                   600,     // mm/s^2
                                   {2, 3},  // left
                                   {4, 5},  // right
                                   2};      // the right motor is mounted the other way round

PheromoneSerial modem(Serial, kBaud, 12);
Steppers wheels(kWheels);
Pheromone robot(kId);

ISR(TIMER1_COMPA_vect) {
  wheels.tick();
}

void setup() {
  Serial.begin(kBaud);
  robot.led(LED_BUILTIN);
#ifdef PHEROMONE_KEY_H
  robot.key(pheromone_key);
#endif
  robot.begin(modem, wheels, {0, 0, 0});  // where it stands: x mm, y mm, heading of 65 536 a turn
  TCCR1A = 0;                            // Steppers::kTicksPerSecond
  TCCR1B = 1 << WGM12 | 1 << CS11;
  OCR1A = F_CPU / 8 / Steppers::kTicksPerSecond - 1;
  TIMSK1 = 1 << OCIE1A;
}

void loop() {
  robot.step();
}
