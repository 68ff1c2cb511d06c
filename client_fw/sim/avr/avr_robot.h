// One robot of a simulation that runs the image that would be flashed: an AVR machine, a modem on a
// radio medium, and a simulated Pioneer on the other UART.
//
//   AvrRobot robot({.machine = {.image = "pheromone_client_avr.elf"}, .id = 7}, &medium);
//   for (int64_t ms = 1; ms <= end_ms; ++ms) {
//     medium.AdvanceTo(ms * 1'000'000);
//     robot.Step();
//   }
//
// Step() catches up with the medium's present time. The cable to the Pioneer is exact to the cycle;
// what is sent by radio goes to the medium at the next Step, so the medium's turnaround should not
// be shorter than the step, or the bytes of a frame come with gaps. Each byte is a block of its
// own: loss is to be simulated by byte_error or bit_error.
//
// The modem is transparent: it keys with the first byte, begins to send after the turnaround, and
// shows a carrier until its own last byte is sent, which is a turnaround later than the AVR
// assumes. Or it is keyed by PTT, and mangles what comes too early or is cut off. Odometry begins
// at (0, 0, 0) wherever the Pioneer is; the firmware's settings give that position on the map. One
// thread. Throws as AvrMachine does.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "client_fw/sim/avr/avr_machine.h"
#include "client_fw/sim/bump_counter.h"
#include "client_fw/sim/mobile_robot.h"
#include "client_fw/sim/pioneer/pioneer_robot.h"
#include "client_fw/sim/radio_medium.h"
#include "client_fw/sim/radio_tally.h"

namespace pheromone::sim {

/// The pins as assigned in client_fw/boards/avr/pins.h.
struct AvrBoardPins {
  AvrPin ptt = {'D', 4};      ///< out, high: transmit
  AvrPin carrier = {'D', 5};  ///< in, low: the modem hears a carrier
  AvrPin load = {'D', 6};     ///< out, high: hold the load
  AvrPin led = {'D', 7};      ///< out, high: light
  char id_port = 'A';         ///< in, straps to ground: the ID, bit by bit
};

struct AvrRobotConfig {
  AvrMachineConfig machine;
  uint8_t id = 1;          ///< strapped
  bool is_signed = false;  ///< the image signs, with the key in its EEPROM
  PioneerConfig pioneer;
  PlanePose start;
  AvrBoardPins pins;
  std::optional<KeyedModem> keyed;  ///< none: it keys itself
};

class AvrRobot final : public MobileRobot {
 public:
  /// `medium` must outlive the robot, and the robot the medium's last event.
  AvrRobot(const AvrRobotConfig& config, RadioMedium* medium);
  AvrRobot(const AvrRobot&) = delete;
  AvrRobot& operator=(const AvrRobot&) = delete;

  void Step() override;
  /// Advances the robot to `ns` ahead of the medium, within the next Step: for a Reset between
  /// steps.
  void RunAhead(int64_t ns);

  void OnByte(uint8_t byte, int64_t time_ns) override;
  void OnTransmitted(int64_t time_ns) override;

  /// Calls back with each byte that the firmware sends to the Pioneer, at its stop bit.
  void OnCommandByte(std::function<void(uint8_t byte, int64_t time_ns)> tap) {
    tap_ = std::move(tap);
  }
  /// Calls back when the LED is switched.
  void OnLed(std::function<void(bool on)> callback) {
    machine_.OnPin(led_pin_, [callback = std::move(callback)](bool high, int64_t /*time_ns*/) {
      callback(high);
    });
  }
  /// Disconnects or reconnects the cable to the Pioneer.
  void set_cable(bool connected) { cable_ = connected; }
  /// The rate of the Pioneer's port from now on.
  void set_robot_baud(int64_t baud);
  /// Switches the Pioneer off and on: it has no session, and its port is at 9600 baud.
  void RestartPioneer();
  /// A byte arrives that nobody has sent.
  void Disturb(AvrMachine::Port port, AvrByteFault fault) {
    machine_.Send(port, 0, machine_.now_ns(), fault);
  }
  void Reset(AvrMachine::Cause cause) { machine_.Reset(cause); }

  int station() const override { return station_; }
  const PlanePose& true_pose() const override { return pioneer_.drive().true_pose(); }
  /// As the Pioneer's encoders show them.
  client::WheelSpeeds wheels() const override;
  client::Counters counters() const override { return tally_.counters(); }
  int16_t p_left() const override { return tally_.p_left(); }
  int16_t p_right() const override { return tally_.p_right(); }
  uint32_t bumps() const override { return bumps_.count(); }

  const AvrMachine& machine() const { return machine_; }
  const PioneerRobot& pioneer() const { return pioneer_; }
  bool HoldsLoad() const override { return load_; }

 private:
  void RunTo(int64_t end_ns);
  void Send(uint8_t byte, int64_t time_ns);
  void Key(bool high, int64_t time_ns);
  void HandOver(int64_t time_ns);
  void ToPioneer(uint8_t byte, int64_t time_ns);
  void FromPioneer(int64_t time_ns);
  void ShowCarrier();

  RadioMedium* medium_;
  AvrPin carrier_pin_;
  AvrPin led_pin_;
  int64_t cable_byte_ns_;
  AvrMachine machine_;
  PioneerRobot pioneer_;
  RadioTally tally_;
  BumpCounter bumps_;
  std::vector<uint8_t> outgoing_;  // to the modem, since the last Step
  struct Held {
    uint8_t byte;
    int64_t time_ns;  // of its stop bit
    bool damaged;
  };
  std::optional<KeyedModem> modem_;
  int64_t byte_ns_;
  std::deque<Held> held_;    // by a keyed modem
  int64_t keyed_at_ns_ = 0;  // PTT's last edge
  bool ptt_ = false;
  std::function<void(uint8_t, int64_t)> tap_;
  bool cable_ = true;
  bool carrier_ = false;
  bool load_ = false;
  int station_;
};

}  // namespace pheromone::sim
