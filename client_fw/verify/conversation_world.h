// One robot and the server, for the question whether each change is made exactly once: the real
// conversation of client_fw/core, the real engine, and between them a network that loses, delays
// and repeats, resets of the robot, and crashes of the server that forget what was not durable.
//
// Its changes are deposits or WRITEs of a tag (conversation_changes.h). A robot that writes on tags
// also asks for intensities. That is one step, in which both request and answer arrive or the
// request is lost: SENSE changes nothing, and its answer has no number, so that a late one is as
// good as one in time. They come first in each period, so that the end of a period is a choice too.
//
// With `rounds`, robot and server share a radio channel, and the answer to what was sent in a turn
// is in the next ROUND, at the place of that turn: another robot has a turn, too, before or after,
// and what it sends is heard or not. A ROUND is lost or heard, and so is what is sent in its turns;
// what the log has not synced yet is answered *busy*. A server that was restarted waits until
// nobody awaits a ROUND any more (ChannelOptions::quiet_start).
//
// Left out of Key, since they decide only when something happens, which is open here anyway: the
// client's timers and random numbers, the log's sequence numbers, the time. So that the robot also
// gives up repeating a request and says HELLO, silence is a step of its own.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client_fw/core/conversation.h"
#include "client_fw/core/requests/tag_exchange.h"
#include "client_fw/verify/conversation_changes.h"
#include "client_fw/verify/explore.h"
#include "client_fw/verify/shared_engine.h"
#include "protocol/messages.h"
#include "server/core/engine/engine.h"

namespace pheromone::verify {

/// Servers that are to be refuted.
enum class ServerMutant : uint8_t {
  kNone,
  kForgetsRobot,    ///< when another robot says HELLO
  kForgetsRequest,  ///< the last one of a robot that says HELLO with a new nonce
  // In rounds:
  kAnswersInNewOrder,   ///< at the places of the turns that it gives, not of those before
  kAnswersUnsynced,     ///< what is not durable yet
  kSaysAgainToTheNext,  ///< an answer that is said again has the SEQ of the change after it
  kNumbersAgain,        ///< after a crash it begins at once, with numbers that are still awaited
};

/// What may happen, and how often.
struct ConversationLimits {
  ChangeKind kind = ChangeKind::kDeposit;
  int changes = 2;       ///< that the robot makes
  int warm_resets = 0;   ///< which keep the request memory
  int power_losses = 0;  ///< which do not
  int crashes = 0;       ///< of the server
  int turned_away = 0;   ///< changes that the server's log does not accept: busy, or read-only
  int silences = 0;      ///< after which a robot that was answered before says HELLO again
  size_t in_flight = 2;  ///< frames in each direction
  int other_robots = 0;  ///< that say HELLO
  int rounds = 0;        ///< in which the robot has a turn; 0: it contends
  /// Mutants.
  ServerMutant server = ServerMutant::kNone;
  bool takes_numbers_back = false;  ///< after a warm reset the robot trusts HELLO's answer alone
  bool repeats_with_pose = false;   ///< the robot repeats a WRITE with its present pose
};

class ConversationWorld {
 public:
  explicit ConversationWorld(const ConversationLimits& limits);
  ConversationWorld(const ConversationWorld& other);
  ConversationWorld(ConversationWorld&& other) noexcept;
  ConversationWorld& operator=(const ConversationWorld&) = delete;
  ~ConversationWorld() = default;

  std::string Key() const;
  /// Empty, or what went wrong: a change that was made twice; an acknowledged one that is gone, or
  /// of which the disk has nothing; one that was refused, which was made or need not have been; one
  /// that was given up although the robot has not lost power; a WRITE whose end nobody will tell.
  std::string Wrong() const;
  /// The robot has made all its changes, and knows of each what became of it.
  bool Finished() const { return left_.changes == 0 && memory_.opcode == 0; }
  /// It can still fall silent and say HELLO, so that no request may keep it from going on.
  bool MustFinish() const { return left_.silences > 0; }

  using Visit = std::function<void(std::string step, ConversationWorld successor)>;
  void Next(const Visit& visit) const;

 private:
  using Engine = engine::Engine;

  enum class Told : uint8_t { kNothing, kMade, kRefused };

  bool is_of_tags() const { return left_.kind != ChangeKind::kDeposit; }
  uint32_t TimesMade(const SharedEngine& server, int change) const {
    return verify::TimesMade(left_.kind, *server, change);
  }

  // The robot's next frame is sent, now or when the present period has ended; false: none.
  bool Send(bool in_next_period);
  std::optional<protocol::Message> TakeTurn();
  protocol::Message TakeSent(uint8_t seq_before);
  void Handle(const protocol::Message& request, std::vector<engine::Outgoing>* out);
  void Deliver(const engine::Outgoing& answer);
  void AskForChange();
  void HearNothing();
  void Sense(const protocol::Message& request);
  void Arrive(size_t frame, bool also_later);
  void TurnAway(size_t frame, protocol::Reason reason);
  void Hear(size_t frame, bool also_later);
  void Take(const protocol::Message& message);
  void Settle(const protocol::Message& message, bool was_asked);
  void Sync();
  void Crash();
  void Reset(bool keeps_memory);
  void OtherHello();
  // conversation_rounds.cc
  struct Turn;
  protocol::Round Answers() const;
  std::vector<engine::Outgoing> SaidAgain() const;
  void Round(const Turn& turn, bool heard, bool arrives);
  void NextRounds(const Visit& visit) const;

  ConversationLimits left_;
  client::RequestMemory memory_{};
  uint16_t boot_counter_ = 1;
  client::TagExchange exchange_;
  client::Conversation robot_;
  uint32_t now_ms_ = 0;

  std::shared_ptr<const SharedEngine> server_;
  std::shared_ptr<const SharedEngine> durable_;  // what a crash goes back to
  std::vector<protocol::Message> held_;          // answers that wait for the disk
  std::vector<protocol::Message> to_server_;
  std::vector<protocol::Message> to_robot_;

  int made_ = 0;            // changes that the robot has begun
  std::vector<Told> told_;  // by change
  int pending_ = -1;        // the change that the robot's request memory holds
  std::string fault_;       // what Settle has found, for Wrong

  // Of the round in progress.
  uint8_t number_ = 0;
  int turns_ = 0;  // 0: there is none
  int place_ = 0;  // of the robot's turn
  bool other_was_heard_ = false;
  std::vector<engine::Outgoing> answered_;  // to what the robot sent in its turn
};

/// All that may happen within the limits, from a robot and a server that have just been started.
Explored ExploreConversation(const ConversationLimits& limits, size_t max_states = 1'000'000);

}  // namespace pheromone::verify
