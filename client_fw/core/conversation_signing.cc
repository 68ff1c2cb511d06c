// Signed frames (protocol/README.md, section 18); see conversation.cc.
//
// HELLO is said twice: the first is answered with a session, of which the second is the first
// frame. A robot that says HELLO because of a silence still has its old session.
#include "client_fw/core/conversation.h"

#if PHEROMONE_SIGNING  // otherwise nothing here is called

namespace pheromone {
namespace client {
namespace {

// Of 65 535 numbers of HELLO, so many are used at the usual pace, 40 minutes beside a server that
// is not there. The others last for a week of that, at ten seconds each; then the robot is silent
// until it is switched off and on.
constexpr uint16_t kQuickHellos = 4096;
constexpr uint16_t kMaxHellos = UINT16_MAX;

}  // namespace

bool Conversation::SavesHellos() const {
  return memory_->hellos_signed >= kQuickHellos;
}

// The number of the HELLO that is to be sent. False: there is none left.
bool Conversation::NumberHello() {
  if (memory_->hellos_signed == kMaxHellos) {
    return false;
  }
  ++memory_->hellos_signed;
  Seal(memory_);  // a reset from here on must not send another HELLO under this number
  return true;
}

uint8_t Conversation::SignatureOf(const FrameView& frame, uint8_t* signature) {
  if (frame.opcode == protocol::kHello && !signing()->TakeSecondHello()) {
    const uint16_t number = static_cast<uint16_t>(memory_->hellos_signed - 1u);
    return signing()->SignHello(frame, number, signature);
  }
  return signing()->Sign(frame, signature);
}

// Whether the frame is to be looked at; `length` is that of DATA without what signing has added.
bool Conversation::Unsign(const FrameView& frame, uint8_t* length) {
  const bool to_all = frame.id == protocol::kBroadcastId;
  if (!protocol::IsFromServer(frame.opcode) || (!to_all && frame.id != parameters().id)) {
    return true;
  }
  if (frame.opcode == protocol::kHelloAnswer && frame.length == protocol::kGreetingSize) {
    OnGreeting(frame);
    return false;
  }
  const uint8_t added = signing()->Verify(frame);
  if (added != LinkSigning::kForged) {
    *length = static_cast<uint8_t>(frame.length - added);
    return true;
  }
  if (to_all && frame.opcode == protocol::kRound && !requests_.greeted) {
    FollowRound(frame.data, frame.length);
  } else {
    Count(&Counters::forged);
  }
  return false;
}

// The answer to a first HELLO begins the session, also if it is late; a second one follows.
void Conversation::OnGreeting(const FrameView& frame) {
  if (requests_.greeted) {
    Count(&Counters::late_answers);
  } else if (tx_size_ != 0 || !signing()->TakeAnswer(frame)) {
    Count(&Counters::forged);
  } else {
    in_turn_ = false;
    hello_attempt_ = 0;
    timers_[kPause] = 0;
    OnSuccess();
    HearServer();
    Contend();
  }
}

// What it says to others shows that it is there, as without signing; but one that was restarted has
// forgotten our session, and is silent to us.
void Conversation::HearServerOfOthers() {
  const uint16_t left_ms = timers_[kSpokenTo];
  HearServer();
  timers_[kSpokenTo] = left_ms;
  if (is_signed() && timers_[kContacted] > left_ms) {
    timers_[kContacted] = left_ms;
  }
}

// Whoever is not in a session, perhaps no longer, cannot verify a ROUND, but keeps out of its turns
// to find the opening. One that is forged can keep us from sending HELLO, as noise can; no answer
// in it is believed.
void Conversation::FollowRound(const uint8_t* data, uint8_t length) {
  Rounds* const rounds = medium_.rounds();
  const uint8_t bare = static_cast<uint8_t>(length - protocol::kSignatureToAll);
  if ((length <= protocol::kSignatureToAll || !rounds->OnRound(data, bare)) &&
      !rounds->OnRound(data, length)) {
    Count(&Counters::forged);
    return;
  }
  Count(&Counters::rounds);
  if (!SavesHellos()) {
    timers_[kPause] = 0;
  }
  if (in_turn_) {  // of the session before
    in_turn_ = false;
    OnRoundAnswer(nullptr);
  } else if (phase_ == Phase::kAwaiting && tx_size_ == 0) {
    OnMiss();
  }
  medium_.Grant(data);
  rounds->Decline();
}

}  // namespace client
}  // namespace pheromone

#endif
