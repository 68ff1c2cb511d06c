// Sending; see conversation.cc.
#include "client_fw/core/base/outlined.h"
#include "client_fw/core/conversation.h"

namespace pheromone {
namespace client {

// It is our turn.
void Conversation::Begin(const Odometry* odometry) {
  uint8_t data[4];
  phase_ = Phase::kAwaiting;
  if (!requests_.greeted) {
    if (is_signed() && !signing()->second_hello_due() && !NumberHello()) {
      WaitForHello();
      return;
    }
    protocol::PutU16(data, memory_->nonce);
    data[2] = parameters().firmware_version;
    data[3] = RoundPeriod();
    Count(&Counters::hellos);
    Send(protocol::kHello, data, sizeof(data));
  } else if (resync_) {
    protocol::PutU16(data, memory_->nonce);
    protocol::PutU16(data + 2, ++pings_);
    Count(&Counters::resyncs);
    Send(protocol::kPing, data, kPingSize);
  } else if (!MakeRequest(odometry)) {
    timers_[kPeriod] = PeriodMs();
    GiveUp();
  }
}

// How often we want a turn, in units of 20 ms; 0: never.
uint8_t Conversation::RoundPeriod() const {
  if (!parameters().rounds) {
    return 0;
  }
  const uint16_t units = parameters().period_ms / 20;
  return units == 0          ? uint8_t{1}
         : units > UINT8_MAX ? uint8_t{UINT8_MAX}
                             : static_cast<uint8_t>(units);
}

void Conversation::Send(uint8_t opcode, const uint8_t* data, uint8_t length) {
  medium_.OnBegin();
  uint8_t* wire = tx_;
  if (resync_) {
    *wire++ = 0x00;  // ends any escape or frame that the receiver may be stuck in
  }
  protocol::FrameWriter writer(wire);
  writer.Put(parameters().id);
  writer.Put(opcode);
  uint8_t signature[LinkSigning::kLongest];
  const uint8_t added =
      is_signed() ? SignatureOf({parameters().id, opcode, data, length}, signature) : uint8_t{0};
  for (; length != 0; --length) {
    writer.Put(*data++);
  }
  for (uint8_t i = 0; i < added; ++i) {
    writer.Put(signature[i]);
  }
  tx_size_ = static_cast<uint8_t>(writer.Finish() - tx_);
  asked_opcode_ = opcode;
}

// Sends the unanswered request, or else an event if one is due, or a request with this pose. False
// if the pose is unknown or does not fit into the message, and there is no event.
bool Conversation::MakeRequest(const Odometry* odometry) {
  uint8_t opcode = memory_->opcode;
  if (kHasTags) {
    PreferSteering();
  }
  if (opcode != 0 && !IsTag(opcode)) {
    if (query_ <= kQueryMade || odometry == nullptr || !MakeFresh(*odometry, &opcode)) {
      Count(&Counters::duplicates);
      if (query_ == kQueryMade) {
        timers_[kPosed] = 0;
      }
    }
  } else if (requests_.event_turn || odometry == nullptr || !MakeFresh(*odometry, &opcode)) {
    if (state().events != 0 && opcode == 0) {
      opcode = protocol::kEvent;
      MakeEvent();
    } else if (!kHasTags || !MakeTagRequest(odometry, &opcode)) {
      return false;
    }
  }
  Seal(memory_);
  if (attempt_ != 0) {
    Count(&Counters::retries);
  }
  if (IsTag(opcode)) {
    SendTagRequest(opcode);
    return true;
  }
  if (opcode != protocol::kEvent) {
    Count(&Counters::requests);
    timers_[kPeriod] = PeriodMs();  // from here, so that it moves to where the channel is free
  }
  const bool pending = opcode == memory_->opcode;
  Send(opcode, pending ? memory_->data : fresh_, pending ? memory_->length : fresh_length_);
  return true;
}

bool Conversation::MakeFresh(const Odometry& odometry, uint8_t* opcode) {
  const StartPose& start = state().start;
  fresh_length_ = 0;
  uint8_t service = parameters().wide ? protocol::kSenseWide : protocol::kSense;
  // One change at a time; after one that was too slow to be steered by, a query once more.
  bool lay_trail = parameters().lay_trail && memory_->opcode == 0;
  if (query_ >= kQueryMade) {
    --query_;
    lay_trail = false;
  }
  if (lay_trail) {
    service = parameters().wide ? protocol::kTraceWide : protocol::kTrace;
    AppendSeq();
  }
  if (!AppendCoordinate(start.XOf(odometry)) || !AppendCoordinate(start.YOf(odometry))) {
    behaviour_.OnOffTheMap();
    return false;
  }
  heading_ = start.HeadingOf(odometry);
  Append(heading_);
  *opcode = static_cast<uint8_t>(service | parameters().type);
  if (lay_trail) {
    MakePending(*opcode);
  }
  timers_[kPosed] = parameters().fail_safe_ms;
  return true;
}

// False if it does not fit into the message.
bool Conversation::AppendCoordinate(int32_t mm) {
  int32_t units = 0;
  if (!ToPoseUnits(mm, protocol::GetU16(server_ + kPoseUnitAt), &units) ||
      (!parameters().wide && units != static_cast<int16_t>(units))) {
    return false;
  }
  const uint32_t bits = static_cast<uint32_t>(units);
  Append(static_cast<uint16_t>(bits & 0xFFFFu));
  if (parameters().wide) {
    Append(static_cast<uint16_t>(bits >> 16));
  }
  return true;
}

PHEROMONE_OUTLINED void Conversation::AppendByte(uint8_t value) {
  fresh_[fresh_length_++] = value;
}

void Conversation::Append(uint16_t value) {
  AppendByte(static_cast<uint8_t>(value & 0xFFu));
  AppendByte(static_cast<uint8_t>(value >> 8));
}

// Requests with a seq begin with it; it is used up once the request is pending.
PHEROMONE_OUTLINED void Conversation::AppendSeq() {
  AppendByte(static_cast<uint8_t>(memory_->seq + 1u));
}

void Conversation::MakeEvent() {
  protocol::EventCode event = protocol::EventCode();
  const int16_t argument = behaviour_.TakeEvent(&event);
  fresh_length_ = 0;
  AppendSeq();
  AppendByte(static_cast<uint8_t>(event));
  Append(static_cast<uint16_t>(argument));
  MakePending(protocol::kEvent);
}

PHEROMONE_OUTLINED void Conversation::MakePending(uint8_t opcode) {
  ++memory_->seq;
  memory_->opcode = opcode;
  memory_->length = fresh_length_;
  for (uint8_t i = 0; i < kMaxPending; ++i) {
    memory_->data[i] = fresh_[i];
  }
}

void Conversation::SendAck() {
  ack_due_ = false;
  Count(&Counters::acks);
  Send(protocol::kCommandAck, memory_->ack, sizeof(memory_->ack));
}

void Conversation::DropPending() {
  if (IsTag(memory_->opcode)) {
    DropTagRequest();
  }
  if (memory_->opcode != 0) {
    Count(&Counters::lost_traces);
    memory_->opcode = 0;
    query_ = kNoQuery;
  }
}

}  // namespace client
}  // namespace pheromone
