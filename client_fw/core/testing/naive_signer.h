// The server's end of a signed link, for one robot: protocol/README.md, section 18, word by word,
// with OpenSSL's CMAC. For tests only.
//
//   NaiveSigner signer;
//   if (signer.Open(&request)) ...              // takes the signature off
//   if (signer.greets) Send(signer.Greeting(request.id));   // it was a first HELLO
//   signer.Sign(&answer);                       // also frames to all
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "protocol/frame.h"
#include "protocol/testing/naive_mac.h"

namespace pheromone {
namespace client {

class NaiveSigner {
 public:
  using Octets = std::vector<uint8_t>;

  /// False, and `message` is as it was: it is not signed as the next frame of this robot.
  bool Open(protocol::Message* message) {
    const Octets all(message->data, message->data + message->length);
    greets = message->opcode == 0x71 && all.size() == 10;
    if (greets) {
      return OpenHello(all, message);
    }
    if (all.size() < 5) {
      return false;
    }
    const Octets data(all.begin(), all.end() - 5);
    const auto opens = [&](Session* with) {
      uint32_t counter = with->received + 1;
      while ((counter & 0xFFu) != all[data.size()]) {
        ++counter;
      }
      if (with->key.empty() || !Ends(all, protocol::NaiveMac(with->key, 1, counter, message->id,
                                                             message->opcode, data))) {
        return false;
      }
      with->received = counter;
      return true;
    };
    if (opens(&next)) {
      session = next;
      next = Session();
    } else if (!opens(&session)) {
      return false;
    }
    message->length = static_cast<uint8_t>(data.size());
    return true;
  }

  void Sign(protocol::Message* message) {
    const Octets data(message->data, message->data + message->length);
    if (message->id == 0xFF) {
      ++group_sent;
      const Octets mac =
          protocol::NaiveMac(group_key, 3, group_sent, message->id, message->opcode, data);
      Add(message, {static_cast<uint8_t>(group_sent), static_cast<uint8_t>(group_sent >> 8)});
      Add(message, {mac.begin(), mac.begin() + 4});
    } else {
      ASSERT_FALSE(session.key.empty()) << "no frame of a session has come";
      ++session.sent;
      const Octets mac =
          protocol::NaiveMac(session.key, 2, session.sent, message->id, message->opcode, data);
      Add(message, {static_cast<uint8_t>(session.sent)});
      Add(message, {mac.begin(), mac.begin() + 4});
    }
  }

  /// The answer to the last first HELLO.
  protocol::Message Greeting(uint8_t id) {
    const uint16_t number = hellos.empty() ? uint16_t{0} : hellos.back();
    Octets nonces = {static_cast<uint8_t>(client_nonce), static_cast<uint8_t>(client_nonce >> 8)};
    nonces.insert(nonces.end(), nonce.begin(), nonce.end());
    ++nonce[0];
    next = {protocol::NaiveMac(key, 6, number, id, 0x71, nonces)};
    const Octets mask = protocol::NaiveMac(key, 7, number, id, 0x71, nonces);
    protocol::Message message;
    message.id = id;
    message.opcode = 0xF1;
    Add(&message, nonces);
    Octets masked = group_key;
    for (size_t i = 0; i < masked.size(); ++i) {
      masked[i] ^= mask[i];
    }
    Add(&message, masked);
    const uint32_t counter = accepts_unsigned ? 0xFFFFFFFF : group_sent;
    Add(&message, {static_cast<uint8_t>(counter), static_cast<uint8_t>(counter >> 8),
                   static_cast<uint8_t>(counter >> 16), static_cast<uint8_t>(counter >> 24)});
    const Octets mac =
        protocol::NaiveMac(key, 5, number, id, 0xF1, {message.data, message.data + message.length});
    Add(&message, {mac.begin(), mac.begin() + 4});
    return message;
  }

  static void Add(protocol::Message* message, const Octets& bytes) {
    ASSERT_LE(message->length + bytes.size(), size_t{protocol::kMaxData});
    std::copy(bytes.begin(), bytes.end(), message->data + message->length);
    message->length = static_cast<uint8_t>(message->length + bytes.size());
  }

  Octets key = {0x0f, 0x1e, 0x2d, 0x3c, 0x4b, 0x5a, 0x69, 0x78,
                0x87, 0x96, 0xa5, 0xb4, 0xc3, 0xd2, 0xe1, 0xf0};
  Octets group_key = {1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23, 25, 27, 29, 31};
  uint32_t group_sent = 70000;
  bool accepts_unsigned = false;
  Octets nonce = {200, 201, 202, 203, 204, 205, 206, 207};  ///< of the next answer

  struct Session {
    Octets key;  ///< empty: there is none
    uint32_t received = 0;
    uint32_t sent = 0;
  };
  Session session;
  Session next;                  ///< of the last greeting; in use from its first frame on
  bool greets = false;           ///< what was opened last is a first HELLO
  std::vector<uint16_t> hellos;  ///< numbers of those
  uint16_t client_nonce = 0;

 private:
  static bool Ends(const Octets& all, const Octets& mac) {
    return std::equal(mac.begin(), mac.begin() + 4, all.end() - 4);
  }

  bool OpenHello(const Octets& all, protocol::Message* message) {
    const auto number = static_cast<uint16_t>(all[4] + 256 * all[5]);
    if (!Ends(all, protocol::NaiveMac(key, 4, number, message->id, 0x71,
                                      {all.begin(), all.begin() + 4}))) {
      return false;
    }
    hellos.push_back(number);
    client_nonce = static_cast<uint16_t>(all[0] + 256 * all[1]);
    message->length = 4;
    return true;
  }
};

}  // namespace client
}  // namespace pheromone
