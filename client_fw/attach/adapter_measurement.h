// For how long the adapter of a serial port holds received bytes back, measured: what the driver
// tells (adapter.h) may be nothing, or wrong.
//
//   AdapterMeasurement measurement(9600, AdapterLatencyMs(port));
//   measurement.OnBytes(bytes, MonotonicNs());            // what was read together
//   if (measurement.TakeNews()) {
//     robot.SetAdapter(measurement.latency_ms(), measurement.rounds());
//   }
//
// The bytes of a frame follow each other on the air without gaps. So of the i-th byte of a frame,
// read at t_i, t_i - i * B is by how much it was late (B: ten bits), up to a constant of the frame.
// The greatest of these less the least is measured: at most the time for which the adapter holds
// bytes back, plus what this computer adds, and at least that less a byte. (pheromonectl modem has
// the same figure from bytes that it has sent itself.) What delays all bytes alike is not seen.
//
// It judges by 40 frames at a time, by the time that 3 in 4 of them do not exceed, so that
// this computer may be late now and then. A quick adapter becomes a lazy one at once; a lazy one
// becomes quick again after twice as many good judgements each time.
//
// Frames of less than kLeastNs say nothing, since they would look quick in any case. One thread.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "protocol/frame_parser.h"

namespace pheromone::attach {

class AdapterMeasurement {
 public:
  /// Of a port with this bit rate, whose driver tells `told_ms`; that holds until it is measured.
  AdapterMeasurement(uint32_t baud, uint8_t told_ms);

  /// What was read together, at a time of any clock.
  void OnBytes(std::span<const uint8_t> bytes, int64_t time_ns);

  /// For how long an answer is to be waited for: what was told; if that was wrong,
  /// kRoundsLatencyMs or kUsualLatencyMs.
  uint8_t latency_ms() const { return quick_ ? quick_ms_ : lazy_ms_; }
  /// Whether the robot may take part in rounds.
  bool rounds() const { return quick_; }
  /// As last judged by; 0 before.
  int64_t measured_ns() const { return measured_ns_; }
  /// True, once: it was measured for the first time, or is quick or lazy now and was not before.
  bool TakeNews();

 private:
  static constexpr size_t kFrames = 40;
  static constexpr size_t kLate = kFrames / 4;  // may be late for another reason
  static constexpr int64_t kLeastNs = 5'000'000;
  // Two clocks drift apart by up to 2 %, a longer frame would show that.
  static constexpr int64_t kMostNs = 35'000'000;

  void OnFrame();
  void Judge();

  int64_t byte_ns_;
  uint8_t quick_ms_;
  uint8_t lazy_ms_;
  bool quick_;
  bool news_ = false;
  int64_t measured_ns_ = 0;
  int wanted_ = 1;  // good judgements in succession before it is quick
  int good_ = 0;

  protocol::FrameParser parser_;
  // Of the frame that is open: the byte that follows, if all were in time, and by how much they
  // are late.
  int64_t on_air_ns_ = 0;
  int64_t least_ns_ = 0;
  int64_t most_ns_ = 0;
  std::array<int64_t, kFrames> held_ns_{};
  size_t frames_ = 0;
};

}  // namespace pheromone::attach
