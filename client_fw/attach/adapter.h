// How soon the adapter of a serial port delivers what it has received. USB adapters collect bytes:
// an FTDI for 16 ms, unless it is told otherwise.
//
//   const uint8_t ms = AdapterLatencyMs("/dev/ttyUSB1");     // 1: it was told to be quick
//
// A robot waits for an answer that much longer, and takes part in rounds only if it can tell the
// time of a byte to kRoundsLatencyMs (protocol/README.md, section 9).
#pragma once

#include <cstdint>
#include <string>

namespace pheromone::attach {

/// Of an adapter that does not tell.
constexpr uint8_t kUsualLatencyMs = 16;
/// At most, to take part in rounds.
constexpr uint8_t kRoundsLatencyMs = 1;

/// Asks the driver for its shortest latency, which any user may, and returns that which it has. 0:
/// a port without an adapter, such as a UART or a pseudo-terminal. `sys`: where sysfs is.
uint8_t AdapterLatencyMs(const std::string& port, const std::string& sys = "/sys");

}  // namespace pheromone::attach
