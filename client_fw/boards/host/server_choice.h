// Which of several servers a client on TCP or UDP speaks to (protocol/README.md, section 8,
// "Several servers"): the next one after a refusal, a missing answer, or a change that goes
// nowhere. Without any I/O: frames and the time go in.
//
//   ServerChoice choice(addresses.size(), id);
//   choice.OnSent(frame, now_ms);          // each frame of the client, whole
//   choice.OnReceived(bytes, now_ms);      // of the server that is spoken to, and of no other
//   choice.OnRefused();                    // or closed, or out of reach
//   if (choice.Move(now_ms)) {
//     ... from now on with addresses[choice.server()]; once it can be written to: ...
//     Write(choice.unanswered());
//   }
//   Write(choice.TakeInquiry(now_ms));     // not told to OnSent; often empty
//   if (choice.TakeNewEpoch()) robot.GreetAgain();
//
// Times are milliseconds of any clock that begins at 0 or later. One thread.
#pragma once

#include <stddef.h>
#include <stdint.h>

#include <optional>
#include <span>
#include <vector>

#include "protocol/decoder.h"

namespace pheromone::client {

/// A server has that long to answer, counted from the first request that it leaves unanswered: the
/// usual period of 200 ms, this, and an exchange are less than the shortest fail-safe in use.
constexpr int64_t kServerPatienceMs = 150;
/// And so long for one that need not wait for a disk or for other servers.
constexpr int64_t kQueryPatienceMs = 40;
/// Both double each time the whole list has been tried in vain, so often.
constexpr size_t kPatienceDoublings = 2;
/// A change that waits longer, while queries are answered: this server cannot make it last.
constexpr int64_t kChangePatienceMs = 1000;
/// Between HELLOs that ask whether the new server is one of the same cluster.
constexpr int64_t kInquiryMs = 1000;

class ServerChoice {
 public:
  /// With one server, it never moves. `id`: the client's CLIENT_ID.
  ServerChoice(size_t servers, uint8_t id) : servers_(servers), id_(id) {}

  void OnSent(std::span<const uint8_t> frame, int64_t now_ms);
  void OnReceived(std::span<const uint8_t> bytes, int64_t now_ms);
  void OnRefused() { refused_ = true; }

  /// True: the client speaks to another server() from now on.
  bool Move(int64_t now_ms);

  /// The place of the server in the list.
  size_t server() const { return server_; }
  /// What goes to a new server as soon as it can be written to; empty: nothing waits for an answer.
  std::span<const uint8_t> unanswered() const { return unanswered_; }
  /// Moves since a server was last heard.
  size_t moves() const { return moves_; }

  /// A HELLO under the nonce in use, to be sent beside everything else: a server of the same
  /// cluster answers it with the same epoch. Empty: nothing to ask now.
  std::span<const uint8_t> TakeInquiry(int64_t now_ms);
  /// True, once: it is a server with another state, which does not know this robot.
  bool TakeNewEpoch();

 private:
  struct Change {
    uint8_t opcode;
    uint8_t seq;
    int64_t since_ms;  // it waits, or those before that were not taken either
    int64_t sent_ms;
  };

  bool Waits(int64_t now_ms) const;
  bool IsDue(int64_t now_ms) const;
  void Hear(const protocol::Message& message);
  void OnHelloAnswer(const protocol::Message& message);

  size_t servers_;
  uint8_t id_;
  size_t server_ = 0;
  size_t moves_ = 0;
  bool refused_ = false;
  int64_t arrived_ms_ = 0;
  protocol::FrameDecoder decoder_{protocol::kNoGapTimeout};
  std::vector<uint8_t> unanswered_;    // the last request
  bool is_query_ = false;              // and it need not wait for anything
  std::optional<int64_t> asked_ms_;    // the first request since something was heard
  std::optional<int64_t> queried_ms_;  // the first query since then
  std::optional<Change> change_;       // not answered yet
  std::vector<uint8_t> hello_;         // as the client said it last
  std::optional<uint16_t> epoch_;      // of the server that answered one
  bool heard_ = false;                 // since the last move
  bool doubtful_ = false;              // nothing tells yet that the epoch is the same
  int64_t next_inquiry_ms_ = 0;
  bool new_epoch_ = false;
};

}  // namespace pheromone::client
