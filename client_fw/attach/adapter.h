// How soon the adapter of a serial port delivers what it has received. USB adapters collect bytes:
// an FTDI for 16 ms, unless it is told otherwise.
//
//   const uint8_t ms = AdapterLatencyMs("/dev/ttyUSB1");     // 1: it was told to be quick
//
// A robot waits for an answer that much longer, and takes part in rounds only if it can tell the
// time of a byte to kRoundsLatencyMs (protocol/README.md, section 9). AdapterMeasurement says later
// whether that was true.
#pragma once

#include <cstdint>
#include <string>

namespace pheromone::attach {

/// Of an adapter that does not tell.
constexpr uint8_t kUsualLatencyMs = 16;
/// At most, to take part in rounds.
constexpr uint8_t kRoundsLatencyMs = 1;

/// Asks the driver of an open port for its shortest latency, which any user may.
void AskForLowLatency(int descriptor);

/// Asks for the shortest latency, and returns that which the driver has. 0: a port without an
/// adapter, such as a UART or a pseudo-terminal. `sys`: where sysfs is.
uint8_t AdapterLatencyMs(const std::string& port, const std::string& sys = "/sys");

/// How a robot gets access to a channel, for its operator.
inline const char* AccessText(bool rounds) {
  return rounds ? "takes turns if the server grants them" : "contends for the channel";
}

}  // namespace pheromone::attach
