// What both ends of a signed link compute (protocol/README.md, section 18). The state is kept by
// server/robots/signing and client_fw/core/signing.
//
//   uint8_t mac[16];
//   ComputeMac(key, {MacUse::kClientFrame, counter, id, opcode}, data, length, mac);
//   frame: DATA, low byte of `counter`, mac[0] ... mac[3]
#pragma once

#include <stdint.h>

#include "protocol/aes.h"
#include "protocol/frame.h"
#include "protocol/opcodes.h"

namespace pheromone {
namespace protocol {

#ifndef PHEROMONE_SIGNING
#define PHEROMONE_SIGNING 1
#endif
/// False: the image is for links without signing.
constexpr bool kHasSigning = PHEROMONE_SIGNING != 0;

/// For what a MAC stands; the first byte that it covers.
enum class MacUse : uint8_t {
  kClientFrame = 1,  ///< a frame of a session
  kServerFrame = 2,
  kToAll = 3,       ///< of the server to all: ROUND and halt
  kHello = 4,       ///< by the robot's own key, as the rest
  kGreeting = 5,    ///< its answer
  kSessionKey = 6,  ///< the MAC is the key
  kGroupMask = 7,   ///< with which the group's key is combined
};

constexpr uint8_t kTagSize = 4;
/// What is added to DATA: the counter's low byte and the tag; to all: two bytes of the counter.
constexpr uint8_t kSignature = 1 + kTagSize;
constexpr uint8_t kSignatureToAll = 2 + kTagSize;
/// HELLO: the number of this HELLO, u16, and the tag.
constexpr uint8_t kSignatureOfHello = 2 + kTagSize;
/// The answer to that HELLO: the client's nonce, the server's, the group's key and its counter, and
/// the tag.
constexpr uint8_t kServerNonce = 8;
constexpr uint8_t kServerNonceAt = 2;
constexpr uint8_t kGroupKeyAt = kServerNonceAt + kServerNonce;
constexpr uint8_t kGroupCounterAt = kGroupKeyAt + kAesBlock;
constexpr uint8_t kGreetingTagAt = kGroupCounterAt + 4;
constexpr uint8_t kGreetingSize = kGreetingTagAt + kTagSize;
/// Instead of a counter: frames to all are not signed on this link.
constexpr uint32_t kUnsignedToAll = 0xFFFFFFFF;

/// The answer to a first HELLO.
inline bool IsGreeting(const Message& message) {
  return message.opcode == kHelloAnswer && message.length == kGreetingSize;
}

/// Of a message that may be signed, what it says if it is.
inline Message WithoutSignature(Message message) {
  const uint8_t size = message.id == kBroadcastId ? kSignatureToAll : kSignature;
  message.length = message.length < size ? uint8_t{0} : static_cast<uint8_t>(message.length - size);
  return message;
}

struct MacHead {
  MacUse use;
  uint32_t counter;
  uint8_t id;
  uint8_t opcode;
};

/// The MAC of use, counter (u32, low byte first), ID, OPCODE and `data`, 16 bytes.
template <typename Cipher>
void ComputeMac(const MacKey<Cipher>& key, const MacHead& head, const uint8_t* data, uint8_t length,
                uint8_t* mac) {
  Cmac<Cipher> cmac(&key);
  cmac.Add(static_cast<uint8_t>(head.use));
  for (uint8_t shift = 0; shift < 32; shift = static_cast<uint8_t>(shift + 8)) {
    cmac.Add(static_cast<uint8_t>((head.counter >> shift) & 0xFFu));
  }
  cmac.Add(head.id);
  cmac.Add(head.opcode);
  for (; length != 0; --length) {
    cmac.Add(*data++);
  }
  cmac.Finish(mac);
}

/// Whether `size` bytes agree; in constant time.
inline bool SameBytes(const uint8_t* a, const uint8_t* b, uint8_t size) {
  uint8_t difference = 0;
  for (uint8_t i = 0; i < size; ++i) {
    difference = static_cast<uint8_t>(difference | (a[i] ^ b[i]));
  }
  return difference == 0;
}

inline bool SameTag(const uint8_t* a, const uint8_t* b) {
  return SameBytes(a, b, kTagSize);
}

/// The smallest counter above `last` whose low bits, those of `mask`, are `low`.
constexpr uint32_t NextCounter(uint32_t last, uint32_t low, uint32_t mask) {
  return last + 1u + ((low - last - 1u) & mask);
}

}  // namespace protocol
}  // namespace pheromone
