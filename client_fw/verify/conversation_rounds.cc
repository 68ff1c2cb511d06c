// Answers in ROUNDs; see conversation_world.h.
#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "client_fw/verify/conversation_world.h"

namespace pheromone::verify {

using protocol::Message;

namespace {

constexpr uint8_t kOther = kChangesRobot + 1;
constexpr uint32_t kTurnMs = 20;
// Of the other robot: ours must never take it for its own.
constexpr protocol::RoundAnswer kOthersAnswer{1234, 4321};
constexpr protocol::RoundAnswer kNone{protocol::kNoIntensities, 0};

// As radio::Rounds does, beside which answers of other kinds are frames of their own.
bool PutIn(const Message& answer, protocol::RoundAnswer* entry) {
  protocol::TraceAnswer trace;
  protocol::SenseAnswer sense;
  protocol::ErrorAnswer error;
  if (Decode(answer, &trace)) {
    *entry = {trace.left, trace.right};
  } else if (Decode(answer, &sense)) {
    *entry = {sense.left, sense.right};
  } else if (Decode(answer, &error)) {
    *entry = {protocol::kNoIntensities, static_cast<int16_t>(error.reason)};
  } else {
    return false;
  }
  return true;
}

}  // namespace

// What becomes of a turn besides its ROUND.
struct ConversationWorld::Turn {
  int place;  // the robot's; the other has the other one
  bool other_is_heard;
};

// To the turns of the round in progress, at their places.
protocol::Round ConversationWorld::Answers() const {
  protocol::Round round;
  round.answer_count = static_cast<uint8_t>(turns_);
  for (int place = 0; place < turns_; ++place) {
    protocol::RoundAnswer* const entry = &round.answers[place];
    *entry = kNone;
    if (place != place_) {
      *entry = other_was_heard_ ? kOthersAnswer : kNone;
      continue;
    }
    for (const engine::Outgoing& answer : answered_) {
      if (answer.durable_at > (*durable_)->sequence() &&
          left_.server != ServerMutant::kAnswersUnsynced) {
        *entry = {protocol::kNoIntensities, static_cast<int16_t>(protocol::Reason::kBusy)};
      } else {
        PutIn(answer.message, entry);
      }
    }
  }
  return round;
}

// The intensities of them, which the server says again if the robot does not use its next turn.
std::vector<engine::Outgoing> ConversationWorld::SaidAgain() const {
  std::vector<engine::Outgoing> told;
  for (const engine::Outgoing& answer : answered_) {
    protocol::TraceAnswer trace;
    protocol::SenseAnswer sense;
    const bool traces = Decode(answer.message, &trace);
    if ((!traces && !Decode(answer.message, &sense)) ||
        answer.durable_at > (*durable_)->sequence()) {
      continue;
    }
    told.push_back(answer);
    if (traces && left_.server == ServerMutant::kSaysAgainToTheNext) {
      ++trace.seq;
      Encode(trace, &told.back().message);
    }
  }
  return told;
}

// What the robot sends in its turn, if anything.
std::optional<Message> ConversationWorld::TakeTurn() {
  const bool has_pose = left_.changes > 0;
  for (uint32_t waited = 0; waited < 2 * kTurnMs; ++waited) {
    client::Odometry odometry{};
    odometry.x_mm = made_ * kBetweenMm;
    ++now_ms_;
    const uint8_t seq_before = memory_.seq;
    robot_.Poll(now_ms_, has_pose ? &odometry : nullptr, false);
    if (robot_.tx_size() != 0) {
      return TakeSent(seq_before);
    }
  }
  return std::nullopt;
}

// The server sends a ROUND; the robot hears it and sends in its turn, which the server hears.
void ConversationWorld::Round(const Turn& turn, bool heard, bool arrives) {
  --left_.rounds;
  protocol::Round round = Answers();
  round.number = ++number_;
  round.turn_ms = kTurnMs;
  round.turn_bytes = 40;
  round.slot_ms = 1;
  round.turn_count = 2;
  round.turns[turn.place] = kChangesRobot;
  round.turns[1 - turn.place] = kOther;
  if (left_.server == ServerMutant::kAnswersInNewOrder && turns_ != 0 && turn.place != place_) {
    std::swap(round.answers[0], round.answers[1]);
  }
  const std::vector<engine::Outgoing> told = SaidAgain();
  turns_ = 2;
  place_ = turn.place;
  other_was_heard_ = turn.other_is_heard;
  answered_.clear();
  std::optional<Message> request;
  if (heard) {
    Message message;
    Encode(round, &message);
    Take(message);
    request = TakeTurn();
  }
  if (!request || !arrives) {
    std::for_each(told.begin(), told.end(), [this](const auto& answer) { Deliver(answer); });
    return;
  }
  Handle(*request, &answered_);
  for (const engine::Outgoing& answer : answered_) {
    protocol::RoundAnswer ignored;
    if (!PutIn(answer.message, &ignored)) {
      Deliver(answer);
    }
  }
}

void ConversationWorld::NextRounds(const Visit& visit) const {
  if (!to_robot_.empty() || !robot_.requests().greeted) {
    return;  // answers of their own come before the next ROUND, and HELLO before the first
  }
  const auto round = [&](const Turn& turn, bool heard, bool arrives, const std::string& what) {
    ConversationWorld next(*this);
    next.Round(turn, heard, arrives);
    if (next.to_robot_.size() <= left_.in_flight) {
      visit("a ROUND " + what, std::move(next));
    }
  };
  // Of one that is lost, it matters only that it was.
  round({.place = 0, .other_is_heard = true}, false, false, "is lost");
  for (const int place : {0, 1}) {
    for (const bool other : {false, true}) {
      const std::string what = "with a turn at " + std::to_string(place) + " is heard, " +
                               (other ? "so is the other robot, " : "");
      round({place, other}, true, false, what + "the robot is not");
      round({place, other}, true, true, what + "and the robot");
    }
  }
}

}  // namespace pheromone::verify
