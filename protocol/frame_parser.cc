#include "protocol/frame_parser.h"

#include "protocol/crc16.h"
#include "protocol/fields.h"
#include "protocol/messages.h"
#include "protocol/signing.h"

namespace pheromone {
namespace protocol {

namespace {

// In the DATA of a ROUND.
constexpr uint8_t kCountsAt = OffsetOf(&Round::turn_count);
constexpr uint8_t kHeader = OffsetOf(&Round::answers, 0);
constexpr uint8_t kAnswerSize = SizeOf<RoundAnswer>().least;

// DATA of the answer to a second HELLO.
constexpr uint8_t kSignedHelloSize = SizeOf<HelloAnswer>().least + kSignature;
constexpr uint8_t kHelloRows = CodedRows(kSignedHelloSize);
constexpr uint8_t kGreetingRows = CodedRows(kGreetingSize);
static_assert(kHelloRows == 3 && kGreetingRows == 5, "the specification says so");

}  // namespace

FrameParser::Result FrameParser::Push(uint8_t byte) {
  if (coded_left_ != 0) {
    return TakeCoded(byte);
  }
  if (!escaped_) {
    if (byte == kDle) {
      escaped_ = true;
      return kNothing;
    }
    return open_ ? Take(byte) : kIgnored;
  }
  if (!open_ && byte == kDle) {
    return kIgnored;  // no stuffing out here: this DLE may begin a frame just as well
  }
  escaped_ = false;
  const bool was_open = open_;
  open_ = false;
  if (byte == kStx) {
    open_ = true;
    size_ = 0;
    return was_open ? kRestart : kNothing;
  }
  if (!was_open) {
    return kIgnoredPair;
  }
  if (byte == kDle) {
    open_ = true;
    return Take(byte);
  }
  return byte == kEtx ? Judge() : kBadEscape;
}

FrameParser::Result FrameParser::Take(uint8_t byte) {
  if (size_ == kMaxBody) {
    open_ = false;
    return kOversize;
  }
  body_[size_++] = byte;
  if (size_ == kCodedLead - 2 && BeginsCoded()) {
    const uint8_t rows = ReadRows(byte);
    if (rows != 0) {
      size_ = rows;
      coded_left_ = CodedSize(rows);
      if ((body_[1] & kCodedAgain) == 0) {
        coded_left_ = static_cast<uint8_t>(coded_left_ + kCodedLead);
      }
    }
  }
  return kNothing;
}

// Of HELLO's answer there are two, which have different numbers of rows.
bool FrameParser::BeginsCoded() const {
  const uint8_t opcode = static_cast<uint8_t>(body_[1] & ~kCodedAgain);
  return body_[0] == kBroadcastId
             ? opcode == kCodedRound
             : kHasSigning && opcode == kCodedHello &&
                   (body_[2] == SayRows(kGreetingRows) || body_[2] == SayRows(kHelloRows));
}

// size_ is the number of rows.
FrameParser::Result FrameParser::TakeCoded(uint8_t byte) {
  const uint8_t rows = size_;
  const uint8_t all = CodedSize(rows);
  uint8_t* const data = body_ + 2;
  if (coded_left_ <= all) {  // else of the second beginning
    data[all - coded_left_] = byte;
  }
  if (--coded_left_ != 0) {
    return kNothing;
  }
  RepairCoded(data, rows);
  open_ = false;
  if (kHasSigning && body_[0] != kBroadcastId) {
    body_[0] = ReadCodedId(body_[0]);
    body_[1] = kHelloAnswer;
    size_ = rows == kGreetingRows ? uint8_t{4 + kGreetingSize} : uint8_t{4 + kSignedHelloSize};
    return Judge();
  }
  body_[1] = kRound;
  const uint8_t answers = data[kCountsAt] & 0x0Fu;
  const uint8_t turns = static_cast<uint8_t>(data[kCountsAt] >> 4);
  size_ = static_cast<uint8_t>(2 + kHeader + kAnswerSize * answers + turns + 2);
  if (kHasSigning && size_ + kSignatureToAll <= 2 + kCodedColumns * rows && Judge() == kCrcError) {
    size_ = static_cast<uint8_t>(size_ + kSignatureToAll);  // it may be signed
  }
  return size_ > 2 + kCodedColumns * rows ? kCrcError : Judge();
}

FrameParser::Result FrameParser::Judge() const {
  if (size_ < 4) {
    return kRunt;
  }
  if (Crc16(body_, size_) != 0) {
    return kCrcError;
  }
  return body_[0] == 0 || body_[1] == 0 ? kRefused : kFrame;
}

}  // namespace protocol
}  // namespace pheromone
