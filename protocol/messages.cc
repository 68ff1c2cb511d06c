#include "protocol/messages.h"

#include "protocol/byte_order.h"

namespace pheromone {
namespace protocol {
namespace {

constexpr uint8_t kNarrowPose = 6;  // x i16, y i16, heading u16
constexpr uint8_t kWidePose = 10;   // x i32, y i32, heading u16
constexpr uint8_t kIntensities = 4;
constexpr uint8_t kRoundHeader = 6;

LengthRule Exactly(uint8_t length) {
  return LengthRule{true, length, length};
}

constexpr LengthRule kUnknown{false, 0, 0};

// The message's opcode is `service` of a valid type, in the given direction, of the right length.
bool IsTyped(const Message& message, uint8_t service, bool from_server) {
  return IsFromServer(message.opcode) == from_server && ServiceOf(message.opcode) == service &&
         TypeOf(message.opcode) >= kMinType && message.length == LengthOf(message.opcode).least;
}

bool Is(const Message& message, uint8_t opcode) {
  return message.opcode == opcode && message.length == LengthOf(opcode).least;
}

void Begin(Message* message, uint8_t id, uint8_t opcode) {
  message->id = id;
  message->opcode = opcode;
  message->length = LengthOf(opcode).least;
}

uint8_t Typed(uint8_t service, uint8_t type, bool from_server) {
  return static_cast<uint8_t>((from_server ? kFromServer : 0u) | service | (type & 0x0Fu));
}

void GetPose(const uint8_t* from, bool wide, WirePose* to) {
  to->x = wide ? GetI32(from) : GetI16(from);
  to->y = wide ? GetI32(from + 4) : GetI16(from + 2);
  to->heading = GetU16(from + (wide ? 8 : 4));
}

bool PutPose(const WirePose& from, bool wide, uint8_t* to) {
  if (wide) {
    PutI32(to, from.x);
    PutI32(to + 4, from.y);
    PutU16(to + 8, from.heading);
    return true;
  }
  if (!FitsNarrow(from.x, from.y)) {
    return false;
  }
  PutI16(to, static_cast<int16_t>(from.x));
  PutI16(to + 2, static_cast<int16_t>(from.y));
  PutU16(to + 4, from.heading);
  return true;
}

}  // namespace

LengthRule LengthOf(uint8_t opcode) {
  switch (opcode) {
    case kCommandAck:
      return Exactly(4);
    case kEvent:
      return Exactly(4);
    case kHello:
      return Exactly(4);
    case kHelloAnswer:
      return Exactly(15);
    case kPing:
    case kPingAnswer:
      return LengthRule{true, 0, kMaxPing};
    case kCommand:
      return LengthRule{true, 2, 2 + kMaxCommandArguments};
    case kRound:
      return LengthRule{true, kRoundHeader, kRoundHeader + kMaxTurns * (kIntensities + 1)};
    case kEventAck:
      return Exactly(1);
    case kError:
      return Exactly(3);
    case kScan:
    case kResolve:
      return Exactly(10);
    case kScanAnswer:
      return LengthRule{true, 1, 57};  // 7 rows
    case kTagRead:
      return Exactly(11);
    case kTagReadAnswer:
      return Exactly(44);
    case kTagWrite:
      return Exactly(45);
    case kTagErase:
      return Exactly(15);
    case kTagWriteAnswer:
    case kTagEraseAnswer:
      return Exactly(8);
    case kSymbol:
      return LengthRule{true, 6, 62};  // 56 bytes of text
    case kSymbolAnswer:
      return Exactly(6);
    case kResolveAnswer:
      return LengthRule{true, 14, 64};  // 50 bytes of text
    default:
      break;
  }
  if (TypeOf(opcode) < kMinType) {
    return kUnknown;
  }
  const bool answer = IsFromServer(opcode);
  switch (ServiceOf(opcode)) {
    case kSense:
      return Exactly(answer ? kIntensities : kNarrowPose);
    case kSenseWide:
      return Exactly(answer ? kIntensities : kWidePose);
    case kDeposit:
      return Exactly(answer ? 1 : 6);
    case kTrace:
      return Exactly(answer ? 1 + kIntensities : 1 + kNarrowPose);
    case kTraceWide:
      return Exactly(answer ? 1 + kIntensities : 1 + kWidePose);
    default:
      return kUnknown;
  }
}

uint8_t CommandArgumentLength(uint8_t code) {
  switch (static_cast<CommandCode>(code)) {
    case CommandCode::kHalt:
    case CommandCode::kResume:
    case CommandCode::kPickLoad:
    case CommandCode::kDropLoad:
      return 0;
    case CommandCode::kFollowType:
    case CommandCode::kGetParameter:
      return 1;
    case CommandCode::kSpeed:
      return 2;
    case CommandCode::kGoTo:
      return 4;
    case CommandCode::kSetParameter:
      return 5;
  }
  return 0xFF;
}

bool Decode(const Message& from, SenseRequest* to) {
  const bool wide = ServiceOf(from.opcode) == kSenseWide;
  if (!IsTyped(from, wide ? kSenseWide : kSense, false)) {
    return false;
  }
  to->id = from.id;
  to->type = TypeOf(from.opcode);
  to->wide = wide;
  GetPose(from.data, wide, &to->pose);
  return true;
}

bool Decode(const Message& from, SenseAnswer* to) {
  const bool wide = ServiceOf(from.opcode) == kSenseWide;
  if (!IsTyped(from, wide ? kSenseWide : kSense, true)) {
    return false;
  }
  *to = SenseAnswer{from.id, TypeOf(from.opcode), wide, GetI16(from.data), GetI16(from.data + 2)};
  return true;
}

bool Decode(const Message& from, DepositRequest* to) {
  if (!IsTyped(from, kDeposit, false)) {
    return false;
  }
  *to = DepositRequest{
      from.id,     TypeOf(from.opcode), from.data[0], GetI16(from.data + 1), GetI16(from.data + 3),
      from.data[5]};
  return true;
}

bool Decode(const Message& from, DepositAnswer* to) {
  if (!IsTyped(from, kDeposit, true)) {
    return false;
  }
  *to = DepositAnswer{from.id, TypeOf(from.opcode), from.data[0]};
  return true;
}

bool Decode(const Message& from, TraceRequest* to) {
  const bool wide = ServiceOf(from.opcode) == kTraceWide;
  if (!IsTyped(from, wide ? kTraceWide : kTrace, false)) {
    return false;
  }
  to->id = from.id;
  to->type = TypeOf(from.opcode);
  to->wide = wide;
  to->seq = from.data[0];
  GetPose(from.data + 1, wide, &to->pose);
  return true;
}

bool Decode(const Message& from, TraceAnswer* to) {
  const bool wide = ServiceOf(from.opcode) == kTraceWide;
  if (!IsTyped(from, wide ? kTraceWide : kTrace, true)) {
    return false;
  }
  *to = TraceAnswer{from.id,      TypeOf(from.opcode),   wide,
                    from.data[0], GetI16(from.data + 1), GetI16(from.data + 3)};
  return true;
}

bool Decode(const Message& from, Command* to) {
  if (from.opcode != kCommand || from.length < 2) {
    return false;
  }
  const uint8_t arguments = CommandArgumentLength(from.data[1]);
  if (arguments > kMaxCommandArguments || from.length != 2 + arguments) {
    return false;
  }
  *to = Command{};
  to->id = from.id;
  to->seq = from.data[0];
  to->code = static_cast<CommandCode>(from.data[1]);
  for (uint8_t i = 0; i < arguments; ++i) {
    to->arguments[i] = from.data[2 + i];
  }
  return true;
}

bool Decode(const Message& from, CommandAck* to) {
  if (!Is(from, kCommandAck)) {
    return false;
  }
  *to = CommandAck{from.id, from.data[0], static_cast<CommandCode>(from.data[1]),
                   GetI16(from.data + 2)};
  return true;
}

bool Decode(const Message& from, EventReport* to) {
  if (!Is(from, kEvent)) {
    return false;
  }
  *to = EventReport{from.id, from.data[0], static_cast<EventCode>(from.data[1]),
                    GetI16(from.data + 2)};
  return true;
}

bool Decode(const Message& from, EventAck* to) {
  if (!Is(from, kEventAck)) {
    return false;
  }
  *to = EventAck{from.id, from.data[0]};
  return true;
}

bool Decode(const Message& from, HelloRequest* to) {
  if (!Is(from, kHello)) {
    return false;
  }
  *to = HelloRequest{from.id, GetU16(from.data), from.data[2], from.data[3]};
  return true;
}

bool Decode(const Message& from, HelloAnswer* to) {
  if (!Is(from, kHelloAnswer)) {
    return false;
  }
  to->id = from.id;
  to->nonce = GetU16(from.data);
  to->protocol_version = from.data[2];
  to->epoch = GetU16(from.data + 3);
  to->pose_unit_10um = GetU16(from.data + 5);
  to->antenna_distance_mm = GetU16(from.data + 7);
  to->type_mask = GetU16(from.data + 9);
  to->slot_ms = from.data[11];
  to->response_window_ms = from.data[12];
  to->last_opcode = from.data[13];
  to->last_seq = from.data[14];
  return true;
}

bool Decode(const Message& from, Ping* to) {
  if ((from.opcode != kPing && from.opcode != kPingAnswer) || from.length > kMaxPing) {
    return false;
  }
  to->id = from.id;
  to->answer = from.opcode == kPingAnswer;
  to->length = from.length;
  for (uint8_t i = 0; i < from.length; ++i) {
    to->payload[i] = from.data[i];
  }
  return true;
}

bool Decode(const Message& from, ErrorAnswer* to) {
  if (!Is(from, kError)) {
    return false;
  }
  *to = ErrorAnswer{from.id, from.data[0], static_cast<Reason>(from.data[1]), from.data[2]};
  return true;
}

bool Decode(const Message& from, Round* to) {
  const LengthRule rule = LengthOf(kRound);
  if (from.opcode != kRound || from.id != kBroadcastId || from.length < rule.least ||
      from.length > rule.most) {
    return false;
  }
  const uint8_t answers = from.data[5] & 0x0Fu;
  const uint8_t turns = static_cast<uint8_t>(from.data[5] >> 4);
  if (answers > kMaxTurns || turns > kMaxTurns ||
      from.length != kRoundHeader + kIntensities * answers + turns) {
    return false;
  }
  for (uint8_t i = 1; i <= turns; ++i) {
    const uint8_t id = from.data[from.length - i];
    if (id == 0 || id == kBroadcastId) {
      return false;
    }
  }
  const uint8_t* at = from.data + kRoundHeader;
  to->number = from.data[0];
  to->turn_ms = from.data[1];
  to->turn_bytes = from.data[2];
  to->slot_ms = from.data[3];
  to->open_slots = from.data[4];
  to->answer_count = answers;
  to->turn_count = turns;
  for (uint8_t i = 0; i < answers; ++i, at += kIntensities) {
    to->answers[i] = RoundAnswer{GetI16(at), GetI16(at + 2)};
  }
  for (uint8_t i = 0; i < to->turn_count; ++i) {
    to->turns[i] = *at++;
  }
  return true;
}

bool Encode(const SenseRequest& from, Message* to) {
  Begin(to, from.id, Typed(from.wide ? kSenseWide : kSense, from.type, false));
  return PutPose(from.pose, from.wide, to->data);
}

bool Encode(const TraceRequest& from, Message* to) {
  Begin(to, from.id, Typed(from.wide ? kTraceWide : kTrace, from.type, false));
  to->data[0] = from.seq;
  return PutPose(from.pose, from.wide, to->data + 1);
}

void Encode(const SenseAnswer& from, Message* to) {
  Begin(to, from.id, Typed(from.wide ? kSenseWide : kSense, from.type, true));
  PutI16(to->data, from.left);
  PutI16(to->data + 2, from.right);
}

void Encode(const DepositRequest& from, Message* to) {
  Begin(to, from.id, Typed(kDeposit, from.type, false));
  to->data[0] = from.seq;
  PutI16(to->data + 1, from.x);
  PutI16(to->data + 3, from.y);
  to->data[5] = from.quanta;
}

void Encode(const DepositAnswer& from, Message* to) {
  Begin(to, from.id, Typed(kDeposit, from.type, true));
  to->data[0] = from.seq;
}

void Encode(const TraceAnswer& from, Message* to) {
  Begin(to, from.id, Typed(from.wide ? kTraceWide : kTrace, from.type, true));
  to->data[0] = from.seq;
  PutI16(to->data + 1, from.left);
  PutI16(to->data + 3, from.right);
}

void Encode(const Command& from, Message* to) {
  Begin(to, from.id, kCommand);
  const uint8_t arguments = CommandArgumentLength(static_cast<uint8_t>(from.code));
  const uint8_t sent = arguments > kMaxCommandArguments ? 0 : arguments;
  to->length = static_cast<uint8_t>(2 + sent);
  to->data[0] = from.seq;
  to->data[1] = static_cast<uint8_t>(from.code);
  for (uint8_t i = 0; i < sent; ++i) {
    to->data[2 + i] = from.arguments[i];
  }
}

void Encode(const CommandAck& from, Message* to) {
  Begin(to, from.id, kCommandAck);
  to->data[0] = from.seq;
  to->data[1] = static_cast<uint8_t>(from.code);
  PutI16(to->data + 2, from.result);
}

void Encode(const EventReport& from, Message* to) {
  Begin(to, from.id, kEvent);
  to->data[0] = from.seq;
  to->data[1] = static_cast<uint8_t>(from.code);
  PutI16(to->data + 2, from.argument);
}

void Encode(const EventAck& from, Message* to) {
  Begin(to, from.id, kEventAck);
  to->data[0] = from.seq;
}

void Encode(const HelloRequest& from, Message* to) {
  Begin(to, from.id, kHello);
  PutU16(to->data, from.nonce);
  to->data[2] = from.firmware_version;
  to->data[3] = from.round_period;
}

void Encode(const HelloAnswer& from, Message* to) {
  Begin(to, from.id, kHelloAnswer);
  PutU16(to->data, from.nonce);
  to->data[2] = from.protocol_version;
  PutU16(to->data + 3, from.epoch);
  PutU16(to->data + 5, from.pose_unit_10um);
  PutU16(to->data + 7, from.antenna_distance_mm);
  PutU16(to->data + 9, from.type_mask);
  to->data[11] = from.slot_ms;
  to->data[12] = from.response_window_ms;
  to->data[13] = from.last_opcode;
  to->data[14] = from.last_seq;
}

void Encode(const Ping& from, Message* to) {
  Begin(to, from.id, from.answer ? kPingAnswer : kPing);
  to->length = from.length > kMaxPing ? kMaxPing : from.length;
  for (uint8_t i = 0; i < to->length; ++i) {
    to->data[i] = from.payload[i];
  }
}

void Encode(const ErrorAnswer& from, Message* to) {
  Begin(to, from.id, kError);
  to->data[0] = from.refused_opcode;
  to->data[1] = static_cast<uint8_t>(from.reason);
  to->data[2] = from.seq;
}

void Encode(const Round& from, Message* to) {
  Begin(to, kBroadcastId, kRound);
  uint8_t* at = to->data;
  *at++ = from.number;
  *at++ = from.turn_ms;
  *at++ = from.turn_bytes;
  *at++ = from.slot_ms;
  *at++ = from.open_slots;
  *at++ = static_cast<uint8_t>(from.turn_count << 4 | from.answer_count);
  for (uint8_t i = 0; i < from.answer_count; ++i, at += kIntensities) {
    PutI16(at, from.answers[i].left);
    PutI16(at + 2, from.answers[i].right);
  }
  for (uint8_t i = 0; i < from.turn_count; ++i) {
    *at++ = from.turns[i];
  }
  to->length = static_cast<uint8_t>(at - to->data);
}

}  // namespace protocol
}  // namespace pheromone
