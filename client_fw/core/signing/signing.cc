#include "client_fw/core/signing/signing.h"

#include "protocol/byte_order.h"
#include "protocol/frame.h"
#include "protocol/opcodes.h"

namespace pheromone {
namespace client {
namespace {

using protocol::kAesBlock;
using protocol::kTagSize;
using protocol::MacUse;

// The group's counter on a link that takes unsigned frames too.
constexpr uint32_t kUnsignedGroup = 0xFFFFFFFF;

// Of HELLO and its answer, in DATA; of the answer, what is added, from the end of its DATA on.
constexpr uint8_t kNonceSize = 2;
constexpr uint8_t kGroupKeyAt = protocol::kServerNonce;
constexpr uint8_t kGroupCounterAt = kGroupKeyAt + kAesBlock;

void CopyTag(const uint8_t* from, uint8_t* to) {
  for (uint8_t i = 0; i < kTagSize; ++i) {
    to[i] = from[i];
  }
}

}  // namespace

uint8_t Signing::SignHello(const FrameView& hello, uint16_t number, uint8_t* signature) {
  awaits_answer_ = true;
  number_ = number;
  nonce_ = protocol::GetU16(hello.data);
  Key own;
  own.Set(key_);
  uint8_t mac[kAesBlock];
  ComputeMac(own, {MacUse::kHello, number, hello.id, hello.opcode}, hello.data, hello.length, mac);
  protocol::PutU16(signature, number);
  CopyTag(mac, signature + 2);
  return protocol::kSignatureOfHello;
}

uint8_t Signing::Sign(const FrameView& frame, uint8_t* signature) {
  ++sent_;
  uint8_t mac[kAesBlock];
  ComputeMac(session_, {MacUse::kClientFrame, sent_, frame.id, frame.opcode}, frame.data,
             frame.length, mac);
  signature[0] = static_cast<uint8_t>(sent_ & 0xFFu);
  CopyTag(mac, signature + 1);
  return protocol::kSignature;
}

bool Signing::TakeAnswer(const FrameView& answer) {
  if (!awaits_answer_ || answer.length < kNonceSize + protocol::kSignatureOfAnswer ||
      protocol::GetU16(answer.data) != nonce_) {
    return false;
  }
  Key own;
  own.Set(key_);
  uint8_t mac[kAesBlock];
  const uint8_t covered = static_cast<uint8_t>(answer.length - kTagSize);
  ComputeMac(own, {MacUse::kHelloAnswer, number_, answer.id, answer.opcode}, answer.data, covered,
             mac);
  if (!protocol::SameTag(mac, answer.data + covered)) {
    return false;
  }
  const uint8_t* const added = answer.data + (answer.length - protocol::kSignatureOfAnswer);
  uint8_t nonces[kNonceSize + protocol::kServerNonce];
  protocol::PutU16(nonces, nonce_);
  for (uint8_t i = 0; i < protocol::kServerNonce; ++i) {
    nonces[kNonceSize + i] = added[i];
  }
  protocol::MacHead head = {MacUse::kSessionKey, number_, answer.id, protocol::kHello};
  ComputeMac(own, head, nonces, sizeof(nonces), mac);
  session_.Set(mac);
  head.use = MacUse::kGroupMask;
  ComputeMac(own, head, nonces, sizeof(nonces), mac);
  for (uint8_t i = 0; i < kAesBlock; ++i) {
    mac[i] ^= added[kGroupKeyAt + i];
  }
  group_.Set(mac);
  of_group_ = protocol::GetU32(added + kGroupCounterAt);
  sent_ = 0;
  received_ = 0;
  awaits_answer_ = false;
  in_session_ = true;
  return true;
}

uint8_t Signing::Verify(const FrameView& frame) {
  const bool to_all = frame.id == protocol::kBroadcastId;
  const uint8_t size = to_all ? protocol::kSignatureToAll : protocol::kSignature;
  if (!in_session_) {
    return kForged;
  }
  if (to_all && of_group_ == kUnsignedGroup) {
    return 0;
  }
  if (frame.length < size) {
    return kForged;
  }
  const uint8_t* const low = frame.data + (frame.length - size);
  const uint32_t counter = to_all ? protocol::NextCounter(of_group_, protocol::GetU16(low), 0xFFFF)
                                  : protocol::NextCounter(received_, low[0], 0xFF);
  const MacUse use = to_all ? MacUse::kToAll : MacUse::kServerFrame;
  if (!Accept(to_all ? group_ : session_, {use, counter, frame.id, frame.opcode}, frame, size)) {
    return kForged;
  }
  (to_all ? of_group_ : received_) = counter;
  return size;
}

bool Signing::Accept(const Key& key, const protocol::MacHead& head, const FrameView& frame,
                     uint8_t size) {
  uint8_t mac[kAesBlock];
  ComputeMac(key, head, frame.data, static_cast<uint8_t>(frame.length - size), mac);
  return protocol::SameTag(mac, frame.data + (frame.length - kTagSize));
}

}  // namespace client
}  // namespace pheromone
