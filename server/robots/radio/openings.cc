#include "server/robots/radio/openings.h"

#include <algorithm>

namespace pheromone::radio {
namespace {

using namespace std::chrono_literals;

constexpr Duration kOtherIsPresent = 5s;
constexpr Duration kTheirAdapter = 16ms;
constexpr uint8_t kLeastSlots = 4;
constexpr uint8_t kMostSlots = 64;
constexpr Duration kLongest = 300ms;
constexpr Duration kCrowded = 600ms;  // many are waiting
constexpr Duration kWidest = 200ms;
constexpr Duration kLongestClosed = 3s;
constexpr int kNewcomers = 8;  // exchanges in an opening, at least
constexpr int kLong = 3;       // exchanges
constexpr int kPlain = 1;      // until one of a coded ROUND
constexpr int kPlainAmongOthers = 3;
constexpr int kQuietInterval = 49;  // of the length of an opening, until the next

}  // namespace

void Openings::OnChannel(Time at) {
  last_heard_ = std::max(last_heard_, at);
}

int Openings::OthersPresent() const {
  return static_cast<int>(std::count_if(others_.begin(), others_.end(), [this](const auto& other) {
    return last_heard_ - other.second <= kOtherIsPresent;
  }));
}

void Openings::OnMessage(const protocol::Message& message, bool has_turns) {
  ++exchanges_;
  greeted_ |= message.opcode == protocol::kHello;
  used_ |= greeted_ || !has_turns;
}

void Openings::OnBytes(Time at, bool damaged) {
  collided_ |= damaged;
  end_ = MayGoOn(at) ? at + options_.response_window + TimeOf(slots_) : at;
}

void Openings::OnAnswered(Time at) {
  end_ = MayGoOn(at) && !OthersServed() ? at + TimeOf(slots_) : at;
}

// Those with turns wait meanwhile. An opening ends with something that was heard or said in it,
// when everybody else is silent.
bool Openings::MayGoOn(Time now) const {
  const int most = std::max(kNewcomers, OthersPresent() / static_cast<int>(round_.of));
  return exchanges_ < most &&
         now < turns_end_ + (collided_ && !round_.bad_air ? kCrowded : kLongest);
}

// Whoever is known to contend had an exchange in this opening, and nobody is about to join: a
// signed HELLO is said twice.
bool Openings::OthersServed() const {
  int served = 0;
  for (const auto& [id, heard] : others_) {
    served += heard > turns_end_ ? 1 : 0;
  }
  return served != 0 && served == OthersPresent() && !greeted_;
}

// Until the first byte of a frame that is begun in the last slot has been read. A client without
// turns may be behind an adapter, and see the opening begin that much later.
Duration Openings::TimeOf(uint8_t slots) const {
  const Duration late = OthersPresent() != 0 ? kTheirAdapter : Duration(0);
  return slots * Duration(options_.slot) + options_.timing.Idle() + late + kGuard;
}

Duration Openings::Shortest() const {
  return TimeOf(kLeastSlots) + exchange_;
}

// The next opening follows at once if somebody without turns used this one, and is wider if there
// were collisions.
void Openings::Judge(Time now, bool bad_air) {
  if (!open()) {
    return;
  }
  wanted_ = used_ || collided_;
  if (!wanted_) {
    next_ = now + std::min(kQuietInterval * TimeOf(slots_), kLongestClosed);
    width_ = static_cast<uint8_t>(width_ / 2);
    return;
  }
  if (bad_air) {
    // Those with turns get two thirds of the time, and an opening is wider only where two in
    // succession had damage.
    next_ = now + 2 * (now - turns_end_);
  }
  if (collided_ && (!bad_air || collided_before_)) {
    const auto most = std::clamp<int64_t>(kWidest / options_.slot, kLeastSlots, kMostSlots);
    width_ = static_cast<uint8_t>(std::min<int64_t>(int64_t{2} * slots_, most));
  }
  collided_before_ = collided_;
}

// Who tells an EVENT in a turn has no answer until two rounds later: these are not longer than
// others, unless somebody joins.
bool Openings::IsTime(Time now, uint8_t number) const {
  return now >= next_ && (wanted_ || number % protocol::kEventRounds > 2);
}

uint8_t Openings::Slots(Time now, uint8_t number) const {
  const bool opens = OthersPresent() != 0 || IsTime(now, number);
  return opens ? std::max(width_, kLeastSlots) : uint8_t{0};
}

// Simple clients ask when they like, and the ROUND waits for whoever has begun.
uint8_t Openings::SlotsUntil(Duration open) const {
  if (open < exchange_) {
    return 0;
  }
  if (OthersPresent() == 0 || open > kLong * exchange_) {
    return protocol::kOpenUntilNextRound;
  }
  // Soon over: who began before the next ROUND is heard would collide with it, and often.
  const auto slots = (open - TimeOf(0)) / Duration(options_.slot);
  return static_cast<uint8_t>(std::clamp<int64_t>(slots, kLeastSlots, kMostSlots));
}

// They may be in worse air. While somebody is there who contends, each round has an opening.
bool Openings::IsForNewcomers(Time now, uint8_t number) const {
  return IsTime(now, number) && plain_ >= (OthersPresent() == 0 ? kPlain : kPlainAmongOthers);
}

void Openings::Begin(uint8_t slots, const Round& round) {
  slots_ = slots;
  round_ = round;
  if (round.has_turns && slots != 0) {
    plain_ = round.coded ? 0 : plain_ + 1;
  }
  used_ = false;
  collided_ = false;
  greeted_ = false;
  exchanges_ = 0;
}

void Openings::OnSent(Time turns_end) {
  turns_end_ = turns_end;
  end_ = round_.has_turns && slots_ != 0 ? turns_end + TimeOf(slots_) : Time::min();
}

}  // namespace pheromone::radio
