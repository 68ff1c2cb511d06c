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
constexpr uint32_t kLastCounter = 0xFFFFFFFE;
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

Opened Signing::Open(protocol::Message* message, std::chrono::nanoseconds now) {
  if (security_ == Security::kOff || protocol::IsFromServer(message->opcode)) {
    return Opened::kMessage;
  }
  const auto found = robots_.find(message->id);
  if (found == robots_.end()) {
    return Unsigned(&counters_.unknown_robots);
  }
  Robot& robot = found->second;
  if (now - robot.second >= kSecond) {
    robot.second = now;
    robot.wrong_tags = 0;
  }
  if (robot.wrong_tags >= kMostWrongTags) {
    ++counters_.wrong_tags;
    return Opened::kIgnore;
  }
  const bool greets = message->opcode == protocol::kHello &&
                      message->length == kHelloSize + protocol::kSignatureOfHello;
  return greets ? OpenHello(message, &robot) : OpenFrame(message, &robot);
}

// A frame without a signature.
Opened Signing::Unsigned(uint64_t* counter) {
  if (security_ == Security::kAccept) {
    return Opened::kMessage;
  }
  ++*counter;
  return Opened::kIgnore;
}

Opened Signing::WrongTag(Robot* robot) {
  ++robot->wrong_tags;
  ++counters_.wrong_tags;
  return Opened::kIgnore;
}

// The first one. Of one nonce, its number goes up.
Opened Signing::OpenHello(protocol::Message* message, Robot* robot) {
  const uint16_t nonce = protocol::GetU16(message->data);
  const uint16_t number = protocol::GetU16(message->data + kHelloSize);
  if (!Fits(MacOf(robot->key, MacUse::kHello, number, *message, kHelloSize), *message)) {
    return WrongTag(robot);
  }
  const uint32_t greets = (uint32_t{nonce} << 16) | number;
  if (robot->greeted && (*robot->greeted >> 16) == nonce && greets <= *robot->greeted) {
    return WrongTag(robot);
  }
  robot->greeted_before = robot->greeted.has_value();
  robot->greeted = greets;
  message->opcode = protocol::kHelloAnswer;
  message->length = protocol::kServerNonceAt;
  return Opened::kGreeting;
}

Opened Signing::OpenFrame(protocol::Message* message, Robot* robot) {
  const bool is_plain_hello = message->opcode == protocol::kHello && message->length == kHelloSize;
  if (is_plain_hello && security_ == Security::kAccept) {
    robot->current.reset();
    robot->next.reset();
    return Opened::kMessage;
  }
  if (!robot->current && !robot->next) {
    return Unsigned(&counters_.unsigned_frames);
  }
  if (message->length < protocol::kSignature) {
    ++counters_.unsigned_frames;
    return Opened::kIgnore;
  }
  const auto length = static_cast<uint8_t>(message->length - protocol::kSignature);
  const auto is_of = [&](std::optional<Session>* session) {
    if (!*session || (*session)->heard >= kLastCounter) {
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
    return WrongTag(robot);
  }
  message->length = length;
  return Opened::kMessage;
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
  if (message->opcode == protocol::kHelloAnswer && message->length == protocol::kServerNonceAt) {
    SignGreeting(message, &robot);
    return true;
  }
  std::optional<Session>& session = robot.current ? robot.current : robot.next;
  if (!session) {
    return security_ == Security::kAccept;
  }
  if (session->sent == kLastCounter) {
    return false;  // until HELLO
  }
  if (message->length + protocol::kSignature > protocol::kMaxData) {
    MakeError(message);
  }
  greeted_before_ = robot.greeted_before || session->sent != 0;
  const uint32_t counter = ++session->sent;
  const Mac mac = MacOf(session->key, MacUse::kServerFrame, counter, *message, message->length);
  const std::array<uint8_t, 1> low = {static_cast<uint8_t>(counter & UINT8_MAX)};
  Append(low, message);
  AppendTag(mac, message);
  return true;
}

void Signing::SignGreeting(protocol::Message* message, Robot* robot) {
  const auto number = static_cast<uint16_t>(robot->greeted.value_or(0) & UINT16_MAX);
  std::array<uint8_t, protocol::kServerNonce> nonce{};
  random_(nonce);
  Append(nonce, message);
  protocol::Message nonces = *message;
  nonces.opcode = protocol::kHello;
  const Mac session = MacOf(robot->key, MacUse::kSessionKey, number, nonces, nonces.length);
  greeted_before_ = robot->greeted_before;
  robot->next.emplace(session.data());
  Mac group = MacOf(robot->key, MacUse::kGroupMask, number, nonces, nonces.length);
  for (size_t i = 0; i < group.size(); ++i) {
    group[i] = static_cast<uint8_t>(group[i] ^ group_[i]);
  }
  Append(group, message);
  std::array<uint8_t, 4> counter{};
  protocol::PutU32(counter.data(),
                   security_ == Security::kRequire ? group_sent_ : protocol::kUnsignedToAll);
  Append(counter, message);
  AppendTag(MacOf(robot->key, MacUse::kGreeting, number, *message, message->length), message);
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
