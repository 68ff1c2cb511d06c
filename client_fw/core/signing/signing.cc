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

void Copy(const uint8_t* from, uint8_t size, uint8_t* to) {
  for (uint8_t i = 0; i < size; ++i) {
    to[i] = from[i];
  }
}

}  // namespace

const Signing::Key& Signing::ExpandOwn() {
  if (due_ == kNothing) {
    group_.Set(key_);
    due_ = kGroupExpanded;
  }
  just_expanded_ = true;
  return group_;
}

uint8_t Signing::SignHello(const FrameView& hello, uint16_t number, uint8_t* signature) {
  if (due_ != kGroupExpanded) {
    Finish();
  }
  awaits_answer_ = true;
  number_ = number;
  Copy(hello.data, protocol::kServerNonceAt, nonces_);
  uint8_t mac[kAesBlock];
  ComputeMac(ExpandOwn(), {MacUse::kHello, number, hello.id, hello.opcode}, hello.data,
             hello.length, mac);
  protocol::PutU16(signature, number);
  Copy(mac, kTagSize, signature + 2);
  return protocol::kSignatureOfHello;
}

uint8_t Signing::Sign(const FrameView& frame, uint8_t* signature) {
  Finish();
  ++sent_;
  uint8_t mac[kAesBlock];
  ComputeMac(session_, {MacUse::kClientFrame, sent_, frame.id, frame.opcode}, frame.data,
             frame.length, mac);
  signature[0] = static_cast<uint8_t>(sent_ & 0xFFu);
  Copy(mac, kTagSize, signature + 1);
  return protocol::kSignature;
}

bool Signing::TakeAnswer(const FrameView& answer) {
  const uint8_t* const data = answer.data;
  if (!awaits_answer_ || answer.opcode != protocol::kHelloAnswer ||
      answer.length != protocol::kGreetingSize ||
      !protocol::SameBytes(data, nonces_, protocol::kServerNonceAt)) {
    return false;
  }
  uint8_t mac[kAesBlock];
  ComputeMac(ExpandOwn(), {MacUse::kGreeting, number_, answer.id, answer.opcode}, data,
             protocol::kGreetingTagAt, mac);
  if (!protocol::SameTag(mac, data + protocol::kGreetingTagAt)) {
    return false;
  }
  Copy(data, protocol::kGroupKeyAt, nonces_);
  Copy(data + protocol::kGroupKeyAt, kAesBlock, session_.subkey);  // until that is made
  group_told_ = protocol::GetU32(data + protocol::kGroupCounterAt);
  id_ = answer.id;
  sent_ = 0;
  received_ = 0;
  awaits_answer_ = false;
  due_ = kGroupKey;
  in_session_ = true;
  second_hellos_ = kSecondHellos;
  return true;
}

bool Signing::Derive() {
  if (due_ == kNothing) {
    return false;
  }
  if (just_expanded_) {
    just_expanded_ = false;
    return true;
  }
  if (due_ == kSessionKey) {
    uint8_t key[kAesBlock];
    MakeKey(MacUse::kSessionKey, key);
    session_.Set(key);
  } else if (due_ == kGroupKey) {
    MakeGroupKey();
  } else {
    group_.Set(group_key_);
  }
  --due_;
  return true;
}

// Under our own key, which is in the place of the group's.
void Signing::MakeKey(MacUse use, uint8_t* key) const {
  ComputeMac(group_, {use, number_, id_, protocol::kHello}, nonces_, protocol::kGroupKeyAt, key);
}

void Signing::MakeGroupKey() {
  uint8_t key[kAesBlock];
  MakeKey(MacUse::kGroupMask, key);
  for (uint8_t i = 0; i < kAesBlock; ++i) {
    key[i] ^= session_.subkey[i];
  }
  // The answer may have been held back, and what was sent to all since has been heard.
  if (group_told_ > of_group_ || !protocol::SameBytes(key, group_key_, kAesBlock)) {
    of_group_ = group_told_;
  }
  Copy(key, kAesBlock, group_key_);
}

uint8_t Signing::Verify(const FrameView& frame) {
  const bool to_all = frame.id == protocol::kBroadcastId;
  const uint8_t size = to_all ? protocol::kSignatureToAll : protocol::kSignature;
  if (!in_session_) {
    return kForged;
  }
  Finish();
  if (to_all && of_group_ == protocol::kUnsignedToAll) {
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
