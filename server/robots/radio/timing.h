// The times of a half-duplex channel, as each end sees them at its own UART (protocol/README.md,
// "Sharing a radio channel"). B is the time of a byte, T_t a modem's turnaround.
//
//   const Timing timing{.byte = ByteTime(9600), .turnaround = 2ms, .adapter = 16ms};
//   const Duration window = timing.ResponseWindow();          // announced in HELLO's answer
//   read + timing.EarliestAnswer() <= begin <= read + timing.LatestAnswer(window)
//
// A modem that keys itself on the first byte puts everything on the air T_t after it left the UART.
// One that is keyed by a line puts bytes on the air at once, `lead` after it was keyed. Robots'
// modems either key themselves, or need a lead and a tail that are T_t together, at most.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>

namespace pheromone::radio {

using Duration = std::chrono::nanoseconds;
/// A point of time, by a steady clock of the caller's choice.
using Time = std::chrono::nanoseconds;

/// Ten bits, start and stop included.
constexpr Duration ByteTime(int64_t baud) {
  return Duration(10'000'000'000 / baud);
}

/// The robots' clocks have steps of a millisecond, and their loops take a part of one.
constexpr Duration kGuard = std::chrono::microseconds(1250);

struct Timing {
  Duration byte{};        ///< B
  Duration turnaround{};  ///< T_t, of every modem
  bool keyed = false;     ///< the server's modem is keyed by a line
  Duration lead{};        ///< from keying to the first byte
  Duration tail{};        ///< from the last bit to unkeying
  Duration adapter{};     ///< for how long the server's adapter may hold back what it received
  Duration processing{};  ///< from reading a request to writing its answer, at most

  /// From the beginning of a transmission of the server to its first bit on the air.
  constexpr Duration KeyDelay() const { return keyed ? lead : turnaround; }
  /// From the server's last bit leaving its UART to that bit arriving at the robots'.
  constexpr Duration Transit() const { return keyed ? Duration(0) : turnaround; }

  /// After reading a request, until a transmission may begin: the robot's modem has turned round
  /// when the first bit arrives.
  constexpr Duration TurningRound() const { return std::max(Duration(0), turnaround - KeyDelay()); }

  /// W: from the last byte of a request leaving the robot's UART to the first byte of the answer.
  constexpr Duration ResponseWindow() const {
    return turnaround + adapter + std::max(processing, TurningRound()) + KeyDelay() + 2 * byte;
  }
  /// From reading a request.
  constexpr Duration EarliestAnswer() const { return byte + TurningRound(); }
  /// From reading a request, which may be `adapter` after its end. `window`: W as announced.
  constexpr Duration LatestAnswer(Duration window) const {
    return window - turnaround - KeyDelay() - adapter - byte;
  }
  /// From the end of a COMMAND until the first byte of its ACK, which may begin W after the robot
  /// has heard it, was read.
  constexpr Duration LatestAck(Duration window) const {
    return Transit() + window + turnaround + byte + adapter;
  }
  /// The channel is free if nothing was read for this long: longer than a robot needs from one
  /// frame's end to the first byte of its own, and more than the adapter may hold back.
  constexpr Duration Idle() const { return adapter + turnaround + 3 * byte; }
};

}  // namespace pheromone::radio
