#include "server/base/base64.h"

#include <array>
#include <cstdint>

namespace pheromone {
namespace {

constexpr std::string_view kBase64Digits =
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
constexpr uint8_t kNoDigit = 0xff;

constexpr std::array<uint8_t, 256> ValuesOfDigits() {
  std::array<uint8_t, 256> values{};
  values.fill(kNoDigit);
  for (size_t i = 0; i < kBase64Digits.size(); ++i) {
    values[static_cast<unsigned char>(kBase64Digits[i])] = static_cast<uint8_t>(i);
  }
  return values;
}
constexpr std::array<uint8_t, 256> kValueOfDigit = ValuesOfDigits();

Error NotBase64(size_t at) {
  return Error{"not Base64 at character " + std::to_string(at + 1)};
}

}  // namespace

std::string ToBase64(std::string_view bytes) {
  std::string text((bytes.size() + 2) / 3 * 4, '=');
  for (char* out = text.data(); !bytes.empty();
       bytes.remove_prefix(bytes.size() < 3 ? bytes.size() : 3)) {
    uint32_t group = 0;
    for (size_t i = 0; i < 3; ++i) {
      group = group << 8 | (i < bytes.size() ? static_cast<unsigned char>(bytes[i]) : 0u);
    }
    for (size_t i = 0; i < 4; ++i, ++out) {
      if (i <= bytes.size()) {
        *out = kBase64Digits[group >> (18 - 6 * i) & 63];
      }
    }
  }
  return text;
}

Result<std::string> FromBase64(std::string_view text) {
  size_t digits = text.size();
  while (digits > 0 && text.size() - digits < 2 && text[digits - 1] == '=') {
    --digits;
  }
  if (text.size() % 4 != 0) {
    return NotBase64(text.size());
  }
  std::string bytes(digits * 3 / 4, '\0');
  char* out = bytes.data();
  uint32_t bits = 0;
  int count = 0;  // of bits that are not yet in bytes
  for (size_t i = 0; i < digits; ++i) {
    const uint8_t value = kValueOfDigit[static_cast<unsigned char>(text[i])];
    if (value == kNoDigit) {
      return NotBase64(i);
    }
    bits = bits << 6 | value;
    count += 6;
    if (count >= 8) {
      count -= 8;
      *out++ = static_cast<char>(bits >> count & 0xff);
    }
  }
  if ((bits & ((1u << count) - 1)) != 0) {
    return NotBase64(digits - 1);
  }
  return bytes;
}

}  // namespace pheromone
