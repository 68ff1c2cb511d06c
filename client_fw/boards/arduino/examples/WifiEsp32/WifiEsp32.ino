// A robot with an ESP32, by Wi-Fi to the server's UDP link. No modem.
//
//   32, 33   left encoder, channels A and B
//   25, 26   right encoder, channels A and B
//   18, 19   left motor's driver: PWM, direction (phase and enable)
//   22, 23   right motor's driver
//   2        LED: steady while it drives, else flashes
#include <Pheromone.h>
#include <PheromoneUdp.h>
#include <WiFi.h>
#include <WiFiUdp.h>
#if __has_include("key.h")  // then it signs its frames: the library's README, "Signed links"
#include "key.h"
#endif

// --- Your network, your server, your robot.

const char* const kNetwork = "lab";
const char* const kPassword = "secret";
const IPAddress kServer(192, 168, 4, 1);
constexpr uint16_t kPort = 4950;
constexpr uint8_t kId = 1;
constexpr double kWheelMm = 65;
constexpr double kTrackMm = 150;      // between the planes of the wheels
constexpr double kTicksPerTurn = 720;  // of a wheel, both edges of channel A
constexpr int16_t kFullSpeedMmS = 500;

constexpr uint8_t kLeftA = 32;
constexpr uint8_t kLeftB = 33;
constexpr uint8_t kRightA = 25;
constexpr uint8_t kRightB = 26;
constexpr uint8_t kLeftPwm = 18;
constexpr uint8_t kLeftDir = 19;
constexpr uint8_t kRightPwm = 22;
constexpr uint8_t kRightDir = 23;
constexpr uint8_t kLed = 2;

// ---

constexpr WheelConfig kWheels = {RollNm(kWheelMm, kTicksPerTurn), TrackUm(kTrackMm), kFullSpeedMmS};

volatile int16_t left_ticks;
volatile int16_t right_ticks;

void IRAM_ATTR onLeft() {
  left_ticks = left_ticks + (digitalRead(kLeftA) == digitalRead(kLeftB) ? -1 : 1);
}

void IRAM_ATTR onRight() {
  right_ticks = right_ticks + (digitalRead(kRightA) == digitalRead(kRightB) ? -1 : 1);
}

void ticks(int16_t* left, int16_t* right) {
  *left = left_ticks;
  *right = right_ticks;
}

void power(int16_t left, int16_t right) {
  digitalWrite(kLeftDir, left < 0 ? HIGH : LOW);
  analogWrite(kLeftPwm, left < 0 ? -left : left);
  digitalWrite(kRightDir, right < 0 ? HIGH : LOW);
  analogWrite(kRightPwm, right < 0 ? -right : right);
}

WiFiUDP udp;
PheromoneUdp<WiFiUDP> server(udp, kServer, kPort);
TwoWheels wheels(power, ticks, kWheels);
Pheromone robot(kId);

void setup() {
  pinMode(kLeftPwm, OUTPUT);
  pinMode(kLeftDir, OUTPUT);
  pinMode(kRightPwm, OUTPUT);
  pinMode(kRightDir, OUTPUT);
  pinMode(kLeftA, INPUT_PULLUP);
  pinMode(kLeftB, INPUT_PULLUP);
  pinMode(kRightA, INPUT_PULLUP);
  pinMode(kRightB, INPUT_PULLUP);
  attachInterrupt(digitalPinToInterrupt(kLeftA), onLeft, CHANGE);
  attachInterrupt(digitalPinToInterrupt(kRightA), onRight, CHANGE);
  WiFi.mode(WIFI_STA);
  WiFi.begin(kNetwork, kPassword);
  while (WiFi.status() != WL_CONNECTED) {
    delay(100);
  }
  robot.led(kLed);
#ifdef PHEROMONE_KEY_H
  robot.key(pheromone_key);
#endif
  robot.begin(server, wheels, {0, 0, 0});  // where it stands: x mm, y mm, heading of 65 536 a turn
}

void loop() {
  robot.step();
}
