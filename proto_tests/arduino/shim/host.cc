// Runs an example for an ESP on a host: a robot with two motors and encoders, in real time.
//
//   esp_sketch PORT EEPROM_FILE [reset]
//
// Its network has one server: wherever datagrams go to, 127.0.0.1:PORT gets them. The EEPROM is
// what was last committed to the file. It was switched on, or else reset by itself. Prints a line
// every half second, "x_m y_m degrees", until SIGTERM.
#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <vector>

#include "client_fw/sim/differential_drive.h"
#include "proto_tests/arduino/shim/Arduino.h"
#include "proto_tests/arduino/shim/EEPROM.h"
#include "proto_tests/arduino/shim/IPAddress.h"
#include "proto_tests/arduino/shim/WiFi.h"
#include "proto_tests/arduino/shim/WiFiUdp.h"
#ifdef ESP32
#include "proto_tests/arduino/shim/esp_system.h"
#else
#include "proto_tests/arduino/shim/user_interface.h"
#endif

namespace shim {
WiFiClass WiFi;
EEPROMClass EEPROM;
#ifdef ESP8266
EspClass ESP;
#endif
}  // namespace shim

namespace {

using Clock = std::chrono::steady_clock;

volatile std::sig_atomic_t stopped = 0;
const char* eeprom_file = nullptr;
bool was_switched_on = true;
sockaddr_in server{};
IPAddress server_ip(0, 0, 0, 0);  // for the sketch
uint16_t server_port = 0;

// --- Wheels: the first two interrupts are the encoders' channels A, the left one first; the first
// two pins with PWM are the motors', and their directions the pins written before each.

constexpr double kTurnM = 0.065 * std::numbers::pi;
constexpr double kTrackM = 0.15;
constexpr double kFullSpeed = 0.6;  // m/s; the sketch believes 0.5
constexpr double kLag = 800;        // tenths of a millisecond

struct Wheel {
  uint8_t pwm_pin = 0xFF;
  uint8_t dir_pin = 0xFF;
  uint8_t a_pin = 0xFF;
  uint8_t b_pin = 0xFF;
  void (*on_edge)() = nullptr;
  double speed = 0;
  double way_m = 0;
  int64_t quarter = 0;
};

std::array<Wheel, 2> wheels;
std::array<int, 256> levels{};
std::vector<uint8_t> input_order;
uint8_t last_written = 0xFF;
pheromone::sim::PlanePose pose;

// A quarter of a turn of the quadrature: A before B, forwards.
void Quarter(Wheel* wheel, int way) {
  wheel->quarter += way;
  const auto phase = static_cast<int>((wheel->quarter % 4 + 4) % 4);
  const int a = phase == 1 || phase == 2 ? HIGH : LOW;
  const bool edge = levels[wheel->a_pin] != a;
  levels[wheel->a_pin] = a;
  levels[wheel->b_pin] = phase >= 2 ? HIGH : LOW;
  if (edge && wheel->on_edge != nullptr) {
    wheel->on_edge();
  }
}

void AdvanceTenth() {
  std::array<double, 2> rolled{};
  for (size_t i = 0; i < 2; ++i) {
    Wheel& wheel = wheels[i];
    if (wheel.pwm_pin == 0xFF) {
      return;
    }
    const double goal =
        levels[wheel.pwm_pin] / 255.0 * kFullSpeed * (levels[wheel.dir_pin] == HIGH ? -1 : 1);
    wheel.speed += (goal - wheel.speed) / kLag;
    rolled[i] = wheel.speed / 10'000;
    wheel.way_m += rolled[i];
    const auto quarter = static_cast<int64_t>(std::floor(wheel.way_m / (kTurnM / 1440)));
    while (wheel.quarter != quarter) {
      Quarter(&wheel, wheel.quarter < quarter ? 1 : -1);
    }
  }
  pose = pheromone::sim::MoveOnArc(pose, rolled[0], rolled[1], kTrackM);
}

int64_t Tenths() {
  static const auto start = Clock::now();
  return std::chrono::duration_cast<std::chrono::microseconds>(Clock::now() - start).count() / 100;
}

void CatchUp() {
  static int64_t done = 0;
  for (const int64_t now = Tenths(); done < now; ++done) {
    AdvanceTenth();
  }
}

int Socket() {
  static const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK, 0);
  return fd;
}

std::vector<uint8_t> outgoing;
std::vector<uint8_t> incoming;
sockaddr_in sender{};
size_t taken = 0;

bool IsFromServer() {
  return sender.sin_addr.s_addr == server.sin_addr.s_addr && sender.sin_port == server.sin_port;
}

}  // namespace

unsigned long millis() {
  CatchUp();
  return static_cast<unsigned long>(Tenths() / 10);
}

void delay(unsigned long ms) {
  usleep(static_cast<useconds_t>(ms * 1000));
}

// In place of a generator: what a test can tell from any other number.
long random(long limit) {
  return 41'000 % limit;
}

void pinMode(uint8_t pin, uint8_t mode) {
  if (mode == INPUT_PULLUP) {
    input_order.push_back(pin);
  }
}

void digitalWrite(uint8_t pin, uint8_t value) {
  levels[pin] = value;
  last_written = pin;
}

int digitalRead(uint8_t pin) {
  return levels[pin];
}

void analogWrite(uint8_t pin, int value) {
  for (Wheel& wheel : wheels) {
    if (wheel.pwm_pin == 0xFF) {
      wheel.pwm_pin = pin;
      wheel.dir_pin = last_written;
    }
    if (wheel.pwm_pin == pin) {
      break;
    }
  }
  levels[pin] = value;
}

void analogWriteRange(uint32_t /*range*/) {}

// Channel B is the pin after A.
void attachInterrupt(uint8_t interrupt, void (*handler)(), int /*mode*/) {
  for (Wheel& wheel : wheels) {
    if (wheel.on_edge == nullptr) {
      wheel.on_edge = handler;
      wheel.a_pin = interrupt;
      for (size_t i = 0; i + 1 < input_order.size(); ++i) {
        if (input_order[i] == interrupt) {
          wheel.b_pin = input_order[i + 1];
        }
      }
      return;
    }
  }
}

namespace {
std::vector<uint8_t> eeprom;
}  // namespace

void EEPROMClass::begin(size_t size) {
  eeprom.assign(size, 0xFF);
  if (FILE* const file = std::fopen(eeprom_file, "rb"); file != nullptr) {
    eeprom.resize(std::fread(eeprom.data(), 1, size, file));
    eeprom.resize(size, 0xFF);
    std::fclose(file);
  }
}

uint8_t EEPROMClass::read(int at) {
  return eeprom.at(static_cast<size_t>(at));
}

void EEPROMClass::write(int at, uint8_t value) {
  eeprom.at(static_cast<size_t>(at)) = value;
}

bool EEPROMClass::commit() {
  FILE* const file = std::fopen(eeprom_file, "wb");
  const bool written =
      file != nullptr && std::fwrite(eeprom.data(), 1, eeprom.size(), file) == eeprom.size();
  return file != nullptr && std::fclose(file) == 0 && written;
}

void WiFiUDP::begin(uint16_t /*port*/) {}

int WiFiUDP::beginPacket(IPAddress to, uint16_t port) {
  server_ip = to;
  server_port = port;
  outgoing.clear();
  return 1;
}

size_t WiFiUDP::write(uint8_t byte) {
  outgoing.push_back(byte);
  return 1;
}

int WiFiUDP::endPacket() {
  return sendto(Socket(), outgoing.data(), outgoing.size(), 0,
                reinterpret_cast<const sockaddr*>(&server), sizeof(server)) < 0
             ? 0
             : 1;
}

int WiFiUDP::parsePacket() {
  incoming.resize(2048);
  taken = 0;
  socklen_t sender_size = sizeof(sender);
  const ssize_t size = recvfrom(Socket(), incoming.data(), incoming.size(), 0,
                                reinterpret_cast<sockaddr*>(&sender), &sender_size);
  incoming.resize(size > 0 ? static_cast<size_t>(size) : 0);
  return static_cast<int>(incoming.size());
}

int WiFiUDP::available() {
  return static_cast<int>(incoming.size() - taken);
}

int WiFiUDP::read() {
  return taken < incoming.size() ? incoming[taken++] : -1;
}

IPAddress WiFiUDP::remoteIP() {
  if (IsFromServer()) {
    return server_ip;
  }
  const auto* const bytes = reinterpret_cast<const uint8_t*>(&sender.sin_addr.s_addr);
  return {bytes[0], bytes[1], bytes[2], bytes[3]};
}

uint16_t WiFiUDP::remotePort() {
  return IsFromServer() ? server_port : ntohs(sender.sin_port);
}

#ifdef ESP32
esp_reset_reason_t esp_reset_reason() {
  return was_switched_on ? ESP_RST_POWERON : ESP_RST_BROWNOUT;
}
#else
rst_info* EspClass::getResetInfoPtr() {
  static rst_info info;
  info.reason = was_switched_on ? REASON_DEFAULT_RST : REASON_WDT_RST;
  return &info;
}
#endif

int main(int argc, char** argv) {
  if (argc != 3 && argc != 4) {
    std::fprintf(stderr, "Usage: %s PORT EEPROM_FILE [reset]\n", argv[0]);
    return 2;
  }
  was_switched_on = argc == 3;
  server.sin_family = AF_INET;
  server.sin_port = htons(static_cast<uint16_t>(std::atoi(argv[1])));
  server.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  eeprom_file = argv[2];
  std::signal(SIGTERM, [](int /*signal*/) { stopped = 1; });
  setup();
  for (unsigned long line_ms = 0; stopped == 0;) {
    loop();
    usleep(500);
    if (millis() >= line_ms) {
      line_ms += 500;
      std::printf("%.3f %.3f %.0f\n", pose.x_m, pose.y_m,
                  pose.heading_rad * 180 / std::numbers::pi);
      std::fflush(stdout);
    }
  }
  return 0;
}
