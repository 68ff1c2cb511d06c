#include "client_fw/boards/arduino/facade.h"

#ifdef ESP32
#include <esp_system.h>
#endif
#ifdef ESP8266
#include <user_interface.h>
#endif

#include "client_fw/boards/boot.h"
#include "client_fw/core/requests/request_memory.h"
#include "client_fw/core/robot.h"
#include "protocol/crc16.h"

namespace pheromone {
namespace arduino {
namespace {

// What outlives a reset that keeps memory. An AVR's bootloader hides the cause of a reset from the
// sketch, so what is found decides: after power-up it passes for whole once in 2^48 times.
struct WarmMemory {
  uint32_t guard;
  client::RequestMemory requests;
  client::Odometry odometry;
  uint16_t crc;  // of the odometry
};
constexpr uint32_t kGuard = 0x50484552;

#ifdef __AVR__
WarmMemory memory __attribute__((section(".noinit")));
#else
WarmMemory memory;
#endif

// At an address that the compiler knows, which is shorter than by a pointer. begin() constructs it.
using Robot = client::Robot<ArduinoBoard, PheromoneWheels>;
union RobotPlace {
  constexpr RobotPlace() : none(0) {}
  uint8_t none;
  Robot robot;
} place;

// Elsewhere no memory is kept, and the robot is where it was put only if it was switched on there.
bool WasSwitchedOn() {
#if defined(__AVR__)
  return true;
#elif defined(ESP32)
  return esp_reset_reason() == ESP_RST_POWERON;
#elif defined(ESP8266)
  return ESP.getResetInfoPtr()->reason == REASON_DEFAULT_RST;
#else
  return false;
#endif
}

uint16_t CheckOf(const client::Odometry& odometry) {
  return protocol::Check(&odometry, sizeof(odometry));
}

void PutCrc(uint16_t crc, uint8_t* to) {
  to[0] = static_cast<uint8_t>(crc & 0xFFu);
  to[1] = static_cast<uint8_t>(crc >> 8);
}

}  // namespace

void ArduinoBoard::save_settings(const uint8_t* bytes, uint8_t size) {
  uint8_t payload[client::kSettingsSize + 2];
  for (uint8_t i = 0; i < size; ++i) {
    payload[i] = bytes[i];
  }
  PutCrc(sketch_crc, payload + client::kSettingsSize);
  stored.Save(payload);
}

void Pheromone::begin(PheromoneLink& link, PheromoneWheels& wheels, const client::Pose& start) {
  wheels_ = &wheels;
  board_.link = &link;
  uint8_t packed[client::kSettingsSize];
  PackSettings(parameters_, packed);
  board_.sketch_crc = protocol::Crc16(packed, sizeof(packed));
  uint8_t crc[2];
  PutCrc(board_.sketch_crc, crc);
  Storage::Begin();
  uint8_t payload[client::kSettingsSize + 2];
  if (!board_.stored.Load(payload)) {
    board_.stored.BeginBehind(Storage::FirstVersion());
  } else if (payload[client::kSettingsSize] == crc[0] &&
             payload[client::kSettingsSize + 1] == crc[1]) {
    client::UnpackSettings(payload, &parameters_);
  }
  wheels.begin();
  if (memory.guard == kGuard && Restore(&memory.requests)) {
    if (memory.crc == CheckOf(memory.odometry)) {
      wheels.resume(memory.odometry);
    } else {
      parameters_.pose_lost = true;
    }
  } else {
    // Damaged: it may be anywhere.
    parameters_.pose_lost = memory.guard == kGuard || !WasSwitchedOn();
    client::StartCold(&board_, parameters_, &memory.requests);
#if PHEROMONE_SIGNING
    if (!Storage::Committed()) {  // this start's number will come again
      parameters_.key = nullptr;
    }
#endif
    memory.odometry = client::Odometry{0, 0, 0};
    memory.crc =
        static_cast<uint16_t>(CheckOf(memory.odometry) + (parameters_.pose_lost ? 1u : 0u));
  }
  parameters_.id = id_;
  parameters_.boot_counter = memory.requests.nonce;
  parameters_.start = start;
  link.begin(&parameters_);
  link.set_keying(parameters_.ptt_lead_ms, parameters_.ptt_tail_ms);
  new (client::Place{&place.robot}) Robot(&board_, &wheels, parameters_, &memory.requests);
  memory.guard = kGuard;  // now the requests are sealed
}

void Pheromone::step() {
  client::Odometry odometry;
  // A pose that is lost stays so over a reset.
  if (wheels_->step(static_cast<uint16_t>(millis())) && wheels_->odometry(&odometry) &&
      (stop_flags() & client::kPoseLost) == 0) {
    const uint16_t crc = CheckOf(odometry);
    memory.odometry = odometry;  // at once: by a reset in between the pose is lost
    memory.crc = crc;
  }
  place.robot.Step();
  board_.EndTurn();
}

Sensed Pheromone::sensed() const {
  const client::BehaviourState& state = place.robot.conversation().state();
  return Sensed{state.p_left, state.p_right};
}

uint8_t Pheromone::stop_flags() const {
  return place.robot.conversation().state().flags;
}

}  // namespace arduino
}  // namespace pheromone
