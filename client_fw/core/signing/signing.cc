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

const Signing::Key& Signing::ExpandOwn(uint8_t* group) {
  if (in_session_) {
    Copy(group_.cipher.key(), kAesBlock, group);
  }
  group_.Set(key_);
  return group_;
}

void Signing::RestoreGroup(const uint8_t* group) {
  if (in_session_) {
    group_.Set(group);
  }
}

uint8_t Signing::SignHello(const FrameView& hello, uint16_t number, uint8_t* signature) {
  awaits_answer_ = true;
  number_ = number;
  nonce_ = protocol::GetU16(hello.data);
  uint8_t group[kAesBlock] = {};
  uint8_t mac[kAesBlock];
  ComputeMac(ExpandOwn(group), {MacUse::kHello, number, hello.id, hello.opcode}, hello.data,
             hello.length, mac);
  RestoreGroup(group);
  protocol::PutU16(signature, number);
  Copy(mac, kTagSize, signature + 2);
  return protocol::kSignatureOfHello;
}

uint8_t Signing::Sign(const FrameView& frame, uint8_t* signature) {
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
      answer.length != protocol::kGreetingSize || protocol::GetU16(data) != nonce_) {
    return false;
  }
  uint8_t group[kAesBlock] = {};
  const Key& own = ExpandOwn(group);
  uint8_t mac[kAesBlock];
  ComputeMac(own, {MacUse::kGreeting, number_, answer.id, answer.opcode}, data,
             protocol::kGreetingTagAt, mac);
  if (!protocol::SameTag(mac, data + protocol::kGreetingTagAt)) {
    RestoreGroup(group);
    return false;
  }
  protocol::MacHead head = {MacUse::kSessionKey, number_, answer.id, protocol::kHello};
  ComputeMac(own, head, data, protocol::kGroupKeyAt, mac);
  session_.Set(mac);
  head.use = MacUse::kGroupMask;
  ComputeMac(own, head, data, protocol::kGroupKeyAt, mac);
  for (uint8_t i = 0; i < kAesBlock; ++i) {
    mac[i] ^= data[protocol::kGroupKeyAt + i];
  }
  // The answer may have been held back, and what was sent to all since has been heard.
  const uint32_t of_group = protocol::GetU32(data + protocol::kGroupCounterAt);
  if (of_group > of_group_ || !in_session_ || !protocol::SameBytes(mac, group, kAesBlock)) {
    of_group_ = of_group;
  }
  group_.Set(mac);
  sent_ = 0;
  received_ = 0;
  awaits_answer_ = false;
  in_session_ = true;
  second_hellos_ = kSecondHellos;
  return true;
}

uint8_t Signing::Verify(const FrameView& frame) {
  const bool to_all = frame.id == protocol::kBroadcastId;
  const uint8_t size = to_all ? protocol::kSignatureToAll : protocol::kSignature;
  if (!in_session_) {
    return kForged;
  }
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
