// Pololu's Romi with a Romi 32U4 Control Board, and a radio modem on 0 (RX) and 1 (TX). Needs Pololu's
// library Romi32U4. For a 3pi+ 32U4: Pololu3piPlus32U4.h, its Motors and Encoders, and its measures
// (32 mm wheels, 85 mm between them; ticks of a turn: 358 with 30:1 motors, 909 with 75:1).
//
// 5 is free on both: PTT of a modem that has to be keyed, high. The yellow LED is that of the robot.
#include <Pheromone.h>
#include <Romi32U4.h>
#if __has_include("key.h")  // then it signs its frames: the library's README, "Signed links"
#include "key.h"
#endif

// --- Your robot: an ID of its own, and its measures.

constexpr uint8_t kId = 1;
constexpr double kWheelMm = 70;
constexpr double kTrackMm = 141;
constexpr double kTicksPerTurn = 1437;
constexpr int16_t kFullSpeedMmS = 500;
constexpr uint32_t kBaud = 9600;

// ---

constexpr WheelConfig kWheels = {RollNm(kWheelMm, kTicksPerTurn), TrackUm(kTrackMm), kFullSpeedMmS};

Romi32U4Motors motors;
Romi32U4Encoders encoders;

void ticks(int16_t* left, int16_t* right) {
  *left = encoders.getCountsLeft();
  *right = encoders.getCountsRight();
}

void power(int16_t left, int16_t right) {  // of 300
  motors.setSpeeds(left + left / 6, right + right / 6);
}

PheromoneSerial modem(Serial1, kBaud, 5);
TwoWheels wheels(power, ticks, kWheels);
Pheromone robot(kId);

void setup() {
  Serial1.begin(kBaud);
  robot.led(LED_BUILTIN);
#ifdef PHEROMONE_KEY_H
  robot.key(pheromone_key);
#endif
  robot.begin(modem, wheels, {0, 0, 0});  // where it stands: x mm, y mm, heading of 65 536 a turn
}

void loop() {
  robot.step();
}
