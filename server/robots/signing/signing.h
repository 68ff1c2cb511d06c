// The server's end of a signed link (protocol/README.md, section 18): takes the signatures of
// clients' frames off, or refuses the frames, and signs the server's.
//
//   Signing signing(Security::kRequire, keys, random);
//   switch (signing.Open(&message, now)) {
//     case Opened::kIgnore: ...                      // nobody's
//     case Opened::kGreeting: Answer(message);       // Sign makes of it the answer to a first
//     HELLO case Opened::kMessage: Handle(message);
//   }
//   if (!signing.Sign(&message)) ...                 // nobody could read it: drop it
//
// A session begins with the answer to a first HELLO. Each robot has at most two sessions: the one
// in use, and the one that it was greeted with, which replaces it with the first frame that is
// signed by it. So a HELLO that somebody repeats changes nothing.
//
// Frames are to be signed in the order in which they are sent. No I/O, no clock; not thread-safe.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>

#include "protocol/frame.h"
#include "server/robots/signing/evp_aes.h"
#include "server/robots/signing/keys.h"

namespace pheromone::signing {

/// Frames that were ignored.
struct SigningCounters {
  uint64_t unsigned_frames = 0;  ///< without a signature, or of no session of now
  uint64_t unknown_robots = 0;   ///< of robots without a key
  uint64_t wrong_tags = 0;       ///< forged, repeated, or too many were lost before

  bool operator==(const SigningCounters&) const = default;
};

/// Wrong tags of one ID within a second, after which its frames are not looked at until the second
/// is over: at that rate a tag is found in 97 days on average.
constexpr int kMostWrongTags = 256;

/// What a frame is, once it is open.
enum class Opened : uint8_t { kIgnore, kGreeting, kMessage };

class Signing {
 public:
  /// Fills with bytes that nobody can foresee.
  using Random = std::function<void(std::span<uint8_t> bytes)>;

  Signing(Security security, const Keys& keys, Random random);

  /// Takes the signature of a client's frame off; kGreeting: makes it the answer to be signed.
  Opened Open(protocol::Message* message, std::chrono::nanoseconds now);

  /// Signs a frame of the server. An answer that has no room for that becomes an ERROR. False:
  /// there is no session under which its robot would accept it.
  bool Sign(protocol::Message* message);

  /// If a robot's key is gone or another one, all sessions end: it has the group's key, too.
  void SetKeys(const Keys& keys);

  bool has_session(uint8_t id) const;
  /// The answer to HELLO that was signed last is for a robot that had said a first one before, or
  /// is not the first in its session: it may have lost those.
  bool greeted_before() const { return greeted_before_; }
  Security security() const { return security_; }
  const SigningCounters& counters() const { return counters_; }

 private:
  struct Session {
    explicit Session(const uint8_t* bytes) { key.Set(bytes); }
    MacKey key;
    uint32_t heard = 0;  // the last counter
    uint32_t sent = 0;
  };
  struct Robot {
    explicit Robot(const Key& key);
    Key bytes;
    MacKey key;
    std::optional<uint32_t> greeted{};  // nonce and number of the last first HELLO
    bool greeted_before = false;
    std::optional<Session> current{};
    std::optional<Session> next{};
    std::chrono::nanoseconds second{};  // since when wrong tags are counted
    int wrong_tags = 0;
  };

  Opened Unsigned(uint64_t* counter);
  Opened WrongTag(Robot* robot);
  Opened OpenHello(protocol::Message* message, Robot* robot);
  Opened OpenFrame(protocol::Message* message, Robot* robot);
  void SignGreeting(protocol::Message* message, Robot* robot);
  void SignToAll(protocol::Message* message);
  void MakeGroupKey();

  Security security_;
  Random random_;
  std::map<uint8_t, Robot> robots_;
  Key group_{};
  MacKey group_key_;
  uint32_t group_sent_ = 0;
  bool greeted_before_ = false;
  SigningCounters counters_;
};

}  // namespace pheromone::signing
