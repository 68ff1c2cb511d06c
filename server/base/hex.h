// Bytes as hexadecimal digits.
//
//   HexText("\x0A\xFF"sv)   // "0aff"
//   ParseHex("0aFF")        // "\x0A\xFF"
//
// Pure; any thread. A number's digits: format.h.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace pheromone {

/// Two lower-case digits for each byte.
std::string HexText(std::span<const uint8_t> bytes);
std::string HexText(std::string_view bytes);

/// The bytes of pairs of digits, of either case; nothing if there is anything else in the text.
std::optional<std::string> ParseHex(std::string_view digits);

}  // namespace pheromone
