// Receiving; the other half is conversation.cc.
#include "client_fw/core/conversation.h"
#include "protocol/byte_order.h"

namespace pheromone {
namespace client {
namespace {

using protocol::Decode;
using protocol::Message;
using protocol::Reason;

// Whether the server answers this client's request, so that the channel is not free yet.
bool OpensWindow(uint8_t opcode) {
  const uint8_t service = protocol::ServiceOf(opcode);
  return opcode == protocol::kEvent || opcode == protocol::kHello || opcode == protocol::kPing ||
         (opcode != 0 && service < 0x50u) ||
         (service == protocol::kTraceWide && protocol::TypeOf(opcode) != 0);
}

}  // namespace

void Conversation::OnByte(uint8_t byte, uint32_t now_ms) {
  now_ = static_cast<uint16_t>(now_ms);
  last_byte_ = now_;
  if (phase_ == Phase::kWaiting) {
    HearOther();
  }
  const uint8_t damaged = static_cast<uint8_t>(decoder_.counters().crc_errors & 0xFFu);
  if (decoder_.Push(byte, now_ms)) {
    OnMessage(decoder_.message());
  } else if (static_cast<uint8_t>(decoder_.counters().crc_errors & 0xFFu) != damaged) {
    Hold();  // it may have been a request that the server understood
  }
}

void Conversation::OnMessage(const Message& message) {
  const bool from_server = protocol::IsFromServer(message.opcode);
  if (message.id == parameters_.id) {
    if (!from_server) {
      Count(&counters_.own_id_heard);
    } else if (message.opcode == protocol::kCommand) {
      holding_ = false;
      OnCommand(message);
    } else {
      holding_ = false;
      OnAnswer(message);
    }
    return;
  }
  OnForeign(message);
}

void Conversation::OnForeign(const Message& message) {
  HearOther();
  holding_ = false;
  Count(&counters_.heard);
  if (!protocol::IsFromServer(message.opcode)) {
    if (OpensWindow(message.opcode)) {
      Hold();
    }
    return;
  }
  protocol::Command command;
  if (!Decode(message, &command)) {
    return;
  }
  if (message.id != protocol::kBroadcastId) {
    Hold();  // for its ACK
  } else if (command.code == protocol::CommandCode::kHalt) {
    Count(&counters_.commands);
    SetFlags(kHalted, 0);
  }
}

void Conversation::OnAnswer(const Message& message) {
  bool expected = false;
  if (phase_ == Phase::kAwaiting) {
    if (message.opcode == protocol::kError) {
      expected = OnError(message);
    } else if (job_ == Job::kHello) {
      expected = OnHelloAnswer(message);
    } else if (job_ == Job::kPing) {
      expected = OnEcho(message);
    } else {
      expected = OnIntensities(message);
    }
  }
  if (expected) {
    contacted_ = now_;
  } else {
    Count(&counters_.late_answers);
  }
}

bool Conversation::OnHelloAnswer(const Message& message) {
  // Looked at before it is taken over.
  if (message.opcode != protocol::kHelloAnswer ||
      protocol::GetU16(message.data) != memory_->nonce || !Decode(message, &server_)) {
    return false;
  }
  if (server_.epoch != memory_->epoch) {
    memory_->epoch = server_.epoch;
    Count(&counters_.epochs);
    command_known_ = false;
    DropPending();  // its coordinates may mean another place now
    memory_->remembered = false;
  }
  if (server_.last_opcode == 0) {
    if (memory_->remembered && memory_->sent != 0) {
      DropPending();  // the server may have taken it before it forgot us
    }
    memory_->remembered = false;
  } else if (static_cast<uint8_t>(server_.last_seq - memory_->seq - 1) < 127) {
    DropPending();  // behind: it would never be answered
  }
  Count(&counters_.hello_answers);
  uint8_t set = 0;
  if (server_.protocol_version != protocol::kProtocolVersion) {
    set = kWrongVersion;
  } else if (!HasType(parameters_.type)) {
    set = kTypeMissing;
  }
  SetFlags(set, kWrongVersion | kTypeMissing);
  if (set != 0) {
    WaitForHello();
    return true;
  }
  if (memory_->opcode == 0) {
    memory_->seq = server_.last_seq;
  }
  SayHello();
  greeted_ = true;
  window_.OnSuccess();
  next_period_ = now_;
  WaitUntil(now_);
  return true;
}

bool Conversation::OnEcho(const Message& message) {
  if (message.opcode != protocol::kPingAnswer || message.length != kPingSize ||
      protocol::GetU16(message.data) != memory_->nonce ||
      protocol::GetU16(message.data + 2) != pings_) {
    return false;
  }
  Count(&counters_.echoes);
  resync_ = false;
  window_.OnSuccess();
  WaitUntil(now_);
  return true;
}

bool Conversation::OnIntensities(const Message& message) {
  if (message.opcode != static_cast<uint8_t>(asked_opcode_ | protocol::kFromServer) ||
      message.length != protocol::LengthOf(message.opcode).least) {
    return false;
  }
  const uint8_t* intensities = message.data;
  if (protocol::IsMutating(asked_opcode_)) {
    if (*intensities++ != memory_->seq) {
      return false;
    }
    memory_->opcode = 0;
    memory_->remembered = true;
  }
  Count(&counters_.answers);
  attempt_ = 0;
  window_.OnSuccess();
  if (!pose_known_ || Since(posed_) >= parameters_.fail_safe_ms) {
    Count(&counters_.stale_answers);
    WaitUntil(now_);
    return true;
  }
  p_left_ = protocol::GetI16(intensities);
  p_right_ = protocol::GetI16(intensities + 2);
  answered_ = now_;
  SetFlags(0, kNoAnswerYet | kFailSafe | kOffTheMap);
  WaitForNextPeriod();
  return true;
}

bool Conversation::OnError(const Message& message) {
  protocol::ErrorAnswer error;
  if (!Decode(message, &error) || error.refused_opcode != asked_opcode_ ||
      (protocol::IsMutating(asked_opcode_) && error.seq != memory_->seq)) {
    return false;
  }
  Count(&counters_.errors);
  last_error_ = error.reason;
  if (protocol::IsMutating(asked_opcode_)) {
    --memory_->sent;  // this time it was not taken, or else it is given up below
    memory_->remembered |= error.reason == Reason::kSayHello;
  }
  if (job_ == Job::kHello) {
    WaitForHello();
  } else if (error.reason == Reason::kSayHello) {
    SayHello();
    WaitUntil(now_);
  } else if (error.reason == Reason::kBusy || job_ == Job::kPing) {
    window_.OnMiss();
    Retry();
  } else {
    DropPending();
    if (error.reason == Reason::kOffTheMap) {
      StopOffTheMap();
    }
    attempt_ = 0;
    WaitForNextPeriod();
  }
  return true;
}

void Conversation::OnCommand(const Message& message) {
  protocol::Command command;
  if (!Decode(message, &command)) {
    Count(&counters_.malformed);
    return;
  }
  contacted_ = now_;
  ack_due_ = true;
  commanded_ = now_;
  if (command_known_ && command.seq == command_seq_) {
    Count(&counters_.repeated_commands);
    return;
  }
  command_known_ = true;
  command_seq_ = command.seq;
  command_code_ = static_cast<uint8_t>(command.code);
  command_result_ = Execute(command);
  Count(command_result_ == Reason::kNone ? &counters_.commands : &counters_.refused_commands);
}

Reason Conversation::Execute(const protocol::Command& command) {
  switch (command.code) {
    case protocol::CommandCode::kHalt:
      SetFlags(kHalted, 0);
      return Reason::kNone;
    case protocol::CommandCode::kResume:
      SetFlags(0, kHalted);
      return Reason::kNone;
    case protocol::CommandCode::kSpeed: {
      const int16_t speed_mm_s = protocol::GetI16(command.arguments);
      if (speed_mm_s < 0 || speed_mm_s > kMaxSpeedMmS) {
        return Reason::kBadValue;
      }
      parameters_.speed_mm_s = speed_mm_s;
      SetFlags(0, 0);
      return Reason::kNone;
    }
    case protocol::CommandCode::kFollowType: {
      const uint8_t type = command.arguments[0];
      if (type < protocol::kMinType || type > protocol::kMaxType) {
        return Reason::kBadValue;
      }
      if (counters_.hello_answers != 0 && !HasType(type)) {
        return Reason::kUnknownPheromone;
      }
      parameters_.type = type;
      return Reason::kNone;
    }
    default:
      return Reason::kNotPermitted;
  }
}

void Conversation::Hold() {
  holding_ = true;
  held_ = now_;
}

void Conversation::HearOther() {
  others_ = true;
  heard_ = now_;
}

bool Conversation::HasType(uint8_t type) const {
  return type >= protocol::kMinType && type <= protocol::kMaxType &&
         (server_.type_mask & (1u << type)) != 0;
}

}  // namespace client
}  // namespace pheromone
