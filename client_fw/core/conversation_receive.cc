// Receiving; see conversation.cc.
#include "client_fw/core/base/outlined.h"
#include "client_fw/core/conversation.h"

namespace pheromone {
namespace client {
namespace {

using protocol::Reason;

}  // namespace

PHEROMONE_OUTLINED void Conversation::OnByte(uint8_t byte, Moment now_ms) {
  Advance(now_ms);
  if (medium_.Hear(byte, phase_ == Phase::kAwaiting) == protocol::FrameParser::kFrame) {
    OnFrame();
    Seal(memory_);
  }
}

void Conversation::OnFrame() {
  const protocol::FrameParser& parser = medium_.state().parser;
  const uint8_t* const data = parser.body() + 2;
  const uint8_t id = parser.body()[0];
  const uint8_t opcode = parser.body()[1];
  uint8_t length = static_cast<uint8_t>(parser.size() - 4);
  if (is_signed() && !Unsign({id, opcode, data, length}, &length)) {
    return;
  }
  if (opcode == protocol::kRound && id == protocol::kBroadcastId) {
    OnRound(data, length);
  } else if (id != parameters().id) {
    OnForeign(id, opcode, data, length);
  } else if (!protocol::IsFromServer(opcode)) {
    Count(&Counters::own_id_heard);
  } else if (opcode == protocol::kCommand) {
    OnCommand(data, length);
  } else if (phase_ == Phase::kAwaiting && tx_size_ == 0 && OnAnswer(opcode, data, length)) {
    in_turn_ = false;
    HearServer();
  } else {
    Count(&Counters::late_answers);
  }
}

void Conversation::OnForeign(uint8_t id, uint8_t opcode, const uint8_t* data, uint8_t length) {
  Count(&Counters::heard);
  if (protocol::IsFromServer(opcode) && !HasTurns()) {
    HearServerOfOthers();  // it is there, though it has not heard us
  }
  if (opcode == protocol::kCommand && id == protocol::kBroadcastId && length == 2 &&
      data[1] == static_cast<uint8_t>(protocol::CommandCode::kHalt)) {
    Count(&Counters::commands);
    behaviour_.Execute(data[1], data + 2);
  }
}

PHEROMONE_OUTLINED bool Conversation::OnAnswer(uint8_t opcode, const uint8_t* data,
                                               uint8_t length) {
  if (opcode == protocol::kError) {
    return OnError(data, length);
  }
  if (opcode != static_cast<uint8_t>(asked_opcode_ | protocol::kFromServer)) {
    return false;
  }
  if (asked_opcode_ == protocol::kHello) {
    return OnHelloAnswer(data, length);
  }
  if (asked_opcode_ == protocol::kPing) {
    return OnEcho(data, length);
  }
  if (IsTag(asked_opcode_)) {
    return OnTagAnswer(opcode, data, length);
  }
  return OnDone(data, length);
}

bool Conversation::OnHelloAnswer(const uint8_t* data, uint8_t length) {
  if (length != kHelloAnswerSize || protocol::GetU16(data) != memory_->nonce) {
    return false;
  }
  for (uint8_t i = 0; i < kHelloAnswerSize; ++i) {
    server_[i] = data[i];
  }
  const uint16_t epoch = protocol::GetU16(data + kEpochAt);
  if (epoch != memory_->epoch) {
    memory_->epoch = epoch;
    Count(&Counters::epochs);
    memory_->command_known = false;
    DropPending();  // its coordinates may mean another place now
  }
  Count(&Counters::hello_answers);
  Greet(false);
  if (!behaviour_.OnServer(data[kVersionAt], protocol::GetU16(data + kTypeMaskAt))) {
    WaitForHello();
    return true;
  }
  // Only forward: a number that was used stands for one request. This answer may be a late one, of
  // before a warm reset; answers to requests of before it may also still arrive.
  const uint8_t last_seq = data[kLastSeqAt];
  if (!memory_->numbered || static_cast<uint8_t>(last_seq - memory_->seq - 1) < 127) {
    DropPending();  // behind: it would never be answered
    memory_->seq = last_seq;
    memory_->numbered = true;
  }
  SayHello();
  Greet(true);
  OnSuccess();
  Contend();
  return true;
}

bool Conversation::OnEcho(const uint8_t* data, uint8_t length) {
  if (length != kPingSize || protocol::GetU16(data) != memory_->nonce ||
      protocol::GetU16(data + 2) != pings_) {
    return false;
  }
  Count(&Counters::echoes);
  resync_ = false;
  medium_.OnOutcome(MediumAccess::kAnswered);
  Contend();
  return true;
}

// The answer to an accepted request.
bool Conversation::OnDone(const uint8_t* data, uint8_t length) {
  const bool event = asked_opcode_ == protocol::kEvent;
  const bool pending = RequestPending();
  if (length != (event ? 0 : 4) + (pending ? 1 : 0)) {
    return false;
  }
  if (pending) {
    if (*data++ != memory_->seq) {
      return false;
    }
    memory_->opcode = 0;
  }
  OnSuccess();
  if (!event) {
    OnIntensities(data);
  } else {
    Count(&Counters::events);
    requests_.event_turn &= timers_[kPeriod] != 0;
  }
  if (requests_.event_turn && state().events == 0 && (!kHasTags || !HasTagRequest())) {
    Rest();
  } else {
    // With nothing to steer by: the change has waited for too long.
    Contend(IsBuffered() && !requests_.event_turn ? MediumAccess::kFirst : MediumAccess::kRandom);
  }
  return true;
}

void Conversation::OnIntensities(const uint8_t* data) {
  Count(&Counters::answers);
  if (timers_[kPosed] == 0) {
    Count(&Counters::stale_answers);
    return;
  }
  requests_.event_turn = true;
  behaviour_.OnIntensities(protocol::GetI16(data), protocol::GetI16(data + 2), heading_);
}

bool Conversation::OnError(const uint8_t* data, uint8_t length) {
  const bool pending = RequestPending();
  if (length != 3 || data[0] != asked_opcode_ || (pending && data[2] != memory_->seq)) {
    return false;
  }
  OnRefusal(static_cast<Reason>(data[1]));
  return true;
}

// The request was refused.
void Conversation::OnRefusal(Reason reason) {
  Count(&Counters::errors);
  requests_.last_error = reason;
  if (asked_opcode_ == protocol::kHello) {
    WaitForHello();
  } else if (reason == Reason::kSayHello) {
    GreetAgain();
  } else if (reason == Reason::kBusy || asked_opcode_ == protocol::kPing) {
    medium_.OnOutcome(MediumAccess::kBusy);
    if (ChangePending()) {
      query_ = static_cast<uint8_t>(query_ + kQueryDue);
    }
    Retry();
  } else if (IsTag(asked_opcode_)) {
    OnTagRefusal(reason);
  } else {
    if (RequestPending()) {
      DropPending();
    }
    if (reason == Reason::kOffTheMap) {
      behaviour_.OnOffTheMap();
    }
    Rest();
  }
}

void Conversation::OnCommand(const uint8_t* data, uint8_t length) {
  if (length < 2 || length != 2 + protocol::CommandArgumentLength(data[1])) {
    Count(&Counters::malformed);
    return;
  }
  HearServer();
  // With turns, a ROUND follows, which takes longer than a window, and has a turn for the ACK.
  timers_[kAckDue] = HasTurns() ? medium_.rounds()->left_ms()
                                : static_cast<uint16_t>(medium_.state().window_ms + 1);
  ack_due_ = true;
  uint8_t* const ack = memory_->ack;
  if (memory_->command_known && data[0] == ack[0]) {
    Count(&Counters::repeated_commands);
    return;
  }
  memory_->command_known = true;
  ack[0] = data[0];
  ack[1] = data[1];
  const Reason result = behaviour_.Execute(data[1], data + 2);
  TellCounter(state().value_wanted);
  ack[2] = static_cast<uint8_t>(result);
  Count(result == Reason::kNone ? &Counters::commands : &Counters::refused_commands);
}

// Where the value that was asked for is one of ours. These are counted also without kAllCounters.
void Conversation::TellCounter(uint8_t id) {
  static_assert(kTimeoutCount == kRequestCount + 1 && kCrcErrorCount == kRequestCount + 2,
                "they are tested as a range");
  if (id < kRequestCount || id > kCrcErrorCount) {
    return;
  }
  const unsigned value = id == kRequestCount ? counters_.requests
                         : id == kTimeoutCount
                             ? counters_.timeouts
                             : static_cast<unsigned>(decoder_counters().crc_errors);
  behaviour_.Tell(static_cast<uint16_t>(value & UINT16_MAX));
}

Counters Conversation::counters() const {
  Counters all = Counters();
  static_cast<ConversationCounters&>(all) = counters_;
  static_cast<BehaviourCounters&>(all) = static_cast<const BehaviourCounters&>(state());
  static_cast<MediumCounters&>(all) = medium_.state().counters;
  return all;
}

protocol::HelloAnswer Conversation::server() const {
  protocol::Message message;
  message.id = parameters().id;
  message.opcode = protocol::kHelloAnswer;
  message.length = kHelloAnswerSize;
  for (uint8_t i = 0; i < kHelloAnswerSize; ++i) {
    message.data[i] = server_[i];
  }
  protocol::HelloAnswer answer;
  Decode(message, &answer);
  return answer;
}

}  // namespace client
}  // namespace pheromone
