#include "client_fw/verify/signing_world.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <span>
#include <tuple>

#include "protocol/byte_order.h"
#include "protocol/opcodes.h"

namespace pheromone::verify {
namespace {

using protocol::Message;

constexpr uint8_t kRobot = 7;
constexpr signing::Key kKey = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16};
constexpr uint8_t kDeposit = 0x21;
constexpr uint8_t kSense = 0x01;
constexpr std::chrono::nanoseconds kNow{0};

// What the server draws next: a function of the world, which is copied.
thread_local int drawn = 0;

void Draw(std::span<uint8_t> bytes) {
  for (size_t i = 0; i < bytes.size(); ++i) {
    bytes[i] = static_cast<uint8_t>(i < 4 ? static_cast<unsigned>(drawn) >> (8 * i) : i);
  }
}

signing::Signing NewServer(SigningMutant mutant) {
  const bool takes_all = mutant == SigningMutant::kTakesUnsigned;
  return {
      takes_all ? signing::Security::kAccept : signing::Security::kRequire, {{kRobot, kKey}}, Draw};
}

Message Make(uint8_t id, uint8_t opcode, std::initializer_list<int> data) {
  Message message;
  message.id = id;
  message.opcode = opcode;
  for (const int byte : data) {
    message.data[message.length++] = static_cast<uint8_t>(byte);
  }
  return message;
}

void Append(const uint8_t* bytes, uint8_t size, Message* message) {
  std::copy_n(bytes, size, message->data + message->length);
  message->length = static_cast<uint8_t>(message->length + size);
}

using Mac = std::array<uint8_t, protocol::kAesBlock>;

Mac MacOf(const signing::Key& with, const protocol::MacHead& head, const uint8_t* data,
          uint8_t size) {
  protocol::MacKey<protocol::Aes> key;
  key.Set(with.data());
  Mac mac{};
  protocol::ComputeMac(key, head, data, size, mac.data());
  return mac;
}

client::FrameView ViewOf(const Message& message) {
  return {message.id, message.opcode, message.data, message.length};
}

bool Same(const Message& a, const Message& b) {
  return a.id == b.id && a.opcode == b.opcode && a.length == b.length &&
         std::equal(a.data, a.data + a.length, b.data);
}

std::string TextOf(const std::vector<int>& numbers) {
  std::string text;
  for (const int number : numbers) {
    text += std::to_string(number) + ',';
  }
  return text;
}

}  // namespace

bool SigningWorld::Heard::operator<(const Heard& other) const {
  const auto values = [](const Heard& it) {
    return std::tuple(it.content, it.greeting, it.counter, it.message.opcode, it.message.id,
                      it.message.length);
  };
  return values(*this) < values(other);
}

SigningWorld::SigningWorld(const SigningLimits& limits)
    : left_(limits), server_(NewServer(limits.mutant)), fresh_(server_), robot_(kKey.data()) {
  PowerUp();
}

void SigningWorld::PowerUp() {
  ++nonce_;
  number_ = 0;
  robot_ = client::Signing(kKey.data());
  awaited_ = 0;
  of_robot_ = {};
  to_all_heard_ = 0;
}

void SigningWorld::Say(Heard heard) {
  air_.insert(std::upper_bound(air_.begin(), air_.end(), heard), heard);
}

void SigningWorld::Greet() {
  Message hello = Make(kRobot, protocol::kHello, {nonce_ & 0xFF, nonce_ >> 8, 1, 0});
  std::array<uint8_t, client::Signing::kLongest> signature{};
  Append(signature.data(), robot_.SignHello(ViewOf(hello), number_++, signature.data()), &hello);
  awaited_ = ++hellos_;
  Say({hello, 0, awaited_, 0});
}

void SigningWorld::Request() {
  Message request = Make(kRobot, kDeposit, {++contents_});
  std::array<uint8_t, client::Signing::kLongest> signature{};
  Append(signature.data(), robot_.Sign(ViewOf(request), signature.data()), &request);
  Say({request, contents_, of_robot_.greeting, ++of_robot_.sent});
}

bool SigningWorld::Command(uint8_t id) {
  Message command = Make(id, protocol::kCommand, {contents_ + 1, 1});
  if (!server_.Sign(&command)) {
    return false;
  }
  ++contents_;
  if (id == protocol::kBroadcastId) {
    Say({command, contents_, 0, ++to_all_});
  } else {
    Session& session = current_.greeting != 0 ? current_ : next_;
    Say({command, contents_, session.greeting, ++session.sent});
  }
  return true;
}

// It draws another group key.
void SigningWorld::Restart() {
  drawn = ++nonces_;
  server_ = left_.mutant == SigningMutant::kSessionAfterRestart ? fresh_ : NewServer(left_.mutant);
  current_ = {};
  next_ = {};
  greeted_ = 0;
  to_all_ = 0;
}

void SigningWorld::Accept(const Heard& heard, const Message& message, std::vector<int>* accepted) {
  const bool by_server = accepted == &by_server_;
  Message original = Make(kRobot, kDeposit, {heard.content});
  if (!by_server) {
    const bool to_all = accepted == &by_robot_of_all_;
    original =
        Make(to_all ? protocol::kBroadcastId : kRobot, protocol::kCommand, {heard.content, 1});
  }
  if (heard.content == 0 || !Same(message, original)) {
    wrong_ = "a forgery was accepted";
  } else if (!accepted->empty() && accepted->back() >= heard.content) {
    wrong_ = "what was accepted before, or something older, was accepted";
  }
  accepted->push_back(heard.content);
}

// False: nothing has changed.
bool SigningWorld::GiveToServer(const Heard& heard) {
  Message message = heard.message;
  if (protocol::IsFromServer(message.opcode)) {
    return false;
  }
  if (left_.mutant == SigningMutant::kGroupKeyOfOne &&
      IsOfGroup(message, protocol::MacUse::kClientFrame, current_.heard)) {
    Accept(heard, protocol::WithoutSignature(message), &by_server_);
    return true;
  }
  const signing::Signing before = server_;
  switch (server_.Open(&message, kNow)) {
    case signing::Opened::kIgnore:
      server_ = before;  // but for its counters
      return false;
    case signing::Opened::kGreeting:
      if (left_.answers == 0) {
        server_ = before;
        return false;
      }
      --left_.answers;
      drawn = left_.mutant == SigningMutant::kNonceAgain ? 0 : ++nonces_;
      server_.Sign(&message);
      greeted_ = heard.greeting;
      next_ = {heard.greeting * 100 + nonces_, 0, 0};
      fresh_ = server_;
      Say({message, 0, next_.greeting, heard.greeting});
      return true;
    case signing::Opened::kMessage:
      break;
  }
  if (heard.greeting == next_.greeting) {
    current_ = next_;
    next_ = {};
  }
  current_.heard = heard.counter;
  if (left_.mutant == SigningMutant::kServerForgetsCounters) {
    server_ = before;
  }
  Accept(heard, message, &by_server_);
  return true;
}

bool SigningWorld::TakeGreeting(const Heard& heard) {
  if (!robot_.TakeAnswer(ViewOf(heard.message))) {
    return false;
  }
  if (heard.content != 0 || heard.counter != awaited_) {
    wrong_ = "the answer to another HELLO was accepted";
  }
  awaited_ = 0;
  of_robot_ = {heard.greeting, 0, 0};
  const uint8_t* const data = heard.message.data;
  const Mac mask = MacOf(
      kKey,
      {protocol::MacUse::kGroupMask, static_cast<uint16_t>(number_ - 1u), kRobot, protocol::kHello},
      data, protocol::kGroupKeyAt);
  for (size_t i = 0; i < mask.size(); ++i) {
    group_[i] = static_cast<uint8_t>(data[protocol::kGroupKeyAt + i] ^ mask[i]);
  }
  to_all_heard_ =
      static_cast<int>(protocol::GetU32(heard.message.data + protocol::kGroupCounterAt));
  return true;
}

bool SigningWorld::GiveToRobot(const Heard& heard) {
  Message message = heard.message;
  const bool to_all = message.id == protocol::kBroadcastId;
  if (!protocol::IsFromServer(message.opcode) || (message.id != kRobot && !to_all)) {
    return false;
  }
  if (protocol::IsGreeting(message)) {
    return TakeGreeting(heard);
  }
  if (left_.mutant == SigningMutant::kGroupKeyToOne &&
      IsOfGroup(message, protocol::MacUse::kServerFrame, of_robot_.heard)) {
    Accept(heard, protocol::WithoutSignature(message), &by_robot_);
    return true;
  }
  const client::Signing before = robot_;
  const uint8_t size = robot_.Verify(ViewOf(message));
  if (size == client::Signing::kForged) {
    return false;
  }
  if (left_.mutant == SigningMutant::kRobotForgetsCounters) {
    robot_ = before;
  }
  message.length = static_cast<uint8_t>(message.length - size);
  (to_all ? to_all_heard_ : of_robot_.heard) = heard.counter;
  Accept(heard, message, to_all ? &by_robot_of_all_ : &by_robot_);
  return true;
}

// What the attacker makes of a frame.
std::vector<SigningWorld::Heard> SigningWorld::MadeOf(const Heard& heard) const {
  std::vector<Heard> made(5, heard);
  made[0].message.opcode ^= protocol::kFromServer;
  made[1].message.opcode = heard.message.opcode == kDeposit ? kSense : kDeposit;
  made[2].message.id = heard.message.id == kRobot ? protocol::kBroadcastId : kRobot;
  made[3].message = protocol::WithoutSignature(heard.message);
  made[4].message.data[0] ^= 1u;
  for (Heard& it : made) {
    it.content = 0;  // whoever accepts it is wrong
  }
  return made;
}

// A frame to or of the robot under the group's key, in the place of the next one.
std::vector<SigningWorld::Heard> SigningWorld::MadeByInsider() const {
  std::vector<Heard> made;
  const auto add = [&](uint8_t opcode, protocol::MacUse use, int heard) {
    Message message = Make(kRobot, opcode, {contents_ + 1, 1});
    const auto counter = static_cast<uint32_t>(heard + 1);
    const Mac mac = MacOf(group_, {use, counter, kRobot, opcode}, message.data, message.length);
    message.data[message.length++] = static_cast<uint8_t>(counter);
    Append(mac.data(), protocol::kTagSize, &message);
    made.push_back({message, 0, 0, 0});
  };
  add(protocol::kCommand, protocol::MacUse::kServerFrame, of_robot_.heard);
  add(protocol::kCommand, protocol::MacUse::kToAll, of_robot_.heard);
  add(kDeposit, protocol::MacUse::kClientFrame, current_.heard);
  return made;
}

// What a mutant takes: signed by the group's key as the frame that is due.
bool SigningWorld::IsOfGroup(const Message& message, protocol::MacUse use, int heard) const {
  if (message.length < protocol::kSignature) {
    return false;
  }
  const auto size = static_cast<uint8_t>(message.length - protocol::kSignature);
  const Mac mac = MacOf(group_, {use, static_cast<uint32_t>(heard + 1), message.id, message.opcode},
                        message.data, size);
  return protocol::SameTag(mac.data(), message.data + size + 1);
}

std::string SigningWorld::Key() const {
  std::string key;
  const auto add = [&key](std::initializer_list<int> numbers) { key += TextOf(numbers) + ';'; };
  add({left_.greetings, left_.answers, left_.requests, left_.commands, left_.to_all,
       left_.power_losses, left_.warm_resets, left_.restarts});
  add({nonce_, number_, contents_, nonces_, hellos_, awaited_, to_all_, to_all_heard_, greeted_});
  for (const Session& it : {of_robot_, current_, next_}) {
    add({it.greeting, it.sent, it.heard});
  }
  for (const Heard& it : air_) {
    add({it.content, it.greeting, it.counter, it.message.opcode});
  }
  return key + TextOf(by_server_) + ';' + TextOf(by_robot_) + ';' + TextOf(by_robot_of_all_);
}

void SigningWorld::Next(const Visit& visit) const {
  const auto step = [&](int SigningLimits::*left, const std::string& name, auto&& change) {
    if (this->left_.*left > 0) {
      SigningWorld world = *this;
      --(world.left_.*left);
      if (change(&world)) {
        visit(name, std::move(world));
      }
    }
  };
  const auto always = [](auto function) {
    return [function](SigningWorld* world) {
      function(world);
      return true;
    };
  };
  step(&SigningLimits::greetings, "HELLO", always([](SigningWorld* it) { it->Greet(); }));
  if (robot_.has_session()) {
    step(&SigningLimits::requests, "request", always([](SigningWorld* it) { it->Request(); }));
  }
  step(&SigningLimits::commands, "COMMAND", [](SigningWorld* it) { return it->Command(kRobot); });
  step(&SigningLimits::to_all, "halt to all",
       [](SigningWorld* it) { return it->Command(protocol::kBroadcastId); });
  step(&SigningLimits::power_losses, "power loss", always([](SigningWorld* it) { it->PowerUp(); }));
  step(&SigningLimits::warm_resets, "warm reset", always([](SigningWorld* it) {
    const uint16_t number = it->number_;
    --it->nonce_;
    it->PowerUp();
    it->number_ = it->left_.mutant == SigningMutant::kNumberAgain ? uint16_t{0} : number;
  }));
  step(&SigningLimits::restarts, "restart", always([](SigningWorld* it) { it->Restart(); }));
  const auto give = [&](const Heard& heard, const std::string& name) {
    SigningWorld world = *this;
    if (world.GiveToServer(heard)) {
      visit("to the server: " + name, std::move(world));
      world = *this;
    }
    if (world.GiveToRobot(heard)) {
      visit("to the robot: " + name, std::move(world));
    }
  };
  if (left_.insider && robot_.has_session()) {
    for (const Heard& made : MadeByInsider()) {
      give(made, "under the group's key");
    }
  }
  for (const Heard& heard : air_) {
    const std::string name = std::to_string(heard.message.opcode) + " " +
                             std::to_string(heard.content) + " of " +
                             std::to_string(heard.greeting);
    give(heard, name);
    for (const Heard& made : MadeOf(heard)) {
      give(made, "made of " + name);
    }
  }
}

}  // namespace pheromone::verify
