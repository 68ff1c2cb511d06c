// How much of an AVR's flash and RAM an image uses, read from its ELF file.
//
//   const AvrImageSize size = ReadAvrImageSize("pheromone_client_avr.elf");
//
// Bytes. The sizes are those that avr-size prints: flash holds the program and the initial values
// of variables; static RAM ends where the stack may reach at its deepest, .noinit included.
#pragma once

#include <cstdint>
#include <string>

namespace pheromone::sim {

struct AvrImageSize {
  uint32_t flash_bytes = 0;
  uint32_t static_ram_bytes = 0;
  uint16_t static_ram_end = 0;  ///< address after the last static variable
};

/// Throws std::runtime_error if `path` cannot be read or is not a 32-bit little-endian ELF file
/// for an AVR.
AvrImageSize ReadAvrImageSize(const std::string& path);

}  // namespace pheromone::sim
