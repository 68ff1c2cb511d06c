#include "server/radio/rounds.h"

#include <algorithm>
#include <utility>

#include "protocol/frame.h"

namespace pheromone::radio {
namespace {

using namespace std::chrono_literals;

// The robots' clocks have steps of a millisecond, and their loops take a part of one.
constexpr Duration kGuard = 1250us;
// Robots that are due this soon are asked in the same round.
constexpr Duration kTogether = 20ms;
constexpr size_t kFirstFrameBytes = 20;
constexpr size_t kMarginBytes = 1;  // a frame may have one more DLE to stuff than the last one
constexpr int kPatientMisses = 2;
constexpr int kLongestWait = 10;  // periods
constexpr Duration kForgotten = 30s;
constexpr Duration kOtherIsPresent = 2s;
constexpr uint8_t kQuietSlots = 4;
constexpr uint8_t kCrowdedSlots = 8;
constexpr int kNewcomers = 4;       // exchanges in an opening, at least
constexpr int kQuietInterval = 49;  // of the length of an opening, until the next

size_t WireBytes(const protocol::Message& message) {
  std::array<uint8_t, protocol::kMaxFrame> frame{};
  return protocol::EncodeFrame(message, frame.data(), frame.size());
}

// The intensities in an answer to SENSE or TRACE, or the reason of an ERROR.
std::optional<protocol::RoundAnswer> InRound(const protocol::Message& answer) {
  protocol::SenseAnswer sense;
  protocol::TraceAnswer trace;
  protocol::ErrorAnswer error;
  if (Decode(answer, &sense)) {
    return protocol::RoundAnswer{sense.left, sense.right};
  }
  if (Decode(answer, &trace)) {
    return protocol::RoundAnswer{trace.left, trace.right};
  }
  if (Decode(answer, &error)) {
    return protocol::RoundAnswer{protocol::kNoIntensities, static_cast<int16_t>(error.reason)};
  }
  return std::nullopt;
}

}  // namespace

void Rounds::OnHeard(const protocol::Message& message, Time at) {
  if (protocol::IsFromServer(message.opcode) || message.id == protocol::kBroadcastId) {
    return;
  }
  last_heard_ = std::max(last_heard_, at);
  if (message.opcode == protocol::kHello && message.length == 4) {
    wished_[message.id] = message.data[3];
  }
  const auto turn = std::find_if(turns_.begin(), turns_.end(),
                                 [&](const Turn& it) { return it.id == message.id && !it.heard; });
  if (turn != turns_.end() && at <= turns_end_) {
    turn->heard = at;
    turn->answerable = message.opcode != protocol::kCommandAck;
  } else if (opening_end_ != Time::min() && at > turns_end_) {
    ++exchanges_;
  }
  const auto robot = robots_.find(message.id);
  if (robot == robots_.end()) {
    others_[message.id] = at;
    return;
  }
  robot->second.heard = at;
  robot->second.frame_bytes = WireBytes(message);
}

void Rounds::OnBytes(Time at) {
  last_heard_ = std::max(last_heard_, at);
  if (opening_end_ == Time::min() || at <= turns_end_) {
    return;
  }
  crowded_ = true;
  if (exchanges_ < ExchangesAnOpening()) {
    opening_end_ = std::max(opening_end_, at + OpeningTime(open_slots_));
  }
}

bool Rounds::TakeAnswer(const protocol::Message& answer, Time asked_at) {
  if (answer.opcode == protocol::kHelloAnswer) {
    Join(answer.id, asked_at);
  }
  for (Turn& turn : turns_) {
    if (turn.id == answer.id && turn.heard == asked_at && turn.answerable && !turn.answer) {
      turn.answer = answer;
      return true;
    }
  }
  return false;
}

std::vector<protocol::Message> Rounds::DropAnswers() {
  std::vector<protocol::Message> dropped;
  for (Turn& turn : turns_) {
    if (turn.answer) {
      dropped.push_back(*std::exchange(turn.answer, std::nullopt));
    }
  }
  return dropped;
}

void Rounds::Join(uint8_t id, Time now) {
  if (wished_[id] == 0) {
    robots_.erase(id);
    return;
  }
  Robot& robot = robots_[id];
  robot.period = wished_[id] * kPeriodUnit;
  robot.due = now;
  robot.heard = now;
  robot.misses = 0;
  others_.erase(id);
  active_ |= robots_.size() > 1;
}

Time Rounds::NextRound() const {
  if (!active()) {
    return kNever;
  }
  if (turns_.empty()) {
    Time due = kNever;
    for (const auto& [id, robot] : robots_) {
      due = std::min(due, robot.due);
    }
    return std::max(due, turns_end_);
  }
  Time end = turns_end_;
  bool all_heard = true;
  Time last = Time::min();
  bool all_answered = true;
  for (const Turn& turn : turns_) {
    all_heard &= turn.heard.has_value();
    last = std::max(last, turn.heard.value_or(Time::min()));
    all_answered &= !turn.answerable || turn.answer.has_value();
  }
  if (opening_end_ != Time::min()) {
    end = opening_end_;
  } else if (all_heard) {
    end = last;
  }
  if (all_answered) {
    return end;
  }
  return std::max(end, last + options_.timing.processing);
}

// Who was heard in the last round, and when each is due again.
void Rounds::CountTurns(Time now) {
  for (const Turn& turn : turns_) {
    const auto found = robots_.find(turn.id);
    if (found == robots_.end() || turn.for_ack) {
      continue;
    }
    Robot& robot = found->second;
    if (turn.heard) {
      robot.misses = 0;
      robot.due += robot.period;
    } else {
      ++counters_.missed;
      ++robot.misses;
      robot.frame_bytes += robot.frame_bytes != 0 ? 2 : 0;  // it may not have fitted
      if (robot.misses > 1) {
        const int doublings = std::clamp(robot.misses - kPatientMisses, 0, 4);
        robot.due = now + robot.period * std::min(1 << doublings, kLongestWait);
      }
      if (now - robot.heard > kForgotten) {
        robots_.erase(found);
      }
    }
  }
}

// Those who are due, in equal parts if there are too many for one round.
std::vector<uint8_t> Rounds::Choose(Time now) {
  std::vector<std::pair<Time, uint8_t>> due;
  bool any = false;
  for (const auto& [id, robot] : robots_) {
    any |= robot.due <= now;
    if (robot.due <= now + kTogether) {
      due.emplace_back(robot.due, id);
    }
  }
  if (!any) {
    return {};
  }
  std::sort(due.begin(), due.end());
  const size_t rounds = (due.size() + protocol::kMaxTurns - 1) / protocol::kMaxTurns;
  const size_t turns = (due.size() + rounds - 1) / rounds;
  std::vector<uint8_t> chosen;
  for (size_t i = 0; i < turns; ++i) {
    chosen.push_back(due[i].second);
    // What could not be served in time is not caught up.
    Robot& robot = robots_[due[i].second];
    robot.due = std::max(robot.due, now);
  }
  return chosen;
}

uint8_t Rounds::OpenSlots(Time now, bool has_turns) {
  if (!has_turns) {
    Time due = kNever;
    for (const auto& [id, robot] : robots_) {
      due = std::min(due, robot.due);
    }
    const auto slots = due <= now ? 0 : (due - now) / options_.slot;
    next_opening_ = std::max(next_opening_, now);
    return static_cast<uint8_t>(std::min<int64_t>(slots, protocol::kOpenUntilNextRound));
  }
  if (now < next_opening_) {
    return 0;
  }
  return crowded_ ? kCrowdedSlots : kQuietSlots;
}

// Until the first byte of a frame that is begun in the last slot has been read.
Duration Rounds::OpeningTime(uint8_t slots) const {
  return slots * Duration(options_.slot) + options_.timing.Idle() + kGuard;
}

Duration Rounds::TurnTime(size_t bytes) const {
  const Duration least =
      options_.timing.turnaround + static_cast<int64_t>(bytes) * options_.timing.byte + kGuard;
  return std::chrono::ceil<std::chrono::milliseconds>(least);
}

// Each client that only contends gets about as many exchanges as a robot has turns.
int Rounds::ExchangesAnOpening() const {
  int present = 0;
  for (const auto& [id, heard] : others_) {
    present += last_heard_ - heard <= kOtherIsPresent ? 1 : 0;
  }
  const size_t rounds =
      std::max<size_t>(1, (robots_.size() + protocol::kMaxTurns - 1) / protocol::kMaxTurns);
  return std::max(kNewcomers, present / static_cast<int>(rounds));
}

std::vector<protocol::Message> Rounds::Compose(Time now, const std::vector<uint8_t>& acks) {
  std::vector<protocol::Message> messages;
  protocol::Round round;
  round.number = ++number_;
  for (Turn& turn : turns_) {
    protocol::RoundAnswer entry{protocol::kNoIntensities, 0};
    if (turn.answer) {
      if (const auto in_round = InRound(*turn.answer)) {
        entry = *in_round;
      } else {
        messages.push_back(*turn.answer);
      }
    } else if (turn.answerable) {
      ++counters_.unanswered;
    }
    round.answers[round.answer_count++] = entry;
  }
  CountTurns(now);
  const bool was_open = opening_end_ != Time::min();
  if (was_open && !crowded_) {
    next_opening_ = now + kQuietInterval * OpeningTime(open_slots_);
  }
  turns_.clear();
  active_ &= !robots_.empty();
  std::vector<uint8_t> chosen = Choose(now);
  size_t bytes = 0;
  for (const uint8_t id : acks) {
    if (serves(id) && turns_.size() + chosen.size() < protocol::kMaxTurns) {
      turns_.push_back({id, true, {}, false, {}});
    }
  }
  for (const uint8_t id : chosen) {
    turns_.push_back({id, false, {}, false, {}});
    const size_t last = robots_[id].frame_bytes;
    bytes = std::max(bytes, last != 0 ? last + kMarginBytes : kFirstFrameBytes);
  }
  bytes = std::min<size_t>(turns_.empty() ? 0 : std::max<size_t>(bytes, 14), protocol::kMaxFrame);
  turn_ = TurnTime(bytes);
  round.turn_ms = static_cast<uint8_t>(std::min<int64_t>(turn_ / 1ms, UINT8_MAX));
  round.turn_bytes = static_cast<uint8_t>(bytes);
  for (const Turn& turn : turns_) {
    round.turns[round.turn_count++] = turn.id;
  }
  round.open_slots = OpenSlots(now, !turns_.empty());
  open_slots_ = round.open_slots;
  if (was_open) {
    crowded_ = false;
  }
  exchanges_ = 0;
  ++counters_.rounds;
  counters_.turns += turns_.size();
  counters_.openings += round.open_slots != 0 ? 1 : 0;
  protocol::Message message;
  Encode(round, &message);
  messages.push_back(message);
  OnSent(now);
  return messages;
}

void Rounds::OnSent(Time end) {
  const auto turns = static_cast<int64_t>(turns_.size());
  turns_end_ = end + options_.timing.Transit();
  if (turns != 0) {
    turns_end_ += std::chrono::milliseconds(protocol::kBeforeTurnsMs) + turns * turn_ +
                  options_.timing.adapter;
  }
  const bool opens = turns != 0 && open_slots_ != 0;
  opening_end_ = opens ? turns_end_ + OpeningTime(open_slots_) : Time::min();
}

}  // namespace pheromone::radio
