// What the test asks of signing_image.cc: command, number of HELLO (u16), ID, OPCODE, DATA. The
// reply is the time in ticks (u16) and the result.
#pragma once

#include <stdint.h>

// The key of the image's robot.
#define PHEROMONE_TEST_KEY \
  0x0f, 0x1e, 0x2d, 0x3c, 0x4b, 0x5a, 0x69, 0x78, 0x87, 0x96, 0xa5, 0xb4, 0xc3, 0xd2, 0xe1, 0xf0

namespace pheromone {
namespace core_boundary {

enum SigningCommand : uint8_t {
  kSignHello = 'H',   ///< the signature
  kTakeAnswer = 'A',  ///< 1: taken
  kDerive = 'D',      ///< 0: nothing was due
  kSign = 'S',        ///< the signature
  kVerify = 'V',      ///< Signing::Verify
};

constexpr uint8_t kSigningHead = 5;
constexpr uint8_t kMaxSigningRequest = kSigningHead + 64;
constexpr uint8_t kCyclesATick = 8;

}  // namespace core_boundary
}  // namespace pheromone
