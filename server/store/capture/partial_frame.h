// The partial frame in a decoder, as bytes that bring a new decoder to the same state.
#pragma once

#include <string>

#include "protocol/frame_parser.h"

namespace pheromone::capture {

inline std::string PartialFrameOf(const protocol::FrameParser& parser) {
  const auto dle = static_cast<char>(protocol::kDle);
  std::string bytes;
  if (parser.open() && !parser.coded()) {  // robots send no coded frame
    bytes = {dle, static_cast<char>(protocol::kStx)};
    for (uint8_t i = 0; i < parser.size(); ++i) {
      const auto byte = static_cast<char>(parser.body()[i]);
      bytes += byte;
      if (byte == dle) {
        bytes += dle;
      }
    }
  }
  if (parser.escaped()) {
    bytes += dle;
  }
  return bytes;
}

}  // namespace pheromone::capture
