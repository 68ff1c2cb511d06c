// Properties of a serial line apart from its data: modem lines and the kernel's error counters.
//
// Pure data; a port that has none of it leaves it empty (port.h).
#pragma once

#include <chrono>
#include <cstdint>

namespace pheromone::links {

/// The input that signals the carrier of another station.
enum class CarrierSense { kNone, kDcd, kCts };

/// How a transceiver is keyed: by a modem line, asserted while there is something to send, or by
/// the driver itself (RS-485, Linux' TIOCSRS485).
enum class Keying { kNone, kRts, kDtr, kRs485 };

struct MediumLines {
  CarrierSense carrier_sense = CarrierSense::kNone;
  Keying ptt = Keying::kNone;
  uint16_t ptt_lead_ms = 0;  ///< from keying to the first byte
  uint16_t ptt_tail_ms = 0;  ///< from the last byte to unkeying
};

/// Errors on the line since it was opened, counted by the driver.
struct LineErrors {
  uint64_t framing = 0;
  uint64_t parity = 0;
  uint64_t overruns = 0;         ///< the UART was not read in time
  uint64_t buffer_overruns = 0;  ///< the kernel's buffer was full
  uint64_t breaks = 0;

  bool operator==(const LineErrors&) const = default;
  LineErrors& operator+=(const LineErrors& more) {
    framing += more.framing;
    parity += more.parity;
    overruns += more.overruns;
    buffer_overruns += more.buffer_overruns;
    breaks += more.breaks;
    return *this;
  }
  friend LineErrors operator-(const LineErrors& a, const LineErrors& b) {
    return {a.framing - b.framing, a.parity - b.parity, a.overruns - b.overruns,
            a.buffer_overruns - b.buffer_overruns, a.breaks - b.breaks};
  }
};

}  // namespace pheromone::links
