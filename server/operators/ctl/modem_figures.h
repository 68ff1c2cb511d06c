// What the arrival of known bytes over a pair of modems says about them.
//
//   std::vector<double> delays;
//   for (const Chunk& chunk : chunks) { delays.push_back(DelayMs(chunk, baud)); }
//   const Delays found = DelaysOf(delays);        // least 2.1 ms, held back for up to 15.6 ms
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace pheromone::ctl {

/// Bytes that were read together.
struct Chunk {
  double at_ms = 0;       ///< since the first byte of the frame was written
  size_t bytes_read = 0;  ///< of the frame so far, with these
};

/// From when the last of `bytes_read` bytes left the sender's UART, ten bits a byte, until it was
/// read; not below 0. The first byte of a chunk tells for how long an adapter held it back, the
/// last one how long the modems took.
double DelayMs(const Chunk& chunk, unsigned baud);

struct Delays {
  double least_ms = 0;  ///< the modems' own: T_t of a modem that passes on what it gets
  double varies_ms =
      0;  ///< by how much 98 of 100 chunks are later at most: what the adapter holds back
};

/// Of at least one delay.
Delays DelaysOf(std::vector<double> delays_ms);

/// The share of damaged bytes if `whole` of `sent` frames of `bytes` bytes arrived, each byte being
/// damaged by itself; with none damaged the share that 1 of 20 such tests would not notice, and
/// more.
double DamagedBytes(size_t whole, size_t sent, size_t bytes);
double UnnoticedDamage(size_t sent, size_t bytes);

/// A setting in whole milliseconds that is not less.
unsigned RoundedUpMs(double ms);

/// A server's table [[link]] for a modem at this port, in TOML.
std::string LinkText(const std::string& port, unsigned baud, unsigned turnaround_ms,
                     unsigned adapter_ms);

/// What a server finds wrong with such a table; empty if it takes it.
std::string LinkProblems(const std::string& link);

}  // namespace pheromone::ctl
