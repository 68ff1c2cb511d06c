// What a robot with a net does, phase by phase. The phases of one NetStage follow from it (Resume),
// so that a reset costs no more than what can be read again. What it reads and writes for that is
// in net_robot_tags.cc.
#include "client_fw/core/tasks/net_robot.h"

#include <stddef.h>

#include "client_fw/core/requests/tag_data.h"
#include "protocol/byte_order.h"
#include "protocol/crc16.h"

namespace pheromone {
namespace client {
namespace {

using protocol::EnvironmentRecord;
using protocol::GetI32;
using protocol::NetAction;
using protocol::NetOutcome;
using protocol::PlaceDoes;
using protocol::Reason;
using protocol::TransitionDoes;

uint16_t CheckOf(const NetState& state) {
  return protocol::Check(&state, offsetof(NetState, crc));
}

}  // namespace

NetRobot::NetRobot(const NetTables& net, const NetRobotParameters& parameters, uint8_t id,
                   uint16_t boot_counter, NetMemory* memory)
    : net_(net),
      parameters_(parameters),
      random_(static_cast<uint8_t>(id + 151u), boot_counter),
      id_(id),
      memory_(memory),
      state_() {
  state_.hash = net.hash;
  state_.marking = net.marking;
  state_.nonce = boot_counter;
  // Another one than before, most probably: a record is not to be taken for one of an earlier life.
  state_.seq = static_cast<uint8_t>(29u * boot_counter);
  bool found = false;
  for (const NetState& kept : memory->states) {
    if (kept.crc == CheckOf(kept) && kept.nonce == boot_counter && kept.hash == net.hash &&
        (!found || static_cast<int16_t>(kept.version - state_.version) > 0)) {
      state_ = kept;
      found = true;
    }
  }
  Save();
}

// Into the older one of the two.
void NetRobot::Save() {
  ++state_.version;
  state_.crc = CheckOf(state_);
  memory_->states[state_.version & 1] = state_;
  line_ = LineNow();
}

bool NetRobot::Step(const NetStep& step) {
  const Moment passed_ms = step.now_ms - static_cast<Moment>(now_ms_);
  Carry(has_time_ ? passed_ms : 0);
  has_time_ = true;
  now_ms_ += passed_ms;
  pace_ms_ = step.pace_ms;
  pose_unit_10um_ = step.pose_unit_10um;
  if (asked_) {
    if (exchange_.state == TagExchange::kAsked) {
      return false;
    }
    asked_ = false;
    if (exchange_.state == TagExchange::kAnswered) {
      OnAnswer();
    } else if (exchange_.state == TagExchange::kRefused) {
      OnRefusal();
    } else {
      OnDropped();
    }
  }
  if (!asked_ && !step.is_held && !raised_) {
    Act();
  }
  return asked_ && exchange_.state == TagExchange::kIdle;
}

// What is to be done next, when nothing is awaited.
void NetRobot::Act() {
  switch (phase_) {
    case Phase::kNaming:
      if (IsTime()) {
        AskForName();
      }
      break;
    case Phase::kDriving:
      if (IsTime()) {
        Look(0);
      }
      break;
    case Phase::kReading:
      if (polls_ == 0 || slot_ != protocol::kTriggerSlot || IsTime()) {
        Read(slot_);
      }
      break;
    case Phase::kChecking:
      Read(slot_);
      break;
    case Phase::kTelling:
      if (polls_ == 0 || IsTime()) {
        Write();
      }
      break;
    case Phase::kAwaiting:
    case Phase::kGreen:
    case Phase::kAdvice:
      if (IsTime()) {
        Read(protocol::kEnvironmentSlot);
      }
      break;
    case Phase::kException:  // it was released
      fault_ = NetFault::kNone;
      Resume();
      break;
  }
}

void NetRobot::OnAnswer() {
  EnvironmentRecord record = EnvironmentRecord();
  switch (phase_) {
    case Phase::kNaming:
      number_ = GetI32(answer() + kDefinedNumber);
      Resume();
      break;
    case Phase::kDriving:
      OnLook();
      break;
    case Phase::kReading:
      OnTrigger();
      break;
    case Phase::kTelling:
      Go(Phase::kAwaiting);
      break;
    case Phase::kAwaiting:
      if (ReadEnvironment(&record) && IsOutcome(record)) {
        OnOutcome(record);
      } else if (phase_ == Phase::kAwaiting && polls_ >= kNetPatience) {
        Go(Phase::kChecking);
      }
      break;
    case Phase::kGreen:
      OnGreen();
      break;
    case Phase::kAdvice:
      OnAdvice();
      break;
    case Phase::kChecking:
      OnCheck();
      break;
    case Phase::kException:
      break;
  }
}

void NetRobot::OnRefusal() {
  reason_ = exchange_.reason;
  if (phase_ == Phase::kNaming || phase_ == Phase::kDriving) {
    return;  // again, at its pace: off the map, perhaps
  }
  if (reason_ == Reason::kUnknownSymbol) {  // the server's tables are others now
    number_ = 0;
    Go(Phase::kNaming);
  } else if (reason_ == Reason::kGenerationChanged) {
    state_.stage = NetStage::kChoosing;
    Save();
    Go(Phase::kAdvice);
  } else if (reason_ != Reason::kTagFull) {  // until the environment has erased what it has read
    Raise(NetFault::kServer);
  }
}

void NetRobot::OnDropped() {
  if (phase_ == Phase::kTelling) {
    Go(Phase::kChecking);
  }
}

void NetRobot::Go(Phase phase) {
  phase_ = phase;
  polls_ = 0;
  paced_ms_ = now_ms_;
  slot_ = phase == Phase::kChecking ? protocol::kEnvironmentSlot : protocol::kTriggerSlot;
  if (phase == Phase::kNaming || phase == Phase::kAdvice || phase == Phase::kDriving) {
    paced_ms_ -= pace_ms_;  // at once
  }
}

// From what a reset leaves.
void NetRobot::Resume() {
  tag_ = state_.tag;
  switch (state_.stage) {
    case NetStage::kOnTheWay:
      Go(Phase::kDriving);
      break;
    case NetStage::kTelling:
      Go(Phase::kChecking);
      break;
    case NetStage::kWaiting:
      Go(Phase::kGreen);
      break;
    case NetStage::kChoosing:
      Go(Phase::kAdvice);
      break;
  }
}

void NetRobot::Raise(NetFault fault) {
  fault_ = fault;
  ++counters_.exceptions;
  raised_ = true;
  Go(Phase::kException);
}

bool NetRobot::TakeException(uint16_t* tag) {
  const bool raised = raised_;
  raised_ = false;
  *tag = tag_;
  return raised;
}

void NetRobot::OnOutcome(const EnvironmentRecord& record) {
  if (record.outcome == NetOutcome::kAccepted) {
    OnAccepted(record.amount);
    return;
  }
  // As before, so that it can be tried again.
  if (state_.action == NetAction::kPass) {
    state_.stage = NetStage::kWaiting;
  } else if (IsChoice(state_.action)) {
    state_.stage = NetStage::kChoosing;
  } else {
    state_.stage = NetStage::kOnTheWay;
    state_.tag = 0;
  }
  Save();
  Raise(NetFault::kRefused);
}

void NetRobot::OnAccepted(uint16_t granted) {
  const NetAction action = state_.action;
  if (action == NetAction::kPass || IsChoice(action)) {
    if (IsChoice(action)) {
      state_.choice = action;
      ++counters_.chosen[action == NetAction::kChooseA ? 0 : 1];
    }
    state_.stage = NetStage::kOnTheWay;
    Save();
    Go(Phase::kDriving);
    return;
  }
  uint32_t marking = state_.marking;
  Fire(net_.transitions[state_.transition - 1].arcs, &marking);
  if (action == NetAction::kTake) {
    state_.energy = granted;
    counters_.taken += granted;
    state_.carried_s = 0;
    carried_ms_ = 0;
  } else if (action == NetAction::kLeave) {
    state_.choice = NetAction::kNone;
  } else if (action != NetAction::kPresent) {
    state_.energy = 0;
    ++state_.trips;
    const uint8_t trail = action == NetAction::kStoreA ? 0 : 1;
    ++counters_.stored[trail];
    counters_.amount[trail] += state_.amount;
  }
  Arrive(marking);
}

// The transition has been fired.
void NetRobot::Arrive(uint32_t marking) {
  state_.marking = marking;
  const NetPlaceRow* const place = PlaceOf(marking);
  state_.stage = place->does == PlaceDoes::kWait     ? NetStage::kWaiting
                 : place->does == PlaceDoes::kChoose ? NetStage::kChoosing
                                                     : NetStage::kOnTheWay;
  Save();
  Resume();
}

void NetRobot::OnGreen() {
  EnvironmentRecord record = EnvironmentRecord();
  if (!ReadEnvironment(&record)) {
    return;
  }
  polls_ = 0;
  if ((record.state & protocol::kNetGreen) != 0 && record.robot == number_) {
    Begin(NetAction::kPass, 0);
  }
}

void NetRobot::OnAdvice() {
  EnvironmentRecord record = EnvironmentRecord();
  if (!ReadEnvironment(&record)) {
    return;
  }
  const bool explores = random_.Below(100) < parameters_.explore_percent;
  const bool advised = (record.state & (protocol::kNetAdviceA | protocol::kNetAdviceB)) != 0;
  const bool takes_a =
      explores || !advised ? random_.Below(2) == 0 : (record.state & protocol::kNetAdviceA) != 0;
  Begin(takes_a ? NetAction::kChooseA : NetAction::kChooseB, 0);
}

// --- Places and energy

// The marked place that does something: the tables have been checked to have one.
const NetPlaceRow* NetRobot::PlaceOf(uint32_t marking) const {
  const NetPlaceRow* place = net_.places;
  for (uint8_t i = 0; i < net_.place_count; ++i) {
    if ((marking >> i & 1u) != 0 && net_.places[i].does != PlaceDoes::kNothing) {
      place = &net_.places[i];
    }
  }
  return place;
}

// At a place that chooses: the line after it, once a trail is chosen.
uint8_t NetRobot::LineNow() const {
  uint32_t marking = state_.marking;
  const NetPlaceRow* const place = PlaceOf(marking);
  if (place->does != PlaceDoes::kChoose) {
    return place->type;
  }
  for (uint8_t i = 0; i < net_.transition_count; ++i) {
    const NetTransitionRow& row = net_.transitions[i];
    if ((row.does == TransitionDoes::kLeaveA || row.does == TransitionDoes::kLeaveB) &&
        IsChosen(row.does) && Fire(row.arcs, &marking) == Firing::kFired) {
      return PlaceOf(marking)->type;
    }
  }
  return line_;
}

void NetRobot::Carry(uint32_t passed_ms) {
  if (state_.energy == 0) {
    return;
  }
  carried_ms_ += passed_ms;
  if (carried_ms_ >= 1000) {
    const uint32_t carried_s = state_.carried_s + carried_ms_ / 1000;
    state_.carried_s = static_cast<uint16_t>(carried_s < UINT16_MAX ? carried_s : UINT16_MAX);
    carried_ms_ %= 1000;
    Save();
  }
}

uint16_t NetRobot::Deposit() const {
  const uint32_t burned = uint32_t{parameters_.burn_per_s} * state_.carried_s;
  if (parameters_.rule == DepositRule::kEqual || state_.energy == 0) {
    return state_.energy;
  }
  return burned < state_.energy ? static_cast<uint16_t>(state_.energy - burned) : uint16_t{1};
}

// The caller of Step sends it.
void NetRobot::Ask(uint8_t opcode, uint8_t length) {
  exchange_.message.opcode = opcode;
  exchange_.message.length = length;
  exchange_.state = TagExchange::kIdle;
  asked_ = true;
}

}  // namespace client
}  // namespace pheromone
