// Signing, or in firmware without it the same functions that do nothing and take no room.
#pragma once

#include <stdint.h>

#include "client_fw/core/signing/signing.h"

namespace pheromone {
namespace client {

struct NoSigning {
  enum : uint8_t { kLongest = 1, kForged = Signing::kForged };

  explicit NoSigning(const uint8_t* /*key*/) {}
  static constexpr bool on() { return false; }
  static constexpr bool has_session() { return false; }
  static constexpr bool second_hello_due() { return false; }
  static void GreetAnew() {}
  static uint8_t SignHello(const FrameView& /*hello*/, uint16_t /*number*/, uint8_t* /*to*/) {
    return 0;
  }
  static uint8_t Sign(const FrameView& /*frame*/, uint8_t* /*to*/) { return 0; }
  static bool TakeAnswer(const FrameView& /*answer*/) { return false; }
  static constexpr bool Derive() { return false; }
  static uint8_t Verify(const FrameView& /*frame*/) { return 0; }
};

template <bool kSigned>
struct ChooseSigning {
  using Type = Signing;
};
template <>
struct ChooseSigning<false> {
  using Type = NoSigning;
};
/// A base rather than a member, so that nothing is nothing.
using LinkSigning = ChooseSigning<kHasSigning>::Type;

}  // namespace client
}  // namespace pheromone
