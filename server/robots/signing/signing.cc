#include "server/robots/signing/signing.h"

#include <algorithm>
#include <array>
#include <utility>

#include "protocol/byte_order.h"
#include "protocol/messages.h"
#include "protocol/signing.h"

namespace pheromone::signing {
namespace {

using protocol::MacUse;
using Mac = std::array<uint8_t, protocol::kAesBlock>;

constexpr uint8_t kHelloSize = 4;
constexpr uint32_t kUnsignedToAll = 0xFFFFFFFF;
constexpr std::chrono::seconds kSecond{1};

// Of the message's ID, OPCODE, and the first `length` bytes of DATA.
Mac MacOf(const MacKey& key, MacUse use, uint32_t counter, const protocol::Message& message,
          uint8_t length) {
  Mac mac;  // NOLINT: filled by the next line
  protocol::ComputeMac(key, {use, counter, message.id, message.opcode}, message.data, length,
                       mac.data());
  return mac;
}

void Append(std::span<const uint8_t> bytes, protocol::Message* message) {
  std::copy(bytes.begin(), bytes.end(), message->data + message->length);
  message->length = static_cast<uint8_t>(message->length + bytes.size());
}

void AppendTag(const Mac& mac, protocol::Message* message) {
  Append(std::span(mac).first(protocol::kTagSize), message);
}

// Whether `mac` is that of the message's last bytes.
bool Fits(const Mac& mac, const protocol::Message& message) {
  return protocol::SameTag(mac.data(), message.data + message.length - protocol::kTagSize);
}

// There is no room for its signature: a name on a tag that is too long for this link.
void MakeError(protocol::Message* message) {
  protocol::ErrorAnswer error;
  error.id = message->id;
  error.refused_opcode = static_cast<uint8_t>(message->opcode & ~protocol::kFromServer);
  error.reason = protocol::Reason::kBadLength;
  Encode(error, message);
}

}  // namespace

Signing::Robot::Robot(const Key& own) : bytes(own) {
  key.Set(own.data());
}

Signing::Signing(Security security, const Keys& keys, Random random)
    : security_(security), random_(std::move(random)) {
  MakeGroupKey();
  SetKeys(keys);
}

void Signing::MakeGroupKey() {
  random_(group_);
  group_key_.Set(group_.data());
  group_sent_ = 0;
}

void Signing::SetKeys(const Keys& keys) {
  const bool all_stay = std::all_of(robots_.begin(), robots_.end(), [&keys](const auto& robot) {
    const auto key = keys.find(robot.first);
    return key != keys.end() && key->second == robot.second.bytes;
  });
  if (!all_stay) {
    robots_.clear();
    MakeGroupKey();
  }
  for (const auto& [id, key] : keys) {
    robots_.try_emplace(id, key);
  }
}

bool Signing::has_session(uint8_t id) const {
  const auto robot = robots_.find(id);
  return robot != robots_.end() && (robot->second.current || robot->second.next);
}

bool Signing::Open(protocol::Message* message, std::chrono::nanoseconds now) {
  if (security_ == Security::kOff || protocol::IsFromServer(message->opcode)) {
    return true;
  }
  const auto found = robots_.find(message->id);
  if (found == robots_.end()) {
    counters_.unknown_robots += security_ == Security::kRequire ? 1 : 0;
    return security_ == Security::kAccept;
  }
  Robot& robot = found->second;
  if (now - robot.second >= kSecond) {
    robot.second = now;
    robot.wrong_tags = 0;
  }
  if (robot.wrong_tags >= kMostWrongTags) {
    ++counters_.wrong_tags;
    return false;
  }
  return message->opcode == protocol::kHello ? OpenHello(message, &robot)
                                             : OpenFrame(message, &robot);
}

bool Signing::OpenHello(protocol::Message* message, Robot* robot) {
  if (message->length != kHelloSize + protocol::kSignatureOfHello) {
    if (security_ == Security::kRequire) {
      ++counters_.unsigned_frames;
      return false;
    }
    robot->greeting.reset();
    robot->current.reset();
    robot->next.reset();
    return true;
  }
  const uint16_t number = protocol::GetU16(message->data + kHelloSize);
  if (!Fits(MacOf(robot->key, MacUse::kHello, number, *message, kHelloSize), *message)) {
    ++robot->wrong_tags;
    ++counters_.wrong_tags;
    return false;
  }
  robot->greeting = number;
  message->length = kHelloSize;
  return true;
}

bool Signing::OpenFrame(protocol::Message* message, Robot* robot) {
  if (!robot->current && !robot->next) {
    counters_.unsigned_frames += security_ == Security::kRequire ? 1 : 0;
    return security_ == Security::kAccept;
  }
  if (message->length < protocol::kSignature) {
    ++counters_.unsigned_frames;
    return false;
  }
  const auto length = static_cast<uint8_t>(message->length - protocol::kSignature);
  const auto is_of = [&](std::optional<Session>* session) {
    if (!*session) {
      return false;
    }
    const uint32_t counter =
        protocol::NextCounter((*session)->heard, message->data[length], UINT8_MAX);
    if (!Fits(MacOf((*session)->key, MacUse::kClientFrame, counter, *message, length), *message)) {
      return false;
    }
    (*session)->heard = counter;
    return true;
  };
  if (is_of(&robot->next)) {
    robot->current = std::exchange(robot->next, std::nullopt);
  } else if (!is_of(&robot->current)) {
    ++robot->wrong_tags;
    ++counters_.wrong_tags;
    return false;
  }
  message->length = length;
  return true;
}

bool Signing::Sign(protocol::Message* message) {
  if (security_ == Security::kOff) {
    return true;
  }
  if (message->id == protocol::kBroadcastId) {
    SignToAll(message);
    return true;
  }
  const auto found = robots_.find(message->id);
  if (found == robots_.end()) {
    return security_ == Security::kAccept;
  }
  Robot& robot = found->second;
  if (message->opcode == protocol::kHelloAnswer && robot.greeting) {
    SignHelloAnswer(message, &robot);
    return true;
  }
  std::optional<Session>& session = robot.current ? robot.current : robot.next;
  if (!session) {
    return security_ == Security::kAccept;
  }
  if (message->length + protocol::kSignature > protocol::kMaxData) {
    MakeError(message);
  }
  const uint32_t counter = ++session->sent;
  const Mac mac = MacOf(session->key, MacUse::kServerFrame, counter, *message, message->length);
  const std::array<uint8_t, 1> low = {static_cast<uint8_t>(counter & UINT8_MAX)};
  Append(low, message);
  AppendTag(mac, message);
  return true;
}

void Signing::SignHelloAnswer(protocol::Message* message, Robot* robot) {
  const uint16_t number = *std::exchange(robot->greeting, std::nullopt);
  std::array<uint8_t, protocol::kServerNonce> nonce{};
  random_(nonce);
  protocol::Message secret;
  secret.id = message->id;
  secret.opcode = protocol::kHello;
  Append(std::span(message->data, 2), &secret);  // the client's nonce
  Append(nonce, &secret);
  const Mac session = MacOf(robot->key, MacUse::kSessionKey, number, secret, secret.length);
  Mac group = MacOf(robot->key, MacUse::kGroupMask, number, secret, secret.length);
  for (size_t i = 0; i < group.size(); ++i) {
    group[i] = static_cast<uint8_t>(group[i] ^ group_[i]);
  }
  robot->next.emplace().key.Set(session.data());
  std::array<uint8_t, 4> counter{};
  protocol::PutU32(counter.data(), security_ == Security::kRequire ? group_sent_ : kUnsignedToAll);
  Append(nonce, message);
  Append(group, message);
  Append(counter, message);
  AppendTag(MacOf(robot->key, MacUse::kHelloAnswer, number, *message, message->length), message);
}

void Signing::SignToAll(protocol::Message* message) {
  if (security_ != Security::kRequire) {
    return;
  }
  const uint32_t counter = ++group_sent_;
  const Mac mac = MacOf(group_key_, MacUse::kToAll, counter, *message, message->length);
  std::array<uint8_t, 2> low{};
  protocol::PutU16(low.data(), static_cast<uint16_t>(counter & UINT16_MAX));
  Append(low, message);
  AppendTag(mac, message);
}

}  // namespace pheromone::signing
