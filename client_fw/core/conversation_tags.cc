// Requests of TAG, beside those for intensities; see conversation.cc. They follow the intensities
// of a period, as EVENTs do, and a robot is never without intensities because of them: until the
// next period begins there are as many as fit, and in rounds every second turn, or the opening
// after a turn left out. One that changes a tag is repeated byte for byte, as a TRACE is, but again
// after the intensities.
#include "client_fw/core/conversation.h"
#include "client_fw/core/requests/tag_data.h"
#include "protocol/tag_messages.h"

namespace pheromone {
namespace client {
namespace {

// Where x and y are in DATA, or kNoPose.
constexpr uint8_t kNoPose = 255;
uint8_t PoseAt(uint8_t opcode) {
  switch (opcode) {
    case protocol::kScan:
    case protocol::kTagRead:
      return 0;
    case protocol::kTagWrite:
    case protocol::kTagErase:
      return 1;
    default:
      return kNoPose;
  }
}

bool FitsResolve(const uint8_t* asked, const uint8_t* data, uint8_t length) {
  using protocol::SymbolKind;
  const SymbolKind kind = static_cast<SymbolKind>(asked[kResolveKind]);
  const uint8_t same = kind == SymbolKind::kRow      ? 0
                       : kind == SymbolKind::kString ? kResolveOffset
                                                     : kResolveNumber;
  for (uint8_t i = 0; i < same; ++i) {  // kind, robot, and of a string its number
    if (data[i] != asked[i]) {
      return false;
    }
  }
  const uint8_t whole = data[kResolvedLength];
  const uint8_t offset = asked[kResolveOffset];
  const uint8_t rest = offset < whole ? static_cast<uint8_t>(whole - offset) : uint8_t{0};
  return length ==
         kResolvedText + (rest < protocol::kMaxResolvedText ? rest : protocol::kMaxResolvedText);
}

// Whether `answer` is of the right length, and to this request: a seq has been compared already.
bool Fits(const protocol::Message& request, const protocol::Message& answer) {
  const uint8_t* const asked = request.data;
  const uint8_t* const data = answer.data;
  switch (request.opcode) {
    case protocol::kScan:
      return answer.length % kScannedRowSize == kScannedRows &&
             answer.length <= kScannedRows + kScannedRowSize * protocol::kMaxTagsInRange;
    case protocol::kTagRead:
      return answer.length == kBlockSize &&
             protocol::GetU16(data + kBlockTag) == protocol::GetU16(asked + kReadTag);
    case protocol::kResolve:
      return FitsResolve(asked, data, answer.length);
    case protocol::kSymbol:
      return answer.length == kDefinedSize;
    default:
      return answer.length == kWrittenSize;
  }
}

static_assert(!kHasTags || kMaxTagRequest == kSymbolText + protocol::kMaxSymbolText,
              "the longest SYMBOL fits the memory");

// Whether the server will not execute the same bytes later either: a copy of them may still be on
// its way. What has the number may be lost in a crash, and a log accepts changes again.
bool IsFinal(protocol::Reason reason) {
  return reason != protocol::Reason::kSequenceReused && reason != protocol::Reason::kReadOnly;
}

}  // namespace

void Conversation::Ask(TagExchange* exchange) {
  if (is_signed() && exchange->message.length > kMaxSignedData) {
    exchange->state = TagExchange::kRefused;
    exchange->reason = protocol::Reason::kBadLength;
    return;
  }
  exchange->state = TagExchange::kAsked;
  exchange->is_pending = false;
  exchange_ = exchange;
  tag_bytes_ = 0;
  if (phase_ == Phase::kResting && requests_.greeted && timers_[kPeriod] != 0 && !HasTurns()) {
    requests_.event_turn = true;  // the intensities of this period are there
    Contend();
  }
}

// One that a reset has left in the memory is repeated too, though nobody waits for its answer.
bool Conversation::HasTagRequest() const {
  return IsTag(memory_->opcode) ||
         (exchange_ != nullptr && exchange_->state == TagExchange::kAsked);
}

// False if there is none, or it needs a pose and there is none.
bool Conversation::MakeTagRequest(const Odometry* odometry, uint8_t* opcode) {
  if (IsTag(memory_->opcode)) {
    *opcode = memory_->opcode;
    Count(&Counters::duplicates);
    return true;
  }
  if (!HasTagRequest()) {
    return false;
  }
  protocol::Message* const request = &exchange_->message;
  const uint8_t pose_at = PoseAt(request->opcode);
  if (pose_at != kNoPose) {
    int32_t x = 0;
    int32_t y = 0;
    const uint16_t unit_10um = protocol::GetU16(server_ + kPoseUnitAt);
    if (odometry == nullptr || !ToPoseUnits(state().start.XOf(*odometry), unit_10um, &x) ||
        !ToPoseUnits(state().start.YOf(*odometry), unit_10um, &y)) {
      return false;
    }
    protocol::PutI32(request->data + pose_at, x);
    protocol::PutI32(request->data + pose_at + 4, y);
  }
  if (protocol::IsMutating(request->opcode)) {
    MakePending(request->opcode);
    request->data[0] = memory_->seq;
    for (uint8_t i = 0; i < request->length && i < kMaxTagRequest; ++i) {
      memory_->tag_data[i] = request->data[i];
    }
    memory_->tag_length = request->length;
    exchange_->is_pending = true;
  }
  *opcode = request->opcode;
  return true;
}

void Conversation::SendTagRequest(uint8_t opcode) {
  Count(&Counters::tag_requests);
  const bool pending = memory_->opcode == opcode;
  Send(opcode, pending ? memory_->tag_data : exchange_->message.data,
       pending ? memory_->tag_length : exchange_->message.length);
}

// Intensities first: a robot drives by them.
void Conversation::PreferSteering() {
  if (state().events == 0 && (!HasTagRequest() || (timers_[kPeriod] == 0 && !HasTurns()))) {
    requests_.event_turn = false;
  }
}

// Whether the exchange is what was sent: the pending request may be one of before a reset.
bool Conversation::Awaits(bool pending) const {
  return exchange_ != nullptr && exchange_->state == TagExchange::kAsked &&
         exchange_->is_pending == pending;
}

bool Conversation::OnTagAnswer(uint8_t opcode, const uint8_t* data, uint8_t length) {
  const bool pending = RequestPending();
  if (pending && (length == 0 || data[0] != memory_->seq)) {
    return false;
  }
  if (Awaits(pending)) {
    protocol::Message answer;
    answer.id = parameters().id;
    answer.opcode = opcode;
    answer.length = length;
    for (uint8_t i = 0; i < length; ++i) {
      answer.data[i] = data[i];
    }
    if (!Fits(exchange_->message, answer)) {
      return false;
    }
    exchange_->message = answer;
    exchange_->state = TagExchange::kAnswered;
  }
  if (pending) {
    memory_->opcode = 0;
  }
  Count(&Counters::tag_answers);
  OnSuccess();
  GoOnAfterTag();
  return true;
}

void Conversation::OnTagRefusal(protocol::Reason reason) {
  const bool pending = RequestPending();
  if (Awaits(pending)) {
    exchange_->state = pending && !IsFinal(reason) ? TagExchange::kDropped : TagExchange::kRefused;
    exchange_->reason = reason;
  }
  if (pending) {
    memory_->opcode = 0;
  }
  attempt_ = 0;
  GoOnAfterTag();
}

void Conversation::GoOnAfterTag() {
  requests_.event_turn &= timers_[kPeriod] != 0 && !HasTurns();
  if (requests_.event_turn && state().events == 0) {
    Rest();  // until Ask, or the next period
  } else {
    Contend();
  }
}

void Conversation::DropTagRequest() {
  if (Awaits(true)) {
    exchange_->state = TagExchange::kDropped;
  }
}

}  // namespace client
}  // namespace pheromone
