// Time and sending; the other half is conversation_receive.cc.
#include "client_fw/core/conversation.h"

#include "protocol/byte_order.h"

namespace pheromone {
namespace client {
namespace {

using protocol::Encode;
using protocol::Message;

constexpr uint8_t kDefaultSlotMs = 5;  // before HELLO's answer tells it
constexpr uint8_t kHalfFirstHelloMs =
    50;                                   // HELLO's back-off: 50, 100 ... 800 ms, and as much again
constexpr uint8_t kHelloDoublings = 4;    // at random
constexpr uint16_t kAloneMs = 1000;       // nobody else heard for so long: no random delay
constexpr uint8_t kStalledFrameMs = 200;  // an open frame does not hold us up for longer
constexpr uint8_t kByteGraceMs = 5;       // a lone DLE is not yet a frame, but its first byte
constexpr uint16_t kLongestPauseMs = 30000;  // less than half of what 16 bits of time can tell

}  // namespace

Conversation::Conversation(const Parameters& parameters, RequestMemory* memory)
    : ConversationState(),
      memory_(memory),
      random_(parameters.id, parameters.boot_counter),
      parameters_(parameters),
      counters_(),
      decoder_(parameters.gap_timeout_ms) {
  flags_ = kNoAnswerYet;
  if (memory->nonce != parameters.boot_counter || memory->length > kMaxPending) {
    *memory = RequestMemory();
    memory->nonce = parameters.boot_counter;
  }
}

void Conversation::Poll(uint32_t now_ms, const Pose* pose, bool channel_busy) {
  const uint32_t elapsed_ms = now_ms - last_poll_ms_;
  last_poll_ms_ = now_ms;
  now_ = static_cast<uint16_t>(now_ms);
  decoder_.Expire(now_ms);
  if (!started_ || elapsed_ms > kLongestPauseMs) {
    Restart();
  }
  if (Since(heard_) >= kAloneMs) {
    others_ = false;
  }
  if (Since(held_) > WindowMs()) {
    holding_ = false;
  }
  const bool open = FrameOpen();
  if (phase_ == Phase::kAwaiting && !open && Since(sent_) > WindowMs() &&
      Since(last_byte_) > kByteGraceMs) {
    OnMiss();
  }
  CheckSilence();
  if (phase_ != Phase::kWaiting) {
    return;
  }
  const bool due = Since(not_before_) < 0x8000u;
  if (due) {
    not_before_ = now_;  // stays due, however long the channel is busy
  }
  const bool free = !channel_busy && !open;
  if (ack_due_ && free) {
    Begin(Job::kAck, pose);
  } else if (due && CountDown(static_cast<uint16_t>(elapsed_ms), free && !holding_)) {
    Begin(!greeted_ ? Job::kHello : resync_ ? Job::kPing : Job::kAsk, pose);
  }
}

void Conversation::OnSent(uint32_t now_ms) {
  if (phase_ == Phase::kSending) {
    now_ = static_cast<uint16_t>(now_ms);
    sent_ = now_;
    tx_size_ = 0;
    phase_ = job_ == Job::kAck ? Phase::kWaiting : Phase::kAwaiting;
  }
}

void Conversation::Restart() {
  if (started_) {
    StopFailSafe();
  }
  started_ = true;
  pose_known_ = false;
  others_ = true;  // we have not listened: others may be about
  heard_ = now_;
  next_period_ = now_;
  SayHello();
  if (phase_ != Phase::kSending) {
    WaitUntil(now_);
  }
}

void Conversation::CheckSilence() {
  if (Since(answered_) >= parameters_.fail_safe_ms) {
    StopFailSafe();
  }
  if (Since(posed_) >= parameters_.fail_safe_ms) {
    pose_known_ = false;
  }
  if (greeted_ && phase_ == Phase::kWaiting && Since(contacted_) >= parameters_.fail_safe_ms) {
    SayHello();
  }
  if (ack_due_ && Since(commanded_) > WindowMs()) {
    ack_due_ = false;  // the server has stopped waiting, and will repeat the command
    Count(&counters_.dropped_acks);
  }
}

// Lets the random delay run, which it does only while the channel is free. True: send now.
bool Conversation::CountDown(uint16_t elapsed_ms, bool free) {
  if (!drawn_) {
    Wait(others_ ? RandomDelay() : 0);
  } else if (was_free_ && free) {
    countdown_ms_ =
        countdown_ms_ > elapsed_ms ? static_cast<uint16_t>(countdown_ms_ - elapsed_ms) : 0;
  }
  was_free_ = free;
  if (!free && countdown_ms_ == 0) {
    countdown_ms_ = static_cast<uint16_t>(SlotMs() + RandomDelay());  // not all at once after it
  }
  return countdown_ms_ == 0;
}

void Conversation::Begin(Job job, const Pose* pose) {
  Message message;
  message.id = parameters_.id;
  if (job == Job::kHello) {
    MakeHello(&message);
  } else if (job == Job::kPing) {
    MakePing(&message);
  } else if (job == Job::kAck) {
    MakeAck(&message);
  } else if (!MakeRequest(pose, &message)) {
    attempt_ = 0;
    WaitForNextPeriod();
    return;
  }
  uint8_t pad = 0;
  if (resync_) {
    tx_[0] = 0x00;  // ends any escape or frame that the receiver may be stuck in
    pad = 1;
  }
  tx_size_ = static_cast<uint8_t>(EncodeFrame(message, tx_ + pad, sizeof(tx_) - pad) + pad);
  job_ = job;
  asked_opcode_ = message.opcode;
  phase_ = Phase::kSending;
}

void Conversation::MakeHello(Message* message) {
  protocol::HelloRequest hello;
  hello.id = parameters_.id;
  hello.nonce = memory_->nonce;
  hello.firmware_version = parameters_.firmware_version;
  hello.capabilities = parameters_.capabilities;
  Encode(hello, message);
  Count(&counters_.hellos);
}

void Conversation::MakePing(Message* message) {
  ++pings_;
  message->opcode = protocol::kPing;
  message->length = kPingSize;
  protocol::PutU16(message->data, memory_->nonce);
  protocol::PutU16(message->data + 2, pings_);
  Count(&counters_.resyncs);
}

void Conversation::MakeAck(Message* message) {
  protocol::CommandAck ack;
  ack.id = parameters_.id;
  ack.seq = command_seq_;
  ack.code = static_cast<protocol::CommandCode>(command_code_);
  ack.result = static_cast<uint8_t>(command_result_);
  Encode(ack, message);
  ack_due_ = false;
  Count(&counters_.acks);
}

// The TRACE that still waits for its answer, or a new request with this pose. False if the pose is
// not known or has no place in the message.
bool Conversation::MakeRequest(const Pose* pose, Message* message) {
  if (memory_->opcode != 0) {
    message->opcode = memory_->opcode;
    message->length = memory_->length;
    for (uint8_t i = 0; i < memory_->length; ++i) {
      message->data[i] = memory_->data[i];
    }
    memory_->sent = static_cast<uint8_t>(memory_->sent != 0 ? 2 : 1);
    Count(&counters_.duplicates);
  } else if (pose == nullptr || !MakeFresh(*pose, message)) {
    return false;
  }
  if (attempt_ != 0) {
    Count(&counters_.retries);
  }
  Count(&counters_.requests);
  return true;
}

bool Conversation::MakeFresh(const Pose& pose, Message* message) {
  protocol::TraceRequest trace;
  trace.id = parameters_.id;
  trace.type = parameters_.type;
  trace.wide = parameters_.wide;
  trace.seq = static_cast<uint8_t>(memory_->seq + 1u);
  trace.pose.heading = pose.heading;
  bool fits = ToPoseUnits(pose.x_mm, server_.pose_unit_10um, &trace.pose.x) &&
              ToPoseUnits(pose.y_mm, server_.pose_unit_10um, &trace.pose.y);
  if (fits && parameters_.lay_trail) {
    fits = Encode(trace, message);
  } else if (fits) {
    protocol::SenseRequest sense;
    sense.id = trace.id;
    sense.type = trace.type;
    sense.wide = trace.wide;
    sense.pose = trace.pose;
    fits = Encode(sense, message);
  }
  if (!fits) {
    StopOffTheMap();
    return false;
  }
  if (parameters_.lay_trail) {
    for (uint8_t i = 0; i < message->length; ++i) {
      memory_->data[i] = message->data[i];
    }
    memory_->length = message->length;
    memory_->seq = trace.seq;
    memory_->sent = 1;
    memory_->opcode = message->opcode;  // last: now it is pending
  }
  posed_ = now_;
  pose_known_ = true;
  return true;
}

void Conversation::OnMiss() {
  Count(&counters_.timeouts);
  resync_ = parameters_.buffered_link;
  window_.OnMiss();
  if (job_ == Job::kHello) {
    WaitForHello();
  } else {
    Retry();
  }
}

// Back off, or give this period up.
void Conversation::Retry() {
  if (attempt_ == kMaxRetries) {
    attempt_ = 0;
    Count(&counters_.abandoned);
    WaitForNextPeriod();
  } else {
    ++attempt_;
    WaitUntil(now_);
    Wait(RandomDelay());
  }
}

void Conversation::SayHello() {
  greeted_ = false;
  hello_attempt_ = 0;
  attempt_ = 0;
}

void Conversation::WaitForHello() {
  const uint16_t half = static_cast<uint16_t>(kHalfFirstHelloMs << hello_attempt_);
  if (hello_attempt_ < kHelloDoublings) {
    ++hello_attempt_;
  }
  WaitUntil(now_);
  Wait(static_cast<uint16_t>(half + random_.Below(half)));
}

// The first period that begins after now, in step with the ones before.
void Conversation::WaitForNextPeriod() {
  const uint16_t late_ms = Since(next_period_);
  if (late_ms < static_cast<uint16_t>(0u - parameters_.period_ms)) {  // else not yet begun
    const uint16_t passed = late_ms / parameters_.period_ms;
    counters_.skipped_periods += passed;
    next_period_ = static_cast<uint16_t>(next_period_ + (passed + 1u) * parameters_.period_ms);
  }
  WaitUntil(next_period_);
}

void Conversation::WaitUntil(uint16_t ms) {
  phase_ = Phase::kWaiting;
  not_before_ = ms;
  drawn_ = false;
}

void Conversation::Wait(uint16_t countdown_ms) {
  countdown_ms_ = countdown_ms;
  drawn_ = true;
}

uint8_t Conversation::SlotMs() const {
  return server_.slot_ms != 0 ? server_.slot_ms : kDefaultSlotMs;
}

uint16_t Conversation::RandomDelay() {
  return static_cast<uint16_t>(random_.Below(window_.slots()) * SlotMs());
}

uint8_t Conversation::WindowMs() const {
  return greeted_ && server_.response_window_ms != 0 ? server_.response_window_ms
                                                     : parameters_.first_window_ms;
}

bool Conversation::FrameOpen() const {
  return decoder_.frame_open() && Since(last_byte_) <= kStalledFrameMs;
}

void Conversation::SetFlags(uint8_t set, uint8_t clear) {
  flags_ = static_cast<uint8_t>((flags_ & ~clear) | set);
  wheels_ = WheelSpeeds{0, 0};
  if (flags_ == 0) {
    wheels_ = Steer(parameters_.law, p_left_, p_right_, parameters_.speed_mm_s);
  }
}

void Conversation::StopOffTheMap() {
  if ((flags_ & kOffTheMap) == 0) {
    Count(&counters_.off_the_map_stops);
    SetFlags(kOffTheMap, 0);
  }
}

void Conversation::StopFailSafe() {
  if ((flags_ & (kNoAnswerYet | kFailSafe)) == 0) {
    Count(&counters_.fail_safe_stops);
    SetFlags(kFailSafe, 0);
  }
}

void Conversation::DropPending() {
  if (memory_->opcode != 0) {
    Count(&counters_.lost_traces);
    memory_->opcode = 0;
  }
}

}  // namespace client
}  // namespace pheromone
