// Both ends of a signed link, and an attacker who hears everything and gives to each end whatever
// he likes: an end accepts what the other one has sent, as it was sent, and once.
//
// Each operation is a byte, and its arguments.

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "client_fw/core/signing/signing.h"
#include "proto_tests/fuzz/require.h"
#include "protocol/frame.h"
#include "protocol/opcodes.h"
#include "protocol/signing.h"
#include "server/robots/signing/signing.h"

namespace {

using pheromone::fuzz::Require;
using namespace pheromone;  // NOLINT(google-build-using-namespace)
using protocol::Message;

constexpr uint8_t kRobot = 7;
constexpr signing::Key kKey = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16};
constexpr size_t kMostFrames = 200;

class Input {
 public:
  Input(const uint8_t* data, size_t size) : at_(data), end_(data + size) {}

  bool empty() const { return at_ == end_; }
  uint8_t Take() { return empty() ? uint8_t{0} : *at_++; }
  Message TakeMessage(uint8_t id, uint8_t opcode, uint8_t most) {
    Message message;
    message.id = id;
    message.opcode = opcode;
    message.length = static_cast<uint8_t>(Take() % (most + 1));
    std::generate_n(message.data, message.length, [this] { return Take(); });
    return message;
  }

 private:
  const uint8_t* at_;
  const uint8_t* end_;
};

struct Frame {
  Message message;
  bool of_server = false;
  bool accepted = false;
};

class Link {
 public:
  void Run(Input* in) {
    while (!in->empty() && air_.size() < kMostFrames) {
      now_ += std::chrono::milliseconds(in->Take());
      switch (in->Take() % 10) {
        case 0:
          Greet();
          break;
        case 1:
          Request(in->TakeMessage(kRobot, OpcodeOf(in->Take(), false),
                                  protocol::kMaxData - protocol::kSignature));
          break;
        case 2:
          Say(in->TakeMessage(kRobot, OpcodeOf(in->Take(), true), protocol::kMaxData));
          break;
        case 3:
          Say(in->TakeMessage(protocol::kBroadcastId, OpcodeOf(in->Take(), true),
                              protocol::kMaxData - protocol::kSignatureToAll));
          break;
        case 4:
        case 5:
          Give(in->Take());
          break;
        case 6:
          GiveChanged(in->Take(), in);
          break;
        case 7:
          server_ = NewServer();
          break;
        case 8:
          ++nonce_;
          number_ = 0;
          robot_ = client::Signing(kKey.data());
          break;
        default:
          GiveAny(in);
      }
    }
  }

 private:
  static uint8_t OpcodeOf(uint8_t byte, bool of_server) {
    const auto opcode = static_cast<uint8_t>(of_server ? byte | 0x80u : byte & 0x7Fu);
    return opcode == protocol::kHello || opcode == protocol::kHelloAnswer
               ? static_cast<uint8_t>(opcode + 1)
               : opcode;
  }

  signing::Signing NewServer() {
    return {signing::Security::kRequire, {{kRobot, kKey}}, [this](std::span<uint8_t> bytes) {
              std::generate(bytes.begin(), bytes.end(), [this] {
                random_ = random_ * 6364136223846793005u + 1442695040888963407u;
                return static_cast<uint8_t>(random_ >> 56);
              });
            }};
  }

  static client::FrameView ViewOf(const Message& message) {
    return {message.id, message.opcode, message.data, message.length};
  }

  void Add(Message message, const uint8_t* signature, uint8_t size) {
    std::copy_n(signature, size, message.data + message.length);
    message.length = static_cast<uint8_t>(message.length + size);
    air_.push_back({message});
  }

  void Greet() {
    Message hello;
    hello.id = kRobot;
    hello.opcode = protocol::kHello;
    hello.length = 4;
    hello.data[0] = static_cast<uint8_t>(nonce_ & 0xFFu);
    hello.data[1] = static_cast<uint8_t>(nonce_ >> 8);
    std::array<uint8_t, client::Signing::kLongest> signature{};
    Add(hello, signature.data(), robot_.SignHello(ViewOf(hello), number_++, signature.data()));
  }

  void Request(const Message& message) {
    std::array<uint8_t, client::Signing::kLongest> signature{};
    if (robot_.has_session()) {
      Add(message, signature.data(), robot_.Sign(ViewOf(message), signature.data()));
    }
  }

  void Say(Message message) {
    if (server_.Sign(&message)) {
      Require(message.length <= protocol::kMaxData);
      air_.push_back({message, true});
    }
  }

  // Whether an end has accepted it.
  bool Accepts(Message message) {
    if (protocol::IsFromServer(message.opcode)) {
      return protocol::IsGreeting(message)
                 ? robot_.TakeAnswer(ViewOf(message))
                 : robot_.Verify(ViewOf(message)) != client::Signing::kForged;
    }
    const signing::Opened opened = server_.Open(&message, now_);
    if (opened == signing::Opened::kGreeting) {
      Require(server_.Sign(&message));
      air_.push_back({message, true});
    }
    return opened == signing::Opened::kMessage;
  }

  void Give(size_t which) {
    if (air_.empty()) {
      return;
    }
    which %= air_.size();
    if (Accepts(air_[which].message)) {
      Require(!air_[which].accepted);
      air_[which].accepted = true;
    }
  }

  void GiveChanged(size_t which, Input* in) {
    if (air_.empty()) {
      return;
    }
    Message message = air_[which % air_.size()].message;
    const Message original = message;
    const uint8_t at = in->Take();
    const uint8_t bits = std::max<uint8_t>(in->Take(), 1);
    if (at < message.length) {
      message.data[at] ^= bits;
    } else if (at % 3 == 0) {
      message.opcode ^= bits;
    } else if (at % 3 == 1) {
      message.id ^= bits;
    } else {
      message.length = static_cast<uint8_t>(bits % (protocol::kMaxData + 1));
      if (message.length == original.length) {
        return;
      }
    }
    const size_t before = air_.size();
    Require(!Accepts(message) && air_.size() == before);
  }

  void GiveAny(Input* in) {
    const Message message = in->TakeMessage(in->Take() % 2 == 0 ? kRobot : protocol::kBroadcastId,
                                            in->Take(), protocol::kMaxData);
    const bool was_heard = std::any_of(air_.begin(), air_.end(), [&](const Frame& it) {
      return it.message.length == message.length &&
             std::equal(message.data, message.data + message.length, it.message.data);
    });
    Require(!Accepts(message) || was_heard);
  }

  std::chrono::nanoseconds now_{0};
  uint64_t random_ = 1;
  signing::Signing server_ = NewServer();
  client::Signing robot_{kKey.data()};
  uint16_t nonce_ = 1;
  uint16_t number_ = 0;
  std::vector<Frame> air_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  Input in(data, size);
  Link().Run(&in);
  return 0;
}
