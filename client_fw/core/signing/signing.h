// A robot's end of a signed link (protocol/README.md, section 18): its key, the session's and the
// group's, and the counters. No I/O and no time.
//
//   Signing signing(key);                                     // 16 bytes; null: unsigned
//   uint8_t tag[Signing::kLongest];
//   size = signing.SignHello(hello, number, tag);             // the first; tag is sent after DATA
//   if (signing.TakeAnswer(answer)) ...                       // then there is a session,
//   while (signing.Derive()) {}                               // its keys a piece at a time:
//   size = signing.Sign(request, tag);                        // beginning with the second HELLO
//   size = signing.Verify(frame);                             // what ends DATA; or kForged
//
// A number of HELLO is never to be used twice under the same nonce; who keeps it is the caller. The
// robot's own key is expanded only while HELLO is signed or answered, in the place of the group's:
// another 192 bytes would be too many for an ATmega328. About 440 bytes; signing one SENSE takes
// one encryption. No call takes an ATmega at 16 MHz more than 2 ms, if Derive is called once in
// each pass of its loop and what is due is done; where it is not, the call that needs it does it
// first.
//
// PHEROMONE_SIGNING=0: firmware without.
#pragma once

#include <stdint.h>

#include "protocol/signing.h"

namespace pheromone {
namespace client {

using protocol::kHasSigning;

/// A frame without delimiters and CRC.
struct FrameView {
  uint8_t id;
  uint8_t opcode;
  const uint8_t* data;
  uint8_t length;  ///< of DATA, with what is added to it if it was received
};

/// What begins at zero, separate so that it can be cleared as plain memory.
class SigningVariables {
 protected:
  bool awaits_answer_;  // to the HELLO of this number
  bool in_session_;
  /// Until the robot's own key makes room for the group's again; each leads to the one before.
  enum Due : uint8_t { kNothing, kGroupExpanded, kSessionKey, kGroupKey };
  uint8_t due_;
  bool just_expanded_;     // our own key, in this pass of the loop
  uint8_t second_hellos_;  // that may still be sent
  uint8_t id_;             // the robot's
  uint16_t number_;
  uint32_t sent_;      // our counter, of the last frame
  uint32_t received_;  // the server's, of the last frame accepted
  uint32_t of_group_;  // the same of frames to all
  uint8_t group_key_[protocol::kAesBlock];
  uint32_t group_told_;                    // its counter, by the last answer
  uint8_t nonces_[protocol::kGroupKeyAt];  // of the last HELLO, and of its answer
};

class Signing : private SigningVariables {
 public:
  enum : uint8_t {
    kLongest = protocol::kSignatureOfHello,  ///< bytes that are added to a client's frame
    kSecondHellos = 4,                       ///< without an answer, before a first one again
    kForged = 255
  };

  /// `key` outlives it.
  explicit Signing(const uint8_t* key) : SigningVariables(), key_(key), session_(), group_() {}

  /// False: nothing is to be signed or verified.
  bool on() const { return key_ != nullptr; }
  bool has_session() const { return in_session_; }

  /// Whether the next HELLO is to be a second one, and is now counted; otherwise it is a first one.
  bool second_hello_due() const { return second_hellos_ != 0; }
  bool TakeSecondHello() {
    const bool due = second_hello_due();
    second_hellos_ = static_cast<uint8_t>(second_hellos_ - (due ? 1 : 0));
    return due;
  }
  /// The next one is a first one. The session holds until that is answered.
  void GreetAnew() { second_hellos_ = 0; }

  /// The first HELLO, whose DATA begins with the nonce. From here on, only its answer is taken.
  /// Returns the bytes in `signature`.
  uint8_t SignHello(const FrameView& hello, uint16_t number, uint8_t* signature);
  /// A frame of a session.
  uint8_t Sign(const FrameView& frame, uint8_t* signature);

  /// The answer to the HELLO that was signed last: begins the session. False: it is none, and
  /// nothing has changed; each is taken once.
  bool TakeAnswer(const FrameView& answer);
  /// Once in each pass of the loop. False: all keys are ready; while they are not, better send
  /// nothing.
  bool Derive();
  /// A frame of the server, to this robot or to all. Returns how many bytes of DATA are not its
  /// own, or kForged; what was accepted once is forged afterwards.
  uint8_t Verify(const FrameView& frame);

 private:
  using Key = protocol::MacKey<protocol::Aes>;

  const Key& ExpandOwn();
  void MakeKey(protocol::MacUse use, uint8_t* key) const;
  void MakeGroupKey();
  void Finish() {
    while (Derive()) {
    }
  }
  bool Accept(const Key& key, const protocol::MacHead& head, const FrameView& frame, uint8_t size);

  const uint8_t* key_;
  Key session_;
  Key group_;
};

}  // namespace client
}  // namespace pheromone
