#include "server/robots/radio/rounds.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>
#include <utility>

#include "protocol/coded_frame.h"
#include "protocol/frame.h"
#include "protocol/signing.h"

namespace pheromone::radio {
namespace {

using namespace std::chrono_literals;

// Robots that are due this soon, or before the round is over, are asked in the same one.
constexpr Duration kTogether = 20ms;
constexpr size_t kMostFrameBytes = 32;
constexpr size_t kLeastFrameBytes = 15;  // SENSE, with one byte stuffed
// Which bytes are doubled changes from frame to frame. A longer turn costs time only if nobody
// sends in it, since the next robot begins when a frame ends.
constexpr size_t kMoreStuffing = 1;
constexpr int kShorterFrames = 16;
// A robot counts as gone when so many turns in succession have been silent that this would be an
// accident of so little probability, if it were there.
constexpr double kAccident = 0.001;
constexpr int kLeastPatience = 4;
constexpr int kMostPatience = 24;
constexpr int kLongestWait = 10;       // periods
constexpr int kInTime = 6;             // requests, after one that was told busy
constexpr int kMissesTheForm = 2;      // turns in succession
constexpr double kManyDamaged = 0.25;  // of the requests that are heard
constexpr double kVeryManyDamaged = 0.45;
constexpr int kAveraged = 64;  // requests
constexpr Duration kForgotten = 30s;
constexpr Duration kLongestSilence = 800ms;  // robots give rounds up after two seconds without one

bool IsForIntensities(const protocol::Message& request) {
  return protocol::TakesType(request.opcode) &&
         protocol::ServiceOf(request.opcode) != protocol::kDeposit;
}

size_t WireBytes(const protocol::Message& message) {
  std::array<uint8_t, protocol::kMaxFrame> frame{};
  return protocol::EncodeFrame(message, frame.data(), frame.size());
}

// For how many silent turns in succession a robot may be there that misses this share of ROUNDs.
int PatienceFor(double lost) {
  const double turns = std::log(kAccident) / std::log(std::clamp(lost, 1e-9, 0.999));
  return static_cast<int>(std::clamp<double>(std::ceil(turns), kLeastPatience, kMostPatience));
}

}  // namespace

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

void Rounds::Resume(const std::vector<RoundMember>& members, Time now) {
  begin_ = now;
  sent_at_ = now;
  addressed_until_ = now + kAwaitedRound;
  for (const RoundMember& member : members) {
    wished_[member.id] = member.period;
    if (MostBytes() >= LeastBytes()) {
      Robot& robot = robots_[member.id];
      robot.period = member.period * kPeriodUnit;
      robot.due = now;
      robot.heard = now;
    }
  }
  active_ = robots_.size() > 1;
}

void Rounds::OnHeard(const protocol::Message& message, Time at, Time since) {
  if (protocol::IsFromServer(message.opcode) || message.id == protocol::kBroadcastId) {
    return;
  }
  openings_.OnChannel(at);
  if (message.opcode == protocol::kHello && message.length == 4) {
    wished_[message.id] = message.data[3];
  }
  const auto turn = std::find_if(turns_.begin(), turns_.end(),
                                 [&](const Turn& it) { return it.id == message.id && !it.heard; });
  const auto robot = robots_.find(message.id);
  const size_t bytes = WireBytes(message) + (signed_ ? protocol::kSignature : 0);
  // Who takes turns asks for intensities in these, unless its frame does not fit: when it is heard
  // later, the machine or an adapter has paused. In bad air it may have missed the ROUND.
  const bool only_in_turn = IsForIntensities(message) && bytes <= turn_bytes_ && !in_bad_air() &&
                            robot != robots_.end() && robot->second.misses == 0;
  // What may have arrived before the ROUND had left is no answer's cause in the next: its robot may
  // have sent a change in the turn, which the ROUND would acknowledge, heard or not.
  if (turn != turns_.end() && since >= sent_at_ && (at <= LastHeard() || only_in_turn)) {
    turn->heard = at;
    turn->answerable = message.opcode != protocol::kCommandAck;
    turn->told = message.opcode == protocol::kEvent;
  } else if (openings_.open() && at > LastHeard()) {
    openings_.OnMessage(message, serves(message.id));
  }
  if (robot == robots_.end()) {
    openings_.OnOther(message.id, at);
    return;
  }
  Robot& it = robot->second;
  it.heard = at;
  it.greets &= message.opcode == protocol::kHello;
  CountUnused(&it);
  if (bytes + kMoreStuffing >= it.frame_bytes || ++it.shorter == kShorterFrames) {
    it.frame_bytes = bytes + kMoreStuffing;
    it.shorter = 0;
  }
}

void Rounds::OnBytes(Time at, bool damaged) {
  openings_.OnChannel(at);
  if (at > LastHeard()) {
    if (openings_.open()) {
      openings_.OnBytes(at, damaged);
    }
  } else if (damaged) {
    OnDamage(at);
  }
}

// The last of the turns may have begun late. In an opening nobody is heard as soon as that.
Time Rounds::LastHeard() const {
  return turns_end_ + std::chrono::milliseconds(protocol::kLatestTurnMs);
}

// Of a damaged frame there may be several signs. It was in the first turn that is still open: not
// for sure, but turns are in another order in each round.
void Rounds::OnDamage(Time at) {
  if (damaged_at_ != Time::min() && at - damaged_at_ < turn_ / 2) {
    return;
  }
  const auto turn = std::find_if(turns_.begin(), turns_.end(),
                                 [](const Turn& it) { return !it.heard && !it.damaged; });
  if (turn != turns_.end()) {
    turn->damaged = true;
    damaged_at_ = at;
  }
}

void Rounds::OnAnswered(Time end) {
  if (openings_.open()) {
    openings_.OnAnswered(end + options_.timing.Transit());
  }
}

// In turns nothing collides: what is damaged there, the air has damaged.
bool Rounds::in_bad_air() const {
  return air_.form() == RoundForm::kCoded || damaged_ > kManyDamaged;
}

bool Rounds::TakeAnswer(const protocol::Message& answer, Time asked_at) {
  const bool greets = signed_ && answer.length == protocol::kServerNonceAt;
  if (answer.opcode == protocol::kHelloAnswer && !greets) {
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
      dropped.push_back(*turn.answer);
      turn.answer.reset();
    }
  }
  return dropped;
}

void Rounds::Join(uint8_t id, Time now) {
  // It awaits no answer of before.
  std::erase_if(told_, [id](const auto& it) { return it.id == id; });
  if (wished_[id] == 0 || MostBytes() < LeastBytes()) {
    robots_.erase(id);
    return;
  }
  // In step with the others, so that one round serves all.
  Time due = now;
  for (const auto& [other, it] : robots_) {
    if (other != id && it.due > now) {
      due = due == now ? it.due : std::min(due, it.due);
    }
  }
  begin_ = begin_.value_or(now + options_.quiet_start);
  Robot& robot = robots_[id];
  robot.period = wished_[id] * kPeriodUnit;
  robot.due = due;
  robot.heard = std::max(robot.heard, now);
  robot.misses = 0;
  robot.greets = true;
  openings_.OnJoined(id);
  if (!active_ && robots_.size() > 1) {
    active_ = true;
    sent_at_ = now;
    for (auto& [other, it] : robots_) {
      it.due = now;
    }
  }
}

Time Rounds::FirstDue() const {
  Time due = kNever;
  for (const auto& [id, robot] : robots_) {
    due = std::min(due, robot.due);
  }
  return due;
}

Time Rounds::NextRound() const {
  if (!active()) {
    return kNever;
  }
  if (turns_.empty()) {
    return std::max({std::min(FirstDue(), sent_at_ + kLongestSilence), turns_end_, *begin_});
  }
  Time end = Time::min();
  Time last = Time::min();
  bool all_answered = true;
  for (size_t i = 0; i < turns_.size(); ++i) {
    const Turn& turn = turns_[i];
    end = std::max(end, turn.heard.value_or(EndOf(i + 1)));
    last = std::max(last, turn.heard.value_or(last));
    all_answered &= !turn.answerable || turn.answer.has_value();
  }
  if (openings_.open()) {
    end = openings_.end();
  }
  if (all_answered) {
    return end;
  }
  return std::max(end, last + options_.timing.processing);
}

// A change that waits for the log is told busy. Its answer is old when it comes.
void Rounds::CountLate(const Turn& turn, Robot* robot) {
  protocol::ErrorAnswer error;
  const bool waits =
      !turn.answer || (Decode(*turn.answer, &error) && error.reason == protocol::Reason::kBusy);
  robot->late = waits ? kInTime : std::max(0, robot->late - 1);
}

// From a robot's turn to its next one, so that it has an answer to steer by in each period: some
// are lost, and only every second one is of use while changes are late.
Duration Rounds::Interval(const Robot& robot) const {
  if (robot.late != 0) {
    return robot.period / 2;
  }
  const double arrives = 1 - robot.reception.LostOf(air_.form());
  return std::chrono::duration_cast<Duration>(arrives * robot.period);
}

// Those fall into step. With others, who wishes less would be asked as often as who wishes more.
bool Rounds::AreOfOnePeriod() const {
  std::set<Duration> periods;
  for (const Turn& turn : turns_) {
    if (const auto robot = robots_.find(turn.id); robot != robots_.end()) {
      periods.insert(robot->second.period);
    }
  }
  return periods.size() <= 1;
}

// Who was heard in the last round, and when each is due again.
void Rounds::CountTurns(Time now) {
  // A ROUND that nobody received has collided, and says nothing of the air.
  const bool all_missed =
      turns_.size() > 2 && std::none_of(turns_.begin(), turns_.end(),
                                        [](const Turn& it) { return it.heard || it.damaged; });
  const bool in_step = AreOfOnePeriod();
  for (const Turn& turn : turns_) {
    const auto found = robots_.find(turn.id);
    if (found == robots_.end() || turn.for_ack) {
      continue;
    }
    // One that has missed its COMMAND sends its request in the first of its turns.
    const auto request = std::find_if(turns_.begin(), turns_.end(), [&turn](const Turn& it) {
      return it.id == turn.id && it.heard && it.answerable;
    });
    Robot& robot = found->second;
    if (request != turns_.end()) {
      robot.more_bytes = 0;
      CountLate(*request, &robot);
      const Duration interval = request->told ? Duration(0) : Interval(robot);
      const Time asked = in_step ? std::min(robot.due, begun_at_) : robot.due;
      robot.due = std::max(asked + interval, *request->heard);  // nothing is caught up
      CountHeard(&robot, false);
    } else if (turn.damaged) {
      CountHeard(&robot, true);  // it is there, and still due
    } else {
      ++counters_.missed;
      robot.unused[static_cast<size_t>(form_)] += all_missed ? 0 : 1;
      CountMissed(&robot, now);
      if (now - robot.heard > kForgotten) {
        robots_.erase(found);
      }
    }
  }
}

// What it missed before says something of the air: while it was silent, it could be gone.
void Rounds::CountUnused(Robot* robot) {
  for (const RoundForm form : {RoundForm::kPlain, RoundForm::kCoded}) {
    int& unused = robot->unused[static_cast<size_t>(form)];
    for (unused = std::min(unused, kMostPatience); unused > 0; --unused) {
      air_.Count(form, false, &robot->reception);
    }
  }
}

void Rounds::CountHeard(Robot* robot, bool damaged) {
  damaged_ += ((damaged ? 1.0 : 0.0) - damaged_) / kAveraged;
  CountUnused(robot);
  air_.Count(form_, true, &robot->reception);
  robot->misses = 0;
}

void Rounds::CountMissed(Robot* robot, Time now) {
  const int over = ++robot->misses - PatienceFor(robot->reception.LostOf(air_.form()));
  if (over < 0) {
    return;  // still due
  }
  robot->more_bytes += 2;  // its requests may not fit the turn
  robot->due = now + robot->period * std::min(1 << std::min(over, 4), kLongestWait);
}

// Those who are due. If there are too many for one round, several take equal parts of them. In bad
// air each takes as many as it can: longer ROUNDs cost less and survive longer bursts. But where
// single bytes are damaged, and very many, they arrive too seldom.
std::vector<uint8_t> Rounds::Choose(Time now, size_t most) {
  std::vector<std::pair<Time, uint8_t>> due;
  bool any = false;
  // Who is left out waits until this round is over.
  const auto turns = static_cast<int64_t>(std::min(robots_.size(), most));
  Duration together = std::max(kTogether, turns * turn_);
  if (openings_.OthersPresent() != 0 && robots_.size() <= most) {
    together += openings_.Shortest();
  }
  for (const auto& [id, robot] : robots_) {
    any |= robot.due <= now;
    if (robot.due <= now + together) {
      due.emplace_back(robot.due, id);
    }
  }
  if (!any) {
    return {};
  }
  std::sort(due.begin(), due.end());
  const size_t rounds = (due.size() + most - 1) / most;
  const bool longest = air_.form() == RoundForm::kCoded && damaged_ < kVeryManyDamaged;
  const size_t share = longest ? std::min(due.size(), most) : (due.size() + rounds - 1) / rounds;
  std::vector<uint8_t> chosen;
  for (size_t i = 0; i < share; ++i) {
    chosen.push_back(due[i].second);
  }
  // Two robots that do not hear each other lose time if one follows the other: not always the same.
  for (size_t i = chosen.size(); i > 1; --i) {
    order_ = order_ * 1664525u + 1013904223u;
    std::swap(chosen[i - 1], chosen[(order_ >> 16) % i]);
  }
  return chosen;
}

// Returns how many bytes a turn has to hold. A robot's ACK has the turn directly before its own.
size_t Rounds::GiveTurns(Time now, std::vector<uint8_t> acks) {
  std::erase_if(acks, [this](uint8_t id) { return !serves(id); });
  size_t bytes = acks.empty() ? 0 : LeastBytes();  // more than an ACK takes
  const auto give_ack = [this](uint8_t id) { turns_.push_back({.id = id, .for_ack = true}); };
  for (const uint8_t id : Choose(now, MostTurns() - acks.size())) {
    if (std::erase(acks, id) != 0) {
      give_ack(id);
    }
    turns_.push_back({.id = id});
    const Robot& robot = robots_[id];
    bytes = std::max(bytes, std::max(robot.frame_bytes, LeastBytes()) + robot.more_bytes);
  }
  std::for_each(acks.begin(), acks.end(), give_ack);
  return bytes;
}

// A SENSE and its answer, in a window.
Duration Rounds::ExchangeTime() const {
  return options_.response_window + 2 * static_cast<int64_t>(LeastBytes()) * options_.timing.byte;
}

Duration Rounds::TurnTime(size_t bytes) const {
  const Duration least =
      options_.timing.turnaround + static_cast<int64_t>(bytes) * options_.timing.byte + kGuard;
  return std::chrono::ceil<std::chrono::milliseconds>(least);
}

// A ROUND tells the length of a turn in one byte: below 600 baud, no frame fits.
size_t Rounds::MostBytes() const {
  constexpr Duration kLongestTurn = std::chrono::milliseconds(UINT8_MAX);
  const Duration for_bytes = kLongestTurn - options_.timing.turnaround - kGuard;
  return std::min(kMostFrameBytes,
                  static_cast<size_t>(std::max(Duration(0), for_bytes) / options_.timing.byte));
}

size_t Rounds::LeastBytes() const {
  return kLeastFrameBytes + (signed_ ? protocol::kSignature : 0);
}

// DATA has room for the signature.
size_t Rounds::MostTurns() const {
  return signed_ ? protocol::kMaxTurns - 1 : protocol::kMaxTurns;
}

size_t Rounds::RoundsForAll() const {
  return std::max<size_t>(1, (robots_.size() + MostTurns() - 1) / MostTurns());
}

// A round that answers nobody may have any number. EVENTs are told in the turns of each eighth:
// that must not always be one without turns, where these come in every second round.
uint8_t Rounds::NextNumber() {
  ++number_;
  if (turns_.empty() && (number_ + 1) % protocol::kEventRounds == 0) {
    ++number_;
  }
  return number_;
}

Rounds::Composed Rounds::Compose(Time now, const std::vector<uint8_t>& acks) {
  Composed composed;
  protocol::Round round;
  round.number = NextNumber();
  for (Turn& turn : turns_) {
    protocol::RoundAnswer entry{protocol::kNoIntensities, 0};
    if (turn.answer) {
      if (const auto in_round = InRound(*turn.answer); in_round && now >= addressed_until_) {
        entry = *in_round;
        composed.in_round.push_back(*turn.answer);
      } else {
        composed.answers.push_back(*turn.answer);
      }
    } else if (turn.answerable) {
      ++counters_.unanswered;
      entry.right = static_cast<int16_t>(protocol::Reason::kBusy);  // the log takes its time
    }
    round.answers[round.answer_count++] = entry;
  }
  Repeat(&composed);
  CountTurns(now);
  openings_.Judge(now, in_bad_air());
  turns_.clear();
  begun_at_ = now;
  active_ &= !robots_.empty();
  turn_bytes_ = std::min(GiveTurns(now, acks), MostBytes());
  const bool must_arrive = openings_.IsForNewcomers(now, number_) || IsForOneThatMisses();
  form_ = air_.Choose(
      [this](const auto& use) {
        for (const auto& [id, robot] : robots_) {
          use(robot.reception);
        }
      },
      !must_arrive);
  if (must_arrive) {
    form_ = RoundForm::kCoded;
  }
  turn_ = TurnTime(turn_bytes_);
  round.turn_ms = static_cast<uint8_t>(turn_ / 1ms);
  round.slot_ms = static_cast<uint8_t>(options_.slot.count());
  round.turn_bytes = static_cast<uint8_t>(turn_bytes_);
  for (const Turn& turn : turns_) {
    round.turns[round.turn_count++] = turn.id;
  }
  Encode(round, &composed.round);
  const size_t signature = signed_ ? protocol::kSignatureToAll : 0;
  const size_t wire = coded() ? protocol::CodedBytes(composed.round.length + signature)
                              : WireBytes(composed.round) + signature;
  const Duration lasts =
      options_.timing.KeyDelay() + static_cast<int64_t>(wire) * options_.timing.byte;
  const bool has_turns = !turns_.empty();
  round.open_slots =
      has_turns ? openings_.Slots(now, number_)
                : openings_.SlotsUntil(FirstDue() - (now + lasts + options_.timing.Idle()));
  openings_.Begin(round.open_slots, {has_turns, coded(), in_bad_air(), RoundsForAll()});
  ++counters_.rounds;
  counters_.coded += coded() ? 1u : 0u;
  counters_.turns += turns_.size();
  Encode(round, &composed.round);
  OnSent(now);
  return composed;
}

// A robot that did not use its turn has missed the ROUND that granted it, and its answer in that.
// It still awaits it, unless its request was lost without a trace: the answer to a change has the
// change's SEQ, and that to a SENSE is newer than what the robot steers by.
void Rounds::Repeat(Composed* composed) {
  for (const protocol::Message& answer : told_) {
    const auto robot = robots_.find(answer.id);
    const auto turn = std::find_if(turns_.begin(), turns_.end(),
                                   [&](const Turn& it) { return it.id == answer.id; });
    const auto is_damaged = [&](const Turn& it) { return it.id == answer.id && it.damaged; };
    if (robot != robots_.end() && robot->second.heard < sent_at_ && turn != turns_.end() &&
        std::none_of(turn, turns_.end(), is_damaged)) {
      composed->again.push_back(answer);
    }
  }
  told_.clear();
  std::copy_if(composed->in_round.begin(), composed->in_round.end(), std::back_inserter(told_),
               [](const auto& it) { return InRound(it)->left != protocol::kNoIntensities; });
}

// Whether the ROUND has a turn for somebody who did not receive the last ones, or may not have
// received the answer to HELLO.
bool Rounds::IsForOneThatMisses() const {
  return std::any_of(turns_.begin(), turns_.end(), [this](const Turn& it) {
    const auto robot = robots_.find(it.id);
    return robot != robots_.end() &&
           (robot->second.misses >= kMissesTheForm || robot->second.greets);
  });
}

// When the first of the turns are over, so many, whatever was heard.
Time Rounds::EndOf(size_t turns) const {
  const Time begin = sent_at_ + options_.timing.Transit();
  return turns == 0 ? begin
                    : begin + std::chrono::milliseconds(protocol::kBeforeTurnsMs) +
                          static_cast<int64_t>(turns) * turn_ + options_.timing.adapter;
}

void Rounds::OnSent(Time end) {
  sent_at_ = end;
  turns_end_ = EndOf(turns_.size());
  openings_.OnSent(turns_end_);
}

}  // namespace pheromone::radio
