// What a cleaning robot does, phase by phase. What it reads for that is in cleaner_view.cc.
#include "client_fw/core/tasks/cleaner.h"

#include "client_fw/core/tasks/go_to.h"
#include "protocol/byte_order.h"

namespace pheromone {
namespace client {
namespace {

using protocol::GetU16;
using protocol::kNoSlot;
using protocol::PutI32;
using protocol::PutU16;
using protocol::Reason;

constexpr uint16_t kClaimEndsEarlyMs = 500;  // than the lease, by our clock
constexpr uint16_t kShortestPauseMs = 200;
constexpr uint8_t kPauseStepMs = 4;  // times up to 150 more
constexpr uint32_t kMovingPatienceMs = 60000;
constexpr uint16_t kBrakingMmS2 = 250;  // a Pioneer as delivered brakes by 300

uint16_t Absolute(int16_t mm) {
  return static_cast<uint16_t>(mm < 0 ? -mm : mm);
}

// The speed from which a robot can still stop within a distance: v^2 = 2 a s.
int16_t SpeedToStopIn(uint16_t distance_mm) {
  const uint32_t square = uint32_t{2} * kBrakingMmS2 * distance_mm;
  uint16_t speed = 0;
  for (uint16_t bit = 4096; bit != 0; bit = static_cast<uint16_t>(bit >> 1)) {
    const uint16_t more = static_cast<uint16_t>(speed | bit);
    if (uint32_t{more} * more <= square) {
      speed = more;
    }
  }
  return static_cast<int16_t>(speed);
}

}  // namespace

void Cleaner::Step(Moment now_ms, const Odometry* odometry, Conversation* conversation) {
  const Moment passed_ms = now_ms - static_cast<Moment>(now_ms_);
  now_ms_ += passed_ms;
  wheels_ = WheelSpeeds{0, 0};
  if (asked_) {
    if (exchange_.state == TagExchange::kAsked) {
      return;
    }
    asked_ = false;
    if (exchange_.state == TagExchange::kAnswered) {
      OnAnswer(conversation);
    } else if (exchange_.state == TagExchange::kRefused) {
      OnRefusal(exchange_.reason, conversation);
    } else {
      Go(phase_ == Phase::kNaming ? Phase::kNaming : Phase::kLooking);
    }
    if (asked_) {
      return;
    }
  }
  if (phase_ == Phase::kCleaning &&
      now_ms_ - claimed_ms_ + kClaimEndsEarlyMs >= uint32_t{1000} * parameters_.lease_s) {
    ++lost_claims_;
    Go(Phase::kLooking);
  }
  if (odometry == nullptr || !conversation->requests().greeted ||
      (conversation->state().flags & kPoseLost) != 0) {
    return;
  }
  pose_ = conversation->state().start.Place(*odometry);
  Act(conversation, passed_ms < 1000 ? static_cast<uint16_t>(passed_ms) : uint16_t{1000});
}

// What is to be done next, when nothing is awaited.
void Cleaner::Act(Conversation* conversation, uint16_t passed_ms) {
  const bool drives = conversation->state().flags == 0;
  switch (phase_) {
    case Phase::kNaming:
      AskForName(conversation);
      break;
    case Phase::kLooking:
      for (Zone& zone : zones_) {
        zone.is_seen = false;
      }
      Look(0, conversation);
      break;
    case Phase::kReading:
      ReadNext(conversation);
      break;
    case Phase::kResolving:
      Resolve(conversation);
      break;
    case Phase::kMoving:
      if (drives) {
        Move(*conversation);
      }
      break;
    case Phase::kClaiming:
      if (drives) {
        Claim(conversation);
      }
      break;
    case Phase::kCleaning:
      if (drives) {
        const int16_t slow = static_cast<int16_t>(conversation->state().parameters.speed_mm_s / 4);
        wheels_ = WheelSpeeds{static_cast<int16_t>(-slow), slow};
        cleaning_left_ms_ = cleaning_left_ms_ > passed_ms
                                ? static_cast<uint16_t>(cleaning_left_ms_ - passed_ms)
                                : uint16_t{0};
        if (cleaning_left_ms_ == 0) {
          Go(Phase::kStamping);
        }
      }
      break;
    case Phase::kStamping:
      Write(kCleanedBy, claim_slot_, claim_generation_, 0, conversation);
      break;
    case Phase::kTidying:
      PutChange(zones_[0].stamp_slot, zones_[0].stamp_generation);
      Ask(protocol::kTagErase, kEraseSize, conversation);
      break;
    case Phase::kPausing:
      if (now_ms_ - since_ms_ >= pause_ms_) {
        Go(number_ == 0 ? Phase::kNaming : Phase::kLooking);
      }
      break;
  }
}

void Cleaner::OnAnswer(Conversation* conversation) {
  switch (phase_) {
    case Phase::kNaming:
      OnName();
      break;
    case Phase::kLooking:
      OnLook(conversation);
      break;
    case Phase::kReading:
      OnRead(conversation);
      break;
    case Phase::kResolving:
      OnResolved(conversation);
      break;
    case Phase::kClaiming:
      claim_slot_ = answer()[kWrittenSlot];
      claim_generation_ = GetU16(answer() + kWrittenSlotGeneration);
      cleaning_left_ms_ = parameters_.cleaning_ms;
      Go(Phase::kCleaning);
      break;
    case Phase::kStamping:
      ++cleaned_;
      zones_[0].is_read = false;
      Go(zones_[0].stamp_slot == kNoSlot ? Phase::kLooking : Phase::kTidying);
      break;
    default:
      Go(Phase::kLooking);
      break;
  }
}

void Cleaner::OnRefusal(Reason reason, Conversation* conversation) {
  if (phase_ == Phase::kNaming) {
    if (reason == Reason::kNotPermitted && name_ != 0) {
      NextStrings();  // these have another meaning, from an earlier life
    } else {
      number_ = 0;
      Pause();
    }
    return;
  }
  if (phase_ == Phase::kResolving) {  // it may be defined later
    Note(GetU16(block_ + kBlockLease) != 0 ? kOccupiedBy : kBase, conversation);
    return;
  }
  if (reason == Reason::kUnknownSymbol) {  // the server's tables are others now
    number_ = 0;
    Pause();
    return;
  }
  if (phase_ == Phase::kStamping || phase_ == Phase::kClaiming) {
    ++lost_claims_;
    zones_[0].is_read = false;
  }
  if (reason == Reason::kGenerationChanged || phase_ == Phase::kTidying) {
    Go(Phase::kLooking);
  } else {
    Pause();
  }
}

void Cleaner::Go(Phase phase) {
  phase_ = phase;
  since_ms_ = now_ms_;
  if (phase == Phase::kReading) {
    reading_ = 0;
    goes_on_ = false;
  } else if (phase == Phase::kNaming) {
    name_ = 0;
    defined_ = false;
  }
}

void Cleaner::Pause() {
  pause_ms_ = static_cast<uint16_t>(kShortestPauseMs + uint16_t{kPauseStepMs} * random_.Below(150));
  Go(Phase::kPausing);
}

int16_t Cleaner::Limited(int32_t mm) {
  return static_cast<int16_t>(mm > INT16_MAX ? INT16_MAX : mm < -INT16_MAX ? -INT16_MAX : mm);
}

// Of a point from here: at most an eighth too much.
uint16_t Cleaner::DistanceMm(int16_t dx_mm, int16_t dy_mm) {
  const uint16_t x = Absolute(dx_mm);
  const uint16_t y = Absolute(dy_mm);
  return static_cast<uint16_t>(x > y ? x + y / 2 : y + x / 2);
}

// Where its middle is, from where the robot is now.
int16_t Cleaner::FromHere(int16_t from_there_mm, int32_t there_mm, int32_t here_mm) {
  return Limited(from_there_mm + there_mm - here_mm);
}

bool Cleaner::IsAt(const Zone& zone) const {
  return DistanceMm(FromHere(zone.dx_mm, looked_from_.x_mm, pose_.x_mm),
                    FromHere(zone.dy_mm, looked_from_.y_mm, pose_.y_mm)) <= parameters_.arrived_mm;
}

void Cleaner::Choose() {
  for (uint8_t i = 1; i < zone_count_; ++i) {  // where it stands comes first
    if (DistanceMm(zones_[i].dx_mm, zones_[i].dy_mm) <
        DistanceMm(zones_[0].dx_mm, zones_[0].dy_mm)) {
      const Zone own = zones_[i];
      zones_[i] = zones_[0];
      zones_[0] = own;
    }
  }
  CleaningView view{};
  view.count = zone_count_;
  for (uint8_t i = 0; i < zone_count_; ++i) {
    view.tags[i] = zones_[i].signs;
  }
  const CleaningDecision decision = Decide(view, random_.Below(255));
  if (decision.act == CleaningAct::kWait) {
    target_ = 0;
    Pause();
    return;
  }
  target_ = zones_[decision.tag].tag;
  moving_to_ = decision.tag;
  const bool stays = decision.act == CleaningAct::kClean && IsAt(zones_[0]);
  Go(stays ? Phase::kClaiming : Phase::kMoving);
}

// Until it is in the middle of the zone, where it looks again. It brakes on the way: from full
// speed it would roll out beyond, and have to turn back, or circle round the tag for ever.
void Cleaner::Move(const Conversation& conversation) {
  const Zone& zone = zones_[moving_to_];
  const int16_t dx_mm = FromHere(zone.dx_mm, looked_from_.x_mm, pose_.x_mm);
  const int16_t dy_mm = FromHere(zone.dy_mm, looked_from_.y_mm, pose_.y_mm);
  const uint16_t left_mm = DistanceMm(dx_mm, dy_mm);
  if (left_mm <= parameters_.arrived_mm || now_ms_ - since_ms_ > kMovingPatienceMs) {
    Go(Phase::kLooking);
    return;
  }
  const int16_t brakes = SpeedToStopIn(left_mm);
  const int16_t speed = conversation.state().parameters.speed_mm_s;
  wheels_ = SteerTo(dx_mm, dy_mm, pose_.heading, speed < brakes ? speed : brakes);
}

void Cleaner::Claim(Conversation* conversation) {
  claimed_ms_ = now_ms_;
  const Zone& zone = zones_[0];
  const bool ours = zone.claim_slot != kNoSlot;  // of before a reset
  Write(kOccupiedBy, zone.claim_slot, ours ? zone.claim_generation : zone.generation,
        parameters_.lease_s, conversation);
}

void Cleaner::Write(Term predicate, uint8_t slot, uint16_t expected, uint16_t lease_s,
                    Conversation* conversation) {
  PutChange(slot, expected);
  uint8_t* const data = exchange_.message.data;
  PutU16(data + kWriteLease, lease_s);
  protocol::PutU32(data + kWriteTime, 0);  // the server's
  const int32_t words[] = {protocol::kTypeTag,    target_,
                           first_string_ + kBase, first_string_ + predicate,
                           protocol::kTypeRobot,  number_};
  for (uint8_t i = 0; i < protocol::kStatementWords; ++i) {
    PutI32(&data[kWriteWords + 4 * i], words[i]);
  }
  Ask(protocol::kTagWrite, kWriteSize, conversation);
}

// What WRITE and ERASE have in common, on condition of the generation.
void Cleaner::PutChange(uint8_t slot, uint16_t expected) {
  uint8_t* const data = exchange_.message.data;
  PutU16(data + kWriteTag, target_);
  data[kWriteSlot] = slot;
  data[kWriteFlags] = protocol::kTagExpect;
  PutU16(data + kWriteExpected, expected);
}

void Cleaner::Ask(uint8_t opcode, uint8_t length, Conversation* conversation) {
  exchange_.message.opcode = opcode;
  exchange_.message.length = length;
  conversation->Ask(&exchange_);
  asked_ = true;
}

WheelSpeeds Cleaner::Wheels(const Conversation& conversation) const {
  return conversation.state().flags == 0 ? wheels_ : WheelSpeeds{0, 0};
}

}  // namespace client
}  // namespace pheromone
